//! What single steps must be: first steps, head-on planes, bad values, starts inside.

use std::error::Error;

use sdfrs_core::contract::{Control, FLAG_INSIDE, Hits, Limits, Prune, Rays, Span, Status};
use sdfrs_core::eval::Native;
use sdfrs_core::{Field, Scratch};
use sdfrs_laws::families::{EPS, FAMILIES, T_MAX};
use sdfrs_laws::field::samples;
use sdfrs_laws::tracers::is_search;
use sdfrs_laws::{Pack, guarded, letter, name, problems};
use sdfrs_trace::march::trace;
use sdfrs_trace::tracer::{Form, Tracer};

const LIMITS: Limits = Limits { eps: EPS, cone: 0.0, max_steps: 4096, prune: Prune::Off };
const BASIC: Tracer = Tracer::Basic { guards: true };

/// A field of z alone.
struct Along<F>(F);

impl<T: Native, F: Fn(T) -> T + Sync> Field<T> for Along<F> {
    fn eval(&self, _: &mut Scratch<T>, p: [&[T]; 3], out: &mut [T]) {
        for (z, out) in p[2].iter().zip(out) {
            *out = (self.0)(*z);
        }
    }
}

/// One ray along z through `field`, from `t_min`.
fn one<T: Native>(
    field: impl Fn(T) -> T + Sync,
    tracer: &Tracer,
    t_min: f64,
) -> Result<Hits<T>, Box<dyn Error>> {
    let (zero, unit) = (T::of(0.0), T::of(1.0));
    let rays = Rays {
        origins: &[[zero; 3]],
        directions: &[[zero, zero, unit]],
        t_min: Span::All(T::of(t_min)),
        t_max: Span::All(T::of(T_MAX)),
    };
    Ok(trace(&Along(field), tracer, &rays, &LIMITS, &Control::new())?)
}

fn relaxed_by_one_is_basic<T: Native>() -> Result<(), Box<dyn Error>> {
    for family in FAMILIES {
        let all = problems(family, 1000, 21);
        let basic = Pack::new(&all).trace::<T>(&BASIC, &LIMITS)?;
        for form in [Form::Y2023, Form::Y2018] {
            let tracer = Tracer::Relaxed { omega: 1.0, form, guards: true };
            let relaxed = Pack::new(&all).trace::<T>(&tracer, &LIMITS)?;
            assert_eq!(basic.t, relaxed.t);
            assert_eq!(basic.status, relaxed.status);
            assert_eq!(basic.steps, relaxed.steps);
            assert_eq!(basic.fallbacks, relaxed.fallbacks);
        }
    }
    Ok(())
}

#[test]
fn relaxed_with_omega_one_is_basic() -> Result<(), Box<dyn Error>> {
    relaxed_by_one_is_basic::<f32>()?;
    relaxed_by_one_is_basic::<f64>()
}

#[test]
fn first_steps_equal_basic() {
    let cautious = |t: &Tracer| matches!(t, Tracer::Enhanced { .. } | Tracer::AutoRelaxed { .. });
    for family in FAMILIES {
        for problem in problems(family, 200, 22) {
            let basic = samples::<f64>(&problem, 1.0, &BASIC, &LIMITS);
            for tracer in guarded().iter().filter(|t| cautious(t)) {
                let others = samples::<f64>(&problem, 1.0, tracer, &LIMITS);
                let first = basic.len().min(2);
                assert_eq!(basic[..first], others[..first.min(others.len())], "{}", name(tracer));
            }
        }
    }
}

fn head_on<T: Native>() -> Result<(), Box<dyn Error>> {
    for wall in [0.25, 1.0, 3.5, 10.0, 16.0] {
        for tracer in guarded().into_iter().chain([Tracer::Basic { guards: false }]) {
            let hits = one(|z: T| T::of(wall) - z, &tracer, 0.0)?;
            assert_eq!(hits.status, [Status::Hit as u8], "{}", name(&tracer));
            let away = (hits.t[0].f64() - wall).abs();
            assert!(away <= 1.5 * EPS, "{} {wall} {away}", name(&tracer));
            let expected = match tracer {
                // Overshoots once, where a longer step than the ray allows was tried.
                Tracer::Relaxed { .. } => Some((3, 1)),
                Tracer::Basic { .. } | Tracer::Enhanced { .. } | Tracer::AutoRelaxed { .. } => Some((2, 0)),
                _ => None,
            };
            if let Some(expected) = expected {
                assert_eq!((hits.steps[0], hits.fallbacks[0]), expected, "{} {wall}", name(&tracer));
                assert_eq!(hits.t[0].f64(), wall);
            }
        }
    }
    Ok(())
}

#[test]
fn a_head_on_plane_takes_the_known_count() -> Result<(), Box<dyn Error>> {
    head_on::<f32>()?;
    head_on::<f64>()
}

fn bad_values<T: Native>() -> Result<(), Box<dyn Error>> {
    let nan = T::of(f64::NAN);
    for tracer in guarded().into_iter().chain(letter()) {
        let hits = one(|_: T| nan, &tracer, 0.0)?;
        assert_eq!((hits.status[0], hits.steps[0]), (Status::Invalid as u8, 1), "{}", name(&tracer));
        let hits = one(|z: T| if z > T::of(5.0) { nan } else { T::of(3.0) }, &tracer, 0.0)?;
        assert_eq!(hits.status[0], Status::Invalid as u8, "{}", name(&tracer));
        assert!(hits.steps[0] <= 4, "{}", name(&tracer));
    }
    for tracer in guarded() {
        let hits = one(|_: T| T::INFINITY, &tracer, 0.0)?;
        assert_eq!((hits.status[0], hits.steps[0]), (Status::Invalid as u8, 1), "{}", name(&tracer));
    }
    Ok(())
}

#[test]
fn a_field_that_is_not_a_number_is_invalid() -> Result<(), Box<dyn Error>> {
    bad_values::<f32>()?;
    bad_values::<f64>()
}

/// A step beyond the plain one that meets NaN goes back; the plain one then finds the wall.
#[test]
fn a_bad_value_beyond_the_surface_does_no_harm() -> Result<(), Box<dyn Error>> {
    let tracer = Tracer::Relaxed { omega: 1.5, form: Form::Y2023, guards: true };
    let hits = one(|z: f64| if z > 10.0 { f64::NAN } else { 10.0 - z }, &tracer, 0.0)?;
    assert_eq!((hits.status[0], hits.t[0], hits.steps[0]), (Status::Hit as u8, 10.0, 3));
    Ok(())
}

#[test]
fn a_start_inside_is_a_hit_at_the_start() -> Result<(), Box<dyn Error>> {
    for tracer in guarded() {
        let hits = one(|z: f64| z - 3.0, &tracer, 0.5)?;
        assert_eq!((hits.status[0], hits.t[0]), (Status::Hit as u8, 0.5), "{}", name(&tracer));
        if !is_search(&tracer) {
            assert!(hits.flags[0] & FLAG_INSIDE != 0, "{}", name(&tracer));
            assert_eq!(hits.steps[0], 1);
        }
    }
    Ok(())
}

#[test]
fn nothing_beyond_the_end_is_hit() -> Result<(), Box<dyn Error>> {
    for tracer in guarded().into_iter().chain(letter()) {
        let hits = one(|z: f64| T_MAX + 0.01 - z, &tracer, 0.0)?;
        assert_eq!(hits.status[0], Status::Miss as u8, "{}", name(&tracer));
        assert!(hits.t[0].is_infinite());
    }
    Ok(())
}
