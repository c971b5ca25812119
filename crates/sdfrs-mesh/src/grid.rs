//! The nodes of the grid in the frame of the descent: the middle of the grid's box at the origin, divided by a power
//! of two so that no node is beyond 1; f64 throughout, rounded to f32 at the end.
//!
//! The axes are reordered so that the last is the one with the smallest spacing (x where all are equal): leaves are
//! 2 x 2 x 4 nodes and come out nearly cubic in space.

use glam::DVec3;

use crate::kernels::Points;
use crate::lanes::Row;

/// Coordinates beyond the last node repeat it this often, so that a leaf may read over the end.
const PAD: usize = 4;

pub struct Grid {
    /// Nodes along the descent's axes.
    pub dims: [u32; 3],
    /// The descent's axis `a` is the world's `axes[a]`.
    pub axes: [usize; 3],
    /// Where the origin lies in the unit frame of the mesh, and how large one is there (world's axes).
    centre: DVec3,
    pub scale: f64,
    /// Spacing along the descent's axes.
    step: [f64; 3],
    /// Node 0.
    start: [f64; 3],
    nodes: [Vec<f32>; 3],
    /// An axis' spacing over the largest.
    pub weights: [f32; 3],
}

/// Part of the grid that the descent looks at: n x n x 2n nodes from `origin`, cut by the box from `lo` to `hi`.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    pub origin: [u32; 3],
    pub n: u32,
    pub lo: [u32; 3],
    pub hi: [u32; 3],
    /// Of either half along the last axis.
    pub sides: [Side; 2],
}

/// Where all nodes of a cell lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Unknown,
    Outside,
    Inside,
}

/// The sixteen children of a cell; lane = 8 i + 4 j + k.
pub struct Children {
    pub centre: Points,
    /// Half the diagonal, rounded up.
    pub radius: Row,
    /// The largest weighted half side, rounded up.
    pub extent: Row,
    /// One bit for each that has nodes.
    pub live: u16,
}

pub fn place(lane: usize) -> [u32; 3] {
    [(lane >> 3) as u32, (lane >> 2 & 1) as u32, (lane & 3) as u32]
}

impl Cell {
    /// The part for one child or several side by side: from child `at`, `count` children along the last axis.
    pub fn part(&self, at: [u32; 3], count: u32, sides: [Side; 2]) -> Cell {
        let m = self.n / 2;
        let origin: [u32; 3] = std::array::from_fn(|a| self.origin[a] + at[a] * m);
        let size = [m, m, m * count];
        Cell {
            origin,
            n: m,
            lo: std::array::from_fn(|a| self.lo[a].max(origin[a])),
            hi: std::array::from_fn(|a| self.hi[a].min(origin[a] + size[a])),
            sides,
        }
    }

    /// Whether a leaf's node is one of the cell's.
    pub fn has(&self, lane: usize) -> bool {
        let at = place(lane);
        (0..3).all(|a| (self.lo[a]..self.hi[a]).contains(&(self.origin[a] + at[a])))
    }

    pub fn count(&self) -> u64 {
        (0..3).map(|a| u64::from(self.hi[a].saturating_sub(self.lo[a]))).product()
    }
}

impl Grid {
    /// Nodes from `lo` to `hi` (unit frame of the mesh), `dims` of them along each axis; coordinates are kept for
    /// `extended` nodes, which may lie past the end.
    pub fn new(lo: [f64; 3], hi: [f64; 3], dims: [u32; 3], extended: [u32; 3]) -> Self {
        let half = (0..3).map(|k| 0.5 * (hi[k] - lo[k])).fold(0.0, f64::max);
        let scale = half.log2().ceil().exp2();
        let spacing: [f64; 3] = std::array::from_fn(|k| (hi[k] - lo[k]) / scale / f64::from(dims[k] - 1));
        let least = (1..3).fold(0, |best, k| if spacing[k] < 0.99 * spacing[best] { k } else { best });
        let axes = match least {
            0 => [2, 1, 0],
            1 => [2, 0, 1],
            _ => [1, 0, 2],
        };
        let start = axes.map(|k| -0.5 * (hi[k] - lo[k]) / scale);
        let step = axes.map(|k| spacing[k]);
        let largest = step[0].max(step[1]).max(step[2]);
        let nodes = std::array::from_fn(|a| {
            let count = extended[axes[a]] as usize;
            let mut x: Vec<f32> = (0..count).map(|i| (start[a] + step[a] * i as f64) as f32).collect();
            let last = x.last().copied().unwrap_or_default();
            x.resize(count + PAD, last);
            x
        });
        Self {
            dims: axes.map(|k| extended[k]),
            axes,
            centre: DVec3::from_array(std::array::from_fn(|k| 0.5 * lo[k] + 0.5 * hi[k])),
            scale,
            step,
            start,
            nodes,
            weights: step.map(|s| (s / largest) as f32),
        }
    }

