//! The loops over a swarm's columns, a pack at a time, compiled for each instruction set.
//!
//! Law: the bits are those of a ray alone, on every instruction set (tests/laws).

use sdfrs_core::{
    Real, Status,
    contract::{FLAG_CROSSING, FLAG_INSIDE, FLAG_PRECISION},
    eval::{Kernel, Lanes as Pack, Native},
};

use super::{
    Threshold,
    swarm::{Crossing, Picked, Sink, Swarm, WIDEST},
};
use crate::tracer::guarded::{Bracket, Lanes, Rule, Samples, code, step};

pub struct Jump<'a, T, S> {
    pub swarm: &'a mut Swarm<T>,
    pub to: T,
    pub sink: &'a mut S,
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

pub struct Points<'a, T> {
    pub swarm: &'a Swarm<T>,
    pub picked: &'a Picked,
    pub p: &'a mut [Vec<T>; 3],
}

impl<T: Native> Kernel for Points<'_, T> {
    #[inline(always)]
    fn run(self) {
        let (s, w) = (self.swarm, T::Lanes::WIDTH);
        for (j, &pack) in self.picked.packs.iter().enumerate() {
            let (i, j) = (pack as usize * w, j * w);
            let t = T::Lanes::load(&s.ask[i..i + w]);
            for a in 0..3 {
                let (o, d) =
                    (T::Lanes::load(&s.origin[a][i..i + w]), T::Lanes::load(&s.direction[a][i..i + w]));
                (o + t * d).store(&mut self.p[a][j..j + w]);
            }
        }
    }
}

pub struct Step<'a, T: Native, R, S> {
    pub swarm: &'a mut Swarm<T>,
    pub rule: R,
    pub limit: &'a Threshold<T>,
    pub max_steps: u32,
    pub picked: &'a Picked,
    pub p: &'a [Vec<T>; 3],
    pub r: &'a [T],
    pub until: T,
    pub sink: &'a mut S,
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
        for (pack, to) in [
            (s.t, &mut t),
            (s.r, &mut r),
            (s.e, &mut e),
            (asked, &mut low),
            (on, &mut ons),
            (ends, &mut codes),
        ] {
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
                tally.flags =
                    if r > asked { FLAG_PRECISION } else { 0 } | if r < -e { FLAG_INSIDE } else { 0 };
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
