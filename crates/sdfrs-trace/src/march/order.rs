//! Which rays step together: tiles in line, square blocks of a picture, or rays sorted by where they start
//! and where they go.

use std::ops::Range;

use rayon::prelude::*;
use sdfrs_core::{Control, Hits, eval::Native};

use super::{Pixel, Source, columns::place, feed::Wanted};

/// Rays along a side of a patch, which shares a pack: neighbours in a row.
pub const QUAD: usize = 4;

/// Pixels from one corner to the other, which lies outside, in a block that begins at a third.
#[derive(Debug, Clone, Copy)]
pub struct Rectangle {
    block: [usize; 2],
    from: [usize; 2],
    to: [usize; 2],
}

impl Rectangle {
    /// The pixels in its corners.
    pub fn corners(&self) -> [Pixel; 4] {
        let [[left, top], [right, bottom]] = [self.from, self.to.map(|end| end - 1)];
        [[left, top], [right, top], [left, bottom], [right, bottom]].map(|[x, y]| Pixel::at(x, y))
    }

    /// Its rows: the place of each one's first result, and its pixels.
    pub fn rows(&self, mut take: impl FnMut(u32, usize, Range<usize>)) {
        for y in self.from[1]..self.to[1] {
            take(place(y - self.block[1], self.from[0] - self.block[0]), y, self.from[0]..self.to[0]);
        }
    }

    /// Its pixels row by row.
    pub fn pixels(&self, rays: &mut Vec<Wanted>) {
        self.rows(|place, y, columns| rays.extend(row(place, y, columns)));
    }

    /// Those of a patch, which has so few.
    pub fn few(&self, take: impl FnOnce(&[Wanted])) {
        let (mut few, mut n) = ([Wanted { pixel: Pixel::default(), place: 0 }; QUAD * QUAD], 0);
        self.rows(|place, y, columns| {
            for pixel in row(place, y, columns) {
                few[n] = pixel;
                n += 1;
            }
        });
        take(&few[..n]);
    }

    /// The squares that it consists of, row by row.
    pub fn squares(&self, side: usize, mut take: impl FnMut(Self)) {
        squares(self.from, self.to, [side; 2], |from, to| take(Self { block: self.block, from, to }));
    }
}

/// Pixels next to each other, whose results begin at a place.
fn row(place: u32, y: usize, columns: Range<usize>) -> impl Iterator<Item = Wanted> {
    columns.zip(place..).map(move |(x, place)| Wanted { pixel: Pixel::at(x, y), place })
}

/// Where a tile begins: at a ray, in rows so wide, or in a corner of a picture's block.
#[derive(Debug, Clone, Copy)]
pub enum Corner {
    Line { first: usize, width: usize },
    Block(Pixel),
}

impl Default for Corner {
    fn default() -> Self {
        Corner::Block(Pixel::default())
    }
}

impl Corner {
    /// The pixel whose result has that place.
    #[inline(always)]
    pub fn pixel(self, place: u32) -> Pixel {
        match self {
            Corner::Block(Pixel(corner)) => Pixel(corner + place),
            Corner::Line { first, width } => {
                let number = first + place as usize;
                Pixel::at(number % width, number / width)
            }
        }
    }
}

/// Rays in tiles.
pub struct Order {
    count: usize,
    kind: Kind,
    /// Rays along a side of a block, which shares a coarse program, and of a group, which shares a fine one.
    block: usize,
    group: usize,
}

enum Kind {
    /// Rays one after the other, so many a tile; rows of a picture are so wide.
    Line { size: usize, width: Option<usize> },
    /// Blocks of a picture.
    Blocks { width: usize, height: usize },
    /// Blocks of rays, by number.
    Sorted(Vec<u32>),
}

impl Order {
    pub fn in_line<T: Native>(rays: &dyn Source<T>, size: usize) -> Self {
        let count = rays.count();
        Self { count, kind: Kind::Line { size, width: rays.width() }, block: 1, group: 1 }
    }

    /// Rays in blocks, blocks in groups.
    pub fn in_blocks<T: Native>(rays: &dyn Source<T>, [block, group]: [usize; 2], control: &Control) -> Self {
        let count = rays.count();
        let kind = match rays.width() {
            Some(width) => Kind::Blocks { width, height: count / width },
            None => Kind::Sorted(sorted(rays, control)),
        };
        Self { count, kind, block, group }
    }

    pub fn tiles(&self) -> usize {
        match &self.kind {
            Kind::Line { size, .. } => self.count.div_ceil(*size),
            Kind::Blocks { width, height } => width.div_ceil(self.block) * height.div_ceil(self.block),
            Kind::Sorted(_) => self.count.div_ceil(self.block * self.block),
        }
    }

    /// Tiles that lie side by side, and the results in as many: whole rows of a picture in blocks.
    pub fn band(&self) -> (usize, usize) {
        match &self.kind {
            Kind::Line { size, .. } => (1, *size),
            Kind::Sorted(_) => (1, self.block * self.block),
            Kind::Blocks { width, .. } => (width.div_ceil(self.block), width * self.block),
        }
    }

    /// Pieces that a tile's results come in, at most.
    pub fn rows(&self) -> usize {
        if let Kind::Blocks { .. } = self.kind { self.block } else { 1 }
    }

    /// Calls `take(tile, n)` for the next `n` results of a band, from the first to the last.
    pub fn pieces(&self, band: usize, mut take: impl FnMut(usize, usize)) {
        let (tiles, size) = self.band();
        let first = band * size;
        let count = size.min(self.count - first);
        let Kind::Blocks { width, .. } = self.kind else { return take(band, count) };
        for _ in 0..count / width {
            for x in 0..tiles {
                take(band * tiles + x, self.block.min(width - x * self.block));
            }
        }
    }

