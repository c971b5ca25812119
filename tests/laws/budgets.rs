//! Counting: a step is an evaluation, budgets are exact, and nothing depends on the number of threads.

use std::error::Error;

use sdfrs_core::contract::{Hits, Limits, Prune, Status};
use sdfrs_core::eval::Native;
use sdfrs_core::pool::set_threads;
use sdfrs_laws::families::{EPS, FAMILIES};
use sdfrs_laws::{Pack, Problem, guarded, letter, name, problems};
use sdfrs_trace::stats::active_rays;
use sdfrs_trace::tracer::Tracer;

fn limits(max_steps: u32) -> Limits {
    Limits { eps: EPS, cone: 0.0, max_steps, prune: Prune::Off }
}

fn everything() -> impl Iterator<Item = Tracer> {
    guarded().into_iter().chain(letter())
}

fn a_few_of_each(count: usize) -> Vec<Problem> {
    FAMILIES.into_iter().flat_map(|family| problems(family, count, 31)).collect()
}

/// Bits, so that NaN compares.
fn bits<T: Native>(hits: &Hits<T>, i: usize) -> (u64, u8, u32, u32, u64, u64, u64, u8) {
    let of = |v: T| v.f64().to_bits();
    let (t, multiplier) = (of(hits.t[i]), of(hits.multiplier[i]));
    let (distance, witness) = (of(hits.distance[i]), of(hits.witness[i]));
    (t, hits.status[i], hits.steps[i], hits.fallbacks[i], multiplier, distance, witness, hits.flags[i])
}

/// Reported steps are the field's own count; a step to infinity, which ends a ray, has no problem to count
/// for, and neither have the empty lanes of a pack, which ask there.
fn assert_counted<T: Native>(hits: &Hits<T>, pack: &Pack, what: &str) {
    let mut lost = 0;
    for (i, (steps, calls)) in hits.steps.iter().zip(pack.calls()).enumerate() {
        let astray = steps - calls;
        assert!(
            astray == 0 || (astray == 1 && hits.status[i] == Status::Invalid as u8),
            "{what} ray {i}: {steps} and {calls}"
        );
        lost += astray;
    }
    assert!(lost <= pack.lost(), "{what}");
}

fn counted<T: Native>() -> Result<(), Box<dyn Error>> {
    let all = a_few_of_each(500);
    for tracer in everything() {
        let pack = Pack::new(&all);
        let hits = pack.trace::<T>(&tracer, &limits(300))?;
        assert_counted(&hits, &pack, &name(&tracer));
        assert!(hits.steps.iter().all(|&n| (1..=300).contains(&n)), "{}", name(&tracer));
        let misses = hits.status.iter().zip(&hits.t).filter(|(s, _)| **s == Status::Miss as u8);
        assert!(misses.into_iter().all(|(_, t)| *t == T::INFINITY), "{}", name(&tracer));
    }
    Ok(())
}

#[test]
fn steps_are_evaluations() -> Result<(), Box<dyn Error>> {
    counted::<f32>()?;
    counted::<f64>()
}

/// A budget cuts a walk short and changes nothing else.
fn budgets<T: Native>() -> Result<(), Box<dyn Error>> {
    let all = a_few_of_each(100);
    for tracer in everything() {
        let free = Pack::new(&all).trace::<T>(&tracer, &limits(400))?;
        for budget in 1..=16 {
            let pack = Pack::new(&all);
            let cut = pack.trace::<T>(&tracer, &limits(budget))?;
            assert_counted(&cut, &pack, &name(&tracer));
            for (i, problem) in all.iter().enumerate() {
                let what = || format!("{} budget {budget} ray {i} {problem:?}", name(&tracer));
                if free.steps[i] <= budget {
                    assert_eq!(bits(&free, i), bits(&cut, i), "{}", what());
                } else {
                    assert_eq!(cut.status[i], Status::OutOfSteps as u8, "{}", what());
                    assert_eq!(cut.steps[i], budget, "{}", what());
                }
            }
        }
    }
    Ok(())
}

#[test]
fn budgets_are_exact() -> Result<(), Box<dyn Error>> {
    budgets::<f32>()?;
    budgets::<f64>()
}

#[test]
fn the_curve_of_active_rays_adds_up() -> Result<(), Box<dyn Error>> {
    let all = a_few_of_each(200);
    for tracer in guarded() {
        let hits = Pack::new(&all).trace::<f64>(&tracer, &limits(200))?;
        let curve = active_rays(&hits.steps);
        let most = hits.steps.iter().copied().max().unwrap_or(0) as usize;
        assert_eq!(curve.len(), most + 1);
        assert_eq!((curve[0], curve[most]), (all.len() as u64, 0));
        assert!(curve.windows(2).all(|pair| pair[0] >= pair[1]));
        assert_eq!(curve.iter().sum::<u64>(), hits.steps.iter().map(|&n| u64::from(n)).sum::<u64>());
        for (n, &active) in curve.iter().enumerate() {
            assert_eq!(active, hits.steps.iter().filter(|&&s| s as usize > n).count() as u64);
        }
    }
    Ok(())
}

fn threads<T: Native>() -> Result<(), Box<dyn Error>> {
    let all = a_few_of_each(700);
    for tracer in everything() {
        let mut runs = vec![];
        for count in [1, 2, 5] {
            set_threads(count);
            runs.push(Pack::new(&all).trace::<T>(&tracer, &limits(200))?);
        }
        for run in &runs[1..] {
            for i in 0..all.len() {
                assert_eq!(bits(&runs[0], i), bits(run, i), "{} ray {i}", name(&tracer));
            }
        }
    }
    set_threads(0);
    Ok(())
}

#[test]
fn any_number_of_threads_gives_the_same_bits() -> Result<(), Box<dyn Error>> {
    threads::<f32>()?;
    threads::<f64>()
}

/// Rays don't learn from their neighbours.
#[test]
fn a_ray_alone_ends_as_in_company() -> Result<(), Box<dyn Error>> {
    let all = a_few_of_each(12);
    for tracer in everything() {
        let together = Pack::new(&all).trace::<f64>(&tracer, &limits(200))?;
        for (i, problem) in all.iter().enumerate() {
            let one = [problem.clone()];
            let alone = Pack::new(&one).trace::<f64>(&tracer, &limits(200))?;
            assert_eq!(bits(&together, i), bits(&alone, 0), "{} ray {i}", name(&tracer));
        }
    }
    Ok(())
}
