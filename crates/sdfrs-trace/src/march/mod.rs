//! The loop around every tracer: tiles of rays sampled together, counters, budgets, ends.
//!
//! The rays of a tile step together: all samples asked for are evaluated in one batch, finished rays
//! leave. Guarded steppers go a pack at a time ([`swarm`]), along shortened programs where that pays
//! ([`cells`]); other walks go ray by ray ([`wave`]). A ray's
//! result depends on nothing but the ray, so tiles may run on any thread. Twin: the GPU's march.
//! Law: steps equal the evaluations the field saw; same bits for any thread count.

mod beam;
mod cells;
mod columns;
mod cones;
mod ends;
mod feed;
mod kernels;
mod order;
mod pixel;
mod refine;
mod sizes;
mod start;
mod surface;
mod swarm;
mod sweep;
mod tiles;
mod wave;
mod worker;

use std::sync::{Mutex, PoisonError};

use sdfrs_core::{
    Control, Field, Hits, Limits, Prune, Rays, Real, Scalar,
    contract::check_spans,
    eval::{Lanes, Native},
};

use crate::{
    error::TraceError,
    tracer::{
        Form, SearchForm, Tracer, auto_relaxed, basic, binary_search, coverage_search, enhanced,
        guarded::{Rule, Samples},
        relaxed,
        retry::Listing,
        split,
        walk::Walk,
    },
};
use columns::Columns;
pub use ends::End;
use ends::Sink;
pub use feed::Bundle;
use order::Order;
pub use pixel::Pixel;
use sizes::Sizes;
use start::Start;
pub use surface::{Canvas, Found, Image, Shader, Shaders};
pub use swarm::WIDEST;
use worker::Worker;

/// Rays that step together.
pub const TILE: usize = 1024;
/// Operations from which on automatic pruning steps over empty cells, or shortens programs; and operations
/// times rays: few rays fill cells badly, and small programs gain less than a probe costs.
const WORTH_SKIPPING: (u64, u64) = (20, 2_000_000);
const WORTH_SHORTENING: (u64, u64) = (150, 10_000_000);

/// One ray, direction of unit length.
#[derive(Debug, Clone, Copy)]
pub struct Ray<T> {
    pub origin: [T; 3],
    pub direction: [T; 3],
    pub t_min: T,
    pub t_max: T,
}

impl<T: Scalar> Ray<T> {
    /// Where it is at a depth.
    #[inline(always)]
    pub fn at(&self, t: T) -> [T; 3] {
        along(self.origin, self.direction, t)
    }
}

/// Where a ray is at a depth.
#[inline(always)]
fn along<T: Scalar>(o: [T; 3], d: [T; 3], t: T) -> [T; 3] {
    [o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]]
}

/// Where rays come from: a batch, or a camera that makes them as they are needed.
pub trait Source<T: Native>: Sync {
    fn count(&self) -> usize;
    fn ray(&self, i: usize) -> Ray<T>;
    /// Rays of a row, where they are a picture row by row: at most [`Pixel::MOST`], in as many rows.
    fn width(&self) -> Option<usize> {
        None
    }
    /// Where all rays start, at depth 0, if there is such a point; and the depth at which all end.
    fn eye(&self) -> Option<([T; 3], T)> {
        None
    }
    /// Whether the rays of a rectangle of a picture lie between those of its corners, in direction and in origin, and
    /// all end at one depth: those of an eye through a plane, and parallel ones.
    fn planar(&self) -> bool {
        false
    }
    /// A pack of rays; lanes beyond are as the last one.
    fn bundle(&self, pixels: &[Pixel], to: &mut Bundle<T::Lanes>) {
        let number = |pixel: &Pixel| match self.width() {
            Some(width) => pixel.y() as usize * width + pixel.x() as usize,
            None => pixel.0 as usize,
        };
        for lane in 0..T::Lanes::WIDTH {
            if let Some(pixel) = pixels.get(lane).or(pixels.last()) {
                to.set(lane, &self.ray(number(pixel)));
            }
        }
    }
}

impl<T: Native> Source<T> for Rays<'_, T> {
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
    trace_over(field, tracer, rays, limits, control, Hits::default())
}

/// The same, written over the hits of another trace: of as many rays, it asks for no memory.
pub fn trace_over<T: Native>(
    field: &dyn Field<T>,
    tracer: &Tracer,
    rays: &dyn Source<T>,
    limits: &Limits,
    control: &Control,
    old: Hits<T>,
) -> Result<Hits<T>, TraceError> {
    Ok(Job::new(field, rays, limits, control, old, None)?.trace(tracer)?.0)
}

