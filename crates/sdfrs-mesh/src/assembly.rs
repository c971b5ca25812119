//! The bricks of a sparse grid in their final place.
//!
//! Tasks leave their bricks' own 8^3 nodes in one growing array. When all are done, and the triangles gone, bricks are put
//! into the order of their places, whatever the order in which tasks came, and spread in place so that each has an apron of
//! the next ones' first nodes. So nothing is there twice: what a bake takes beside its result is the mesh and a table.
//!
//! Kept are bricks with a node of their own within the band, so that every node within the band is kept by the brick that
//! owns it. Values are cut at the band, so an apron node of a brick that isn't kept is the band itself. A brick that isn't
//! kept has a value that bounds |d| from below over all of it, its far walls included.
//! Law: `tests/sparse.rs` compares all nodes with the dense grid.

use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicU32, Ordering::Relaxed},
};

use glam::DVec3;
use rayon::prelude::*;
use sdfrs_core::grid::Word;

use crate::{
    MeshError,
    budget::Budget,
    descent::Far,
    grid::{Cell, Grid},
    shared::Shared,
};

/// Cells along a brick's side, and nodes without the apron.
pub const SIDE: u32 = 8;
/// Nodes along a brick's side.
const NODES: usize = 9;
const VOLUME: usize = NODES * NODES * NODES;
/// Nodes of a brick without its apron.
pub const CORE: usize = 512;
/// A brick of cut nodes alone whose walls reach into the band is bounded, not kept, where the bound is at least this part
/// of the band.
const WORTH: f32 = 0.25;

/// Bricks near the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Sparse {
    /// Along x, y and z.
    pub bricks: [u32; 3],
    /// One per brick, x fastest: which of the kept ones; or a value of d's sign that |d| is nowhere in the brick less than.
    pub words: Vec<Word>,
    /// Kept bricks, 9 x 9 x 9 nodes each (8 cells and the next bricks' first nodes), x fastest.
    pub nodes: Vec<f32>,
}

/// World units a unit of the descent; and the band, world units.
#[derive(Debug, Clone, Copy)]
pub struct Units {
    pub scale: f32,
    pub band: f32,
}

/// A brick's own nodes, x fastest; its place in bricks along the descent's axes.
pub struct Core {
    pub key: [u32; 3],
    pub nodes: [f32; CORE],
}

/// What all tasks share.
pub struct Store<'a> {
    pub grid: &'a Grid,
    pub units: Units,
    budget: &'a Budget,
    /// Along the world's axes.
    bricks: [usize; 3],
    /// Words of all bricks, and of one more along each axis: the nodes past the last cells, which are aprons only.
    words: Vec<AtomicU32>,
    /// Kept bricks as they came, without aprons.
    nodes: Mutex<Vec<f32>>,
}

impl<'a> Store<'a> {
    pub fn new(
        grid: &'a Grid,
        units: Units,
        bricks: [u32; 3],
        budget: &'a Budget,
    ) -> Result<Self, MeshError> {
        let all = bricks.iter().map(|&n| u64::from(n) + 1).product::<u64>();
        budget.take(all.saturating_mul(size_of::<Word>() as u64), "the table of bricks")?;
        let mut words = Vec::new();
        words
            .try_reserve_exact(all as usize)
            .map_err(|_| MeshError::bad("memory", format!("the system has none for {all} bricks")))?;
        words.extend((0..all).map(|_| AtomicU32::new(Word::far(units.band).bits())));
        let bricks = bricks.map(|n| n as usize);
        // About what a surface crosses; pages that stay empty cost nothing, and what begins large grows in place.
        let (mut nodes, guess) = (Vec::new(), (2.0 * (all as f64).powf(2.0 / 3.0)) as usize);
        if ((guess * CORE * size_of::<f32>()) as u64) < budget.left() / 4 {
            reserve(&mut nodes, guess * CORE, 0)?;
        }
        Ok(Self { grid, units, budget, bricks, words, nodes: Mutex::new(nodes) })
    }

    /// The place in the table of a brick given along the descent's axes.
    fn at(&self, key: [u32; 3]) -> usize {
        let mut world = [0; 3];
        for a in 0..3 {
            world[self.grid.axes[a]] = key[a] as usize;
        }
        index(self.bricks, world)
    }

    fn put(&self, at: usize, word: Word) {
        self.words[at].store(word.bits(), Relaxed);
    }

