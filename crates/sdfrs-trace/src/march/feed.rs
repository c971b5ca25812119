//! Rays on their way into lanes: made a pack at a time, in the order in which they are to be walked.

use sdfrs_core::{
    Real,
    eval::{Lanes, Native},
};

use super::{
    Pixel, Ray, Source,
    start::Start,
    swarm::{Pack, WIDEST},
};
use crate::tracer::guarded::Rule;

/// A ray a lane.
#[derive(Debug, Clone, Copy)]
pub struct Bundle<L> {
    pub origin: [L; 3],
    pub direction: [L; 3],
    /// Where they begin, and where they end.
    pub t: L,
    pub t_max: L,
}

impl<L: Lanes> Bundle<L> {
    pub fn blank() -> Self {
        let zero = L::c(0.0);
        Self { origin: [zero; 3], direction: [zero; 3], t: zero, t_max: zero }
    }

    pub fn set(&mut self, lane: usize, ray: &Ray<L::S>) {
        for a in 0..3 {
            self.origin[a].set(lane, ray.origin[a]);
            self.direction[a].set(lane, ray.direction[a]);
        }
        self.t.set(lane, ray.t_min);
        self.t_max.set(lane, ray.t_max);
    }

    /// Where a ray is at a depth.
    #[inline(always)]
    pub fn at(&self, lane: usize, t: L::S) -> [L::S; 3] {
        let axis = |a: usize| self.origin[a].lane(lane) + t * self.direction[a].lane(lane);
        [axis(0), axis(1), axis(2)]
    }

    /// The direction of another bundle's ray.
    #[inline]
    pub fn turn(&mut self, lane: usize, from: &Self, which: usize) {
        for a in 0..3 {
            self.direction[a].set(lane, from.direction[a].lane(which));
        }
    }

    /// Another bundle's ray.
    #[inline]
    pub fn take(&mut self, lane: usize, from: &Self, which: usize) {
        self.turn(lane, from, which);
        for a in 0..3 {
            self.origin[a].set(lane, from.origin[a].lane(which));
        }
        self.t.set(lane, from.t.lane(which));
        self.t_max.set(lane, from.t_max.lane(which));
    }
}

/// Which rays are to come, and the place of each one's result.
pub struct Feed<'a, T: Native> {
    rays: &'a dyn Source<T>,
    /// The rays that wait; the next is `at`.
    order: &'a [Wanted],
    at: usize,
    bundle: Bundle<T::Lanes>,
    place: [u32; WIDEST],
    /// Lanes of the bundle that have been handed out, and that hold a ray.
    used: usize,
    made: usize,
    /// What all know of the field where they start.
    pub start: Start<T>,
}

/// A ray to come.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    pub pixel: Pixel,
    /// Where its result goes.
    pub place: u32,
}

impl<'a, T: Native> Feed<'a, T> {
    pub fn new(rays: &'a dyn Source<T>, order: &'a [Wanted], start: Start<T>) -> Self {
        Self { rays, order, at: 0, bundle: Bundle::blank(), place: [0; WIDEST], used: 0, made: 0, start }
    }

    /// Nothing to come.
    pub fn empty(rays: &'a dyn Source<T>) -> Self {
        Self::new(rays, &[], Start::unknown())
    }

    /// Whether all rays come from one.
    pub fn eye(&self) -> bool {
        self.rays.eye().is_some()
    }

    /// Rays that wait.
    pub fn waiting(&self) -> usize {
        self.order.len() - self.at
    }

    /// Fills packs with the next rays; their number.
    pub fn packs<R: Rule<T::Lanes>>(&mut self, packs: &mut [Pack<T::Lanes>]) -> usize {
        let first = self.at;
        for pack in packs {
            self.at += pack.begin::<R>(self.rays, &self.order[self.at..], &self.start);
        }
        self.at - first
    }

    /// The next ray: its lane of the bundle, and its place; none if none waits.
    #[inline(always)]
    pub fn next(&mut self) -> Option<(usize, u32)> {
        if self.used == self.made {
            if self.waiting() == 0 {
                return None;
            }
            self.more();
        }
        let which = self.used % WIDEST;
        self.used += 1;
        Some((which, self.place[which]))
    }

    #[inline(never)]
    fn more(&mut self) {
        self.used = 0;
        self.made = make(self.rays, &self.order[self.at..], &mut self.bundle, &mut self.place);
        self.at += self.made;
    }

    pub fn bundle(&self) -> &Bundle<T::Lanes> {
        &self.bundle
    }
}

/// The first rays of a queue, as many as a pack holds, and their places; their number.
pub fn make<T: Native>(
    rays: &dyn Source<T>,
    order: &[Wanted],
    to: &mut Bundle<T::Lanes>,
    place: &mut [u32; WIDEST],
) -> usize {
    let next = &order[..order.len().min(T::Lanes::WIDTH)];
    if !next.is_empty() {
        let mut pixels = [Pixel::default(); WIDEST];
        pixels.iter_mut().zip(next).for_each(|(pixel, wanted)| *pixel = wanted.pixel);
        rays.bundle(&pixels[..next.len()], to);
        // A way without an end ends at the largest number: infinity marks a free lane.
        to.t_max = to.t_max.min(T::Lanes::splat(T::MAX));
    }
    for (place, wanted) in place.iter_mut().zip(next) {
        *place = wanted.place;
    }
    next.len()
}
