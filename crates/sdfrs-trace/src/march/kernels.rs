//! The loops over a swarm's packs, compiled for each instruction set.
//!
//! Law: the bits are those of a ray alone, on every instruction set (tests/laws).

use std::marker::PhantomData;

use sdfrs_core::{
    Real, Status,
    contract::{FLAG_CROSSING, FLAG_INSIDE, FLAG_PRECISION},
    eval::{Kernel, Lanes, Native},
    lane::Truth,
};

use super::{
    Threshold,
    feed::Feed,
    swarm::{Crossing, Pack, Passed, QUAD, Sink, Span, Swarm},
};
use crate::tracer::guarded::{Bracket, Rule, State, Verdict, step};

/// Rays step over what is known to be empty.
pub struct Jump<'a, T: Native, R, S> {
    pub swarm: &'a mut Swarm<T>,
    pub rule: PhantomData<R>,
    pub from: T,
    pub to: T,
    pub sink: &'a mut S,
}

impl<T: Native, R: Rule<T::Lanes>, S: Sink<T>> Kernel for Jump<'_, T, R, S> {
    #[inline(always)]
    fn run(self) {
        let (from, to) = (T::Lanes::splat(self.from), T::Lanes::splat(self.to));
        let Swarm { packs, near, alive } = self.swarm;
        for (pack, near) in packs.iter_mut().zip(near) {
            if !(*near < self.to) {
                continue;
            }
            let (ask, t_max) = (pack.rays.t, pack.rays.t_max);
            let s = &mut pack.state;
            let asks = T::Lanes::lt(ask, to);
            let reaches = asks & !T::Lanes::lt(s.t + s.r, from);
            let plain = asks & !reaches;
            let ask = T::Lanes::pick(reaches, to, T::Lanes::pick(plain, s.t + s.r, ask));
            restart::<T::Lanes, R>(s, plain, reaches, to);
            pack.rays.t = ask;
            let passed = (reaches & !T::Lanes::lt(to, t_max)).settled();
            if passed.any() {
                *alive -= pass::<T, R>(pack, passed.bits(), self.sink);
            }
            *near = pack.rays.t.least();
        }
    }
}

/// Rays that have passed everything, by a bit a lane; their number.
#[inline(never)]
fn pass<T: Native, R: Rule<T::Lanes>>(
    pack: &mut Pack<T::Lanes>,
    passed: u32,
    sink: &mut impl Sink<T>,
) -> usize {
    let mut left = passed;
    for first in (0..T::Lanes::WIDTH).step_by(QUAD) {
        let places: [u32; QUAD] = std::array::from_fn(|i| pack.place[first + i]);
        let side_by_side = (0..QUAD).all(|i| places[i] == places[0] + i as u32);
        let all = ((1 << QUAD) - 1) << first;
        if side_by_side && passed & all == all {
            let tallies: [_; QUAD] = std::array::from_fn(|i| pack.tally::<R>(first + i));
            let four = Passed {
                steps: tallies.each_ref().map(|tally| tally.steps),
                fallbacks: tallies.each_ref().map(|tally| tally.fallbacks),
                multiplier: tallies.each_ref().map(|tally| tally.multiplier()),
                witness: tallies.each_ref().map(|tally| tally.witness),
            };
            sink.pass(&places, &four);
            (first..first + QUAD).for_each(|lane| pack.rays.t.set(lane, T::INFINITY));
            left &= !all;
        }
    }
    for lane in lanes(left) {
        let mut tally = pack.tally::<R>(lane);
        tally.r = T::INFINITY;
        sink.end(pack.place[lane], Status::Miss, &tally, T::of(0.0));
        pack.rays.t.set(lane, T::INFINITY);
    }
    passed.count_ones() as usize
}

/// Rays come to a stretch with a field of its own: no step into it is one of this field.
pub struct Enter<'a, T: Native, R> {
    pub swarm: &'a mut Swarm<T>,
    pub rule: PhantomData<R>,
    pub from: T,
    pub to: T,
}

