//! The guarded tracers lose no surface and report none late: NUMERICS' harness, 10^5 rays for every
//! tracer, form and precision. Run with `--nocapture` for the table of counts.

use std::error::Error;

use sdfrs_core::contract::{Limits, Prune};
use sdfrs_core::eval::Native;
use sdfrs_laws::families::{EPS, FAMILIES};
use sdfrs_laws::field::samples;
use sdfrs_laws::tracers::reach;
use sdfrs_laws::{Family, Pack, Problem, Verdict, guarded, judge, name, problems};
use sdfrs_trace::tracer::Tracer;

const PER_FAMILY: usize = 12_500;

fn run<T: Native>(tracer: &Tracer, all: &[Problem], limits: &Limits) -> Result<Verdict, Box<dyn Error>> {
    let pack = Pack::new(all);
    let hits = pack.trace::<T>(tracer, limits)?;
    let verdict = judge(all, &pack, &hits, limits, reach(tracer));
    if let Some(i) = verdict.first {
        println!("{} eps {:e} ray {i}: {:?}", name(tracer), limits.eps, all[i]);
        println!("  status {} t {:?} steps {}", hits.status[i], hits.t[i], hits.steps[i]);
        println!("  samples {:?}", samples::<T>(&all[i], 1.0, tracer, limits));
    }
    Ok(verdict)
}

fn all_families<T: Native>(limits: &Limits, per_family: usize, seed: u64) -> Result<(), Box<dyn Error>> {
    let precision = std::any::type_name::<T>();
    let mut broken = vec![];
    for family in FAMILIES {
        let all = problems(family, per_family, seed);
        for tracer in guarded() {
            let verdict = run::<T>(&tracer, &all, limits)?;
            let row =
                format!("{family:?} {} {precision} eps {:e}: {}", name(&tracer), limits.eps, verdict.row());
            println!("{row}");
            // Rays that graze may take any number of steps: only there may a budget end.
            let ends = family == Family::Grazing || verdict.unresolved == 0;
            if !(verdict.clean() && ends) {
                broken.push(row);
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
    Ok(())
}

#[test]
fn no_surface_is_missed_or_late_f32() -> Result<(), Box<dyn Error>> {
    all_families::<f32>(&Limits { eps: EPS, cone: 0.0, max_steps: 4096, prune: Prune::Off }, PER_FAMILY, 1)
}

#[test]
fn no_surface_is_missed_or_late_f64() -> Result<(), Box<dyn Error>> {
    all_families::<f64>(&Limits { eps: EPS, cone: 0.0, max_steps: 4096, prune: Prune::Off }, PER_FAMILY, 1)
}

#[test]
fn nor_at_other_thresholds() -> Result<(), Box<dyn Error>> {
    for eps in [1e-2, 1e-3, 1e-5, 1e-6, 1e-8] {
        let limits = Limits { eps, cone: 0.0, max_steps: 4096, prune: Prune::Off };
        for family in FAMILIES.into_iter().filter(|f| *f != Family::Grazing) {
            let all = problems(family, 1500, 2);
            for tracer in guarded() {
                for verdict in [run::<f32>(&tracer, &all, &limits)?, run::<f64>(&tracer, &all, &limits)?] {
                    let what = format!("{family:?} {} eps {eps:e}: {}", name(&tracer), verdict.row());
                    assert!(verdict.clean() && verdict.unresolved == 0, "{what}");
                }
            }
        }
    }
    Ok(())
}

#[test]
fn nor_with_thresholds_that_grow_with_the_distance() -> Result<(), Box<dyn Error>> {
    let limits = Limits { eps: EPS, cone: 1e-3, max_steps: 4096, prune: Prune::Off };
    for family in FAMILIES {
        let all = problems(family, 1500, 3);
        for tracer in guarded() {
            for verdict in [run::<f32>(&tracer, &all, &limits)?, run::<f64>(&tracer, &all, &limits)?] {
                assert!(verdict.clean(), "{family:?} {}: {}", name(&tracer), verdict.row());
            }
        }
    }
    Ok(())
}

#[test]
fn exact_fields_raise_no_witness() -> Result<(), Box<dyn Error>> {
    let limits = Limits { eps: EPS, cone: 0.0, max_steps: 4096, prune: Prune::Off };
    for family in FAMILIES {
        let all = problems(family, 2000, 4);
        for tracer in guarded() {
            let verdict = run::<f64>(&tracer, &all, &limits)?;
            assert!(verdict.witness <= 1.01, "{family:?} {}: {}", name(&tracer), verdict.row());
        }
    }
    Ok(())
}
