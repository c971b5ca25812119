//! What drives a swarm: sample, step, until every ray has ended; in a tile of rays, or in a block of them
//! along which programs are shortened.

use sdfrs_core::{Field, Scratch, eval::Native, prune::Pruner};

use super::{
    Job, Threshold,
    beam::Beam,
    cells::{Cells, Found},
    columns::Columns,
    order::Order,
    refine::refine,
    swarm::{Picked, Swarm},
};
use crate::tracer::guarded::Rule;

/// What a worker keeps from tile to tile.
pub struct Worker<T: Native> {
    swarms: Vec<Swarm<T>>,
    cells: Cells<T>,
    samples: Samples<T>,
}

/// Points, and the field there.
struct Samples<T: Native> {
    scratch: Scratch<T>,
    picked: Picked,
    p: [Vec<T>; 3],
    r: Vec<T>,
}

impl<T: Native> Samples<T> {
    /// One step of the rays that ask for a sample before `until`; the number of points evaluated.
    fn step<R: Rule<T::Lanes>>(
        &mut self,
        job: &Job<T>,
        field: &dyn Field<T>,
        rule: R,
        until: T,
        swarm: &mut Swarm<T>,
        out: &mut Columns<T>,
    ) -> u64 {
        let Self { scratch, picked, p, r } = self;
        swarm.pick(until, picked);
        swarm.points(picked, p);
        let n = picked.packs.len() * Swarm::<T>::WIDTH;
        r.resize(r.len().max(n), T::of(0.0));
        field.eval(scratch, [&p[0][..n], &p[1][..n], &p[2][..n]], &mut r[..n]);
        swarm.step(rule, &job.threshold(), job.limits.max_steps, picked, (p, r), until, out);
        n as u64
    }

    /// Walks a swarm to its end through the whole field.
    fn walk<R: Rule<T::Lanes>>(&mut self, job: &Job<T>, rule: R, swarm: &mut Swarm<T>, out: &mut Columns<T>) {
        let mut points = 0;
        while swarm.alive() > 0 && !job.control.is_cancelled() {
            points += self.step(job, job.field, rule, T::INFINITY, swarm, out);
        }
        out.work.add(job.field.ops(), points);
    }
}

impl<T: Native> Worker<T> {
    pub fn new(skip: bool, limit: &Threshold<T>) -> Self {
        let samples = Samples {
            scratch: Scratch::new(),
            picked: Picked::default(),
            p: Default::default(),
            r: Vec::new(),
        };
        Self { swarms: Vec::new(), cells: Cells::new(skip, limit), samples }
    }

    /// Walks the rays from `first` on to their ends.
    pub fn tile<R: Rule<T::Lanes>>(&mut self, job: &Job<T>, rule: R, first: usize, out: &mut Columns<T>) {
        if self.swarms.is_empty() {
            self.swarms.push(Swarm::default());
        }
        let swarm = &mut self.swarms[0];
        swarm.clear();
        for k in 0..out.len() {
            swarm.push(&job.rays.ray(first + k), k as u32);
        }
        swarm.start();
        self.samples.walk(job, rule, swarm, out);
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
        let swarms = &mut self.swarms;
        swarms.iter_mut().for_each(Swarm::clear);
        let (mut groups, mut place) = (0, 0);
        order.each(block, |group, x, y| {
            if swarms.len() <= group {
                swarms.push(Swarm::default());
            }
            swarms[group].push(&job.rays.at(x, y), place);
            (groups, place) = (group + 1, place + 1);
        });
        swarms[..groups].iter_mut().for_each(Swarm::start);
        let beam = Beam::around(self.swarms[..groups].iter());
        if let Some(beam) = beam {
            self.cells.begin_block(beam);
        }
        for group in 0..groups {
            let beam = beam.and_then(|_| Beam::around(std::iter::once(&self.swarms[group])));
            match beam {
                Some(beam) => self.group(job, pruner, rule, (group, beam), out),
                // Rays without a common direction share no cells.
                None => self.samples.walk(job, rule, &mut self.swarms[group], out),
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
        let Self { swarms, cells, samples } = self;
        let swarm = &mut swarms[group];
        cells.begin_group(beam);
        while swarm.alive() > 0 && !job.control.is_cancelled() {
            let near = swarm.nearest();
            let (until, field): (T, &dyn Field<T>) = match cells.find(pruner, near.f64()) {
                Found::Empty(from, to) if T::of(to) > near => {
                    swarm.jump(T::of(from), T::of(to), out);
                    continue;
                }
                Found::Program(until, program) if T::of(until) > near => (T::of(until), program),
                _ => (T::INFINITY, job.field),
            };
            let (ops, points) = (field.ops(), samples.step(job, field, rule, until, swarm, out));
            cells.count(ops, points);
        }
    }

    /// Bytes that shortened programs take.
    pub fn arena_bytes(&self) -> u64 {
        self.cells.bytes()
    }
}
