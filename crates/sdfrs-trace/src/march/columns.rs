//! What a trace writes, tile by tile.

use sdfrs_core::{Hits, Real, Scalar, Status, contract::Work};

use super::swarm::{Crossing, Sink};
use crate::tracer::walk::Tally;

/// The part of all hits that belongs to one tile.
pub struct Columns<'a, T> {
    t: &'a mut [T],
    status: &'a mut [u8],
    steps: &'a mut [u32],
    fallbacks: &'a mut [u32],
    multiplier: &'a mut [T],
    distance: &'a mut [T],
    witness: &'a mut [T],
    flags: &'a mut [u8],
    /// Largest threshold that decided a hit.
    pub threshold: T,
    /// Rays whose surface has to be refined yet.
    pub crossings: Vec<Crossing<T>>,
    pub work: Work,
}

impl<T> Columns<'_, T> {
    pub fn len(&self) -> usize {
        self.t.len()
    }
}

impl<T: Scalar> Sink<T> for Columns<'_, T> {
    #[inline]
    fn end(&mut self, id: u32, status: Status, tally: &Tally<T>, threshold: T) {
        let k = id as usize;
        (self.t[k], self.status[k]) =
            (if status == Status::Miss { T::INFINITY } else { tally.t }, status as u8);
        (self.steps[k], self.fallbacks[k]) = (tally.steps, tally.fallbacks);
        (self.multiplier[k], self.distance[k]) = (tally.multiplier(), tally.r);
        (self.witness[k], self.flags[k]) = (tally.witness, tally.flags);
        self.threshold = Real::max(self.threshold, threshold);
    }
    fn cross(&mut self, crossing: Crossing<T>) {
        self.crossings.push(crossing);
    }
}

pub fn blank<T: Scalar>(n: usize) -> Hits<T> {
    let zero = T::of(0.0);
    Hits {
        t: vec![zero; n],
        status: vec![0; n],
        steps: vec![0; n],
        fallbacks: vec![0; n],
        multiplier: vec![zero; n],
        distance: vec![zero; n],
        witness: vec![zero; n],
        flags: vec![0; n],
        threshold: zero,
        work: Work::default(),
    }
}

/// The hits as tiles that begin at `starts`, the last of which is the number of rays.
pub fn split<'a, T: Scalar>(hits: &'a mut Hits<T>, starts: &[usize]) -> Vec<Columns<'a, T>> {
    let Hits { t, status, steps, fallbacks, multiplier, distance, witness, flags, .. } = hits;
    let (mut times, mut statuses) = (Cut::new(t), Cut::new(status));
    let (mut step_counts, mut fallback_counts) = (Cut::new(steps), Cut::new(fallbacks));
    let (mut multipliers, mut distances) = (Cut::new(multiplier), Cut::new(distance));
    let (mut witnesses, mut notes) = (Cut::new(witness), Cut::new(flags));
    let size = |tile: &[usize]| tile[1] - tile[0];
    starts
        .windows(2)
        .map(size)
        .map(|n| Columns {
            t: times.take(n),
            status: statuses.take(n),
            steps: step_counts.take(n),
            fallbacks: fallback_counts.take(n),
            multiplier: multipliers.take(n),
            distance: distances.take(n),
            witness: witnesses.take(n),
            flags: notes.take(n),
            threshold: T::of(0.0),
            crossings: Vec::new(),
            work: Work::default(),
        })
        .collect()
}

/// A slice that is handed out from its front.
struct Cut<'a, V>(&'a mut [V]);

impl<'a, V> Cut<'a, V> {
    fn new(all: &'a mut [V]) -> Self {
        Self(all)
    }
    fn take(&mut self, n: usize) -> &'a mut [V] {
        let (front, rest) = std::mem::take(&mut self.0).split_at_mut(n);
        self.0 = rest;
        front
    }
}
