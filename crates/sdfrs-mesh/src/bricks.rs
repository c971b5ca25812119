//! Bricks of 8^3 cells near the surface, a bound for each of the others.
//!
//! A brick keeps its own 8^3 nodes and an apron of the next bricks' first, so that a sample needs one brick only. Values
//! are cut at the band, so an apron node of a brick that isn't kept is the band itself. Bricks without a node within
//! the band are not kept: their value bounds |d| from below over the whole brick.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::{
    MeshError,
    bake::Sparse,
    budget::Budget,
    descent::{Far, Sink},
    grid::{Cell, Grid, place},
};

/// Cells along a brick's side.
pub const SIDE: u32 = 8;
/// Nodes along it.
const NODES: usize = 9;
pub const VOLUME: usize = NODES * NODES * NODES;
/// Not kept.
pub const NONE: u32 = u32::MAX;

/// World units a unit of the descent; and the band, world units.
#[derive(Debug, Clone, Copy)]
pub struct Units {
    pub scale: f32,
    pub band: f32,
}

/// One task's bricks.
pub struct Bricks<'a> {
    budget: &'a Budget,
    /// Of all tasks.
    count: &'a AtomicU64,
    units: Units,
    /// The descent's axis along each of the brick's.
    stride: [usize; 3],
    /// Their places, in bricks along the descent's axes, and nodes.
    pub(crate) keys: Vec<[u32; 3]>,
    pub(crate) nodes: Vec<f32>,
    pub(crate) far: Vec<(Cell, Far)>,
    /// Where the two bricks of the present cell begin.
    open: [Option<usize>; 2],
}

impl<'a> Bricks<'a> {
    pub fn new(budget: &'a Budget, count: &'a AtomicU64, grid: &Grid, units: Units) -> Self {
        let stride = grid.axes.map(|k| [1, NODES, NODES * NODES][k]);
        Self { budget, count, units, stride, keys: vec![], nodes: vec![], far: vec![], open: [None; 2] }
    }

    fn start(&self, cell: &Cell) -> Option<usize> {
        let base = self.open[(cell.origin[2] >> 3 & 1) as usize]?;
        Some(base + (0..3).map(|a| (cell.origin[a] & 7) as usize * self.stride[a]).sum::<usize>())
    }
}

impl Bricks<'_> {
    /// A brick's own nodes: where they are on the grid (descent's axes), and in `nodes`.
    pub fn own_nodes(&self, brick: usize) -> impl Iterator<Item = ([u32; 3], usize)> + '_ {
        let key = self.keys[brick];
        (0..SIDE.pow(3)).map(move |n| {
            let at = [n / 64, n / 8 % 8, n % 8];
            let place = brick * VOLUME + (0..3).map(|a| at[a] as usize * self.stride[a]).sum::<usize>();
            (std::array::from_fn(|a| key[a] * SIDE + at[a]), place)
        })
    }
}

impl Sink for Bricks<'_> {
    fn fork(&self) -> Self {
        let Self { budget, count, units, stride, .. } = *self;
        Self { budget, count, units, stride, keys: vec![], nodes: vec![], far: vec![], open: [None; 2] }
    }

    fn open(&mut self, cell: &Cell) -> Result<(), MeshError> {
        for half in 0..2 {
            self.open[half as usize] = None;
            let from = cell.origin[2] + SIDE * half;
            if cell.lo[2].max(from) >= cell.hi[2].min(from + SIDE) {
                continue;
            }
            if self.count.fetch_add(1, Ordering::Relaxed) >= u64::from(NONE) {
                return Err(MeshError::bad("resolution", format!("more than {NONE} bricks lie within the band")));
            }
            let start = self.nodes.len();
            // Nodes that no leaf reaches lie past the grid's end.
            self.budget.grow(&mut self.nodes, start, 0.0, "bricks")?;
            if self.nodes.capacity() < start + VOLUME {
                let more = (start / 2).max(64 * VOLUME);
                self.budget.take((more * size_of::<f32>()) as u64, "bricks")?;
                self.nodes
                    .try_reserve_exact(more)
                    .map_err(|_| MeshError::bad("memory", "the system has none for bricks"))?;
            }
            self.nodes.resize(start + VOLUME, self.units.band);
            self.keys.push([cell.origin[0] / SIDE, cell.origin[1] / SIDE, from / SIDE]);
            self.open[half as usize] = Some(start);
        }
        Ok(())
    }

    fn leaf(&mut self, cell: &Cell, values: &[f32; 16]) {
        let Some(start) = self.start(cell) else { return };
        let Units { scale, band } = self.units;
        for lane in 0..16 {
            if cell.has(lane) {
                let offset = place(lane);
                let at = start + (0..3).map(|a| offset[a] as usize * self.stride[a]).sum::<usize>();
                self.nodes[at] = (values[lane] * scale).min(band).max(-band);
            }
        }
    }

    fn far(&mut self, cell: &Cell, far: Far) {
        if cell.n >= SIDE {
            self.far.push((*cell, far));
            return;
        }
        let Some(start) = self.start(cell) else { return };
        let value = if far.inside { -self.units.band } else { self.units.band };
        let count: [usize; 3] = std::array::from_fn(|a| (cell.hi[a] - cell.lo[a]) as usize);
        for i in 0..count[0] {
            for j in 0..count[1] {
                for k in 0..count[2] {
                    self.nodes[start + i * self.stride[0] + j * self.stride[1] + k * self.stride[2]] = value;
                }
            }
        }
    }
}

