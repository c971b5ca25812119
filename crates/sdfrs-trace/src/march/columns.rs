//! What a trace writes, tile by tile.

use sdfrs_core::{Hits, Real, Scalar, Status};

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
        (self.t[k], self.status[k]) = (if status == Status::Miss { T::INFINITY } else { tally.t }, status as u8);
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
    }
}

/// The hits as tiles of `size` rays.
pub fn split<T: Scalar>(hits: &mut Hits<T>, size: usize) -> Vec<Columns<'_, T>> {
    let times = hits.t.chunks_mut(size).zip(hits.status.chunks_mut(size));
    let counts = hits.steps.chunks_mut(size).zip(hits.fallbacks.chunks_mut(size));
    let values = hits.multiplier.chunks_mut(size).zip(hits.distance.chunks_mut(size));
    let notes = hits.witness.chunks_mut(size).zip(hits.flags.chunks_mut(size));
    times
        .zip(counts)
        .zip(values.zip(notes))
        .map(|(((t, status), (steps, fallbacks)), ((multiplier, distance), (witness, flags)))| Columns {
            t,
            status,
            steps,
            fallbacks,
            multiplier,
            distance,
            witness,
            flags,
            threshold: T::of(0.0),
            crossings: Vec::new(),
        })
        .collect()
}
