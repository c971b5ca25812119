//! The loop around every tracer: tiles of rays sampled together, counters, budgets, ends.
//!
//! A tile of 1,024 rays steps in waves: all samples asked for are evaluated in one batch, finished
//! rays leave. A ray's result depends on nothing but the ray, so tiles may run on any thread. Twin:
//! the GPU's march. Law: steps equal the evaluations the field saw; same bits for any thread count.

use std::sync::Mutex;

use rayon::prelude::*;
use sdfrs_core::{
    Control, Field, Hits, Limits, Rays, Scalar, Scratch, Status, contract::check_spans, eval::Native, pool,
};

use crate::{
    error::TraceError,
    tracer::{
        Form, SearchForm, Tracer, auto_relaxed, basic, binary_search, coverage_search, enhanced,
        guarded::Guarded,
        relaxed,
        retry::Listing,
        split,
        walk::{Next, Range, Sample, Tally, Walk},
    },
};

/// Rays that step together.
pub const TILE: usize = 1024;

/// One ray, direction of unit length.
#[derive(Debug, Clone, Copy)]
pub struct Ray<T> {
    pub origin: [T; 3],
    pub direction: [T; 3],
    pub t_min: T,
    pub t_max: T,
}

/// Where rays come from: a batch, or a camera that makes them as they are needed.
pub trait Source<T>: Sync {
    fn count(&self) -> usize;
    fn ray(&self, i: usize) -> Ray<T>;
}

impl<T: Scalar> Source<T> for Rays<'_, T> {
    fn count(&self) -> usize {
        self.origins.len()
    }
    fn ray(&self, i: usize) -> Ray<T> {
        let (t_min, t_max) = (self.t_min.at(i), self.t_max.at(i));
        Ray { origin: self.origins[i], direction: self.directions[i], t_min, t_max }
    }
}

/// Traces a batch of rays (finite, unit length: see `contract::check_rays`).
pub fn trace<T: Native>(
    field: &dyn Field<T>,
    tracer: &Tracer,
    rays: &Rays<T>,
    limits: &Limits,
    control: &Control,
) -> Result<Hits<T>, TraceError> {
    check_spans(rays.origins.len(), &rays.t_min, &rays.t_max, tracer.needs_finite_range())?;
    trace_source(field, tracer, rays, limits, control)
}

/// Traces the rays of any source.
pub fn trace_source<T: Native>(
    field: &dyn Field<T>,
    tracer: &Tracer,
    rays: &dyn Source<T>,
    limits: &Limits,
    control: &Control,
) -> Result<Hits<T>, TraceError> {
    tracer.check()?;
    limits.check()?;
    let of = T::of;
    let job = Job { field, rays, limits, guards: tracer.guards(), control };
    match *tracer {
        Tracer::Basic { guards: true } => job.run(&Guarded(basic::Basic)),
        Tracer::Basic { guards: false } => job.run(&basic::Letter),
        Tracer::Relaxed { omega, guards: true, .. } => {
            job.run(&Guarded(relaxed::Relaxed { omega: of(omega) }))
        }
        Tracer::Relaxed { omega, form: Form::Y2023, .. } => job.run(&relaxed::Letter { omega: of(omega) }),
        Tracer::Relaxed { omega, form: Form::Y2018, .. } => {
            job.run(&Listing(relaxed::Relaxed { omega: of(omega) }))
        }
        Tracer::Enhanced { omega, guards: true, .. } => {
            job.run(&Guarded(enhanced::Enhanced { omega: of(omega) }))
        }
        Tracer::Enhanced { omega, form: Form::Y2023, .. } => job.run(&enhanced::Letter { omega: of(omega) }),
        Tracer::Enhanced { omega, form: Form::Y2018, .. } => {
            job.run(&Listing(enhanced::Enhanced { omega: of(omega) }))
        }
        Tracer::AutoRelaxed { beta, guards: true } => {
            job.run(&Guarded(auto_relaxed::AutoRelaxed { beta: of(beta) }))
        }
        Tracer::AutoRelaxed { beta, guards: false } => job.run(&auto_relaxed::Letter { beta: of(beta) }),
        Tracer::BinarySearch { form: SearchForm::Stackless, max_level, guards } => {
            job.run(&binary_search::Stackless { max_level, guards })
        }
        Tracer::BinarySearch { form: SearchForm::Split, guards: true, .. } => job.run(&split::Split),
        Tracer::BinarySearch { form, guards, .. } => {
            job.run(&binary_search::Stack { guards, split: form == SearchForm::Split })
        }
        Tracer::CoverageSearch { .. } => job.run(&coverage_search::CoverageSearch),
    }
}

struct Job<'a, T: Native> {
    field: &'a dyn Field<T>,
    rays: &'a dyn Source<T>,
    limits: &'a Limits,
    guards: bool,
    control: &'a Control,
}