/// Traces the rays of a picture's pixels, row by row, and shows what they find.
pub fn trace_shown<T: Native>(
    field: &dyn Field<T>,
    tracer: &Tracer,
    rays: &dyn Source<T>,
    limits: &Limits,
    control: &Control,
    shaders: &dyn Shaders<T>,
) -> Result<(Hits<T>, Image), TraceError> {
    Job::new(field, rays, limits, control, Hits::default(), Some(shaders))?.trace(tracer)
}

/// The same for rays that are walked to their ends one by one, whatever the field.
pub fn trace_each<T: Native>(
    field: &dyn Field<T>,
    walk: impl Fn(&Ray<T>) -> End<T> + Sync,
    rays: &dyn Source<T>,
    limits: &Limits,
    control: &Control,
    shaders: Option<&dyn Shaders<T>>,
) -> Result<(Hits<T>, Image), TraceError> {
    let job = Job::new(field, rays, limits, control, Hits::default(), shaders)?;
    Ok((job.each(&walk)?, job.image()))
}

struct Job<'a, T: Native> {
    field: &'a dyn Field<T>,
    rays: &'a dyn Source<T>,
    limits: &'a Limits,
    guards: bool,
    control: &'a Control,
    /// Hits to write over.
    old: Mutex<Hits<T>>,
    /// What shows the surfaces that are found, if they are to be shown, and what came of it.
    shaders: Option<&'a dyn Shaders<T>>,
    image: Mutex<Image>,
}

/// When a radius is a hit: `max(eps, cone * t)`.
#[derive(Debug, Clone, Copy)]
pub struct Threshold<T> {
    eps: T,
    cone: T,
}

impl<T: Scalar> Threshold<T> {
    /// What was asked for at `t`.
    #[inline(always)]
    pub fn asked<R: Real<S = T>>(&self, t: R) -> R {
        R::splat(self.eps).max(R::splat(self.cone) * t)
    }

    /// A sample at a point, and its threshold: never below 4 ulp of the sample's numbers.
    #[inline(always)]
    pub fn sample<R: Real<S = T>>(&self, t: R, p: [R; 3], r: R) -> Samples<R> {
        let scale = t.abs().max(p[0].abs()).max(p[1].abs()).max(p[2].abs());
        let asked = self.asked(t);
        let e = asked.max(R::c(4.0) * R::splat(T::EPS) * scale);
        Samples { t, r, e, asked, scale }
    }
}

impl<'a, T: Native> Job<'a, T> {
    fn new(
        field: &'a dyn Field<T>,
        rays: &'a dyn Source<T>,
        limits: &'a Limits,
        control: &'a Control,
        old: Hits<T>,
        shaders: Option<&'a dyn Shaders<T>>,
    ) -> Result<Self, TraceError> {
        limits.check()?;
        let (old, image) = (Mutex::new(old), Mutex::default());
        Ok(Self { field, rays, limits, guards: true, control, old, shaders, image })
    }

