//! Rays that step together, as columns of numbers that a pack at a time goes through.
//!
//! A finished ray stays in its lane, switched off, until a quarter of the lanes are: then the others
//! move up. Law: a ray's result depends on nothing but the ray (tests/laws, any tile, any thread count).

use sdfrs_core::{
    Status,
    eval::{Lanes as Pack, Native, vectorise},
};

use super::{
    Ray, Threshold,
    kernels::{Jump, Points, Step, least},
};
use crate::tracer::{
    guarded::{Bracket, Rule},
    walk::Tally,
};

/// Widest pack of any scalar.
pub const WIDEST: usize = 16;

/// The columns; all have one length, a multiple of the pack's width.
#[derive(Default)]
pub struct Swarm<T> {
    pub origin: [Vec<T>; 3],
    pub direction: [Vec<T>; 3],
    pub t_max: Vec<T>,
    /// Where the field is wanted next.
    pub ask: Vec<T>,
    pub(super) t: Vec<T>,
    pub(super) r: Vec<T>,
    pub(super) z: Vec<T>,
    pub(super) m: Vec<T>,
    pub(super) ratios: Vec<T>,
    pub(super) witness: Vec<T>,
    /// 1 for a ray under way, 0 for an empty lane.
    pub(super) live: Vec<T>,
    /// The nearest sample asked for in each pack.
    pub(super) near: Vec<T>,
    pub(super) steps: Vec<u32>,
    pub(super) fallbacks: Vec<u32>,
    pub(super) accepted: Vec<u32>,
    /// The ray's number within the tile.
    pub(super) id: Vec<u32>,
    pub(super) alive: usize,
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
        let [ox, oy, oz] = &mut self.origin;
        let [dx, dy, dz] = &mut self.direction;
        let columns = [ox, oy, oz, dx, dy, dz, &mut self.t_max, &mut self.ask];
        let ([a, b, c], [d, e, f]) = (ray.origin, ray.direction);
        for (column, v) in columns.into_iter().zip([a, b, c, d, e, f, ray.t_max, ray.t_min]) {
            column.push(v);
        }
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
        self.near.extend(self.ask.chunks(Self::WIDTH).map(|pack| least(T::Lanes::load(pack))));
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

    /// Nothing lies from `from` to `to`: rays whose own ball reaches there and that ask for a sample before
    /// its end start anew at the end. A longer step tried into it proves nothing of what it left out: such
    /// rays take the plain step first.
    pub fn jump(&mut self, from: T, to: T, sink: &mut impl Sink<T>) {
        vectorise(Jump { swarm: self, from, to, sink });
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
    pub(super) fn tally(&self, i: usize, flags: u8) -> Tally<T> {
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

impl<T: Native> Swarm<T> {
    /// The ray in a lane has passed everything.
    #[inline(never)]
    pub(super) fn pass(&mut self, lane: usize, sink: &mut impl Sink<T>) {
        (self.live[lane], self.ask[lane]) = (T::of(0.0), T::INFINITY);
        self.alive -= 1;
        let mut tally = self.tally(lane, 0);
        tally.r = T::INFINITY;
        sink.end(self.id[lane], Status::Miss, &tally, T::of(0.0));
    }
}
