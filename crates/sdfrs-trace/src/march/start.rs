//! The first sample of rays that all start at one point, taken once: an eye's picture asks the field a million times
//! for the same number.
//!
//! Law: the bits, steps and statuses of rays that take it each by itself (tests below).

use sdfrs_core::{
    Hits, Real, Scratch,
    eval::{Lanes, Native},
};

use super::Job;
use crate::tracer::guarded::Rule;

/// What rays know of the field where they start: all of it the same.
#[derive(Debug, Clone, Copy)]
pub struct Start<T> {
    /// The field there, and the length of the step tried from there; 0 where neither is known.
    pub r: T,
    pub length: T,
    /// Where they ask next.
    pub next: T,
    /// Samples taken.
    pub steps: u32,
}

impl<T: Native> Start<T> {
    pub fn unknown() -> Self {
        let zero = T::of(0.0);
        Self { r: zero, length: zero, next: zero, steps: 0 }
    }

    /// Asks the field at the eye, if there is one; and whether that was of any use: not where a walk ends with its first
    /// sample.
    pub fn find<R: Rule<T::Lanes>>(job: &Job<T>, rule: R) -> Self {
        let Some((p, t_max)) = job.rays.eye() else { return Self::unknown() };
        let mut r = [T::of(0.0)];
        let columns = p.map(|v| [v]);
        job.field.eval(&mut Scratch::new(), columns.each_ref().map(|v| v.as_slice()), &mut r);
        let [r] = r;
        let e = job.threshold().sample(T::of(0.0), p, r).e;
        // A zero below zero is another number where a ray goes up.
        let plain = p.iter().all(|v| v.f64().to_bits() != (-0.0f64).to_bits());
        if plain && r.is_finite() && r > e && r < t_max && job.limits.max_steps > 1 {
            let length = if R::LONGER { rule.next(T::Lanes::splat(r), T::Lanes::c(-1.0)).lane(0) } else { r };
            return Self { r, length, next: Real::min(length, Real::min(t_max, T::MAX)), steps: 1 };
        }
        Self::unknown()
    }

    /// The sample is one of the whole program's.
    pub fn counted(self, job: &Job<T>, mut hits: Hits<T>) -> Hits<T> {
        if self.steps > 0 {
            hits.work.add(job.field.ops(), 1);
        }
        hits
    }
}

#[cfg(test)]
mod tests {
    use sdfrs_core::{Control, Hits, Limits, Program, Prune, Shape, Status, Value};

    use crate::{
        Tracer,
        camera::{Camera, Kind},
        march::{Native, Ray, Source, trace_source},
        render::CameraRays,
        tracer::Form,
    };

    /// Rays of whom nobody knows that they start at one point.
    struct Each<'a, T>(&'a CameraRays<T>);

    impl<T: Native> Source<T> for Each<'_, T> {
        fn count(&self) -> usize {
            self.0.count()
        }
        fn ray(&self, i: usize) -> Ray<T> {
            self.0.ray(i)
        }
        fn width(&self) -> Option<usize> {
            self.0.width()
        }
    }

    fn balls() -> Shape {
        let ball = |x: f64| {
            let ball = Shape::build("sphere", vec![("radius".into(), Value::Num(0.5))], vec![]).unwrap();
            let to = vec![("offset".into(), Value::Vec3([x, 0.2, -0.1]))];
            Shape::build("translate", to, vec![ball]).unwrap()
        };
        let k = vec![("k".into(), Value::Num(0.2))];
        Shape::build("union", k, (0..5).map(|i| ball(f64::from(i) * 0.4 - 1.0)).collect()).unwrap()
    }

    fn bits<T: Native>(hits: &Hits<T>) -> [Vec<u64>; 8] {
        let of = |v: &Vec<T>| v.iter().map(|v| v.f64().to_bits()).collect();
        let counts = |v: &Vec<u32>| v.iter().map(|v| u64::from(*v)).collect();
        let bytes = |v: &Vec<u8>| v.iter().map(|v| u64::from(*v)).collect();
        let Hits { t, status, steps, fallbacks, multiplier, distance, witness, flags, .. } = hits;
        [
            of(t),
            bytes(status),
            counts(steps),
            counts(fallbacks),
            of(multiplier),
            of(distance),
            of(witness),
            bytes(flags),
        ]
    }

    fn compare<T: Native>() {
        let (guards, form) = (true, Form::Y2018);
        let tracers = [
            Tracer::Basic { guards },
            Tracer::Relaxed { omega: 1.6, form, guards },
            Tracer::Enhanced { omega: 0.9, form, guards },
            Tracer::AutoRelaxed { beta: 0.3, guards },
        ];
        // Outside, at a zero below zero, inside, on the surface; and an end before the first ball's.
        let eyes = [[2.0, 1.0, 3.0], [0.0, -0.0, 3.0], [0.1, 0.2, 0.0], [1.1, 0.2, -0.1]];
        let program = Program::<T>::for_tracing(&balls()).unwrap();
        for (origin, t_max) in eyes.map(|eye| (eye, 9.0)).into_iter().chain([(eyes[0], 1.5)]) {
            let (kind, up) = (Kind::Pinhole { fov_deg: 50.0 }, [0.0, 1.0, 0.0]);
            let camera = Camera { kind, origin, target: [0.0; 3], up, width: 37, height: 23 };
            for tracer in &tracers {
                let rays = CameraRays::<T>::new(&camera, tracer, t_max).unwrap();
                for (prune, max_steps) in
                    [(Prune::Off, 100), (Prune::Exact, 100), (Prune::Off, 1), (Prune::Off, 2)]
                {
                    let limits = Limits { eps: 1e-4, cone: 0.0, max_steps, prune };
                    let trace =
                        |rays| trace_source(&program, tracer, rays, &limits, &Control::new()).unwrap();
                    let (once, each) = (trace(&rays), trace(&Each(&rays)));
                    assert_eq!(bits(&once), bits(&each), "{tracer:?} {origin:?} {limits:?}");
                    let saved = |hits: &Hits<T>| hits.work.node_evaluations;
                    let shared = t_max == 9.0 && origin == eyes[0] && max_steps > 1;
                    let hit = once.status.iter().filter(|s| **s == Status::Hit as u8).count();
                    assert!(!shared || max_steps == 2 || hit > 50);
                    assert!(if shared {
                        saved(&once) < saved(&each)
                    } else {
                        saved(&once) <= saved(&each) + 9
                    });
                }
            }
        }
    }

    #[test]
    fn a_sample_shared_is_the_one_each_would_take() {
        compare::<f32>();
        compare::<f64>();
    }
}
