//! What drives a swarm: sample, step, until every ray has ended; in a tile of rays, or in a block of them
//! along which programs are shortened (`sweep`).

use sdfrs_core::{Field, Scratch, eval::Native, prune::Pruner};

use super::{
    Job, Threshold,
    beam::Beam,
    cells::Cells,
    columns::Columns,
    cones::Patches,
    feed::{Bundle, Feed, Wanted},
    order::{Order, Rectangle},
    refine::refine,
    sizes::Sizes,
    start::Start,
    swarm::{Span, Swarm},
    sweep::Sweep,
};
use crate::tracer::guarded::Rule;

/// Packs that step together where rays wait to take free lanes: as many as keep the instructions' calls
/// cheap and stay near.
const PACKS: usize = 16;

/// What a worker keeps from tile to tile.
pub struct Worker<T: Native> {
    swarms: Vec<Swarm<T>>,
    patches: Patches<T>,
    cells: Cells<T>,
    samples: Samples<T>,
    wanted: Vec<Wanted>,
    /// Where each group ends among the rays wanted.
    groups: Vec<usize>,
    start: Start<T>,
}

/// Points, and the field there.
pub struct Samples<T: Native> {
    pub scratch: Scratch<T>,
    pub picked: Vec<u32>,
    p: [Vec<T>; 3],
    r: Vec<T>,
}

impl<T: Native> Samples<T> {
    /// One step of the picked packs' rays that ask for a sample of the span; the number of points evaluated.
    #[allow(clippy::too_many_arguments)] // a step's all, from two places
    pub fn step<R: Rule<T::Lanes>>(
        &mut self,
        job: &Job<T>,
        field: &dyn Field<T>,
        rule: R,
        span: Span<T>,
        swarm: &mut Swarm<T>,
        feed: &mut Feed<T>,
        out: &mut Columns<T>,
    ) -> u64 {
        let Self { scratch, picked, p, r } = self;
        swarm.points(picked, span.until, p);
        let n = picked.len() * Swarm::<T>::WIDTH;
        r.resize(r.len().max(n), T::of(0.0));
        field.eval(scratch, [&p[0][..n], &p[1][..n], &p[2][..n]], &mut r[..n]);
        swarm.step(rule, &job.threshold(), job.limits.max_steps, picked, (p, r), span, feed, out);
        n as u64
    }

    /// Walks rays that ask for samples of a span until none does, or one falls back to before its beginning; the
    /// number of points.
    #[allow(clippy::too_many_arguments)] // the same
    pub fn cross<R: Rule<T::Lanes>>(
        &mut self,
        job: &Job<T>,
        field: &dyn Field<T>,
        rule: R,
        (from, span): (T, Span<T>),
        swarm: &mut Swarm<T>,
        feed: &mut Feed<T>,
        out: &mut Columns<T>,
    ) -> u64 {
        let mut points = 0;
        swarm.pick(span.until, &mut self.picked);
        while !self.picked.is_empty() && !job.control.is_cancelled() {
            points += self.step(job, field, rule, span, swarm, feed, out);
            if swarm.note(&mut self.picked) < from {
                break;
            }
            swarm.pick_again(span.until, &mut self.picked);
        }
        points
    }

    /// Walks rays to their ends through the whole field.
    pub fn walk<R: Rule<T::Lanes>>(
        &mut self,
        job: &Job<T>,
        field: &dyn Field<T>,
        rule: R,
        swarm: &mut Swarm<T>,
        feed: &mut Feed<T>,
        out: &mut Columns<T>,
    ) {
        let mut points = 0;
        while swarm.alive() > 0 && !job.control.is_cancelled() {
            self.picked.clear();
            self.picked.extend(0..swarm.packs().len() as u32);
            points += self.step(job, field, rule, Span::ALL, swarm, feed, out);
        }
        out.work.add(field.ops(), points);
    }
}

impl<T: Native> Worker<T> {
    pub fn new(skip: bool, sizes: Sizes, limit: &Threshold<T>, start: Start<T>) -> Self {
        let samples =
            Samples { scratch: Scratch::new(), picked: Vec::new(), p: Default::default(), r: Vec::new() };
        let (swarms, wanted, groups) = (Vec::new(), Vec::new(), Vec::new());
        let (patches, cells) = (Patches::new(), Cells::new(skip, sizes, limit));
        Self { swarms, patches, cells, samples, wanted, groups, start }
    }

