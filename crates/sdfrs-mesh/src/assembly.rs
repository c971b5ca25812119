//! The bricks of a sparse grid put into their final place, when all tasks are done and the triangles gone.
//!
//! Bricks come as their own 8^3 nodes, in whatever order tasks had. They are put into the order of their places and spread in
//! place, from the last, so that each has an apron of the next ones' first nodes.
//!
//! Kept are bricks with a node of their own within the band, so that every node within the band is kept by the brick that
//! owns it. Values are cut at the band, so an apron node of a brick that isn't kept is the band itself. A brick that isn't
//! kept has a value that bounds |d| from below over all of it, its far walls included.
//! Law: `tests/sparse.rs` compares all nodes with the dense grid.

use rayon::prelude::*;
use sdfrs_core::grid::Word;

use crate::{MeshError, budget::Budget, shared::Shared};

/// Cells along a brick's side, and nodes without the apron.
pub const SIDE: u32 = 8;
/// Nodes along a brick's side.
pub const NODES: usize = 9;
pub const VOLUME: usize = NODES * NODES * NODES;
/// Nodes of a brick without its apron.
pub const CORE: usize = 512;
/// A brick of cut nodes alone whose walls reach into the band is bounded, not kept, where the bound is at least this part
/// of the band.
const WORTH: f32 = 0.25;

/// All bricks, nobody else at work on them.
pub struct Assembly {
    pub bricks: [usize; 3],
    pub band: f32,
    pub words: Vec<Word>,
    pub nodes: Vec<f32>,
}

impl Assembly {
    /// `diagonal` is half a cell's, world units.
    pub fn finish(&mut self, diagonal: f32, budget: &Budget) -> Result<(), MeshError> {
        self.bound_walls(diagonal, budget)?;
        let (kept, behind) = self.order()?;
        self.spread(kept + behind)?;
        self.fill_aprons();
        self.nodes.truncate(kept * VOLUME);
        self.nodes.shrink_to_fit();
        self.close_up();
        Ok(())
    }

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

/// Room for more nodes. Room ahead is never touched before it is used, and large arrays grow without being copied where
/// the system can move pages.
pub fn reserve(nodes: &mut Vec<f32>, more: usize, left: u64) -> Result<(), MeshError> {
    if nodes.capacity() - nodes.len() >= more {
        return Ok(());
    }
    let ahead = (nodes.len() / 4).min(usize::try_from(left / 4).unwrap_or(usize::MAX));
    nodes
        .try_reserve_exact(more + ahead)
        .or_else(|_| nodes.try_reserve_exact(more))
        .map_err(|_| MeshError::bad("memory", "the system has none for bricks"))
}

pub fn word(slot: usize) -> Result<Word, MeshError> {
    let slot = u32::try_from(slot).ok().filter(|slot| *slot < Word::SLOTS);
    slot.map(Word::kept).ok_or_else(|| {
        MeshError::bad("resolution", format!("over {} bricks lie within the band", Word::SLOTS))
    })
}

pub fn index([nx, ny, _]: [usize; 3], [x, y, z]: [usize; 3]) -> usize {
    x + (nx + 1) * (y + (ny + 1) * z)
}

/// One of the eight bricks that a brick's nodes come from.
fn beyond(brick: [usize; 3], next: usize) -> [usize; 3] {
    [brick[0] + (next & 1), brick[1] + (next >> 1 & 1), brick[2] + (next >> 2)]
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