impl<T: Native, R: Rule<T::Lanes>> Kernel for Enter<'_, T, R> {
    #[inline(always)]
    fn run(self) {
        let (from, to) = (T::Lanes::splat(self.from), T::Lanes::splat(self.to));
        let Swarm { packs, near, .. } = self.swarm;
        for (pack, near) in packs.iter_mut().zip(near) {
            if !(*near < self.to) {
                continue;
            }
            let ask = pack.rays.t;
            let s = &mut pack.state;
            let asks = T::Lanes::lt(ask, to) & T::Lanes::lt(s.t, from);
            // A longer step proves nothing of what it left out.
            let ask = T::Lanes::pick(asks, ask.min(s.t + s.r), ask);
            let anew = asks & !T::Lanes::lt(ask, from);
            restart::<T::Lanes, R>(s, asks, anew, ask);
            pack.rays.t = ask;
            *near = pack.rays.t.least();
        }
    }
}

/// Where rays take the plain step, and where they start anew at a depth.
#[inline(always)]
fn restart<L: Lanes, R: Rule<L>>(s: &mut State<L>, plain: L::Mask, anew: L::Mask, t: L) {
    let zero = L::c(0.0);
    // Other rules never look at these.
    if R::LONGER {
        s.z = L::pick(anew, zero, L::pick(plain, s.r, s.z));
        s.m = L::pick(anew, L::c(-1.0), s.m);
    }
    s.t = L::pick(anew, t, s.t);
    s.r = L::pick(anew, zero, s.r);
}

/// The lanes whose bits are set.
#[inline(always)]
fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros();
        bits &= bits.wrapping_sub(1);
        (lane < u32::BITS).then_some(lane as usize)
    })
}

/// Where the rays want the field.
pub struct Points<'a, T: Native> {
    pub swarm: &'a Swarm<T>,
    pub picked: &'a [u32],
    /// Lanes that ask for nothing before this are taken here: points that are no numbers cost most.
    pub until: T,
    pub p: &'a mut [Vec<T>; 3],
}

impl<T: Native> Kernel for Points<'_, T> {
    #[inline(always)]
    fn run(self) {
        let w = T::Lanes::WIDTH;
        let [x, y, z] = self.p;
        let columns = x.chunks_exact_mut(w).zip(y.chunks_exact_mut(w)).zip(z.chunks_exact_mut(w));
        for (&pack, ((x, y), z)) in self.picked.iter().zip(columns) {
            let rays = &self.swarm.packs[pack as usize].rays;
            let ([ox, oy, oz], [dx, dy, dz]) = (rays.origin, rays.direction);
            let t = rays.t.min(T::Lanes::splat(self.until));
            (ox + t * dx).store(x);
            (oy + t * dy).store(y);
            (oz + t * dz).store(z);
        }
    }
}

/// Rays take a sample in.
pub struct Step<'a, 'b, T: Native, R, S> {
    pub swarm: &'a mut Swarm<T>,
    pub rule: R,
    pub limit: &'a Threshold<T>,
    pub max_steps: u32,
    pub picked: &'a [u32],
    pub p: &'a [Vec<T>; 3],
    pub r: &'a [T],
    pub span: Span<T>,
    pub feed: &'a mut Feed<'b, T>,
    pub sink: &'a mut S,
}

impl<T: Native, R: Rule<T::Lanes>, S: Sink<T>> Kernel for Step<'_, '_, T, R, S> {
    #[inline(always)]
    fn run(self) {
        let w = T::Lanes::WIDTH;
        let [x, y, z] = self.p;
        let columns =
            x.chunks_exact(w).zip(y.chunks_exact(w)).zip(z.chunks_exact(w)).zip(self.r.chunks_exact(w));
        let mut ends =
            Ends { limit: self.limit, max_steps: self.max_steps, feed: self.feed, sink: self.sink, ended: 0 };
        let Swarm { packs, alive, .. } = &mut *self.swarm;
        let until = T::Lanes::splat(self.span.until);
        let endless = T::Lanes::splat(T::INFINITY);
        let edge = T::Lanes::splat(self.span.edge);
        for (&number, (((x, y), z), r)) in self.picked.iter().zip(columns) {
            let pack = &mut packs[number as usize];
            let p = [T::Lanes::load(x), T::Lanes::load(y), T::Lanes::load(z)];
            let samples = self.limit.sample(pack.rays.t, p, T::Lanes::load(r));
            let on = T::Lanes::lt(samples.t, until);
            let t_max = pack.rays.t_max;
            // A field that ends before the ray tells nothing of its end.
            let short = T::Lanes::lt(edge, t_max);
            let end = T::Lanes::pick(short, endless, t_max);
            let verdict = step(self.rule, &mut pack.state, &samples, end, on);
            verdict.accepted.count(&mut pack.accepted);
            if R::LONGER {
                verdict.fallback.count(&mut pack.fallbacks);
            }
            on.count(&mut pack.steps);
            let spent = on & <T::Lanes as Lanes>::Mask::at_least(&pack.steps, self.max_steps);
            let length = if R::LONGER { pack.state.z } else { pack.state.r };
            pack.rays.t = T::Lanes::pick(on, (pack.state.t + length).min(t_max).min(edge), samples.t);
            let Verdict { invalid, crossed, hit, far, .. } = verdict;
            let ended = invalid | crossed | hit | far | spent;
            if ended.any() {
                let mut code = T::Lanes::pick(far, T::Lanes::c(code::MISS), T::Lanes::c(code::SPENT));
                code = T::Lanes::pick(hit, T::Lanes::c(code::HIT), code);
                code = T::Lanes::pick(crossed, T::Lanes::c(code::CROSSED), code);
                code = T::Lanes::pick(invalid, T::Lanes::c(code::INVALID), code);
                // A copy of its own: what another function sees has to lie in memory.
                let last = Last { t: samples.t, r: samples.r, e: samples.e, code };
                ends.pack::<R>(pack, &last, ended.bits());
            }
        }
        *alive -= ends.ended;
        // Not above: a sum over the lanes there would take the packs of the whole loop apart.
        let Swarm { packs, near, .. } = self.swarm;
        for &number in self.picked {
            near[number as usize] = packs[number as usize].rays.t.least();
        }
    }
}