    /// What was shown: nothing where nobody asked for it.
    fn image(self) -> Image {
        self.image.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    fn trace(self, tracer: &Tracer) -> Result<(Hits<T>, Image), TraceError> {
        tracer.check()?;
        let job = Self { guards: tracer.guards(), ..self };
        Ok((job.hits(tracer)?, job.image()))
    }

    fn hits(&self, tracer: &Tracer) -> Result<Hits<T>, TraceError> {
        let of = T::of;
        match *tracer {
            Tracer::Basic { guards: true } => self.steps(basic::Basic),
            Tracer::Basic { guards: false } => self.walks(&basic::Letter),
            Tracer::Relaxed { omega, guards: true, .. } => {
                self.steps(relaxed::Relaxed { omega: T::Lanes::c(omega) })
            }
            Tracer::Relaxed { omega, form: Form::Y2023, .. } => {
                self.walks(&relaxed::Letter { omega: of(omega) })
            }
            Tracer::Relaxed { omega, form: Form::Y2018, .. } => {
                self.walks(&Listing(relaxed::Relaxed { omega: of(omega) }))
            }
            Tracer::Enhanced { omega, guards: true, .. } => {
                self.steps(enhanced::Enhanced { omega: T::Lanes::c(omega) })
            }
            Tracer::Enhanced { omega, form: Form::Y2023, .. } => {
                self.walks(&enhanced::Letter { omega: of(omega) })
            }
            Tracer::Enhanced { omega, form: Form::Y2018, .. } => {
                self.walks(&Listing(enhanced::Enhanced { omega: of(omega) }))
            }
            Tracer::AutoRelaxed { beta, guards: true } => {
                self.steps(auto_relaxed::AutoRelaxed { beta: T::Lanes::c(beta) })
            }
            Tracer::AutoRelaxed { beta, guards: false } => {
                self.walks(&auto_relaxed::Letter { beta: of(beta) })
            }
            Tracer::BinarySearch { form: SearchForm::Stackless, max_level, guards } => {
                self.walks(&binary_search::Stackless { max_level, guards })
            }
            Tracer::BinarySearch { form: SearchForm::Split, guards: true, .. } => self.walks(&split::Split),
            Tracer::BinarySearch { form, guards, .. } => {
                self.walks(&binary_search::Stack { guards, split: form == SearchForm::Split })
            }
            Tracer::CoverageSearch { .. } => self.walks(&coverage_search::CoverageSearch),
        }
    }

    fn threshold(&self) -> Threshold<T> {
        Threshold { eps: T::of(self.limits.eps), cone: T::of(self.limits.cone) }
    }

    /// What is pruned: nothing where that would cost more than it saves.
    fn prune(&self) -> Prune {
        let Some(pruner) = self.field.pruner() else { return Prune::Off };
        let ops = self.field.ops();
        let worth = |(least, all): (u64, u64)| ops >= least && ops * self.rays.count() as u64 >= all;
        match self.limits.prune {
            Prune::Auto { skip: true } if worth(WORTH_SKIPPING) => Prune::Skip,
            Prune::Auto { skip: false } if pruner.has_choices() && worth(WORTH_SHORTENING) => Prune::Exact,
            Prune::Auto { .. } => Prune::Off,
            asked => asked,
        }
    }

    /// Guarded steppers.
    fn steps<R: Rule<T::Lanes>>(&self, rule: R) -> Result<Hits<T>, TraceError> {
        let prune = self.prune();
        let pruner = self.field.pruner().filter(|_| prune != Prune::Off);
        let skip = prune == Prune::Skip;
        let sizes = pruner.map(|pruner| match skip {
            true if self.rays.planar() => Sizes::patches(pruner, self.rays.count()),
            true => Sizes::skip(pruner),
            false => Sizes::exact(pruner, self.rays.count(), self.rays.width().is_some()),
        });
        let sizes = sizes.unwrap_or_default();
        // Where cells are stepped over, nobody asks there.
        let start = if skip { Start::unknown() } else { Start::find(self, rule) };
        let memory = || Worker::new(skip, sizes, &self.threshold(), start);
        let Some(pruner) = pruner else {
            // The last rays of a tile leave lanes empty: large tiles waste fewer, small ones keep all threads busy.
            let size = (self.rays.count() / 32).next_multiple_of(TILE).clamp(TILE, 16 * TILE);
            let order = Order::in_line(self.rays, size);
            let tile = |worker: &mut Worker<T>, tile: usize, out: &mut Columns<T>| {
                worker.tile(self, rule, (&order, tile), out);
            };
            return Ok(start.counted(self, self.tiles(&order, memory, tile)?.0));
        };
        let order = Order::in_blocks(self.rays, [sizes.block, sizes.group], self.control);
        let (mut hits, workers) = self.tiles(&order, memory, |worker, block, out| {
            worker.block(self, pruner, rule, (&order, block), out);
        })?;
        hits.work.prune = prune;
        hits.work.arena_bytes = workers.iter().map(Worker::arena_bytes).sum();
        Ok(start.counted(self, hits))
    }

    /// Any other walk.
    fn walks<W: Walk<T>>(&self, walk: &W) -> Result<Hits<T>, TraceError> {
        let order = Order::in_line(self.rays, TILE);
        let run = |wave: &mut wave::Wave<T, W>, tile: usize, out: &mut Columns<T>| {
            wave.tile(self, walk, tile * TILE, out)
        };
        Ok(self.tiles(&order, wave::Wave::new, run)?.0)
    }

    /// Rays one after the other.
    fn each(&self, walk: &(impl Fn(&Ray<T>) -> End<T> + Sync)) -> Result<Hits<T>, TraceError> {
        let order = Order::in_line(self.rays, TILE);
        let run = |_: &mut (), tile: usize, out: &mut Columns<T>| {
            for k in 0..out.len() {
                let ray = self.rays.ray(tile * TILE + k);
                let end = walk(&ray);
                out.work.add(1, end.steps.into());
                out.end(k as u32, &end, || ray.at(end.t));
            }
        };
        Ok(self.tiles(&order, || (), run)?.0)
    }
}
