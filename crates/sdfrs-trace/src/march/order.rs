//! Which rays step together where programs are shortened place by place: square blocks of a picture, or
//! rays sorted by where they start and where they go.

use rayon::prelude::*;
use sdfrs_core::{Hits, Scalar};

use super::Source;

/// Rays along a side of a block that shares one coarse program, of a group that shares a fine one, and of
/// a patch that shares a pack.
const BLOCK: usize = 64;
const GROUP: usize = 16;
const PATCH: usize = 4;

/// Rays in blocks, blocks in groups.
pub struct Order {
    kind: Kind,
    /// Where each block begins among all; one more than there are blocks.
    starts: Vec<usize>,
}

enum Kind {
    Picture { width: usize, height: usize },
    Sorted(Vec<u32>),
}

impl Order {
    pub fn new<T: Scalar>(rays: &dyn Source<T>) -> Self {
        let n = rays.count();
        let Some(width) = rays.width() else {
            let starts = (0..n).step_by(BLOCK * BLOCK).chain([n]).collect();
            return Self { kind: Kind::Sorted(sorted(rays)), starts };
        };
        let height = n / width;
        let mut starts = vec![0];
        for y in (0..height).step_by(BLOCK) {
            for x in (0..width).step_by(BLOCK) {
                let size = BLOCK.min(width - x) * BLOCK.min(height - y);
                starts.push(starts[starts.len() - 1] + size);
            }
        }
        Self { kind: Kind::Picture { width, height }, starts }
    }

    pub fn starts(&self) -> &[usize] {
        &self.starts
    }

    /// Calls `take(group, x, y)` for the rays of a block in order, group by group; the ray's number is
    /// `y * width + x`.
    pub fn each(&self, block: usize, mut take: impl FnMut(usize, usize, usize)) {
        match &self.kind {
            Kind::Sorted(order) => {
                let rays = &order[self.starts[block]..self.starts[block + 1]];
                rays.iter().enumerate().for_each(|(i, ray)| take(i / (GROUP * GROUP), *ray as usize, 0));
            }
            Kind::Picture { width, height } => {
                let across = width.div_ceil(BLOCK);
                let (x0, y0) = (block % across * BLOCK, block / across * BLOCK);
                let (x1, y1) = ((x0 + BLOCK).min(*width), (y0 + BLOCK).min(*height));
                let mut group = 0;
                for gy in (y0..y1).step_by(GROUP) {
                    for gx in (x0..x1).step_by(GROUP) {
                        let (end_x, end_y) = ((gx + GROUP).min(x1), (gy + GROUP).min(y1));
                        for py in (gy..end_y).step_by(PATCH) {
                            for px in (gx..end_x).step_by(PATCH) {
                                for y in py..(py + PATCH).min(end_y) {
                                    for x in px..(px + PATCH).min(end_x) {
                                        take(group, x, y);
                                    }
                                }
                            }
                        }
                        group += 1;
                    }
                }
            }
        }
    }

    /// Puts what was found block by block into the order of the rays.
    pub fn restore<T: Scalar>(&self, hits: &mut Hits<T>) {
        let Hits { t, status, steps, fallbacks, multiplier, distance, witness, flags, .. } = hits;
        let (values, counts, bytes) =
            ([t, multiplier, distance, witness], [steps, fallbacks], [status, flags]);
        values.into_par_iter().for_each(|column| self.column(column));
        counts.into_par_iter().for_each(|column| self.column(column));
        bytes.into_par_iter().for_each(|column| self.column(column));
    }

    fn column<V: Copy + Default>(&self, column: &mut Vec<V>) {
        let from = std::mem::take(column);
        column.resize(from.len(), V::default());
        let width = match self.kind {
            Kind::Picture { width, .. } => width,
            Kind::Sorted(_) => 0,
        };
        for block in 0..self.starts.len() - 1 {
            let mut at = self.starts[block];
            self.each(block, |_, x, y| {
                column[y * width + x] = from[at];
                at += 1;
            });
        }
    }
}

/// Rays along a space-filling curve through their directions and origins.
fn sorted<T: Scalar>(rays: &dyn Source<T>) -> Vec<u32> {
    let n = rays.count();
    let (mut lo, mut hi) = ([f64::INFINITY; 6], [f64::NEG_INFINITY; 6]);
    let numbers = |i: usize| {
        let ray = rays.ray(i);
        let [a, b, c] = ray.origin.map(|v| v.f64());
        let [d, e, f] = ray.direction.map(|v| v.f64());
        [a, b, c, d, e, f]
    };
    for i in 0..n {
        for (a, v) in numbers(i).into_iter().enumerate() {
            (lo[a], hi[a]) = (lo[a].min(v), hi[a].max(v));
        }
    }
    let key = |i: usize| {
        let cells = numbers(i);
        let mut key = 0u64;
        for bit in (0..10).rev() {
            for a in 0..6 {
                let cell = ((cells[a] - lo[a]) / (hi[a] - lo[a]) * 1023.0) as u64;
                key = key << 1 | (cell >> bit & 1);
            }
        }
        key
    };
    // A span of a few billion rays doesn't fit into memory long before it outgrows u32.
    let mut keyed: Vec<(u64, u32)> = (0..n).into_par_iter().map(|i| (key(i), i as u32)).collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(_, i)| i).collect()
}
