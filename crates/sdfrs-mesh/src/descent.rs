//! Exact distances at all nodes of a grid, by a depth-first descent of cells with lists of triangles.
//!
//! A cell's list holds every triangle that is nearest to one of its points. Its sixteen children are held against the
//! list at once, one a lane; a triangle goes on to a child only if some point of the child can be nearer to it than to
//! the point q of the mesh that is nearest to the child's centre (`Bound`). Pairs of children become the next cells,
//! down to leaves of 2 x 2 x 4 nodes, where the distances to all that is left are taken. Large cells work on clusters
//! of 16 triangles in oriented boxes. A child farther from the mesh than its radius has one sign.
//!
//! Law: equal to brute force in f64 up to `Baked::max_error` (`tests/exact.rs`); the same bits for any number of threads
//! and any instruction set (`tests/isa.rs`).

use std::sync::Mutex;

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    MeshError, Pulse, Watch,
    budget::Budget,
    check::Checked,
    clusters::CLUSTER,
    frames::{Slab, Tri},
    grid::{Cell, Children, Grid, Side, place},
    kernels::Kernels,
    lanes::Row,
    sign::Signs,
};

/// Cells of at most so many nodes across are one task's.
const TASK: u32 = 16;
/// Lists of fewer clusters become lists of triangles.
const EXPAND: usize = 1000;

/// Takes what the descent finds. Origins and boxes are in nodes along the descent's axes, distances in its frame.
pub trait Sink: Send + Sized {
    /// An empty one for a task of its own.
    fn fork(&self) -> Self;
    /// A cell of 8 x 8 x 16 nodes begins.
    fn open(&mut self, _cell: &Cell) {}
    /// It ends.
    fn close(&mut self) {}
    /// The task ends.
    fn finish(self) -> Result<(), MeshError> {
        Ok(())
    }
    /// Signed distances at the nodes of a leaf.
    fn leaf(&mut self, cell: &Cell, values: &[f32; 16]);
    /// All points of the cell, and the nodes one past its end, are farther than the band.
    fn far(&mut self, cell: &Cell, far: Far);
}

/// A cell without a node within the band.
#[derive(Debug, Clone, Copy)]
pub struct Far {
    pub centre: [f32; 3],
    /// Nothing of the mesh is nearer to the centre.
    pub distance: f32,
    pub inside: bool,
}

/// What doesn't change during a descent.
pub struct Descent<'a> {
    pub tris: Vec<Tri>,
    pub slabs: Vec<Slab>,
    /// The mesh's face behind each triangle.
    pub faces: Vec<u32>,
    pub mesh: &'a Checked,
    pub grid: &'a Grid,
    pub kernels: Kernels,
    /// None: distances without a sign.
    pub signs: Option<&'a Signs<'a>>,
    /// Every node's sign by its own nearest triangle: the surface is open, and signs change away from it.
    pub each: bool,
    /// A little more than the spacing.
    pub steps: [f32; 3],
    /// Cells that are farther go to `Sink::far`.
    pub band: Option<f32>,
    /// Children of 8 nodes and more are closed boxes, up to the next one's first node.
    pub bricks: bool,
    /// What rounding can do to a coordinate's difference (descent's frame).
    pub slack: f32,
    pub budget: &'a Budget,
    pub watch: &'a dyn Watch,
    pub arenas: Mutex<Vec<Arena>>,
}

/// A task's memory; lists and masks are stacks, rows are written and read within one cell.
#[derive(Default)]
pub struct Arena {
    pub(crate) ids: Vec<u32>,
    pub(crate) masks: Vec<u16>,
    pub(crate) rows: Vec<Row>,
}

impl Arena {
    pub(crate) fn reserve(
        &mut self,
        budget: &Budget,
        ids: usize,
        masks: usize,
        rows: usize,
    ) -> Result<(), MeshError> {
        budget.grow(&mut self.ids, ids, 0, "lists of triangles")?;
        budget.grow(&mut self.masks, masks, 0, "lists of triangles")?;
        budget.grow(&mut self.rows, rows, Row::ZERO, "lists of triangles")
    }
}