/// Samples with which rays of a pack end, and how.
struct Last<L> {
    t: L,
    r: L,
    e: L,
    code: L,
}

/// Where rays end, and others begin.
struct Ends<'a, 'b, T: Native, S> {
    limit: &'a Threshold<T>,
    max_steps: u32,
    feed: &'a mut Feed<'b, T>,
    sink: &'a mut S,
    ended: usize,
}

impl<T: Native, S: Sink<T>> Ends<'_, '_, T, S> {
    /// Rays of a pack that end here, by a bit a lane, and how.
    #[inline(never)]
    fn pack<R: Rule<T::Lanes>>(&mut self, pack: &mut Pack<T::Lanes>, last: &Last<T::Lanes>, ended: u32) {
        for lane in lanes(ended) {
            let (t, r, e) = (last.t.lane(lane), last.r.lane(lane), last.e.lane(lane));
            self.end::<R>(pack, lane, (t, r, e), last.code.lane(lane).f64());
            if !self.feed.next(|bundle, which, place| pack.enter::<R>(lane, bundle, which, place)) {
                pack.rays.t.set(lane, T::INFINITY);
                self.ended += 1;
            }
        }
    }

    #[inline]
    fn end<R: Rule<T::Lanes>>(
        &mut self,
        pack: &Pack<T::Lanes>,
        lane: usize,
        (t, r, e): (T, T, T),
        code: f64,
    ) {
        let mut tally = pack.tally::<R>(lane);
        let place = pack.place[lane];
        let mut hit = T::of(0.0);
        let status = match code {
            code::HIT => {
                let limited = if r > self.limit.asked(t) { FLAG_PRECISION } else { 0 };
                tally.flags = limited | if r < -e { FLAG_INSIDE } else { 0 };
                hit = e;
                Status::Hit
            }
            code::MISS => Status::Miss,
            code::CROSSED => {
                let origin = pack.rays.origin.each_ref().map(|v| v.lane(lane));
                let direction = pack.rays.direction.each_ref().map(|v| v.lane(lane));
                (tally.flags, tally.max_steps) = (FLAG_CROSSING, self.max_steps);
                let bracket = Bracket::new(tally.t, tally.r, t, r, e);
                self.sink.cross(Crossing { origin, direction, bracket, tally, e, place });
                return;
            }
            code::INVALID => {
                // Only a first sample is where the ray stands.
                if tally.t == t {
                    tally.r = r;
                }
                Status::Invalid
            }
            _ => Status::OutOfSteps,
        };
        self.sink.end(place, status, &tally, hit);
    }
}

/// Ends of a walk as numbers that fit into lanes; where several hold, the last one counts.
mod code {
    pub const SPENT: f64 = 0.0;
    pub const MISS: f64 = 1.0;
    pub const HIT: f64 = 2.0;
    pub const CROSSED: f64 = 3.0;
    pub const INVALID: f64 = 4.0;
}
