//! Rays that step together, as columns of numbers that a pack at a time goes through.
//!
//! A finished ray stays in its lane, switched off, until a quarter of the lanes are: then the others
//! move up. Law: a ray's result depends on nothing but the ray (tests/laws, any tile, any thread count).

use sdfrs_core::{
    Real, Scratch, Status,
    contract::{FLAG_CROSSING, FLAG_INSIDE, FLAG_PRECISION},
    eval::{Kernel, Lanes as Pack, Native, vectorise},
};

use super::{Job, Ray, Threshold, columns::Columns, refine::refine};
use crate::tracer::{
    guarded::{Bracket, Lanes, Rule, Samples, code, step},
    walk::Tally,
};

/// Widest pack of any scalar.
const WIDEST: usize = 16;

/// The columns; all have one length, a multiple of the pack's width.
#[derive(Default)]
pub struct Swarm<T> {
    pub origin: [Vec<T>; 3],
    pub direction: [Vec<T>; 3],
    pub t_max: Vec<T>,
    /// Where the field is wanted next.
    pub ask: Vec<T>,
    t: Vec<T>,
    r: Vec<T>,
    z: Vec<T>,
    m: Vec<T>,
    ratios: Vec<T>,
    witness: Vec<T>,
    /// 1 for a ray under way, 0 for an empty lane.
    pub live: Vec<T>,
    steps: Vec<u32>,
    fallbacks: Vec<u32>,
    accepted: Vec<u32>,
    /// The ray's number within the tile.
    id: Vec<u32>,
    alive: usize,
    /// Most evaluations of any ray so far.
    most_steps: u32,
}

/// A surface that a safe step went through, to be refined when the others are done.
pub struct Crossing<T> {
    pub origin: [T; 3],
    pub direction: [T; 3],
    pub bracket: Bracket<T>,
    pub tally: Tally<T>,
    /// Threshold of the last sample.
    pub e: T,
    pub id: u32,
}

/// Where ended rays go.
pub trait Sink<T> {
    fn end(&mut self, id: u32, status: Status, tally: &Tally<T>, threshold: T);
    fn cross(&mut self, crossing: Crossing<T>);
}

/// The packs of a swarm that are sampled together, by number.
#[derive(Default)]
pub struct Picked {
    pub packs: Vec<u32>,
}

impl<T: Native> Swarm<T> {
    const WIDTH: usize = T::Lanes::WIDTH;

    pub fn clear(&mut self) {
        self.each(|column| column.clear());
        for counts in [&mut self.steps, &mut self.fallbacks, &mut self.accepted, &mut self.id] {
            counts.clear();
        }
        (self.alive, self.most_steps) = (0, 0);
    }

    /// A ray more, standing at its start.
    pub fn push(&mut self, ray: &Ray<T>, id: u32) {
        let zero = T::of(0.0);
        for a in 0..3 {
            self.origin[a].push(ray.origin[a]);
            self.direction[a].push(ray.direction[a]);
        }
        let values = [ray.t_max, ray.t_min, ray.t_min, zero, zero, T::of(-1.0), zero, zero, T::of(1.0)];
        for (column, v) in self.own().into_iter().zip(values) {
            column.push(v);
        }
        for (counts, v) in
            [&mut self.steps, &mut self.fallbacks, &mut self.accepted, &mut self.id].into_iter().zip([0, 0, 0, id])
        {
            counts.push(v);
        }
        self.alive += 1;
    }

    /// Fills the last pack with switched off copies of the last ray.
    pub fn pad(&mut self) {
        let n = self.live.len();
        let to = n.next_multiple_of(Self::WIDTH);
        self.each(|column| {
            let last = column.last().copied().unwrap_or_default();
            column.resize(to, last);
        });
        self.live[n..].fill(T::of(0.0));
        for counts in [&mut self.steps, &mut self.fallbacks, &mut self.accepted, &mut self.id] {
            counts.resize(to, 0);
        }
    }

    pub fn alive(&self) -> usize {
        self.alive
    }
    pub fn packs(&self) -> usize {
        self.live.len() / Self::WIDTH
    }

    fn own(&mut self) -> [&mut Vec<T>; 9] {
        [
            &mut self.t_max,
            &mut self.ask,
            &mut self.t,
            &mut self.r,
            &mut self.z,
            &mut self.m,
            &mut self.ratios,
            &mut self.witness,
            &mut self.live,
        ]
    }
    fn each(&mut self, mut f: impl FnMut(&mut Vec<T>)) {
        self.own().into_iter().for_each(&mut f);
        self.origin.iter_mut().chain(&mut self.direction).for_each(f);
    }

    /// The points that the picked packs ask for, side by side.
    pub fn points(&self, picked: &Picked, p: &mut [Vec<T>; 3]) {
        for p in p.iter_mut() {
            p.resize(p.len().max(picked.packs.len() * Self::WIDTH), T::of(0.0));
        }
        vectorise(Points { swarm: self, picked, p });
    }

