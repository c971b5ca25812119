//! Rays that step one by one between their samples: the search tracers and the listings' own forms.

use sdfrs_core::{Limits, Scalar, Scratch, Status, eval::Native};

use super::{
    Job, Ray, TILE,
    columns::Columns,
    ends::{End, Sink},
};
use crate::tracer::walk::{Next, Range, Sample, Tally, Walk};

/// A worker's memory for a tile of rays.
pub struct Wave<T: Native, W: Walk<T>> {
    scratch: Scratch<T>,
    rays: Vec<Ray<T>>,
    states: Vec<(W::State, Tally<T>)>,
    /// Rays still walking, the samples they ask for and the field there.
    active: Vec<u32>,
    at: Vec<T>,
    p: [Vec<T>; 3],
    r: Vec<T>,
}

impl<T: Native, W: Walk<T>> Wave<T, W> {
    pub fn new() -> Self {
        Self {
            scratch: Scratch::new(),
            rays: Vec::with_capacity(TILE),
            states: Vec::with_capacity(TILE),
            active: Vec::with_capacity(TILE),
            at: Vec::with_capacity(TILE),
            p: std::array::from_fn(|_| vec![T::of(0.0); TILE]),
            r: vec![T::of(0.0); TILE],
        }
    }

    fn begin(&mut self, job: &Job<T>, walk: &W, first: usize, n: usize) {
        self.rays.clear();
        self.states.clear();
        self.active.clear();
        self.at.clear();
        for k in 0..n {
            let ray = job.rays.ray(first + k);
            let (state, t) = walk.start(&range(&ray, job.limits));
            self.rays.push(ray);
            self.states.push((state, Tally::new(job.limits.max_steps)));
            self.active.push(k as u32);
            self.at.push(t);
        }
    }

    /// Walks the rays from `first` on to their ends.
    pub fn tile(&mut self, job: &Job<T>, walk: &W, first: usize, out: &mut Columns<T>) {
        self.begin(job, walk, first, out.len());
        while !self.active.is_empty() && !job.control.is_cancelled() {
            self.sample(job);
            out.work.add(job.field.ops(), self.active.len() as u64);
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
                            out.hit(s.e);
                        }
                        let t = tally.t;
                        out.end(k as u32, &End::of(status, tally), || self.rays[k].at(t));
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
            let p = self.rays[k as usize].at(self.at[i]);
            for axis in 0..3 {
                self.p[axis][i] = p[axis];
            }
        }
        let p = [&self.p[0][..n], &self.p[1][..n], &self.p[2][..n]];
        job.field.eval(&mut self.scratch, p, &mut self.r[..n]);
    }

    /// The `i`-th active ray's sample.
    fn look(&self, i: usize, job: &Job<T>) -> Sample<T> {
        let (t, r) = (self.at[i], self.r[i]);
        let (limit, p) = (job.threshold(), self.p.each_ref().map(|p| p[i]));
        let (asked, guarded) = (limit.asked(t), limit.sample(t, p, r));
        Sample { t, r, e: if job.guards { guarded.e } else { asked }, asked, scale: guarded.scale }
    }
}

fn range<T: Scalar>(ray: &Ray<T>, limits: &Limits) -> Range<T> {
    Range { t_min: ray.t_min, t_max: ray.t_max, eps: T::of(limits.eps) }
}