    /// Takes a task's bricks.
    pub fn keep(&self, cores: &[Core]) -> Result<(), MeshError> {
        if cores.is_empty() {
            return Ok(());
        }
        self.budget.take((cores.len() * VOLUME * size_of::<f32>()) as u64, "bricks")?;
        let mut nodes = self.nodes.lock().unwrap_or_else(PoisonError::into_inner);
        reserve(&mut nodes, cores.len() * CORE, self.budget.left())?;
        for core in cores {
            self.put(self.at(core.key), word(nodes.len() / CORE)?);
            nodes.extend_from_slice(&core.nodes);
        }
        Ok(())
    }

    /// All nodes cut: every point of the brick has a node within half a cell's diagonal.
    pub fn flat(&self, key: [u32; 3], inside: bool) {
        let least = self.within(self.units.band).max(0.0);
        self.put(self.at(key), Word::far(if inside { -least } else { least }));
    }

    /// What bounds |d| between nodes of at least `least`.
    fn within(&self, least: f32) -> f32 {
        let diagonal = self.grid.half_diagonal() * f64::from(self.units.scale);
        ((f64::from(least) - diagonal) * (1.0 - 1e-6)) as f32
    }

    /// Bounds for the bricks of a cell without any near the band.
    pub fn bound(&self, cell: &Cell, far: &Far) {
        let Units { scale, band } = self.units;
        let c = DVec3::from_array(far.centre.map(f64::from));
        let radius = self.grid.half_diagonal() * f64::from(SIDE) * (1.0 + 1e-6) + 1e-6;
        let from: [u32; 3] = cell.lo.map(|i| i / SIDE);
        let to: [u32; 3] = cell.hi.map(|i| i.div_ceil(SIDE));
        for i in from[0]..to[0] {
            for j in from[1]..to[1] {
                for k in from[2]..to[2] {
                    let middle =
                        self.grid.place([i, j, k].map(|b| f64::from(b * SIDE) + 0.5 * f64::from(SIDE)));
                    let least = (f64::from(far.distance) - (middle - c).length() - radius) * f64::from(scale);
                    let value = (least as f32 * (1.0 - 1e-6)).max(band);
                    self.put(self.at([i, j, k]), Word::far(if far.inside { -value } else { value }));
                }
            }
        }
    }

    /// When all tasks are done.
    pub fn finish(self) -> Result<Sparse, MeshError> {
        let Self { grid, units, budget, bricks, words, nodes } = self;
        // In place: the two have the same layout.
        let words: Vec<Word> = words.into_iter().map(|w| Word::of_bits(w.into_inner())).collect();
        let nodes = nodes.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mut all = Assembly { bricks, band: units.band, words, nodes };
        let diagonal = (grid.half_diagonal() * f64::from(units.scale) * (1.0 + 1e-6)) as f32;
        all.bound_walls(diagonal, budget)?;
        let (kept, behind) = all.order()?;
        all.spread(kept + behind)?;
        all.fill_aprons();
        all.nodes.truncate(kept * VOLUME);
        all.nodes.shrink_to_fit();
        all.close_up();
        Ok(Sparse { bricks: bricks.map(|n| n as u32), words: all.words, nodes: all.nodes })
    }
}

/// Room for more nodes. Room ahead is never touched before it is used, and large arrays grow without being copied where
/// the system can move pages.
fn reserve(nodes: &mut Vec<f32>, more: usize, left: u64) -> Result<(), MeshError> {
    if nodes.capacity() - nodes.len() >= more {
        return Ok(());
    }
    let ahead = (nodes.len() / 4).min(usize::try_from(left / 4).unwrap_or(usize::MAX));
    nodes
        .try_reserve_exact(more + ahead)
        .or_else(|_| nodes.try_reserve_exact(more))
        .map_err(|_| MeshError::bad("memory", "the system has none for bricks"))
}

fn word(slot: usize) -> Result<Word, MeshError> {
    let slot = u32::try_from(slot).ok().filter(|slot| *slot < Word::SLOTS);
    slot.map(Word::kept).ok_or_else(|| {
        MeshError::bad("resolution", format!("over {} bricks lie within the band", Word::SLOTS))
    })
}

fn index([nx, ny, _]: [usize; 3], [x, y, z]: [usize; 3]) -> usize {
    x + (nx + 1) * (y + (ny + 1) * z)
}

/// One of the eight bricks that a brick's nodes come from.
fn beyond(brick: [usize; 3], next: usize) -> [usize; 3] {
    [brick[0] + (next & 1), brick[1] + (next >> 1 & 1), brick[2] + (next >> 2)]
}

/// All bricks, nobody else at work on them.
struct Assembly {
    bricks: [usize; 3],
    band: f32,
    words: Vec<Word>,
    nodes: Vec<f32>,
}