    /// Takes the field at those points in, for rays that ask at `until` or before; ended rays go to the sink.
    #[allow(clippy::too_many_arguments)] // columns and limits of one call from one place
    pub fn step<R: Rule<T::Lanes>>(
        &mut self,
        rule: R,
        limit: &Threshold<T>,
        max_steps: u32,
        picked: &Picked,
        (p, r): (&[Vec<T>; 3], &[T]),
        until: T,
        sink: &mut impl Sink<T>,
    ) {
        self.most_steps += 1;
        let check = self.most_steps >= max_steps;
        vectorise(Step { swarm: self, rule, limit, max_steps, check, picked, p, r, until, sink });
        if self.alive * 4 < self.live.len() * 3 {
            self.close_ranks();
        }
    }

    /// Rays under way move up into the lanes of those that have ended.
    fn close_ranks(&mut self) {
        let half = T::of(0.5);
        let keep: Vec<u32> =
            (0..self.live.len()).filter(|&i| half < self.live[i]).map(|i| i as u32).collect();
        fn take<V: Copy>(column: &mut Vec<V>, keep: &[u32]) {
            for (to, &from) in keep.iter().enumerate() {
                column[to] = column[from as usize];
            }
            column.truncate(keep.len());
        }
        self.each(|column| take(column, &keep));
        for counts in [&mut self.steps, &mut self.fallbacks, &mut self.accepted, &mut self.id] {
            take(counts, &keep);
        }
        self.pad();
    }

    /// What the ray in a lane has come to.
    fn tally(&self, i: usize, flags: u8) -> Tally<T> {
        Tally {
            steps: self.steps[i],
            max_steps: 0,
            fallbacks: self.fallbacks[i],
            accepted: self.accepted[i],
            ratios: self.ratios[i],
            t: self.t[i],
            r: self.r[i],
            witness: self.witness[i],
            flags,
        }
    }
}

/// What a worker keeps from tile to tile.
pub struct Worker<T: Native> {
    scratch: Scratch<T>,
    swarm: Swarm<T>,
    picked: Picked,
    p: [Vec<T>; 3],
    r: Vec<T>,
}

impl<T: Native> Worker<T> {
    pub fn new() -> Self {
        Self {
            scratch: Scratch::new(),
            swarm: Swarm::default(),
            picked: Picked::default(),
            p: Default::default(),
            r: Vec::new(),
        }
    }

    /// Walks the rays from `first` on to their ends.
    pub fn tile<R: Rule<T::Lanes>>(&mut self, job: &Job<T>, rule: R, first: usize, out: &mut Columns<T>) {
        let Self { scratch, swarm, picked, p, r } = self;
        swarm.clear();
        for k in 0..out.len() {
            swarm.push(&job.rays.ray(first + k), k as u32);
        }
        swarm.pad();
        let limit = job.threshold();
        while swarm.alive() > 0 && !job.control.is_cancelled() {
            picked.packs.clear();
            picked.packs.extend(0..swarm.packs() as u32);
            swarm.points(picked, p);
            let n = swarm.packs() * Swarm::<T>::WIDTH;
            r.resize(r.len().max(n), T::of(0.0));
            job.field.eval(scratch, [&p[0][..n], &p[1][..n], &p[2][..n]], &mut r[..n]);
            swarm.step(rule, &limit, job.limits.max_steps, picked, (p, r), T::INFINITY, out);
        }
        let crossings = std::mem::take(&mut out.crossings);
        refine(job.field, scratch, &limit, crossings, out);
    }
}

struct Points<'a, T> {
    swarm: &'a Swarm<T>,
    picked: &'a Picked,
    p: &'a mut [Vec<T>; 3],
}

impl<T: Native> Kernel for Points<'_, T> {
    #[inline(always)]
    fn run(self) {
        let (s, w) = (self.swarm, T::Lanes::WIDTH);
        for (j, &pack) in self.picked.packs.iter().enumerate() {
            let (i, j) = (pack as usize * w, j * w);
            let t = T::Lanes::load(&s.ask[i..i + w]);
            for a in 0..3 {
                let (o, d) = (T::Lanes::load(&s.origin[a][i..i + w]), T::Lanes::load(&s.direction[a][i..i + w]));
                (o + t * d).store(&mut self.p[a][j..j + w]);
            }
        }
    }
}

struct Step<'a, T: Native, R, S> {
    swarm: &'a mut Swarm<T>,
    rule: R,
    limit: &'a Threshold<T>,
    max_steps: u32,
    /// Whether some ray may have spent its budget.
    check: bool,
    picked: &'a Picked,
    p: &'a [Vec<T>; 3],
    r: &'a [T],
    until: T,
    sink: &'a mut S,
}

impl<T: Native, R: Rule<T::Lanes>, S: Sink<T>> Kernel for Step<'_, T, R, S> {
    #[inline(always)]
    fn run(mut self) {
        for j in 0..self.picked.packs.len() {
            self.pack(j);
        }
    }
}