    /// Walks the rays of a tile to their ends.
    pub fn tile<R: Rule<T::Lanes>>(
        &mut self,
        job: &Job<T>,
        rule: R,
        (order, tile): (&Order, usize),
        out: &mut Columns<T>,
    ) {
        order.tile(tile, &mut self.wanted, &mut self.groups);
        out.fetch();
        self.swarms.resize_with(1, Swarm::default);
        let mut feed = Feed::new(job.rays, &self.wanted, self.start);
        self.swarms[0].fill::<R>(&mut feed, PACKS);
        self.samples.walk(job, job.field, rule, &mut self.swarms[0], &mut feed, out);
        self.finish(job, out);
    }

    fn finish(&mut self, job: &Job<T>, out: &mut Columns<T>) {
        let crossings = std::mem::take(&mut out.crossings);
        if !crossings.is_empty() {
            let points = refine(job.field, &mut self.samples.scratch, &job.threshold(), crossings, out);
            out.work.add(job.field.ops(), points);
        }
    }

    /// Walks the rays of a block to their ends, group by group.
    pub fn block<R: Rule<T::Lanes>>(
        &mut self,
        job: &Job<T>,
        pruner: &Pruner,
        rule: R,
        (order, block): (&Order, usize),
        out: &mut Columns<T>,
    ) {
        self.cells.prepare(pruner);
        let sweep = Sweep { job, pruner, rule };
        match order.block(block) {
            Some(pixels) if self.cells.sizes.patches => self.sweep_pixels(&sweep, pixels, out),
            _ => self.sweep_rays(&sweep, (order, block), out),
        }
        self.finish(job, out);
        self.cells.tell(&mut out.work);
    }

    /// Rays are made first: only they tell where they are.
    fn sweep_rays<R: Rule<T::Lanes>>(
        &mut self,
        sweep: &Sweep<T, R>,
        (order, block): (&Order, usize),
        out: &mut Columns<T>,
    ) {
        let Self { swarms, cells, samples, patches, wanted, groups, start, .. } = self;
        let rays = sweep.job.rays;
        out.fetch();
        order.tile(block, wanted, groups);
        swarms.resize_with(swarms.len().max(groups.len()), Swarm::default);
        let swarms = &mut swarms[..groups.len()];
        let mut from = 0;
        for (swarm, &mut to) in swarms.iter_mut().zip(groups) {
            swarm.fill::<R>(&mut Feed::new(rays, &wanted[from..to], *start), usize::MAX);
            from = to;
        }
        let whole = Beam::around(swarms);
        if let Some(beam) = whole {
            cells.begin_block(beam);
        }
        for swarm in swarms {
            let beam = whole.and_then(|_| Beam::around(std::slice::from_ref(swarm)));
            sweep.group(beam, patches, swarm, cells, samples, out);
        }
    }

    /// Rays between the corners of a picture's block: most are made only where something is near.
    fn sweep_pixels<R: Rule<T::Lanes>>(
        &mut self,
        sweep: &Sweep<T, R>,
        block: Rectangle,
        out: &mut Columns<T>,
    ) {
        let Self { swarms, cells, samples, patches, .. } = self;
        let rays = sweep.job.rays;
        let eye = rays.eye().is_some();
        out.miss();
        swarms.resize_with(swarms.len().max(1), Swarm::default);
        let mut corners = Bundle::blank();
        let mut beam = |of: &Rectangle| {
            rays.bundle(&of.corners(), &mut corners);
            Beam::between::<T>(&corners)
        };
        let whole = beam(&block);
        if let Some(beam) = whole {
            cells.begin_block(beam);
        }
        block.squares(cells.sizes.group, |pixels| {
            let beam = whole.and_then(|_| beam(&pixels));
            patches.begin(rays, pixels);
            swarms[0].clear(eye);
            sweep.group(beam, patches, &mut swarms[0], cells, samples, out);
        });
    }

    /// Bytes that shortened programs take.
    pub fn arena_bytes(&self) -> u64 {
        self.cells.bytes()
    }
}