impl Assembly {
    fn word(&self, brick: [usize; 3]) -> Word {
        self.words[index(self.bricks, brick)]
    }

    /// Bounds for bricks without a node of their own within the band, but with some on their far walls. Kept are those of
    /// them where the bound says nothing, or whose walls have another sign.
    fn bound_walls(&mut self, diagonal: f32, budget: &Budget) -> Result<(), MeshError> {
        let layers = (0..self.bricks[2]).into_par_iter();
        let found: Vec<(usize, Option<Word>)> = layers.flat_map_iter(|z| self.walls(z, diagonal)).collect();
        let kept = found.iter().filter(|(_, word)| word.is_none()).count();
        budget.take((kept * VOLUME * size_of::<f32>()) as u64, "bricks")?;
        reserve(&mut self.nodes, kept * CORE, 0)?;
        for (at, bound) in found {
            if let Some(bound) = bound {
                self.words[at] = bound;
                continue;
            }
            let cut = self.band.copysign(self.words[at].value());
            self.words[at] = word(self.nodes.len() / CORE)?;
            self.nodes.resize(self.nodes.len() + CORE, cut);
        }
        Ok(())
    }

    /// Bricks of a layer whose walls are others than themselves, and their new bounds; None: to be kept.
    fn walls(&self, z: usize, diagonal: f32) -> Vec<(usize, Option<Word>)> {
        let [nx, ny, _] = self.bricks;
        let mut found = Vec::new();
        for y in 0..ny {
            let rows = [[y, z], [y + 1, z], [y, z + 1], [y + 1, z + 1]]
                .map(|[y, z]| &self.words[index(self.bricks, [0, y, z])..][..=nx]);
            for x in 0..nx {
                let eight = rows.map(|row| [row[x].bits(), row[x + 1].bits()]);
                let any = eight.iter().flatten().fold(0, |a, b| a | b);
                let all = eight.iter().flatten().fold(!0, |a, b| a & b);
                // None kept, and one sign.
                if eight[0][0] & 1 == 1 || any & 1 == 0 && (any ^ all) >> 31 == 0 {
                    continue;
                }
                let own = rows[0][x].value();
                let (least, mixed) = self.apron([x, y, z], own);
                let bound = least - diagonal;
                if mixed || (least < self.band && bound < WORTH * self.band) {
                    found.push((index(self.bricks, [x, y, z]), None));
                } else if least < self.band {
                    let bound = Word::far(bound.min(own.abs()).copysign(own));
                    found.push((index(self.bricks, [x, y, z]), Some(bound)));
                }
            }
        }
        found
    }

    /// The least magnitude on the far walls of a brick that isn't kept, and whether some have another sign than it has.
    fn apron(&self, brick: [usize; 3], own: f32) -> (f32, bool) {
        let (mut least, mut mixed) = (self.band, false);
        for next in 1..8 {
            let word = self.word(beyond(brick, next));
            let Some(slot) = word.slot() else {
                mixed |= word.value().is_sign_negative() != own.is_sign_negative();
                continue;
            };
            for (_, from) in shared(next, 8) {
                let v = self.nodes[slot * CORE + from];
                least = least.min(v.abs());
                mixed |= v.is_sign_negative() != own.is_sign_negative();
            }
        }
        (least, mixed)
    }

    /// Puts the bricks into the order of their places, those that are aprons only behind all others; how many both are.
    fn order(&mut self) -> Result<(usize, usize), MeshError> {
        // Where the brick for each slot is.
        let mut from: Vec<u32> = Vec::new();
        let [nx, ny, nz] = self.bricks;
        let mut kept = 0;
        for behind in [false, true] {
            for z in 0..=nz {
                for y in 0..=ny {
                    let row = index(self.bricks, [0, y, z]);
                    let last = y == ny || z == nz;
                    let columns = match (behind, last) {
                        (false, false) => 0..nx,
                        (true, false) => nx..nx + 1,
                        (true, true) => 0..nx + 1,
                        (false, true) => 0..0,
                    };
                    for at in columns.map(|x| row + x) {
                        if let Some(slot) = self.words[at].slot() {
                            self.words[at] = word(from.len())?;
                            from.push(slot as u32);
                        }
                    }
                }
            }
            if !behind {
                kept = from.len();
            }
        }
        permute(&mut self.nodes, &mut from);
        Ok((kept, from.len() - kept))
    }

