//! What a trace writes, tile by tile: straight into the rows of the hits that the tile covers.

use sdfrs_core::{
    Hits, Real, Status,
    contract::Work,
    eval::{Kernel, Native, vectorise},
    lane::opaque,
};

use super::{
    ends::{Crossing, End, Sink},
    order::Order,
    surface::Surface,
};

/// The part of all hits that belongs to one tile: pieces of rows.
pub struct Columns<'a, T: Native> {
    rows: Vec<Row<'a, T>>,
    /// Nobody has written to it.
    new: bool,
    /// Largest threshold that decided a hit.
    pub threshold: T,
    /// Largest witness.
    pub steepest: T,
    /// Rays whose surface has to be refined yet.
    pub crossings: Vec<Crossing<T>>,
    pub work: Work,
    /// Where surfaces are shown as they are found: in pictures.
    pub surface: Option<Surface<'a, T>>,
}

/// A row's results side by side.
struct Row<'a, T> {
    t: &'a mut [T],
    status: &'a mut [u8],
    steps: &'a mut [u32],
    fallbacks: &'a mut [u32],
    multiplier: &'a mut [T],
    flags: &'a mut [u8],
    detail: Option<Detail<'a, T>>,
}

/// What a picture does not show.
struct Detail<'a, T> {
    distance: &'a mut [T],
    witness: &'a mut [T],
}

impl<T: Native> Row<'_, T> {
    /// What every end tells.
    #[inline(always)]
    #[allow(unsafe_code)]
    fn set(&mut self, k: usize, end: &End<T>) {
        assert!(k < self.t.len());
        // SAFETY: all columns of a row are as long ([`split`]).
        unsafe {
            *self.t.get_unchecked_mut(k) = end.t;
            *self.status.get_unchecked_mut(k) = end.status as u8;
            *self.steps.get_unchecked_mut(k) = end.steps;
            if let Some(detail) = &mut self.detail {
                *detail.distance.get_unchecked_mut(k) = end.r;
                *detail.witness.get_unchecked_mut(k) = end.witness;
            }
        }
    }
}

/// A result's place: which of the tile's rows, and where in it.
pub fn place(row: usize, column: usize) -> u32 {
    (row << ROW | column) as u32
}
/// The row and the column.
#[inline(always)]
pub fn parts(place: u32) -> (usize, usize) {
    ((place >> ROW) as usize, (place & ((1 << ROW) - 1)) as usize)
}
/// Bits of the column: a piece of a row has at most 2^16 results. As pixels have, so that in a block's corner a place is one.
const ROW: u32 = 16;

impl<'a, T: Native> Columns<'a, T> {
    /// What `place` names.
    #[inline(always)]
    fn at(&mut self, place: u32) -> (&mut Row<'a, T>, usize) {
        let (row, column) = parts(place);
        (&mut self.rows[row], column)
    }

    pub fn len(&self) -> usize {
        self.rows.iter().map(|row| row.t.len()).sum()
    }
}

impl<T: Native> Columns<'_, T> {
    /// Fills what is not written for every ray; what may be left of others is forgotten.
    pub fn begin(&mut self, loud: bool) {
        for row in &mut self.rows {
            row.multiplier.fill(T::of(1.0));
            if loud {
                row.flags.fill(0);
                row.fallbacks.fill(0);
            }
        }
    }

    /// Writes to all that every end will tell, and so brings it near: rays end in no order that a processor could foresee.
    pub fn fetch(&mut self) {
        self.fill(true);
    }

    /// As if all rays had missed everything without a step: those that end otherwise say so.
    pub fn miss(&mut self) {
        // New ones are 0 where they should be, as pages are that nobody has written to.
        self.fill(!self.new);
    }

    /// Misses without a step, at least where those are not 0.
    fn fill(&mut self, all: bool) {
        vectorise(Fill { rows: &mut self.rows, all });
    }
}

/// Rows of misses. Short rows: a call for each column would take longer than what it does.
struct Fill<'a, 'b, T: Native> {
    rows: &'a mut [Row<'b, T>],
    all: bool,
}