    /// A point of the unit frame, in the descent's.
    pub fn frame(&self, v: [f64; 3]) -> DVec3 {
        let f = (DVec3::from_array(v) - self.centre) / self.scale;
        DVec3::from_array(self.axes.map(|k| f[k]))
    }

    /// And back.
    pub fn unit(&self, f: [f64; 3]) -> [f64; 3] {
        let mut u = [0.0; 3];
        for a in 0..3 {
            u[self.axes[a]] = self.centre[self.axes[a]] + self.scale * f[a];
        }
        u
    }

    /// A node, unrounded, in the unit frame.
    pub fn node(&self, index: [u32; 3]) -> [f64; 3] {
        self.unit(std::array::from_fn(|a| self.start[a] + self.step[a] * f64::from(index[a])))
    }

    /// Coordinates of all nodes along one of the world's axes, in the unit frame.
    pub fn line(&self, axis: usize) -> Vec<f64> {
        let a = self.axes.iter().position(|&k| k == axis).unwrap_or_default();
        let at = |i: u32| self.centre[axis] + self.scale * (self.start[a] + self.step[a] * f64::from(i));
        (0..self.dims[a]).map(at).collect()
    }

    /// The longest distance of any point of a node's cell from the nearest node.
    pub fn half_diagonal(&self) -> f64 {
        0.5 * DVec3::from_array(self.step).length()
    }

    /// A node in the descent's frame.
    pub fn place(&self, index: [f64; 3]) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|a| self.start[a] + self.step[a] * index[a]))
    }

    pub fn step(&self) -> [f64; 3] {
        self.step
    }

    /// The sixteen nodes of a leaf.
    pub fn leaf(&self, origin: [u32; 3]) -> Points {
        let at = |a: usize, i: u32| self.nodes[a].get((origin[a] + i) as usize).copied().unwrap_or_default();
        let mut p = [Row::ZERO; 3];
        let (x, y) = ([at(0, 0), at(0, 1)], [at(1, 0), at(1, 1)]);
        let z = [at(2, 0), at(2, 1), at(2, 2), at(2, 3)];
        for lane in 0..16 {
            p[0].0[lane] = x[lane >> 3];
            p[1].0[lane] = y[lane >> 2 & 1];
            p[2].0[lane] = z[lane & 3];
        }
        p
    }

    /// The children of a cell, from the true nodes; with `apron`, each as far as the next one's first node.
    pub fn children(&self, cell: &Cell, apron: bool) -> Children {
        let m = cell.n / 2;
        let (mut centre, mut half, mut live) = ([[0.0f32; 4]; 3], [[0.0f32; 4]; 3], [[false; 4]; 3]);
        for a in 0..3 {
            for s in 0..[2, 2, 4][a] {
                let first = cell.origin[a] + s as u32 * m;
                let (from, end) = (first.max(cell.lo[a]), (first + m).min(cell.hi[a]));
                if from >= end {
                    centre[a][s] = centre[a][s.saturating_sub(1)];
                    continue;
                }
                let at = |i: u32| self.nodes[a].get(i as usize).copied().unwrap_or_default();
                let (x0, x1) = (at(from), at(if apron { end } else { end - 1 }));
                let c = 0.5 * (x0 + x1);
                centre[a][s] = c;
                half[a][s] = (c - x0).max(x1 - c) * (1.0 + 2e-7);
                live[a][s] = true;
            }
        }
        self.lanes(&centre, &half, &live)
    }

    fn lanes(&self, centre: &[[f32; 4]; 3], half: &[[f32; 4]; 3], live: &[[bool; 4]; 3]) -> Children {
        let mut out = Children { centre: [Row::ZERO; 3], radius: Row::ZERO, extent: Row::ZERO, live: 0 };
        let w = self.weights;
        for lane in 0..16 {
            let [i, j, k] = place(lane).map(|x| x as usize);
            let (x, y, z) = (half[0][i], half[1][j], half[2][k]);
            out.centre[0].0[lane] = centre[0][i];
            out.centre[1].0[lane] = centre[1][j];
            out.centre[2].0[lane] = centre[2][k];
            out.radius.0[lane] = (x * x + y * y + z * z).sqrt() * (1.0 + 5e-7);
            out.extent.0[lane] = (x / w[0]).max(y / w[1]).max(z / w[2]) * (1.0 + 5e-7);
            out.live |= u16::from(live[0][i] && live[1][j] && live[2][k]) << lane;
        }
        out
    }
}
