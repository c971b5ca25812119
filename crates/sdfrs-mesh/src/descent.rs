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
    MeshError, Watch,
    budget::Budget,
    check::Checked,
    clusters::CLUSTER,
    exact::distance2,
    frames::{Slab, Tri},
    grid::{Cell, Children, Grid, Side, place},
    kernels::{Bound, Kernels, Points},
    lanes::Row,
    sign::{Nearest, Signs},
};

/// Cells of at most so many nodes across are one task's, and hold triangles rather than clusters.
const TASK: u32 = 16;
/// Triangles that reach so many half sides of a cell are held against the tangent bound too.
const LARGE: f32 = 8.0;

/// Takes what the descent finds. Origins and boxes are in nodes along the descent's axes, distances in its frame.
pub trait Sink: Send + Sized {
    /// An empty one for a task of its own.
    fn fork(&self) -> Self;
    /// A cell of 8 x 8 x 16 nodes begins.
    fn open(&mut self, _cell: &Cell) -> Result<(), MeshError> {
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
    ids: Vec<u32>,
    masks: Vec<u16>,
    rows: Vec<Row>,
}

impl Arena {
    fn reserve(&mut self, budget: &Budget, ids: usize, masks: usize, rows: usize) -> Result<(), MeshError> {
        budget.grow(&mut self.ids, ids, 0, "lists of triangles")?;
        budget.grow(&mut self.masks, masks, 0, "lists of triangles")?;
        budget.grow(&mut self.rows, rows, Row::ZERO, "lists of triangles")
    }
}

/// What is known of a cell's children.
struct Known {
    children: Children,
    /// Nothing of the mesh is nearer to their centres.
    clear: Row,
    sides: [Side; 16],
    /// One bit for each that is farther than the band.
    far: u16,
}

/// A list's kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Slabs,
    Tris,
}

