//! The loops over a swarm's columns, a pack at a time, compiled for each instruction set.
//!
//! Law: the bits are those of a ray alone, on every instruction set (tests/laws).

use sdfrs_core::{
    Real, Scalar, Status,
    contract::{FLAG_CROSSING, FLAG_INSIDE, FLAG_PRECISION},
    eval::{Kernel, Lanes as Pack, Native},
};

use super::{
    Threshold,
    swarm::{Crossing, Picked, Sink, Swarm, WIDEST},
};
use crate::tracer::guarded::{Bracket, Lanes, Rule, Samples, code, pick, step};

pub struct Jump<'a, T, S> {
    pub swarm: &'a mut Swarm<T>,
    pub from: T,
    pub to: T,
    pub sink: &'a mut S,
}

impl<T: Native, S: Sink<T>> Kernel for Jump<'_, T, S> {
    #[inline(always)]
    fn run(self) {
        let (w, zero) = (T::Lanes::WIDTH, T::Lanes::c(0.0));
        let (from, to) = (T::Lanes::splat(self.from), T::Lanes::splat(self.to));
        for pack in 0..self.swarm.near.len() {
            if !(self.swarm.near[pack] < self.to) {
                continue;
            }
            let sw = &mut *self.swarm;
            let lanes = pack * w..(pack + 1) * w;
            let i = pack * w;
            let (ask, t, r) = (load(&sw.ask, i), load::<T::Lanes>(&sw.t, i), load::<T::Lanes>(&sw.r, i));
            let (z, m) = (load::<T::Lanes>(&sw.z, i), load::<T::Lanes>(&sw.m, i));
            let one = T::Lanes::c(1.0);
            let asks = T::Lanes::select_lt(ask, to, one, zero);
            let reaches = asks * T::Lanes::select_lt(t + r, from, zero, one);
            let plain = asks - reaches;
            pick(reaches, to, pick(plain, t + r, ask)).store(&mut sw.ask[lanes.clone()]);
            pick(reaches, to, t).store(&mut sw.t[lanes.clone()]);
            pick(reaches, zero, r).store(&mut sw.r[lanes.clone()]);
            pick(reaches, zero, pick(plain, r, z)).store(&mut sw.z[lanes.clone()]);
            pick(reaches, T::Lanes::c(-1.0), m).store(&mut sw.m[lanes.clone()]);
            let ends = T::Lanes::load(&sw.t_max[lanes.clone()]);
            // Some ray may have passed everything; a negative `to` is rare enough to be looked at as well.
            if T::Lanes::any_lt(ends, to + to.abs() * T::Lanes::splat(T::EPS)) || self.to <= T::of(0.0) {
                for lane in lanes.clone() {
                    if self.swarm.ask[lane] >= self.swarm.t_max[lane] && self.swarm.ask[lane] == self.to {
                        self.swarm.pass(lane, self.sink);
                    }
                }
            }
            let sw = &mut *self.swarm;
            sw.near[pack] = least(T::Lanes::load(&sw.ask[lanes]));
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

/// The pack that begins at a lane. No closure: one that isn't inlined is compiled for the baseline.
#[inline(always)]
fn load<P: Pack>(column: &[P::S], lane: usize) -> P {
    P::load(&column[lane..lane + P::WIDTH])
}

/// Adds the truth values of a pack to counts.
#[inline(always)]
fn count<P: Pack>(counts: &mut [u32], truth: P) {
    let mut flags = [P::S::of(0.0); WIDEST];
    truth.store(&mut flags);
    let half = P::S::of(0.5);
    for (n, flag) in counts.iter_mut().zip(&flags) {
        *n += u32::from(half < *flag);
    }
}

/// Least lane, by halves: a chain of sixteen comparisons would take as long as the step itself.
#[inline(always)]
pub fn least<P: Pack>(pack: P) -> P::S {
    let mut lanes = [P::S::INFINITY; WIDEST];
    pack.store(&mut lanes);
    let mut half = WIDEST / 2;
    while half > 0 {
        for l in 0..half {
            lanes[l] = Real::min(lanes[l], lanes[l + half]);
        }
        half /= 2;
    }
    lanes[0]
}

impl<T: Native, R: Rule<T::Lanes>, S: Sink<T>> Step<'_, T, R, S> {
    #[inline(always)]
    fn pack(&mut self, j: usize) {
        let w = T::Lanes::WIDTH;
        let (i, j) = (self.picked.packs[j] as usize * w, j * w);
        let sw = &mut *self.swarm;
        let (t, t_max) = (load::<T::Lanes>(&sw.ask, i), load::<T::Lanes>(&sw.t_max, i));
        let near = T::Lanes::select_lt(t, T::Lanes::splat(self.until), T::Lanes::c(1.0), T::Lanes::c(0.0));
        let on = load::<T::Lanes>(&sw.live, i) * near;
        let [x, y, z] = self.p;
        let (x, y, z): (T::Lanes, T::Lanes, T::Lanes) = (load(x, j), load(y, j), load(z, j));
        let scale = t.abs().max(x.abs()).max(y.abs()).max(z.abs());
        let asked = T::Lanes::splat(self.limit.eps).max(T::Lanes::splat(self.limit.cone) * t);
        let e = asked.max(T::Lanes::c(4.0) * T::Lanes::splat(T::EPS) * scale);
        let samples = Samples { t, r: load(self.r, j), e, scale };
        let mut lanes = Lanes {
            t: load::<T::Lanes>(&sw.t, i),
            r: load::<T::Lanes>(&sw.r, i),
            z: load::<T::Lanes>(&sw.z, i),
            m: load::<T::Lanes>(&sw.m, i),
            ratios: load::<T::Lanes>(&sw.ratios, i),
            witness: load::<T::Lanes>(&sw.witness, i),
        };
        let verdict = step(self.rule, &mut lanes, &samples, t_max, on);
        // One by one: an array of packs would live in memory.
        lanes.t.store(&mut sw.t[i..i + w]);
        lanes.r.store(&mut sw.r[i..i + w]);
        lanes.z.store(&mut sw.z[i..i + w]);
        lanes.m.store(&mut sw.m[i..i + w]);
        lanes.ratios.store(&mut sw.ratios[i..i + w]);
        lanes.witness.store(&mut sw.witness[i..i + w]);
        count(&mut sw.accepted[i..i + w], verdict.accepted);
        count(&mut sw.fallbacks[i..i + w], verdict.fallback);
        let steps = &mut sw.steps[i..i + w];
        count(steps, on);
        let mut spent = false;
        for n in steps.iter() {
            spent |= *n >= self.max_steps;
        }
        if spent || T::Lanes::any_lt(T::Lanes::c(0.5), verdict.code) {
            self.ends(i, j, on, verdict.code);
        }
        // Rays that ended ask nowhere.
        let sw = &mut *self.swarm;
        let half = T::Lanes::c(0.5);
        let next = T::Lanes::select_lt(half, on, (lanes.t + lanes.z).min(t_max), t);
        let live = T::Lanes::load(&sw.live[i..i + w]);
        let ask = T::Lanes::select_lt(half, live, next, T::Lanes::splat(T::INFINITY));
        ask.store(&mut sw.ask[i..i + w]);
        sw.near[i / w] = least(ask);
    }

    /// Rays of a pack that end here, lane by lane.
    #[inline(never)]
    fn ends(&mut self, i: usize, j: usize, on: T::Lanes, ends: T::Lanes) {
        let half = T::of(0.5);
        let [mut ons, mut codes] = [[T::of(0.0); WIDEST]; 2];
        on.store(&mut ons);
        ends.store(&mut codes);
        for l in 0..T::Lanes::WIDTH {
            let (lane, code) = (i + l, codes[l].f64());
            if half < ons[l] && (code != 0.0 || self.swarm.steps[lane] >= self.max_steps) {
                let (t, r) = (self.swarm.ask[lane], self.r[j + l]);
                let scale = self.p.iter().fold(t.abs(), |s, p| s.max(p[j + l].abs()));
                let asked = self.limit.eps.max(self.limit.cone * t);
                let e = asked.max(T::of(4.0) * T::EPS * scale);
                self.end(lane, code, (t, r), (e, asked));
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
