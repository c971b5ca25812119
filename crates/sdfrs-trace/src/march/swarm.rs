//! Rays that step together, as columns of numbers that a pack at a time goes through.
//!
//! A finished ray stays in its lane, switched off, until a quarter of the lanes are: then the others
//! move up. Law: a ray's result depends on nothing but the ray (tests/laws, any tile, any thread count).

use sdfrs_core::{
    Real, Status,
    contract::{FLAG_CROSSING, FLAG_INSIDE, FLAG_PRECISION},
    eval::{Kernel, Lanes as Pack, Native, vectorise},
};

use super::{Ray, Threshold};
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
    live: Vec<T>,
    /// The nearest sample asked for in each pack.
    near: Vec<T>,
    steps: Vec<u32>,
    fallbacks: Vec<u32>,
    accepted: Vec<u32>,
    /// The ray's number within the tile.
    id: Vec<u32>,
    alive: usize,
    /// Lanes to keep, while ranks are closed.
    keep: Vec<u32>,
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
    pub const WIDTH: usize = T::Lanes::WIDTH;

    pub fn clear(&mut self) {
        self.each(|column| column.clear());
        for counts in [&mut self.steps, &mut self.fallbacks, &mut self.accepted, &mut self.id] {
            counts.clear();
        }
        self.alive = 0;
    }

    /// A ray more.
    #[inline]
    pub fn push(&mut self, ray: &Ray<T>, id: u32) {
        for a in 0..3 {
            self.origin[a].push(ray.origin[a]);
            self.direction[a].push(ray.direction[a]);
        }
        self.t_max.push(ray.t_max);
        self.ask.push(ray.t_min);
        self.id.push(id);
    }

    /// All rays stand at their starts.
    pub fn start(&mut self) {
        let (n, zero) = (self.id.len(), T::of(0.0));
        self.alive = n;
        self.t.extend_from_slice(&self.ask);
        for column in [&mut self.r, &mut self.z, &mut self.ratios, &mut self.witness] {
            column.resize(n, zero);
        }
        self.m.resize(n, T::of(-1.0));
        self.live.resize(n, T::of(1.0));
        for counts in [&mut self.steps, &mut self.fallbacks, &mut self.accepted] {
            counts.resize(n, 0);
        }
        self.pad();
    }

    /// Fills the last pack with switched off copies of the last ray.
    fn pad(&mut self) {
        let n = self.live.len();
        let to = n.next_multiple_of(Self::WIDTH);
        self.each(|column| {
            let last = column.last().copied().unwrap_or_default();
            column.resize(to, last);
        });
        self.live[n..].fill(T::of(0.0));
        self.ask[n..].fill(T::INFINITY);
        for counts in [&mut self.steps, &mut self.fallbacks, &mut self.accepted, &mut self.id] {
            counts.resize(to, 0);
        }
        self.near.clear();
        self.near.extend(self.ask.chunks(Self::WIDTH).map(|pack| pack.iter().copied().fold(T::INFINITY, T::min)));
    }

    pub fn alive(&self) -> usize {
        self.alive
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

    /// Takes the field at those points in, for rays that ask before `until`; ended rays go to the sink.
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
        vectorise(Step { swarm: self, rule, limit, max_steps, picked, p, r, until, sink });
        self.tidy();
    }

    /// The nearest sample asked for; infinite where no ray is under way.
    pub fn nearest(&self) -> T {
        self.near.iter().copied().fold(T::INFINITY, T::min)
    }

    /// The packs in which a ray asks for a sample before `until`.
    pub fn pick(&self, until: T, picked: &mut Picked) {
        picked.packs.clear();
        picked.packs.extend((0u32..).zip(&self.near).filter(|(_, near)| **near < until).map(|(i, _)| i));
    }

    /// Rays that ask for a sample before `to` start anew there: nothing lies in between.
    pub fn jump(&mut self, to: T, sink: &mut impl Sink<T>) {
        vectorise(Jump { swarm: self, to, sink });
        self.tidy();
    }

    /// Closes the ranks once a quarter of the lanes is empty.
    fn tidy(&mut self) {
        if self.alive * 4 < self.live.len() * 3 {
            self.close_ranks();
        }
    }

    /// Rays under way move up into the lanes of those that have ended.
    fn close_ranks(&mut self) {
        let half = T::of(0.5);
        let mut keep = std::mem::take(&mut self.keep);
        keep.clear();
        keep.extend((0u32..).zip(&self.live).filter(|(_, live)| half < **live).map(|(i, _)| i));
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
        self.keep = keep;
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

struct Jump<'a, T, S> {
    swarm: &'a mut Swarm<T>,
    to: T,
    sink: &'a mut S,
}

impl<T: Native, S: Sink<T>> Kernel for Jump<'_, T, S> {
    #[inline(always)]
    fn run(self) {
        let (w, zero) = (T::Lanes::WIDTH, T::Lanes::c(0.0));
        let to = T::Lanes::splat(self.to);
        for pack in 0..self.swarm.near.len() {
            if !(self.swarm.near[pack] < self.to) {
                continue;
            }
            let sw = &mut *self.swarm;
            let lanes = pack * w..(pack + 1) * w;
            let ask = T::Lanes::load(&sw.ask[lanes.clone()]);
            let fresh = [
                (&mut sw.ask, to),
                (&mut sw.t, to),
                (&mut sw.r, zero),
                (&mut sw.z, zero),
                (&mut sw.m, T::Lanes::c(-1.0)),
            ];
            for (column, value) in fresh {
                let column = &mut column[lanes.clone()];
                T::Lanes::select_lt(ask, to, value, T::Lanes::load(column)).store(column);
            }
            let mut near = T::INFINITY;
            for lane in lanes {
                if self.swarm.ask[lane] >= self.swarm.t_max[lane] && self.swarm.ask[lane] == self.to {
                    self.swarm.pass(lane, self.sink);
                }
                near = near.min(self.swarm.ask[lane]);
            }
            self.swarm.near[pack] = near;
        }
    }
}

impl<T: Native> Swarm<T> {
    /// The ray in a lane has passed everything.
    #[inline(never)]
    fn pass(&mut self, lane: usize, sink: &mut impl Sink<T>) {
        (self.live[lane], self.ask[lane]) = (T::of(0.0), T::INFINITY);
        self.alive -= 1;
        let mut tally = self.tally(lane, 0);
        tally.r = T::INFINITY;
        sink.end(self.id[lane], Status::Miss, &tally, T::of(0.0));
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
        let near = T::Lanes::select_lt(t, T::Lanes::splat(self.until), T::Lanes::c(1.0), T::Lanes::c(0.0));
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
        for (counts, flags) in [&mut sw.accepted, &mut sw.fallbacks].into_iter().zip(&flags[1..]) {
            for (n, flag) in counts[i..i + w].iter_mut().zip(flags) {
                *n += u32::from(half < *flag);
            }
        }
        let mut spent = false;
        for (n, flag) in sw.steps[i..i + w].iter_mut().zip(&flags[0]) {
            *n += u32::from(half < *flag);
            spent |= *n >= self.max_steps;
        }
        if spent || T::Lanes::any_lt(T::Lanes::c(0.5), verdict.code) {
            self.ends(i, &samples, asked, on, verdict.code);
        }
        let asks = &self.swarm.ask[i..i + w];
        self.swarm.near[i / w] = asks.iter().fold(T::INFINITY, |near, t| near.min(*t));
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
        // An empty lane asks for a sample where no scene is.
        (sw.live[lane], sw.ask[lane]) = (T::of(0.0), T::INFINITY);
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