impl<T: Native> Kernel for Fill<'_, '_, T> {
    #[inline(always)]
    fn run(self) {
        for row in self.rows {
            fill(row.t, T::INFINITY);
            if self.all {
                fill(row.status, Status::Miss as u8);
                fill(row.steps, 0);
            }
            let Some(detail) = &mut row.detail else { continue };
            fill(detail.distance, T::INFINITY);
            if self.all {
                fill(detail.witness, T::of(0.0));
            }
        }
    }
}

/// By registers: what `opaque` parts LLVM cannot join to a call again.
#[inline(always)]
fn fill<V: Copy>(column: &mut [V], with: V) {
    let (runs, rest) = column.as_chunks_mut::<16>();
    for run in runs {
        *run = [with; 16];
        opaque();
    }
    rest.fill(with);
}

impl<T: Native> Sink<T> for Columns<'_, T> {
    #[inline(always)]
    fn end(&mut self, place: u32, end: &End<T>, point: impl FnOnce() -> [T; 3]) {
        // One that is no number is left out.
        self.steepest = Real::max(end.witness, self.steepest);
        let (row, k) = self.at(place);
        row.set(k, end);
        // 1 is there already, and rules that try no longer steps have no other.
        if end.multiplier != T::of(1.0) {
            row.multiplier[k] = end.multiplier;
        }
        // A page that nobody writes to costs nothing, and is zero.
        if end.fallbacks != 0 {
            row.fallbacks[k] = end.fallbacks;
        }
        if end.flags != 0 {
            row.flags[k] = end.flags;
        }
        self.work.quiet &= end.fallbacks == 0 && end.flags == 0;
        if let Some(surface) = &mut self.surface {
            surface.end(place, end, point);
        }
    }
    #[inline]
    fn hit(&mut self, threshold: T) {
        self.threshold = Real::max(self.threshold, threshold);
    }
    fn cross(&mut self, crossing: Crossing<T>) {
        self.crossings.push(crossing);
    }
}

/// The hits as the tiles of an order.
pub fn split<'a, T: Native>(hits: &'a mut Hits<T>, order: &Order, new: bool) -> Vec<Columns<'a, T>> {
    let Hits { t, status, steps, fallbacks, multiplier, distance, witness, flags, .. } = hits;
    let (mut times, mut statuses) = (Cut(t), Cut(status));
    let (mut step_counts, mut fallback_counts) = (Cut(steps), Cut(fallbacks));
    let (mut multipliers, mut distances) = (Cut(multiplier), Cut(distance));
    let (mut witnesses, mut notes) = (Cut(witness), Cut(flags));
    let detailed = distances.0.len() == times.0.len();
    let tile = |_| Columns {
        rows: Vec::with_capacity(order.rows()),
        new,
        threshold: T::of(0.0),
        steepest: T::of(0.0),
        crossings: Vec::new(),
        work: Work { quiet: true, ..Work::default() },
        surface: None,
    };
    let mut tiles: Vec<Columns<'a, T>> = (0..order.tiles()).map(tile).collect();
    for band in 0..order.tiles().div_ceil(order.band().0) {
        order.pieces(band, |tile, n| {
            tiles[tile].rows.push(Row {
                t: times.take(n),
                status: statuses.take(n),
                steps: step_counts.take(n),
                fallbacks: fallback_counts.take(n),
                multiplier: multipliers.take(n),
                flags: notes.take(n),
                detail: detailed.then(|| Detail { distance: distances.take(n), witness: witnesses.take(n) }),
            });
        });
    }
    tiles
}

/// A slice that is handed out from its front.
pub struct Cut<'a, V>(pub &'a mut [V]);

impl<'a, V> Cut<'a, V> {
    pub fn take(&mut self, n: usize) -> &'a mut [V] {
        let (front, rest) = std::mem::take(&mut self.0).split_at_mut(n);
        self.0 = rest;
        front
    }
}