    /// The rays of a tile in the order of their walks, and where each group of a block ends.
    pub fn tile(&self, tile: usize, rays: &mut Vec<Wanted>, groups: &mut Vec<usize>) {
        rays.clear();
        groups.clear();
        let Self { block, group, .. } = *self;
        match &self.kind {
            Kind::Line { size, width } => {
                let first = tile * size;
                let end = self.count.min(first + size);
                // A source that is no picture is one row.
                let width = width.unwrap_or(self.count);
                let mut at = first;
                while at < end {
                    let (x, y) = (at % width, at / width);
                    let to = end.min(at - x + width);
                    rays.extend(row(place(0, at - first), y, x..x + to - at));
                    at = to;
                }
                groups.push(rays.len());
            }
            Kind::Sorted(order) => {
                let first = tile * block * block;
                let ids = order[first..].iter().take(block * block).enumerate();
                rays.extend(ids.map(|(i, ray)| Wanted { pixel: Pixel(*ray), place: place(0, i) }));
                groups.extend((group * group..rays.len()).step_by(group * group));
                groups.push(rays.len());
            }
            Kind::Blocks { width, height } => {
                rectangle(tile, block, [*width, *height]).squares(group, |group| {
                    group.squares(QUAD, |patch| patch.pixels(rays));
                    groups.push(rays.len());
                });
            }
        }
    }

    /// Where a tile of a picture begins.
    pub fn corner(&self, tile: usize) -> Corner {
        match self.kind {
            Kind::Line { size, width } => {
                Corner::Line { first: tile * size, width: width.unwrap_or(self.count) }
            }
            Kind::Blocks { width, height } => {
                let [x, y] = rectangle(tile, self.block, [width, height]).from;
                Corner::Block(Pixel::at(x, y))
            }
            Kind::Sorted(_) => Corner::default(),
        }
    }

    /// A tile that is a block of a picture.
    pub fn block(&self, tile: usize) -> Option<Rectangle> {
        match self.kind {
            Kind::Blocks { width, height } => Some(rectangle(tile, self.block, [width, height])),
            _ => None,
        }
    }

    /// Puts the results of sorted rays into the order of the rays.
    pub fn restore<T: Native>(&self, hits: &mut Hits<T>) {
        let Kind::Sorted(order) = &self.kind else { return };
        let Hits { t, status, steps, fallbacks, multiplier, distance, witness, flags, .. } = hits;
        let (values, counts, bytes) =
            ([t, multiplier, distance, witness], [steps, fallbacks], [status, flags]);
        values.into_par_iter().for_each(|column| unsort(column, order));
        counts.into_par_iter().for_each(|column| unsort(column, order));
        bytes.into_par_iter().for_each(|column| unsort(column, order));
    }
}

/// The pixels of a picture's block.
fn rectangle(number: usize, block: usize, [width, height]: [usize; 2]) -> Rectangle {
    let across = width.div_ceil(block);
    let from = [number % across * block, number / across * block];
    Rectangle { block: from, from, to: [(from[0] + block).min(width), (from[1] + block).min(height)] }
}

/// The squares of a rectangle, or rectangles of another kind, row by row: their corners.
#[inline]
pub fn squares(
    from: [usize; 2],
    to: [usize; 2],
    side: [usize; 2],
    mut take: impl FnMut([usize; 2], [usize; 2]),
) {
    for y in (from[1]..to[1]).step_by(side[1]) {
        for x in (from[0]..to[0]).step_by(side[0]) {
            take([x, y], [(x + side[0]).min(to[0]), (y + side[1]).min(to[1])]);
        }
    }
}

fn unsort<V: Copy + Default>(column: &mut Vec<V>, order: &[u32]) {
    let from = std::mem::take(column);
    column.resize(from.len(), V::default());
    for (ray, v) in order.iter().zip(from) {
        column[*ray as usize] = v;
    }
}

/// Rays along a space-filling curve through their directions and origins; in line where nobody waits for
/// them any more.
fn sorted<T: Native>(rays: &dyn Source<T>, control: &Control) -> Vec<u32> {
    let n = rays.count();
    let numbers = |i: usize| {
        let ray = rays.ray(i);
        let [a, b, c] = ray.origin.map(|v| v.f64());
        let [d, e, f] = ray.direction.map(|v| v.f64());
        [a, b, c, d, e, f]
    };
    let none = ([f64::INFINITY; 6], [f64::NEG_INFINITY; 6]);
    let grow = |(lo, hi): Extent, (least, most): Extent| {
        let each = |a: usize| (lo[a].min(least[a]), hi[a].max(most[a]));
        (std::array::from_fn(|a| each(a).0), std::array::from_fn(|a| each(a).1))
    };
    // Least and largest are the same in any order.
    let chunk = |i: usize| {
        let rays = i * CHUNK..n.min(i * CHUNK + CHUNK);
        if control.is_cancelled() {
            none
        } else {
            rays.fold(none, |all, i| grow(all, (numbers(i), numbers(i))))
        }
    };
    let (lo, hi) = (0..n.div_ceil(CHUNK)).into_par_iter().map(chunk).reduce(|| none, grow);
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
    let key = |i: usize| if control.is_cancelled() { 0 } else { key(i) };
    // A span of a few billion rays doesn't fit into memory long before it outgrows u32.
    let mut keyed: Vec<(u64, u32)> = (0..n).into_par_iter().map(|i| (key(i), i as u32)).collect();
    if !control.is_cancelled() {
        keyed.par_sort_unstable();
    }
    keyed.into_iter().map(|(_, i)| i).collect()
}

/// Least and largest coordinates of origins and directions.
type Extent = ([f64; 6], [f64; 6]);
/// Rays looked at between two looks at the clock.
const CHUNK: usize = 1 << 14;
