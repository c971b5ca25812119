//! Every walk ends: rays without an end of their own, at the end of what a precision holds.
#![allow(clippy::unwrap_used)]

use sdfrs_core::{Control, Limits, Program, Prune, Rays, Shape, Span, Status, Value, eval::Native};
use sdfrs_trace::{Form, Tracer, march};

/// Rays from far away that look away from a plane, and one that looks at it.
fn trace<T: Native>(tracer: &Tracer, prune: Prune, far: f64) -> Vec<u8> {
    let (up, point) = (Value::Vec3([0.0, 0.0, 1.0]), Value::Vec3([0.0; 3]));
    let args = vec![("normal".into(), up), ("point".into(), point)];
    let plane = Shape::build("plane", args, vec![]).unwrap();
    let program = Program::<T>::for_tracing(&plane).unwrap();
    let limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 200, prune };
    let at = |z: f64| [0.0, 0.0, z].map(T::of);
    let rays = Rays {
        origins: &[at(far), at(0.1 * far), at(3.0)],
        directions: &[at(1.0), at(1.0), at(-1.0)],
        t_min: Span::All(T::of(0.0)),
        t_max: Span::All(T::INFINITY),
    };
    march::trace(&program, tracer, &rays, &limits, &Control::new()).unwrap().status
}

#[test]
fn rays_at_the_end_of_all_numbers_end() {
    let (form, guards) = (Form::Y2023, true);
    for tracer in [
        Tracer::Basic { guards },
        Tracer::Relaxed { omega: 1.9, form, guards },
        Tracer::Enhanced { omega: 0.9, form, guards },
        Tracer::AutoRelaxed { beta: 0.3, guards },
    ] {
        for prune in [Prune::Off, Prune::Exact, Prune::Skip] {
            for found in [trace::<f32>(&tracer, prune, 2e38), trace::<f64>(&tracer, prune, 1e308)] {
                assert!(found[..2].iter().all(|s| *s != Status::Hit as u8), "{tracer:?}: {found:?}");
                assert_eq!(found[2], Status::Hit as u8, "{tracer:?}");
            }
        }
    }
}