impl<T: Native> Job<'_, T> {
    fn run<W: Walk<T>>(&self, walk: &W) -> Result<Hits<T>, TraceError> {
        let n = self.rays.count();
        let mut hits = blank::<T>(n);
        let threshold = Mutex::new(T::of(0.0));
        let work = || {
            let tiles = hits.t.par_chunks_mut(TILE).zip(hits.status.par_chunks_mut(TILE));
            let tiles = tiles.zip(hits.steps.par_chunks_mut(TILE)).zip(hits.fallbacks.par_chunks_mut(TILE));
            let tiles =
                tiles.zip(hits.multiplier.par_chunks_mut(TILE)).zip(hits.distance.par_chunks_mut(TILE));
            let tiles = tiles.zip(hits.witness.par_chunks_mut(TILE)).zip(hits.flags.par_chunks_mut(TILE));
            tiles.enumerate().for_each_init(
                || Wave::new(walk),
                |wave, (i, (((((((t, status), steps), fallbacks), multiplier), distance), witness), flags))| {
                    if self.control.is_cancelled() {
                        return;
                    }
                    wave.tile(self, walk, i * TILE, t.len(), |k, end, tally| {
                        (t[k], status[k]) = (if end == Status::Miss { T::INFINITY } else { tally.t }, end as u8);
                        (steps[k], fallbacks[k]) = (tally.steps, tally.fallbacks);
                        (multiplier[k], distance[k]) = (tally.multiplier(), tally.r);
                        (witness[k], flags[k]) = (tally.witness, tally.flags);
                    });
                    let mut most = threshold.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    *most = most.max(wave.threshold);
                    self.control.advance(t.len() as u64);
                },
            );
        };
        pool::install(work);
        if self.control.is_cancelled() {
            return Err(TraceError::Cancelled);
        }
        hits.threshold = threshold.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        Ok(hits)
    }
}

fn blank<T: Scalar>(n: usize) -> Hits<T> {
    let zero = T::of(0.0);
    Hits {
        t: vec![zero; n],
        status: vec![0; n],
        steps: vec![0; n],
        fallbacks: vec![0; n],
        multiplier: vec![zero; n],
        distance: vec![zero; n],
        witness: vec![zero; n],
        flags: vec![0; n],
        threshold: zero,
    }
}

/// A worker's memory for a tile of rays.
struct Wave<T: Native, W: Walk<T>> {
    scratch: Scratch<T>,
    rays: Vec<Ray<T>>,
    states: Vec<(W::State, Tally<T>)>,
    /// Rays still walking, the samples they ask for and the field there.
    active: Vec<u32>,
    at: Vec<T>,
    p: [Vec<T>; 3],
    r: Vec<T>,
    /// Largest threshold that decided a hit.
    threshold: T,
}

impl<T: Native, W: Walk<T>> Wave<T, W> {
    fn new(_walk: &W) -> Self {
        Self {
            scratch: Scratch::new(),
            rays: Vec::with_capacity(TILE),
            states: Vec::with_capacity(TILE),
            active: Vec::with_capacity(TILE),
            at: Vec::with_capacity(TILE),
            p: std::array::from_fn(|_| vec![T::of(0.0); TILE]),
            r: vec![T::of(0.0); TILE],
            threshold: T::of(0.0),
        }
    }

    fn begin(&mut self, job: &Job<T>, walk: &W, first: usize, n: usize) {
        self.rays.clear();
        self.states.clear();
        self.active.clear();
        self.at.clear();
        self.threshold = T::of(0.0);
        for k in 0..n {
            let ray = job.rays.ray(first + k);
            let (state, t) = walk.start(&range(&ray, job.limits));
            self.rays.push(ray);
            self.states.push((state, Tally::new(job.limits.max_steps)));
            self.active.push(k as u32);
            self.at.push(t);
        }
    }

    /// Walks `n` rays from `first` on to their ends.
    fn tile(
        &mut self,
        job: &Job<T>,
        walk: &W,
        first: usize,
        n: usize,
        mut end: impl FnMut(usize, Status, &Tally<T>),
    ) {
        self.begin(job, walk, first, n);
        while !self.active.is_empty() && !job.control.is_cancelled() {
            self.sample(job);
            let mut kept = 0;
            for i in 0..self.active.len() {
                let k = self.active[i] as usize;
                let s = self.look(i, job);
                let (state, tally) = &mut self.states[k];
                tally.steps += 1;
                match walk.step(state, &s, &range(&self.rays[k], job.limits), tally) {
                    Next::Ask(t) => {
                        (self.active[kept], self.at[kept]) = (k as u32, t);
                        kept += 1;
                    }
                    Next::Done(status) => {
                        if status == Status::Hit {
                            self.threshold = self.threshold.max(s.e);
                        }
                        end(k, status, tally);
                    }
                }
            }
            self.active.truncate(kept);
            self.at.truncate(kept);
        }
    }

    /// Evaluates the field at every sample asked for.
    fn sample(&mut self, job: &Job<T>) {
        let n = self.active.len();
        for (i, &k) in self.active.iter().enumerate() {
            let (ray, t) = (&self.rays[k as usize], self.at[i]);
            for axis in 0..3 {
                self.p[axis][i] = ray.origin[axis] + t * ray.direction[axis];
            }
        }
        let p = [&self.p[0][..n], &self.p[1][..n], &self.p[2][..n]];
        job.field.eval(&mut self.scratch, p, &mut self.r[..n]);
    }

    /// The `i`-th active ray's sample.
    fn look(&self, i: usize, job: &Job<T>) -> Sample<T> {
        let (t, r) = (self.at[i], self.r[i]);
        let scale = self.p.iter().fold(t.abs(), |a, p| a.max(p[i].abs()));
        let asked = T::of(job.limits.eps).max(T::of(job.limits.cone) * t);
        let e = if job.guards { asked.max(T::of(4.0) * T::EPS * scale) } else { asked };
        Sample { t, r, e, asked, scale }
    }
}

fn range<T: Scalar>(ray: &Ray<T>, limits: &Limits) -> Range<T> {
    Range { t_min: ray.t_min, t_max: ray.t_max, eps: T::of(limits.eps) }
}
