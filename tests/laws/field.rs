//! Many one-dimensional fields as one field: the ray's x and y name the problem, z is the way along it.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

use sdfrs_core::contract::{Control, Hits, Limits, Rays, Span};
use sdfrs_core::eval::Native;
use sdfrs_core::{Field, Scratch};
use sdfrs_trace::TraceError;
use sdfrs_trace::march::trace;
use sdfrs_trace::tracer::Tracer;

use crate::families::{Problem, T_MAX};

/// Cells along x and y; multiples of 1/SIDE below 1 are exact, and small enough to leave the floor of 4 ulp alone.
const SIDE: usize = 1024;

/// The problems, and how often each has been evaluated.
pub struct Pack<'a> {
    problems: &'a [Problem],
    calls: Vec<AtomicU32>,
    lost: AtomicU32,
    /// Multiplies the values: a field steeper than it says.
    pub steepness: f64,
    samples: Option<Mutex<Vec<(f64, f64)>>>,
}

impl<'a> Pack<'a> {
    pub fn new(problems: &'a [Problem]) -> Self {
        assert!(problems.len() <= SIDE * SIDE);
        let calls = problems.iter().map(|_| AtomicU32::new(0)).collect();
        Self { problems, calls, lost: AtomicU32::new(0), steepness: 1.0, samples: None }
    }

    pub fn calls(&self) -> Vec<u32> {
        self.calls.iter().map(|n| n.load(Ordering::Relaxed)).collect()
    }

    /// Evaluations at points that are not numbers, which belong to no problem: printed forms may step to infinity.
    pub fn lost(&self) -> u32 {
        self.lost.load(Ordering::Relaxed)
    }

    pub fn value<T: Native>(&self, index: usize, z: T) -> T {
        T::of(self.steepness) * self.problems[index].value(z)
    }

    /// max(|p|, t) of a ray's point at `t`.
    pub fn reach(&self, index: usize, t: f64) -> f64 {
        let cell = |i: usize| i as f64 / SIDE as f64;
        t.abs().max(cell(index % SIDE)).max(cell(index / SIDE))
    }

    pub fn trace<T: Native>(&self, tracer: &Tracer, limits: &Limits) -> Result<Hits<T>, TraceError> {
        self.trace_span(tracer, limits, 0.0, T_MAX)
    }

    pub fn trace_span<T: Native>(
        &self,
        tracer: &Tracer,
        limits: &Limits,
        t_min: f64,
        t_max: f64,
    ) -> Result<Hits<T>, TraceError> {
        let cell = |i: usize| T::of(i as f64 / SIDE as f64);
        let origins: Vec<_> =
            (0..self.problems.len()).map(|i| [cell(i % SIDE), cell(i / SIDE), T::of(0.0)]).collect();
        let directions = vec![[T::of(0.0), T::of(0.0), T::of(1.0)]; origins.len()];
        let (t_min, t_max) = (Span::All(T::of(t_min)), Span::All(T::of(t_max)));
        let rays = Rays { origins: &origins, directions: &directions, t_min, t_max };
        trace(self, tracer, &rays, limits, &Control::new())
    }
}

/// Every sample (z, value) a tracer takes on one problem: what to print when a law breaks.
pub fn samples<T: Native>(
    problem: &Problem,
    steepness: f64,
    tracer: &Tracer,
    limits: &Limits,
) -> Vec<(f64, f64)> {
    let one = [problem.clone()];
    let mut pack = Pack::new(&one);
    pack.steepness = steepness;
    pack.samples = Some(Mutex::new(vec![]));
    // A refusal leaves the list short, which is all this is for.
    let _ = pack.trace::<T>(tracer, limits);
    pack.samples.map(|all| all.into_inner().unwrap_or_default()).unwrap_or_default()
}

impl<T: Native> Field<T> for Pack<'_> {
    fn eval(&self, _: &mut Scratch<T>, p: [&[T]; 3], out: &mut [T]) {
        let side = SIDE as f64;
        for (((x, y), z), out) in p[0].iter().zip(p[1]).zip(p[2]).zip(out) {
            if x.is_nan() || y.is_nan() {
                self.lost.fetch_add(1, Ordering::Relaxed);
                *out = T::of(f64::NAN);
                continue;
            }
            let index = (x.f64() * side) as usize + (y.f64() * side) as usize * SIDE;
            self.calls[index].fetch_add(1, Ordering::Relaxed);
            *out = self.value(index, *z);
            if let Some(Ok(mut all)) = self.samples.as_ref().map(Mutex::lock) {
                all.push((z.f64(), out.f64()));
            }
        }
    }
}
