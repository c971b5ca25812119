//! The loops over a swarm's packs, compiled for each instruction set.
//!
//! Law: the bits are those of a ray alone, on every instruction set (tests/laws).

use std::marker::PhantomData;

use sdfrs_core::{
    Real, Scalar,
    eval::{Kernel, Lanes, Native},
    lane::Truth,
};

use super::{
    Threshold,
    swarm::{Eight, Pack, Span},
};
use crate::tracer::guarded::{Rule, State, Verdict, step};

/// Rays step over what is known to be empty.
pub struct Jump<'a, T: Native, R> {
    pub packs: &'a mut [Pack<T::Lanes>],
    pub rule: PhantomData<R>,
    pub picked: &'a [u32],
    pub codes: &'a mut [Eight],
    pub from: T,
    pub to: T,
}

impl<T: Native, R: Rule<T::Lanes>> Kernel for Jump<'_, T, R> {
    #[inline(always)]
    fn run(self) {
        let (from, to) = (T::Lanes::splat(self.from), T::Lanes::splat(self.to));
        for &number in self.picked {
            let pack = &mut self.packs[number as usize];
            let (ask, t_max) = (pack.rays.t, pack.rays.t_max);
            let s = &mut pack.state;
            let asks = T::Lanes::lt(ask, to);
            let reaches = asks & !T::Lanes::lt(s.t + s.r, from);
            let plain = asks & !reaches;
            let ask = T::Lanes::pick(reaches, to, T::Lanes::pick(plain, s.t + s.r, ask));
            restart::<T::Lanes, R>(s, plain, reaches, to);
            pack.rays.t = ask;
            let passed = reaches & !T::Lanes::lt(to, t_max);
            pack.end = T::Lanes::pick(
                passed,
                T::Lanes::c(f64::from(code::MISS)),
                T::Lanes::c(f64::from(code::NONE)),
            );
        }
        mark_ended(self.packs, self.picked, self.codes);
    }
}

/// Which lanes have ended; what has missed goes to infinity. In a loop of its own: bytes would take the packs of a step
/// apart.
#[inline(always)]
fn mark_ended<L: Lanes>(packs: &mut [Pack<L>], picked: &[u32], codes: &mut [Eight]) {
    let (least, endless) = (L::c(f64::from(code::MISS - 1)), L::splat(L::S::INFINITY));
    for (&number, codes) in picked.iter().zip(codes.as_flattened_mut()) {
        let pack = &mut packs[number as usize];
        pack.state.t = L::pick(L::lt(least, pack.end), endless, pack.state.t);
        pack.end.bytes(codes);
    }
}

/// Rays come to a stretch with a field of its own: no step into it is one of this field.
pub struct Enter<'a, T: Native, R> {
    pub packs: &'a mut [Pack<T::Lanes>],
    pub rule: PhantomData<R>,
    pub picked: &'a [u32],
    pub from: T,
    pub to: T,
}

impl<T: Native, R: Rule<T::Lanes>> Kernel for Enter<'_, T, R> {
    #[inline(always)]
    fn run(self) {
        let (from, to) = (T::Lanes::splat(self.from), T::Lanes::splat(self.to));
        for &number in self.picked {
            let pack = &mut self.packs[number as usize];
            let ask = pack.rays.t;
            let s = &mut pack.state;
            let asks = T::Lanes::lt(ask, to) & T::Lanes::lt(s.t, from);
            // A longer step proves nothing of what it left out.
            let ask = T::Lanes::pick(asks, ask.min(s.t + s.r), ask);
            let anew = asks & !T::Lanes::lt(ask, from);
            restart::<T::Lanes, R>(s, asks, anew, ask);
            pack.rays.t = ask;
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

/// Where the rays want the field.
pub struct Points<'a, T: Native> {
    pub packs: &'a [Pack<T::Lanes>],
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
            let rays = &self.packs[pack as usize].rays;
            let ([ox, oy, oz], [dx, dy, dz]) = (rays.origin, rays.direction);
            let t = rays.t.min(T::Lanes::splat(self.until));
            (ox + t * dx).store(x);
            (oy + t * dy).store(y);
            (oz + t * dz).store(z);
        }
    }
}

/// Rays take a sample in.
pub struct Step<'a, T: Native, R> {
    pub packs: &'a mut [Pack<T::Lanes>],
    pub rule: R,
    pub limit: &'a Threshold<T>,
    pub max_steps: u32,
    pub picked: &'a [u32],
    pub p: &'a [Vec<T>; 3],
    pub r: &'a [T],
    pub span: Span<T>,
    pub codes: &'a mut [Eight],
    /// Largest threshold that decided a hit.
    pub threshold: &'a mut T,
}