/// What is known of a cell's children.
pub(crate) struct Known {
    pub children: Children,
    /// Nothing of the mesh is nearer to their centres.
    pub clear: Row,
    pub sides: [Side; 16],
    /// One bit for each that is farther than the band.
    pub far: u16,
}

/// A list's kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Slabs,
    Tris,
}

impl Descent<'_> {
    /// Down from one cell around everything.
    pub fn run<S: Sink + Sync>(&self, sink: &S) -> Result<(), MeshError> {
        let dims = self.grid.dims;
        let widest = dims[0].max(dims[1]).max(dims[2].div_ceil(2));
        let side = if self.signs.is_some() { Side::Unknown } else { Side::Outside };
        let root = Cell {
            origin: [0; 3],
            n: widest.next_power_of_two().max(TASK),
            lo: [0; 3],
            hi: dims,
            sides: [side; 2],
        };
        if self.slabs.len() > CLUSTER {
            self.top(sink, (0..self.slabs.len() as u32).collect(), Kind::Slabs, root)
        } else {
            self.top(sink, (0..self.tris.len() as u32).collect(), Kind::Tris, root)
        }
    }

    /// Cells too large for one task.
    fn top<S: Sink + Sync>(&self, sink: &S, list: Vec<u32>, kind: Kind, cell: Cell) -> Result<(), MeshError> {
        if self.watch.cancelled() {
            return Err(MeshError::Cancelled);
        }
        if kind == Kind::Slabs && list.len() < EXPAND {
            return self.top(sink, self.expand(&list), Kind::Tris, cell);
        }
        let mut part = sink.fork();
        let mut arena = self.arenas.lock().ok().and_then(|mut a| a.pop()).unwrap_or_default();
        if cell.n <= TASK {
            arena.reserve(self.budget, list.len(), 0, 0)?;
            arena.ids[..list.len()].copy_from_slice(&list);
            self.descend(&mut arena, &mut part, kind, [0, list.len()], 0, cell)?;
            part.finish()?;
            if let Ok(mut arenas) = self.arenas.lock() {
                arenas.push(arena);
            }
            self.watch.advance(cell.count());
            return Ok(());
        }
        let mut cells = Vec::with_capacity(8);
        let bytes = (list.len() * size_of::<u32>() * 9) as u64;
        self.budget.take(bytes, "lists of triangles")?;
        arena.reserve(self.budget, 0, list.len(), list.len())?;
        let known = self.examine(&mut arena, &list, kind, 0, &cell)?;
        for pair in 0..8 {
            let Some(next) = self.next(&mut part, &cell, &known, pair) else { continue };
            let mut ids = vec![0; list.len() + 16];
            let n = self.kernels.pick(&list, &arena.masks[..list.len()], 3 << (2 * pair), &mut ids);
            ids.truncate(n);
            ids.shrink_to_fit();
            cells.push((ids, next));
        }
        if let Ok(mut arenas) = self.arenas.lock() {
            arenas.push(arena);
        }
        drop(list);
        part.finish()?;
        cells.into_par_iter().try_for_each(|(ids, next)| self.top(sink, ids, kind, next))?;
        self.budget.give(bytes);
        Ok(())
    }

    pub(crate) fn expand(&self, slabs: &[u32]) -> Vec<u32> {
        let cluster = |s: &u32| {
            let first = s * CLUSTER as u32;
            first..(first + CLUSTER as u32).min(self.tris.len() as u32)
        };
        slabs.iter().flat_map(cluster).collect()
    }

    /// A task's cells: the list lies in the arena from `from` to `end`, its masks go to `mask`.
    fn descend<S: Sink>(
        &self,
        arena: &mut Arena,
        sink: &mut S,
        kind: Kind,
        [from, end]: [usize; 2],
        mask: usize,
        cell: Cell,
    ) -> Result<(), MeshError> {
        if kind == Kind::Slabs && (cell.n <= 8 || end - from < EXPAND) {
            let all = self.expand(&arena.ids[from..end]);
            arena.reserve(self.budget, end + all.len(), 0, 0)?;
            arena.ids[end..end + all.len()].copy_from_slice(&all);
            return self.descend(arena, sink, Kind::Tris, [end, end + all.len()], mask, cell);
        }
        if cell.n >= 8 && self.watch.cancelled() {
            return Err(MeshError::Cancelled);
        }
        if cell.n == 8 {
            sink.open(&cell);
        }
        let count = end - from;
        arena.reserve(self.budget, end + count + 16, mask + count, count)?;
        let list = std::mem::take(&mut arena.ids);
        let known = self.examine(arena, &list[from..end], kind, mask, &cell);
        arena.ids = list;
        let known = known?;
        if cell.n == 4 {
            return self.leaves(arena, sink, [from, end], mask, &cell, &known);
        }
        for pair in 0..8 {
            let Some(next) = self.next(sink, &cell, &known, pair) else { continue };
            let (above, below) = arena.ids.split_at_mut(end);
            let masks = &arena.masks[mask..mask + count];
            let n = self.kernels.pick(&above[from..], masks, 3 << (2 * pair), below);
            self.descend(arena, sink, kind, [end, end + n], mask + count, next)?;
        }
        if cell.n == 8 {
            sink.close();
        }
        Ok(())
    }

    /// The cell of a pair of children, or of the one that has nodes within the band; hands over those that have not.
    pub(crate) fn next<S: Sink>(
        &self,
        sink: &mut S,
        cell: &Cell,
        known: &Known,
        pair: usize,
    ) -> Option<Cell> {
        let lanes = [2 * pair, 2 * pair + 1];
        let near = lanes.map(|l| known.children.live & !known.far & (1 << l) != 0);
        for l in lanes {
            if known.children.live & known.far & (1 << l) != 0 {
                let part = cell.part(place(l), 1, [known.sides[l]; 2]);
                let c = &known.children.centre;
                let far = Far {
                    centre: [c[0].0[l], c[1].0[l], c[2].0[l]],
                    distance: known.clear.0[l],
                    inside: known.sides[l] == Side::Inside,
                };
                sink.far(&part, far);
                if part.n >= TASK {
                    self.watch.advance(part.count());
                }
            }
        }
        if near == [false; 2] {
            return None;
        }
        let at = place(lanes[0]);
        let mut next = cell.part(at, 2, lanes.map(|l| known.sides[l]));
        let middle = cell.origin[2] + (at[2] + 1) * next.n;
        if !near[0] {
            next.lo[2] = next.lo[2].max(middle);
        }
        if !near[1] {
            next.hi[2] = next.hi[2].min(middle);
        }
        Some(next)
    }
}

/// The mesh's triangles in the descent's frame, in their order, and clusters of them.
pub fn prepare(
    mesh: &Checked,
    grid: &Grid,
    order: &[u32],
    watch: &dyn Watch,
) -> Result<(Vec<Tri>, Vec<Slab>), MeshError> {
    let weights = DVec3::from_array(grid.weights.map(f64::from));
    let corners = |f: u32| mesh.faces[f as usize].map(|v| grid.frame(mesh.vertices[v as usize]));
    // Once nobody waits for them, zeros do.
    let tri = |&f: &u32| if watch.cancelled() { Tri::default() } else { Tri::new(corners(f), weights) };
    let tris = order.par_iter().map(tri).collect();
    let slab = |cluster: &[u32]| {
        if watch.cancelled() {
            return Slab::default();
        }
        let all: Vec<DVec3> = cluster.iter().flat_map(|&f| corners(f)).collect();
        Slab::new(&all, weights)
    };
    let slabs = order.par_chunks(CLUSTER).map(slab).collect();
    Pulse::new(watch).ask()?;
    Ok((tris, slabs))
}
