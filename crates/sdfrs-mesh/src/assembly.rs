//! Bricks with aprons, in the order of their places.
//!
//! A brick keeps its own 8^3 nodes and an apron of the next bricks' first, so that a sample needs one brick only. Values
//! are cut at the band, so an apron node of a brick that isn't kept is the band itself. Bricks without a node within
//! the band are not kept: their value bounds |d| from below over the whole brick.
//! Law: `tests/sparse.rs` compares all nodes with the dense grid.

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    MeshError,
    bake::Sparse,
    bricks::{Bricks, CORE, SIDE, Units},
    budget::Budget,
    descent::Far,
    grid::{Cell, Grid},
};

/// Nodes along a brick's side.
const NODES: usize = 9;
const VOLUME: usize = NODES * NODES * NODES;
/// Not kept.
pub const NONE: u32 = u32::MAX;
/// In `Assembly::source`: all nodes are cut there; the second with the band's minus.
const FLAT: u64 = u64::MAX - 1;
const FLAT_INSIDE: u64 = u64::MAX;

pub struct Assembly<'g> {
    grid: &'g Grid,
    units: Units,
    /// Along the world's axes.
    bricks: [u32; 3],
    /// Where a brick's nodes are, part << 32 | brick of the part, or flat. The table has one brick more along each axis:
    /// the nodes past the last cells, which are aprons only.
    source: Vec<u64>,
    /// Bounds, same places.
    far: Vec<f32>,
}

impl<'g> Assembly<'g> {
    /// Of all tasks' bricks.
    pub fn run(
        grid: &'g Grid,
        units: Units,
        bricks: [u32; 3],
        budget: &Budget,
        parts: &[Bricks],
    ) -> Result<Sparse, MeshError> {
        let all = bricks.iter().map(|&n| u64::from(n) + 1).product::<u64>();
        let (source, far) = (vec![FLAT; all as usize], vec![0.0; all as usize]);
        let mut assembly = Self { grid, units, bricks, source, far };
        for (p, part) in parts.iter().enumerate() {
            for (b, key) in part.keys.iter().enumerate() {
                let at = assembly.at(*key);
                assembly.source[at] = (p as u64) << 32 | b as u64;
            }
            for (key, inside) in &part.flat {
                assembly.flat(*key, *inside);
            }
            for (cell, far) in &part.far {
                assembly.bound(cell, far);
            }
        }
        assembly.finish(budget, parts)
    }

    /// Bytes of tables, for so many bricks along the axes.
    pub fn tables(bricks: [u32; 3]) -> u64 {
        let all = bricks.iter().map(|&n| u64::from(n) + 1).product::<u64>();
        all.saturating_mul((size_of::<u64>() + 3 * size_of::<u32>()) as u64)
    }

    /// The place in the tables of a brick given along the descent's axes.
    fn at(&self, key: [u32; 3]) -> usize {
        let mut world = [0; 3];
        for a in 0..3 {
            world[self.grid.axes[a]] = key[a] as usize;
        }
        self.index(world)
    }

    fn index(&self, b: [usize; 3]) -> usize {
        let [nx, ny, _] = self.bricks.map(|n| n as usize + 1);
        b[0] + nx * (b[1] + ny * b[2])
    }

    /// All nodes cut: every point of the brick has a node within half a cell's diagonal.
    fn flat(&mut self, key: [u32; 3], inside: bool) {
        let at = self.at(key);
        let diagonal = self.grid.half_diagonal() * f64::from(self.units.scale);
        let least = ((f64::from(self.units.band) - diagonal) * (1.0 - 1e-6)).max(0.0) as f32;
        self.source[at] = if inside { FLAT_INSIDE } else { FLAT };
        self.far[at] = if inside { -least } else { least };
    }

    /// Bounds for the bricks of a cell without any near the band.
    fn bound(&mut self, cell: &Cell, far: &Far) {
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
                    let at = self.at([i, j, k]);
                    self.source[at] = if far.inside { FLAT_INSIDE } else { FLAT };
                    self.far[at] = if far.inside { -value } else { value };
                }
            }
        }
    }

    fn finish(self, budget: &Budget, parts: &[Bricks]) -> Result<Sparse, MeshError> {
        let [bx, by, bz] = self.bricks.map(|n| n as usize);
        let mut table = vec![NONE; bx * by * bz];
        let mut far = vec![0.0; bx * by * bz];
        let mut kept: Vec<[usize; 3]> = Vec::new();
        for z in 0..bz {
            for y in 0..by {
                for x in 0..bx {
                    let (at, to) = (self.index([x, y, z]), x + bx * (y + by * z));
                    if self.source[at] < FLAT || self.apron_counts([x, y, z], parts) {
                        table[to] = kept.len() as u32;
                        kept.push([x, y, z]);
                    } else {
                        far[to] = self.far[at];
                    }
                }
            }
        }
        if kept.len() as u64 >= u64::from(NONE) {
            return Err(MeshError::bad("resolution", format!("{} bricks lie within the band", kept.len())));
        }
        let bytes = (kept.len() * VOLUME * size_of::<f32>()) as u64;
        budget.take(bytes, "bricks with aprons")?;
        let mut nodes: Vec<f32> = Vec::new();
        nodes.try_reserve_exact(kept.len() * VOLUME).map_err(|_| {
            MeshError::bad("memory", format!("the system has none for {bytes} bytes of bricks"))
        })?;
        nodes.resize(kept.len() * VOLUME, 0.0);
        nodes.par_chunks_mut(VOLUME).zip(&kept).for_each(|(out, &b)| self.fill(b, parts, out));
        Ok(Sparse { bricks: self.bricks, table, far, nodes })
    }

    /// Whether a flat brick has an apron node within the band, or one of the other sign.
    fn apron_counts(&self, brick: [usize; 3], parts: &[Bricks]) -> bool {
        let own = self.source[self.index(brick)];
        let near = |next: usize| self.source[self.index(beyond(brick, next))];
        if (1..8).all(|next| near(next) == own) {
            return false;
        }
        let mut out = [0.0; VOLUME];
        self.fill(brick, parts, &mut out);
        out.iter().any(|v| *v != out[0])
    }

    /// A brick's own nodes and the next ones' first.
    fn fill(&self, brick: [usize; 3], parts: &[Bricks], out: &mut [f32]) {
        let band = self.units.band;
        for next in 0..8usize {
            let d = [next & 1, next >> 1 & 1, next >> 2];
            let source = self.source[self.index(beyond(brick, next))];
            let core = (source < FLAT).then(|| {
                let (part, b) = ((source >> 32) as usize, source as u32 as usize);
                &parts[part].nodes[b * CORE..(b + 1) * CORE]
            });
            let cut = if source == FLAT_INSIDE { -band } else { band };
            let count = d.map(|d| if d == 1 { 1 } else { SIDE as usize });
            for k in 0..count[2] {
                for j in 0..count[1] {
                    let to = 8 * d[0] + NODES * ((j + 8 * d[1]) + NODES * (k + 8 * d[2]));
                    let row = &mut out[to..to + count[0]];
                    match core {
                        Some(core) => row.copy_from_slice(&core[8 * (j + 8 * k)..][..count[0]]),
                        None => row.fill(cut),
                    }
                }
            }
        }
    }
}

/// One of the eight bricks that a brick's nodes come from.
fn beyond(brick: [usize; 3], next: usize) -> [usize; 3] {
    [brick[0] + (next & 1), brick[1] + (next >> 1 & 1), brick[2] + (next >> 2)]
}