impl<T: Native, R: Rule<T::Lanes>, S: Sink<T>> Step<'_, T, R, S> {
    #[inline(always)]
    fn pack(&mut self, j: usize) {
        let w = T::Lanes::WIDTH;
        let (i, j) = (self.picked.packs[j] as usize * w, j * w);
        let at = |column: &Vec<T>| T::Lanes::load(&column[i..i + w]);
        let sw = &mut *self.swarm;
        let (t, t_max) = (at(&sw.ask), at(&sw.t_max));
        let near = T::Lanes::select_lt(T::Lanes::splat(self.until), t, T::Lanes::c(0.0), T::Lanes::c(1.0));
        let on = at(&sw.live) * near;
        let p: [T::Lanes; 3] = std::array::from_fn(|a| T::Lanes::load(&self.p[a][j..j + w]));
        let scale = t.abs().max(p[0].abs()).max(p[1].abs()).max(p[2].abs());
        let asked = T::Lanes::splat(self.limit.eps).max(T::Lanes::splat(self.limit.cone) * t);
        let e = asked.max(T::Lanes::c(4.0) * T::Lanes::splat(T::EPS) * scale);
        let samples = Samples { t, r: T::Lanes::load(&self.r[j..j + w]), e, scale };
        let mut lanes = Lanes {
            t: at(&sw.t),
            r: at(&sw.r),
            z: at(&sw.z),
            m: at(&sw.m),
            ratios: at(&sw.ratios),
            witness: at(&sw.witness),
        };
        let verdict = step(self.rule, &mut lanes, &samples, t_max, on);
        let next = (lanes.t + lanes.z).min(t_max);
        let half = T::Lanes::c(0.5);
        let columns = [
            (&mut sw.ask, T::Lanes::select_lt(half, on, next, t)),
            (&mut sw.t, lanes.t),
            (&mut sw.r, lanes.r),
            (&mut sw.z, lanes.z),
            (&mut sw.m, lanes.m),
            (&mut sw.ratios, lanes.ratios),
            (&mut sw.witness, lanes.witness),
        ];
        for (column, value) in columns {
            value.store(&mut column[i..i + w]);
        }
        let mut flags = [[T::of(0.0); WIDEST]; 3];
        on.store(&mut flags[0]);
        verdict.accepted.store(&mut flags[1]);
        verdict.fallback.store(&mut flags[2]);
        let half = T::of(0.5);
        for (counts, flags) in [&mut sw.steps, &mut sw.accepted, &mut sw.fallbacks].into_iter().zip(&flags) {
            for (n, flag) in counts[i..i + w].iter_mut().zip(flags) {
                *n += u32::from(half < *flag);
            }
        }
        if self.check || T::Lanes::any_lt(T::Lanes::c(0.5), verdict.code) {
            self.ends(i, &samples, asked, on, verdict.code);
        }
    }

    /// Rays of a pack that end here, lane by lane.
    #[inline(never)]
    fn ends(&mut self, i: usize, s: &Samples<T::Lanes>, asked: T::Lanes, on: T::Lanes, ends: T::Lanes) {
        let half = T::of(0.5);
        let [mut t, mut r, mut e, mut low, mut ons, mut codes] = [[T::of(0.0); WIDEST]; 6];
        for (pack, to) in
            [(s.t, &mut t), (s.r, &mut r), (s.e, &mut e), (asked, &mut low), (on, &mut ons), (ends, &mut codes)]
        {
            pack.store(to);
        }
        for l in 0..T::Lanes::WIDTH {
            let (lane, code) = (i + l, codes[l].f64());
            let spent = self.swarm.steps[lane] >= self.max_steps;
            if half < ons[l] && (code != 0.0 || spent) {
                self.end(lane, code, (t[l], r[l]), (e[l], low[l]));
            }
        }
    }

    fn end(&mut self, lane: usize, code: f64, (t, r): (T, T), (e, asked): (T, T)) {
        let sw = &mut *self.swarm;
        sw.live[lane] = T::of(0.0);
        sw.alive -= 1;
        let id = sw.id[lane];
        let mut tally = sw.tally(lane, 0);
        let mut hit = T::of(0.0);
        let status = match code {
            code::HIT => {
                tally.flags = if r > asked { FLAG_PRECISION } else { 0 } | if r < -e { FLAG_INSIDE } else { 0 };
                hit = e;
                Status::Hit
            }
            code::MISS => Status::Miss,
            code::INVALID => {
                // Only a first sample is where the ray stands.
                if tally.t == t {
                    tally.r = r;
                }
                Status::Invalid
            }
            code::CROSSED => {
                let origin = std::array::from_fn(|a| sw.origin[a][lane]);
                let direction = std::array::from_fn(|a| sw.direction[a][lane]);
                tally.flags = FLAG_CROSSING;
                tally.max_steps = self.max_steps;
                let bracket = Bracket::new(tally.t, tally.r, t, r, e);
                self.sink.cross(Crossing { origin, direction, bracket, tally, e, id });
                return;
            }
            _ => Status::OutOfSteps,
        };
        self.sink.end(id, status, &tally, hit);
    }
}
