//! What drives a swarm: sample, step, until every ray has ended; in a tile of rays, or in a block of them
//! along which programs are shortened.

use sdfrs_core::{Field, Scratch, eval::Native, prune::Pruner};

use super::{
    Job, Threshold,
    beam::Beam,
    cells::{Cells, Found, Sizes},
    columns::Columns,
    feed::{Feed, Wanted},
    order::Order,
    refine::refine,
    start::Start,
    swarm::{Span, Swarm},
};
use crate::tracer::guarded::Rule;

/// Packs that step together where rays wait to take free lanes: as many as keep the instructions' calls
/// cheap and stay near.
const PACKS: usize = 16;

/// Where a cell begins that is none: the whole field.
const EVERYWHERE: f64 = f64::NEG_INFINITY;

/// What a worker keeps from tile to tile.
pub struct Worker<T: Native> {
    swarms: Vec<Swarm<T>>,
    cells: Cells<T>,
    samples: Samples<T>,
    wanted: Vec<Wanted>,
    /// Where each group ends among the rays wanted.
    groups: Vec<usize>,
    start: Start<T>,
}

/// Points, and the field there.
struct Samples<T: Native> {
    scratch: Scratch<T>,
    picked: Vec<u32>,
    p: [Vec<T>; 3],
    r: Vec<T>,
}

impl<T: Native> Samples<T> {
    /// One step of the picked packs' rays that ask for a sample of the span; the number of points evaluated.
    #[allow(clippy::too_many_arguments)] // a step's all, from two places
    fn step<R: Rule<T::Lanes>>(
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

    /// Walks rays to their ends through the whole field.
    fn walk<R: Rule<T::Lanes>>(
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
        Self { swarms, cells: Cells::new(skip, sizes, limit), samples, wanted, groups, start }
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
        order.tile(block, &mut self.wanted, &mut self.groups);
        let groups = self.groups.len();
        self.swarms.resize_with(self.swarms.len().max(groups), Swarm::default);
        let mut from = 0;
        for (swarm, &to) in self.swarms.iter_mut().zip(&self.groups) {
            swarm.fill::<R>(&mut Feed::new(job.rays, &self.wanted[from..to], self.start), usize::MAX);
            from = to;
        }
        let beam = Beam::around(&self.swarms[..groups]);
        if let Some(beam) = beam {
            self.cells.begin_block(beam);
        }
        for group in 0..groups {
            let beam = beam.and_then(|_| Beam::around(&self.swarms[group..=group]));
            match beam {
                Some(beam) => self.group(job, pruner, rule, (group, beam), out),
                // Rays without a common direction share no cells.
                None => {
                    let swarm = &mut self.swarms[group];
                    let whole = self.cells.whole(job.field);
                    self.samples.walk(job, whole, rule, swarm, &mut Feed::empty(job.rays), out);
                }
            }
        }
        self.finish(job, out);
        self.cells.tell(&mut out.work);
    }

    fn group<R: Rule<T::Lanes>>(
        &mut self,
        job: &Job<T>,
        pruner: &Pruner,
        rule: R,
        (group, beam): (usize, Beam),
        out: &mut Columns<T>,
    ) {
        let Self { swarms, cells, samples, .. } = self;
        let (swarm, mut nobody) = (&mut swarms[group], Feed::empty(job.rays));
        cells.begin_group(beam);
        swarm.note(&[]);
        // Whether some cell had a field of its own: from then on none is stepped into from another.
        let (mut parted, mut inside) = (false, f64::NAN);
        while swarm.alive() > 0 && !job.control.is_cancelled() {
            let near = swarm.nearest();
            let (span, field): (_, &dyn Field<T>) = match cells.find(pruner, near.f64()) {
                Found::Empty(from, to) if T::of(to) > near => {
                    swarm.jump::<R>((T::of(from), T::of(to)), &mut samples.picked, out);
                    inside = f64::NAN;
                    continue;
                }
                Found::Cell(cell) if T::of(cell.to) > near => {
                    let (from, to) = (T::of(cell.from), T::of(cell.to));
                    parted |= cell.near;
                    if parted && inside != cell.from {
                        inside = cell.from;
                        swarm.enter::<R>((from, to), &mut samples.picked);
                        // Some may have to take a shorter step first.
                        if !(swarm.nearest() >= from && swarm.nearest() < to) {
                            continue;
                        }
                    }
                    (Span { until: to, edge: if cell.near { to } else { T::INFINITY } }, cell.program)
                }
                _ => {
                    if parted && inside != EVERYWHERE {
                        inside = EVERYWHERE;
                        swarm.enter::<R>((near, T::INFINITY), &mut samples.picked);
                        if swarm.nearest() < near {
                            continue;
                        }
                    }
                    (Span::ALL, cells.whole(job.field))
                }
            };
            let ops = field.ops();
            swarm.pick(span.until, &mut samples.picked);
            let points = samples.step(job, field, rule, span, swarm, &mut nobody, out);
            swarm.note(&samples.picked);
            cells.count(ops, points);
        }
    }

    /// Bytes that shortened programs take.
    pub fn arena_bytes(&self) -> u64 {
        self.cells.bytes()
    }
}