impl<T: Native, R: Rule<T::Lanes>> Kernel for Step<'_, T, R> {
    #[inline(always)]
    fn run(self) {
        let w = T::Lanes::WIDTH;
        let [x, y, z] = self.p;
        let columns =
            x.chunks_exact(w).zip(y.chunks_exact(w)).zip(z.chunks_exact(w)).zip(self.r.chunks_exact(w));
        let until = T::Lanes::splat(self.span.until);
        let endless = T::Lanes::splat(T::INFINITY);
        let edge = T::Lanes::splat(self.span.edge);
        let mut threshold = T::Lanes::c(0.0);
        for (&number, (((x, y), z), r)) in self.picked.iter().zip(columns) {
            let pack = &mut self.packs[number as usize];
            let p = [T::Lanes::load(x), T::Lanes::load(y), T::Lanes::load(z)];
            let samples = self.limit.sample(pack.rays.t, p, T::Lanes::load(r));
            let on = T::Lanes::lt(samples.t, until);
            let t_max = pack.rays.t_max;
            // A field that ends before the ray tells nothing of its end.
            let short = T::Lanes::lt(edge, t_max);
            let end = T::Lanes::pick(short, endless, t_max);
            let verdict = step(self.rule, &mut pack.state, &samples, end, on);
            // Other rules know these without counting.
            if R::LONGER {
                verdict.accepted.count(&mut pack.accepted);
                verdict.fallback.count(&mut pack.fallbacks);
            }
            on.count(&mut pack.steps);
            let spent = on & <T::Lanes as Lanes>::Mask::at_least(&pack.steps, self.max_steps);
            let Verdict { invalid, crossed, hit, far, .. } = verdict;
            let told =
                hit & (T::Lanes::lt(samples.asked, samples.r) | T::Lanes::lt(samples.r, T::Lanes::c(0.0)));
            let mut end = T::Lanes::pick(
                spent,
                T::Lanes::c(f64::from(code::SPENT)),
                T::Lanes::c(f64::from(code::NONE)),
            );
            for (truth, code) in [
                (far, code::MISS),
                (hit, code::HIT),
                (told, code::TOLD),
                (crossed, code::CROSSED),
                (invalid, code::INVALID),
            ] {
                end = T::Lanes::pick(truth, T::Lanes::c(f64::from(code)), end);
            }
            pack.end = end;
            threshold = threshold.max(T::Lanes::pick(hit, samples.e, T::Lanes::c(0.0)));
            let length = if R::LONGER { pack.state.z } else { pack.state.r };
            // The end of a walk is where its last sample was.
            let goes_on = on & !T::Lanes::lt(T::Lanes::c(f64::from(code::NONE)), end);
            let next = (pack.state.t + length).min(t_max).min(edge);
            pack.rays.t = T::Lanes::pick(goes_on, next, samples.t);
        }
        *self.threshold = Real::max(*self.threshold, -(-threshold).least());
        mark_ended(self.packs, self.picked, self.codes);
    }
}

/// The nearest sample asked for in some packs.
pub struct Note<'a, T: Native> {
    pub packs: &'a [Pack<T::Lanes>],
    pub picked: &'a [u32],
    pub near: &'a mut [T],
    /// Of all these.
    pub least: &'a mut T,
}

impl<T: Native> Kernel for Note<'_, T> {
    #[inline(always)]
    fn run(self) {
        let mut least = T::INFINITY;
        for &number in self.picked {
            let near = self.packs[number as usize].rays.t.least();
            self.near[number as usize] = near;
            least = Real::min(least, near);
        }
        *self.least = least;
    }
}

/// Ends of a walk as numbers that fit into lanes: odd, so that one bit tells them.
pub mod code {
    use sdfrs_core::Status;

    /// Goes on.
    pub const NONE: u8 = 0;
    pub const HIT: u8 = 1;
    pub const SPENT: u8 = 3;
    /// These are seldom: a hit by the floor of the threshold, or from inside.
    pub const TOLD: u8 = 5;
    pub const CROSSED: u8 = 7;
    pub const INVALID: u8 = 9;
    /// The largest, so that one comparison tells it.
    pub const MISS: u8 = 11;

    /// What a ray has come to, where its code says all.
    #[inline(always)]
    pub fn status(code: u8) -> Option<Status> {
        const ALL: [Status; 8] = {
            let mut all = [Status::Invalid; 8];
            all[HIT as usize / 2] = Status::Hit;
            all[SPENT as usize / 2] = Status::OutOfSteps;
            all[MISS as usize / 2] = Status::Miss;
            all
        };
        let seldom = (TOLD..=INVALID).contains(&code);
        (!seldom).then(|| ALL[usize::from(code / 2) % ALL.len()])
    }
}