impl Descent<'_> {
    /// Down from one cell around everything; what the tasks found, in the cells' order.
    pub fn run<S: Sink + Sync>(&self, sink: &S) -> Result<Vec<S>, MeshError> {
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
    fn top<S: Sink + Sync>(&self, sink: &S, list: Vec<u32>, kind: Kind, cell: Cell) -> Result<Vec<S>, MeshError> {
        if self.watch.cancelled() {
            return Err(MeshError::Cancelled);
        }
        let mut part = sink.fork();
        let mut arena = self.arenas.lock().ok().and_then(|mut a| a.pop()).unwrap_or_default();
        if cell.n <= TASK {
            let list = if kind == Kind::Slabs { self.expand(&list) } else { list };
            arena.reserve(self.budget, list.len(), 0, 0)?;
            arena.ids[..list.len()].copy_from_slice(&list);
            self.descend(&mut arena, &mut part, [0, list.len()], 0, cell)?;
            if let Ok(mut arenas) = self.arenas.lock() {
                arenas.push(arena);
            }
            self.watch.advance(cell.count());
            return Ok(vec![part]);
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
        let found: Result<Vec<Vec<S>>, MeshError> =
            cells.into_par_iter().map(|(ids, next)| self.top(sink, ids, kind, next)).collect();
        self.budget.give(bytes);
        Ok(std::iter::once(part).chain(found?.into_iter().flatten()).collect())
    }

    fn expand(&self, slabs: &[u32]) -> Vec<u32> {
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
        [from, end]: [usize; 2],
        mask: usize,
        cell: Cell,
    ) -> Result<(), MeshError> {
        if cell.n >= 8 && self.watch.cancelled() {
            return Err(MeshError::Cancelled);
        }
        if cell.n == 8 {
            sink.open(&cell)?;
        }
        let count = end - from;
        arena.reserve(self.budget, end + count + 16, mask + count, count)?;
        let list = std::mem::take(&mut arena.ids);
        let known = self.examine(arena, &list[from..end], Kind::Tris, mask, &cell);
        arena.ids = list;
        let known = known?;
        for pair in 0..8 {
            let Some(next) = self.next(sink, &cell, &known, pair) else { continue };
            let (above, below) = arena.ids.split_at_mut(end);
            let masks = &arena.masks[mask..mask + count];
            let n = self.kernels.pick(&above[from..], masks, 3 << (2 * pair), below);
            if next.n == 2 {
                self.leaf(&mut arena.rows, sink, &arena.ids[end..end + n], &next);
            } else {
                self.descend(arena, sink, [end, end + n], mask + count, next)?;
            }
        }
        Ok(())
    }

    /// The cell of a pair of children, or of the one that has nodes within the band; hands over those that have not.
    fn next<S: Sink>(&self, sink: &mut S, cell: &Cell, known: &Known, pair: usize) -> Option<Cell> {
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

    /// Holds a list against the children: masks of who needs what go to the arena, from `mask` on.
    fn examine(
        &self,
        arena: &mut Arena,
        list: &[u32],
        kind: Kind,
        mask: usize,
        cell: &Cell,
    ) -> Result<Known, MeshError> {
        let closed = self.bricks && cell.n >= 16;
        let children = self.grid.children(cell, closed);
        let rows = &mut arena.rows[..list.len()];
        let masks = &mut arena.masks[mask..mask + list.len()];
        let c = &children.centre;
        let (least, q, low) = match kind {
            Kind::Tris => {
                let least = self.kernels.measure(&self.tris, list, c, rows);
                let q = self.kernels.nearest(&self.tris, &least.id, c);
                self.kernels.keep(&self.tris, list, rows, &self.bound(&children, &q), masks);
                (least, q, least.d2)
            }
            Kind::Slabs => {
                let (least, low) = self.kernels.survey(&self.slabs, list, c, rows);
                let mut q = [Row::ZERO; 3];
                for lane in 0..16 {
                    let corner = self.slabs[least.id[lane] as usize].corner;
                    for a in 0..3 {
                        q[a].0[lane] = corner[a];
                    }
                }
                self.kernels.retain(&self.slabs, list, rows, &self.bound(&children, &q), masks);
                (least, q, low)
            }
        };
        let _ = (least, q);
        let mut known = Known { children, clear: Row::ZERO, sides: [Side::Unknown; 16], far: 0 };
        for lane in 0..16 {
            let d = low.0[lane].max(0.0).sqrt();
            known.clear.0[lane] = (d * (1.0 - 4e-6) - self.slack).max(0.0);
        }
        self.decide(arena, list, kind, mask, cell, &mut known)?;
        Ok(known)
    }

    /// Sides of the children, and which are farther than the band.
    fn decide(
        &self,
        arena: &mut Arena,
        list: &[u32],
        kind: Kind,
        mask: usize,
        cell: &Cell,
        known: &mut Known,
    ) -> Result<(), MeshError> {
        let mut open = 0u16;
        for lane in 0..16 {
            let (clear, radius) = (known.clear.0[lane], known.children.radius.0[lane]);
            known.sides[lane] = cell.sides[lane >> 1 & 1];
            let live = known.children.live & (1 << lane) != 0;
            if let Some(band) = self.band
                && live
                && clear > radius + band
                && (cell.n <= TASK || !self.bricks || clear > 2.0 * radius)
            {
                known.far |= 1 << lane;
            }
            // Clusters know no nearest triangle: they look for a sign only where the descent ends.
            let wanted = kind == Kind::Tris || known.far & (1 << lane) != 0;
            if live && wanted && clear > radius && known.sides[lane] == Side::Unknown {
                open |= 1 << lane;
            }
        }
        if open == 0 {
            return Ok(());
        }
        let all: Vec<u32>;
        let (list, c) = match kind {
            Kind::Tris => (list, known.children.centre),
            Kind::Slabs => {
                let masks = &arena.masks[mask..mask + list.len()];
                let kept: Vec<u32> =
                    list.iter().zip(masks).filter(|(_, m)| **m & open != 0).map(|(s, _)| *s).collect();
                all = self.expand(&kept);
                arena.reserve(self.budget, 0, 0, all.len())?;
                self.kernels.measure(&self.tris, &all, &known.children.centre, &mut arena.rows[..all.len()]);
                (&all[..], known.children.centre)
            }
        };
        for lane in 0..16 {
            if open & (1 << lane) != 0 {
                let p = self.grid.unit([0, 1, 2].map(|a| f64::from(c[a].0[lane])));
                known.sides[lane] = self.side(list, &arena.rows, lane, p);
            }
        }
        Ok(())
    }

    /// Where a point lies (unit frame): f64 decides which of the triangles that f32 cannot tell apart is nearest.
    fn side(&self, list: &[u32], rows: &[Row], lane: usize, p: [f64; 3]) -> Side {
        let Some(signs) = self.signs else { return Side::Outside };
        let least = rows[..list.len()].iter().map(|r| r.0[lane]).fold(f32::INFINITY, f32::min);
        let most = least * (1.0 + 1e-5) + 4.0 * self.slack * (least.sqrt() + self.slack);
        let mut best = f64::INFINITY;
        let mut nearest = Nearest { face: 0, point: p };
        for (&t, row) in list.iter().zip(rows) {
            if row.0[lane] <= most {
                let face = self.faces[t as usize];
                let (d2, point) = distance2(self.corners(face), p);
                if d2 < best {
                    best = d2;
                    nearest = Nearest { face, point };
                }
            }
        }
        if signs.inside(p, nearest) { Side::Inside } else { Side::Outside }
    }

    fn corners(&self, face: u32) -> [[f64; 3]; 3] {
        self.mesh.faces[face as usize].map(|v| self.mesh.vertices[v as usize])
    }

    fn bound(&self, children: &Children, q: &Points) -> Bound {
        let c = &children.centre;
        let w = self.grid.weights;
        let mut bound = Bound {
            c: *c,
            q: *q,
            base: Row::ZERO,
            twice: Row::ZERO,
            extent2: Row::ZERO,
            weights: w,
            large: 0.0,
        };
        let mut widest = 0.0f32;
        for lane in 0..16 {
            let d: [f32; 3] = [0, 1, 2].map(|a| c[a].0[lane] - q[a].0[lane]);
            let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let (radius, extent) = (children.radius.0[lane], children.extent.0[lane]);
            // Both sides of the test round: by parts of the squares, and by the coordinates' own digits.
            bound.base.0[lane] = d2 * (1.0 + 8e-6) + 4.0 * self.slack * (d2.sqrt() + radius + self.slack);
            bound.twice.0[lane] = 2.0 * extent * (1.0 + 8e-6);
            bound.extent2.0[lane] = radius * radius;
            widest = widest.max(extent);
        }
        for a in 0..3 {
            for lane in 0..16 {
                bound.q[a].0[lane] *= w[a];
            }
        }
        bound.large = LARGE * widest;
        bound
    }

    /// Distances at the nodes of a leaf.
    fn leaf<S: Sink>(&self, rows: &mut [Row], sink: &mut S, list: &[u32], cell: &Cell) {
        let points = self.grid.leaf(cell.origin);
        let mut values = [0.0; 16];
        let known = cell.sides[0] != Side::Unknown && cell.sides[1] != Side::Unknown;
        let d2 = if known {
            self.kernels.leaf(&self.tris, list, &points)
        } else {
            self.kernels.measure(&self.tris, list, &points, rows).d2
        };
        for lane in 0..16 {
            values[lane] = d2.0[lane].sqrt();
        }
        for lane in 0..16 {
            let mut side = cell.sides[lane >> 1 & 1];
            if side == Side::Unknown {
                let at = place(lane);
                let index: [u32; 3] = std::array::from_fn(|a| cell.origin[a] + at[a]);
                if (0..3).any(|a| index[a] < cell.lo[a] || index[a] >= cell.hi[a]) {
                    continue;
                }
                side = self.side(list, rows, lane, self.grid.node(index));
            }
            if side == Side::Inside {
                values[lane] = -values[lane];
            }
        }
        sink.leaf(cell, &values);
    }
}

/// The mesh's triangles in the descent's frame, in their order, and clusters of them.
pub fn prepare(mesh: &Checked, grid: &Grid, order: &[u32]) -> (Vec<Tri>, Vec<Slab>) {
    let weights = DVec3::from_array(grid.weights.map(f64::from));
    let corners = |f: u32| mesh.faces[f as usize].map(|v| grid.frame(mesh.vertices[v as usize]));
    let tris = order.par_iter().map(|&f| Tri::new(corners(f), weights)).collect();
    let slab = |cluster: &[u32]| {
        let all: Vec<DVec3> = cluster.iter().flat_map(|&f| corners(f)).collect();
        Slab::new(&all, weights)
    };
    (tris, order.par_chunks(CLUSTER).map(slab).collect())
}
