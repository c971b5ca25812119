//! The loop around every tracer: tiles of rays sampled together, counters, budgets, ends.
//!
//! The rays of a tile step together: all samples asked for are evaluated in one batch, finished rays
//! leave. Guarded steppers go a pack at a time ([`swarm`]), other walks ray by ray ([`wave`]). A ray's
//! result depends on nothing but the ray, so tiles may run on any thread. Twin: the GPU's march.
//! Law: steps equal the evaluations the field saw; same bits for any thread count.

mod columns;
mod refine;
mod swarm;
mod wave;

use rayon::prelude::*;
use sdfrs_core::{
    Control, Field, Hits, Limits, Rays, Real, Scalar, contract::check_spans, eval::Native, pool,
};

use crate::{
    error::TraceError,
    tracer::{
        Form, SearchForm, Tracer, auto_relaxed, basic, binary_search, coverage_search, enhanced,
        guarded::Rule, relaxed, retry::Listing, split, walk::Walk,
    },
};
use columns::Columns;

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
        Tracer::Basic { guards: true } => job.steps(basic::Basic),
        Tracer::Basic { guards: false } => job.walks(&basic::Letter),
        Tracer::Relaxed { omega, guards: true, .. } => {
            job.steps(relaxed::Relaxed { omega: T::Lanes::c(omega) })
        }
        Tracer::Relaxed { omega, form: Form::Y2023, .. } => job.walks(&relaxed::Letter { omega: of(omega) }),
        Tracer::Relaxed { omega, form: Form::Y2018, .. } => {
            job.walks(&Listing(relaxed::Relaxed { omega: of(omega) }))
        }
        Tracer::Enhanced { omega, guards: true, .. } => {
            job.steps(enhanced::Enhanced { omega: T::Lanes::c(omega) })
        }
        Tracer::Enhanced { omega, form: Form::Y2023, .. } => job.walks(&enhanced::Letter { omega: of(omega) }),
        Tracer::Enhanced { omega, form: Form::Y2018, .. } => {
            job.walks(&Listing(enhanced::Enhanced { omega: of(omega) }))
        }
        Tracer::AutoRelaxed { beta, guards: true } => {
            job.steps(auto_relaxed::AutoRelaxed { beta: T::Lanes::c(beta) })
        }
        Tracer::AutoRelaxed { beta, guards: false } => job.walks(&auto_relaxed::Letter { beta: of(beta) }),
        Tracer::BinarySearch { form: SearchForm::Stackless, max_level, guards } => {
            job.walks(&binary_search::Stackless { max_level, guards })
        }
        Tracer::BinarySearch { form: SearchForm::Split, guards: true, .. } => job.walks(&split::Split),
        Tracer::BinarySearch { form, guards, .. } => {
            job.walks(&binary_search::Stack { guards, split: form == SearchForm::Split })
        }
        Tracer::CoverageSearch { .. } => job.walks(&coverage_search::CoverageSearch),
    }
}

struct Job<'a, T: Native> {
    field: &'a dyn Field<T>,
    rays: &'a dyn Source<T>,
    limits: &'a Limits,
    guards: bool,
    control: &'a Control,
}

/// When a radius is a hit: `max(eps, cone * t)`.
#[derive(Debug, Clone, Copy)]
pub struct Threshold<T> {
    eps: T,
    cone: T,
}

impl<T: Native> Job<'_, T> {
    fn threshold(&self) -> Threshold<T> {
        Threshold { eps: T::of(self.limits.eps), cone: T::of(self.limits.cone) }
    }

    /// Guarded steppers.
    fn steps<R: Rule<T::Lanes>>(&self, rule: R) -> Result<Hits<T>, TraceError> {
        self.tiles(swarm::Worker::new, |worker, first, out| worker.tile(self, rule, first, out))
    }

    /// Any other walk.
    fn walks<W: Walk<T>>(&self, walk: &W) -> Result<Hits<T>, TraceError> {
        self.tiles(wave::Wave::<T, W>::new, |wave, first, out| wave.tile(self, walk, first, out))
    }

    /// Runs tiles of rays on the pool, each worker with a memory of its own.
    fn tiles<M: Send>(
        &self,
        memory: impl Fn() -> M + Send + Sync,
        tile: impl Fn(&mut M, usize, &mut Columns<T>) + Send + Sync,
    ) -> Result<Hits<T>, TraceError> {
        let mut hits = columns::blank::<T>(self.rays.count());
        let mut tiles = columns::split(&mut hits, TILE);
        let work = || {
            tiles.par_iter_mut().enumerate().for_each_init(&memory, |memory, (i, out)| {
                if !self.control.is_cancelled() {
                    tile(memory, i * TILE, out);
                    self.control.advance(out.len() as u64);
                }
            });
        };
        pool::install(work);
        if self.control.is_cancelled() {
            return Err(TraceError::Cancelled);
        }
        hits.threshold = tiles.iter().map(|out| out.threshold).fold(T::of(0.0), Real::max);
        Ok(hits)
    }
}
