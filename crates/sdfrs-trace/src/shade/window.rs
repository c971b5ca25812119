//! What the rays of a block have come to, side by side: in the hits its rows lie a picture's width apart.

use sdfrs_core::{Hits, Status, eval::Native};

use super::clusters::{Clusters, SQUARE};
use crate::march::Pixel;

/// Pixels along a block: some squares whose pixels share a program shortened for their surroundings.
pub const BLOCK: [usize; 2] = [128, 32];

/// Depths and statuses of a block's pixels. Beyond its sides nothing is hit.
pub struct Window<T> {
    /// Column and row of the first.
    from: [usize; 2],
    depths: Vec<T>,
    statuses: Vec<u8>,
}

impl<T: Native> Window<T> {
    pub fn new() -> Self {
        let n = BLOCK[0] * BLOCK[1];
        Self { from: [0; 2], depths: vec![T::default(); n], statuses: vec![0; n] }
    }

    /// Copies a block of a picture; the largest of its statuses: a miss where nothing is seen.
    pub fn copy(&mut self, hits: &Hits<T>, width: usize, from: [usize; 2], to: [usize; 2]) -> u8 {
        self.from = from;
        let row = |y: usize| y * width + from[0]..y * width + to[0];
        let mut most = Status::Miss as u8;
        for (y, statuses) in (from[1]..).zip(self.statuses.chunks_mut(BLOCK[0])) {
            statuses.fill(Status::Miss as u8);
            if y < to[1] {
                statuses[..to[0] - from[0]].copy_from_slice(&hits.status[row(y)]);
            }
            most = statuses.iter().fold(most, |most, status| most.max(*status));
        }
        if most == Status::Miss as u8 {
            return most;
        }
        for (y, depths) in (from[1]..to[1]).zip(self.depths.chunks_mut(BLOCK[0])) {
            depths[..to[0] - from[0]].copy_from_slice(&hits.t[row(y)]);
        }
        most
    }

    /// Pixels that show a surface go to the clusters, square by square, and `close` is called after each.
    pub fn squares(&self, clusters: &mut Clusters<T>, close: impl Fn(&mut Clusters<T>, usize)) {
        for y in (0..BLOCK[1]).step_by(SQUARE) {
            for x in (0..BLOCK[0]).step_by(SQUARE) {
                let start = clusters.len();
                for row in y..y + SQUARE {
                    let at = row * BLOCK[0] + x;
                    let (depths, statuses) =
                        (self.depths[at..].first_chunk(), self.statuses[at..].first_chunk());
                    let (Some(depths), Some(statuses)) = (depths, statuses) else { continue };
                    if *statuses != [Status::Miss as u8; SQUARE] {
                        clusters.add(Pixel::at(self.from[0] + x, self.from[1] + row), depths, statuses);
                    }
                }
                close(clusters, start);
            }
        }
    }

    /// Pixels on which the field was not a number.
    pub fn invalid(&self) -> impl Iterator<Item = Pixel> {
        let pixel = |(i, _)| Pixel::at(self.from[0] + i % BLOCK[0], self.from[1] + i / BLOCK[0]);
        self.statuses.iter().enumerate().filter(|(_, s)| **s == Status::Invalid as u8).map(pixel)
    }
}