    /// Makes room for aprons, from the last bricks to the first: those whose new places lie behind all old ones at once.
    fn spread(&mut self, all: usize) -> Result<(), MeshError> {
        reserve(&mut self.nodes, all * (VOLUME - CORE), 0)?;
        self.nodes.resize(all * VOLUME, 0.0);
        let mut end = all;
        while end > 0 {
            let first = (end * CORE).div_ceil(VOLUME);
            if first == end {
                // The last few reach into themselves.
                widen_in_place(&mut self.nodes[..end * VOLUME], end - 1);
                end -= 1;
                continue;
            }
            let (old, new) = self.nodes[..end * VOLUME].split_at_mut(first * VOLUME);
            let cores = old[..end * CORE].par_chunks_exact(CORE).skip(first);
            new.par_chunks_exact_mut(VOLUME).zip(cores).for_each(|(brick, core)| {
                for (row, from) in core.chunks_exact(8).enumerate() {
                    brick[row_at(row)..][..8].copy_from_slice(from);
                }
            });
            end = first;
        }
        Ok(())
    }

    /// The next bricks' first nodes.
    fn fill_aprons(&mut self) {
        let [nx, ny, nz] = self.bricks;
        let Self { bricks, band, words, nodes } = self;
        let nodes = Shared::new(nodes);
        (0..nz).into_par_iter().for_each(|z| {
            for brick in (0..ny).flat_map(|y| (0..nx).map(move |x| [x, y, z])) {
                let Some(slot) = words[index(*bricks, brick)].slot() else { continue };
                for next in 1..8 {
                    let word = words[index(*bricks, beyond(brick, next))];
                    apron(&nodes, slot, next, word, *band);
                }
            }
        });
    }

    /// Leaves out the words of bricks that are aprons only.
    fn close_up(&mut self) {
        let [nx, ny, nz] = self.bricks;
        for z in 0..nz {
            for y in 0..ny {
                let from = index(self.bricks, [0, y, z]);
                self.words.copy_within(from..from + nx, nx * (y + ny * z));
            }
        }
        self.words.truncate(nx * ny * nz);
        self.words.shrink_to_fit();
    }
}

/// The nodes that a brick shares with the next one: where they are in the brick with its apron, and in the next one, which
/// has `side` nodes along a side.
fn shared(next: usize, side: usize) -> impl Iterator<Item = (usize, usize)> {
    let d = [next & 1, next >> 1 & 1, next >> 2];
    let count = d.map(|d| if d == 1 { 1 } else { 8 });
    (0..count[2]).flat_map(move |k| {
        (0..count[1]).flat_map(move |j| {
            (0..count[0]).map(move |i| {
                let to = i + 8 * d[0] + NODES * (j + 8 * d[1] + NODES * (k + 8 * d[2]));
                (to, i + side * (j + side * k))
            })
        })
    })
}

/// One of the seven parts of a brick's apron.
#[allow(unsafe_code)]
fn apron(nodes: &Shared, slot: usize, next: usize, word: Word, band: f32) {
    let cut = [band.copysign(word.value())];
    for (to, from) in shared(next, NODES) {
        let to = slot * VOLUME + to;
        // SAFETY: a brick's apron is written by the one task that has the brick, and read are nodes of cores alone, which
        // nobody writes.
        unsafe {
            match word.slot() {
                Some(other) => nodes.copy(other * VOLUME + from, to),
                None => nodes.write(to, &cut),
            }
        }
    }
}

/// Where a row of a brick's own nodes lies in the brick with its apron.
fn row_at(row: usize) -> usize {
    NODES * (row % 8 + NODES * (row / 8))
}

/// Makes room for one brick's apron.
fn widen_in_place(nodes: &mut [f32], slot: usize) {
    for row in (0..64).rev() {
        let from = slot * CORE + 8 * row;
        nodes.copy_within(from..from + 8, slot * VOLUME + row_at(row));
    }
}

/// Bricks in another order, in place: `from` says where the one for each slot is.
fn permute(nodes: &mut [f32], from: &mut [u32]) {
    let mut aside = [0.0; CORE];
    for start in 0..from.len() {
        if from[start] as usize == start {
            continue;
        }
        aside.copy_from_slice(&nodes[start * CORE..(start + 1) * CORE]);
        let mut to = start;
        loop {
            let next = std::mem::replace(&mut from[to], to as u32) as usize;
            if next == start {
                nodes[to * CORE..(to + 1) * CORE].copy_from_slice(&aside);
                break;
            }
            nodes.copy_within(next * CORE..(next + 1) * CORE, to * CORE);
            to = next;
        }
    }
}