/// All bricks, while they are put together. The table has one brick more along each axis: the nodes past the last
/// cells, which are aprons only.
pub struct Assembly<'g> {
    grid: &'g Grid,
    units: Units,
    /// Bricks along the world's axes, without and with the one more.
    bricks: [u32; 3],
    table: Vec<u32>,
    far: Vec<f32>,
}

impl<'g> Assembly<'g> {
    pub fn new(grid: &'g Grid, units: Units, bricks: [u32; 3], budget: &Budget) -> Result<Self, MeshError> {
        let all = bricks.iter().map(|&n| u64::from(n) + 1).product::<u64>();
        // Twice: with and without the one more.
        budget.take(all.saturating_mul(16), "the table of bricks")?;
        Ok(Self { grid, units, bricks, table: vec![NONE; all as usize], far: vec![0.0; all as usize] })
    }

    /// A place in the table of a brick given along the descent's axes.
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

    pub fn finish(mut self, parts: Vec<Bricks>) -> Sparse {
        let total: usize = parts.iter().map(|p| p.nodes.len()).sum();
        let mut nodes: Vec<f32> = Vec::with_capacity(total);
        for part in parts {
            for (i, key) in part.keys.iter().enumerate() {
                let at = self.at(*key);
                self.table[at] = (nodes.len() / VOLUME + i) as u32;
            }
            for (cell, far) in &part.far {
                self.bound(cell, far);
            }
            // Memory goes back part by part: there is never a second copy of everything.
            nodes.extend_from_slice(&part.nodes);
        }
        self.aprons(&mut nodes);
        self.compact(nodes)
    }

    /// Bounds for the bricks of a cell without any within the band.
    fn bound(&mut self, cell: &Cell, far: &Far) {
        let Units { scale, band } = self.units;
        let c = far.centre.map(f64::from);
        let radius = self.grid.half_diagonal() * f64::from(SIDE) * (1.0 + 1e-6) + 1e-6;
        let from: [u32; 3] = cell.lo.map(|i| i / SIDE);
        let to: [u32; 3] = cell.hi.map(|i| i.div_ceil(SIDE));
        for i in from[0]..to[0] {
            for j in from[1]..to[1] {
                for k in from[2]..to[2] {
                    let middle = self.grid.place([i, j, k].map(|b| f64::from(b * SIDE) + 0.5 * f64::from(SIDE)));
                    let off = (middle - glam::DVec3::from_array(c)).length();
                    let least = (f64::from(far.distance) - off - radius) * f64::from(scale);
                    let value = (least as f32 * (1.0 - 1e-6)).max(band);
                    let at = self.at([i, j, k]);
                    self.far[at] = if far.inside { -value } else { value };
                }
            }
        }
    }

    /// The first nodes of the next bricks, to the ends of each.
    fn aprons(&self, nodes: &mut [f32]) {
        let band = self.units.band;
        let [bx, by, bz] = self.bricks.map(|n| n as usize);
        for z in 0..bz {
            for y in 0..by {
                for x in 0..bx {
                    let to = self.table[self.index([x, y, z])];
                    if to == NONE {
                        continue;
                    }
                    let to = to as usize * VOLUME;
                    for next in 1..8usize {
                        let d = [next & 1, next >> 1 & 1, next >> 2];
                        let at = self.index([x + d[0], y + d[1], z + d[2]]);
                        let from = self.table[at];
                        let cut = if self.far[at] < 0.0 { -band } else { band };
                        let range = |a: usize| if d[a] == 1 { 8..9 } else { 0..8 };
                        for k in range(2) {
                            for j in range(1) {
                                for i in range(0) {
                                    let there = (i - 8 * d[0]) + NODES * ((j - 8 * d[1]) + NODES * (k - 8 * d[2]));
                                    let here = to + i + NODES * (j + NODES * k);
                                    nodes[here] =
                                        if from == NONE { cut } else { nodes[from as usize * VOLUME + there] };
                                }
                            }
                        }
                    }
                }
            }
        }
    }

    /// Drops bricks whose nodes are all cut, and the row of bricks past the last cells.
    fn compact(self, mut nodes: Vec<f32>) -> Sparse {
        let band = self.units.band;
        let bricks = self.bricks.map(|n| n as usize);
        let count = bricks[0] * bricks[1] * bricks[2];
        let (mut table, mut far) = (vec![NONE; count], vec![0.0; count]);
        // Every point has a node within half a diagonal.
        let least = (f64::from(band) - self.grid.half_diagonal() * f64::from(self.units.scale) * (1.0 + 1e-6))
            .max(0.0) as f32;
        let mut owner = vec![NONE; nodes.len() / VOLUME];
        for z in 0..bricks[2] {
            for y in 0..bricks[1] {
                for x in 0..bricks[0] {
                    let (from, to) = (self.index([x, y, z]), x + bricks[0] * (y + bricks[1] * z));
                    far[to] = self.far[from];
                    if let Some(o) = owner.get_mut(self.table[from] as usize) {
                        *o = to as u32;
                    }
                }
            }
        }
        let mut kept = 0;
        for (i, &to) in owner.iter().enumerate() {
            let range = i * VOLUME..(i + 1) * VOLUME;
            if to == NONE {
                continue;
            }
            // Around an open mesh signs may change far from it.
            let first = nodes[range.start];
            if first.abs() >= band && nodes[range.clone()].iter().all(|v| *v == first) {
                far[to as usize] = least.copysign(first);
                continue;
            }
            table[to as usize] = kept as u32;
            nodes.copy_within(range, kept * VOLUME);
            kept += 1;
        }
        nodes.truncate(kept * VOLUME);
        nodes.shrink_to_fit();
        Sparse { bricks: self.bricks, table, far, nodes }
    }
}
