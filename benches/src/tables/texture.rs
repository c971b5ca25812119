//! What a sample of a texture costs, against a plain function that reads eight nodes and mixes them.
//!
//! Batches of 1,024 points: a tile of 32 x 32 rays goes through the grid a cell at a time, all of its rays at once, as a
//! walk does (along z, across the rows of nodes; along x, with them), tile after tile; or points are anywhere in the box.
//! Positions are made inside the clock, for both.

use std::hint::black_box;

use sdfrs_core::{
    Program, Scratch, Shape,
    grid::{Grid, GridValues},
};

use super::{SECONDS, bar};
use crate::{clock, scenes::Random};

/// Rays along a tile's side.
const TILE: usize = 32;
const BATCH: usize = TILE * TILE;

/// Node values at -1 to 1 along each axis, x fastest.
struct Nodes {
    n: usize,
    values: Vec<f32>,
}

/// Which way a tile goes.
#[derive(Clone, Copy)]
enum March {
    Z,
    X,
    Anywhere,
}

pub fn texture() {
    println!("| dense f32 grid | points | ours, ns/sample | plain function | ours / plain | bar |");
    println!("|---|---|---|---|---|---|");
    for n in [64, 256] {
        let nodes = Nodes::new(n);
        let grid =
            Grid::new(GridValues::F32(nodes.values.clone().into()), [n; 3], [-1.0; 3], [1.0; 3]).unwrap();
        let program = Program::<f32>::values(&Shape::texture(grid).unwrap()).unwrap();
        // What the prototype's pairs of neighbours took of its plain function.
        let marches = [(March::Z, "along z"), (March::X, "along x"), (March::Anywhere, "anywhere")];
        let bars = if n == 64 { [0.45, 0.45, 0.45] } else { [11.8 / 17.8, 9.9 / 15.9, 35.0 / 86.0] };
        for ((march, name), most) in marches.into_iter().zip(bars) {
            let [ours, plain] = against(&nodes, &program, march);
            let ratio = ours / plain;
            println!("| {n}^3 | {name} | {ours:.1} | {plain:.1} | {ratio:.2} | {} |", bar(Some(most), ratio));
        }
    }
    println!();
}

/// Nanoseconds a sample, ours and the plain function's.
fn against(nodes: &Nodes, program: &Program<f32>, march: March) -> [f64; 2] {
    let batches = Batches::new(nodes.n, march);
    let mut p: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; BATCH]);
    let (mut ours, mut plain) = (vec![0.0; BATCH], vec![0.0; BATCH]);
    let mut scratch = Scratch::new();
    for batch in (0..batches.count).step_by(97) {
        batches.fill(batch, &mut p);
        program.evaluate(&mut scratch, [&p[0], &p[1], &p[2]], &mut ours);
        nodes.sample([&p[0], &p[1], &p[2]], &mut plain);
        assert!(ours.iter().zip(&plain).all(|(a, b)| (a - b).abs() < 1e-5), "values differ");
    }
    let mut q = p.clone();
    clock::minima(
        SECONDS,
        [
            &mut || {
                for batch in 0..batches.count {
                    batches.fill(batch, &mut p);
                    program.evaluate(&mut scratch, [&p[0], &p[1], &p[2]], black_box(&mut ours));
                }
            },
            &mut || {
                for batch in 0..batches.count {
                    batches.fill(batch, &mut q);
                    nodes.sample([&q[0], &q[1], &q[2]], black_box(&mut plain));
                }
            },
        ],
    )
    .map(|s| s * 1e9 / (batches.count * BATCH) as f64)
}

/// Points by batches.
struct Batches {
    march: March,
    /// Tiles along a side, and cells on the way.
    tiles: usize,
    cells: usize,
    count: usize,
    anywhere: [Vec<f32>; 3],
}

impl Batches {
    fn new(n: usize, march: March) -> Self {
        let (tiles, cells) = (n / TILE, n - 2);
        let count = match march {
            March::Anywhere => 256,
            _ => tiles * tiles * cells,
        };
        let mut random = Random(7);
        let wanted = if matches!(march, March::Anywhere) { count * BATCH } else { 0 };
        let anywhere =
            std::array::from_fn(|_| (0..wanted).map(|_| random.within(-1.0, 1.0) as f32).collect());
        Self { march, tiles, cells, count, anywhere }
    }

    #[inline(never)]
    fn fill(&self, batch: usize, p: &mut [Vec<f32>; 3]) {
        let [x, y, z] = p;
        let axes = match self.march {
            March::Anywhere => {
                let all = batch * BATCH..(batch + 1) * BATCH;
                for (p, from) in [x, y, z].into_iter().zip(&self.anywhere) {
                    p.copy_from_slice(&from[all.clone()]);
                }
                return;
            }
            March::Z => [x, y, z],
            March::X => [y, z, x],
        };
        let (tile, cell) = (batch / self.cells, batch % self.cells);
        let (first, second) = ((tile % self.tiles * TILE) as f32, (tile / self.tiles * TILE) as f32);
        let side = (self.tiles * TILE) as f32;
        let depth = (cell as f32 + 0.7) * 2.0 / (self.cells + 1) as f32;
        let [u, v, w] = axes;
        for j in 0..TILE {
            for i in 0..TILE {
                // Rays from a pinhole: no two at the same places of their cells.
                let (a, b) = ((first + i as f32 + 0.4) * 2.0 / side, (second + j as f32 + 0.3) * 2.0 / side);
                let at = j * TILE + i;
                u[at] = (a - 1.0) * (1.0 - 0.01 * depth);
                v[at] = (b - 1.0) * (1.0 - 0.01 * depth);
                w[at] = depth - 1.0;
            }
        }
    }
}

impl Nodes {
    /// Distances to a sphere.
    fn new(n: usize) -> Self {
        let at = |i: usize| 2.0 * i as f32 / (n - 1) as f32 - 1.0;
        let mut values = Vec::with_capacity(n * n * n);
        for z in 0..n {
            for y in 0..n {
                values.extend((0..n).map(|x| (at(x) * at(x) + at(y) * at(y) + at(z) * at(z)).sqrt() - 0.7));
            }
        }
        Self { n, values }
    }

    #[inline(never)]
    fn sample(&self, [x, y, z]: [&[f32]; 3], out: &mut [f32]) {
        for i in 0..out.len() {
            out[i] = self.one([x[i], y[i], z[i]]);
        }
    }

    #[inline(always)]
    fn one(&self, p: [f32; 3]) -> f32 {
        let last = (self.n - 2) as f32;
        let place = |v: f32| {
            let u = ((v + 1.0) * 0.5 * (self.n - 1) as f32).max(0.0);
            let cell = u.min(last) as usize;
            (cell, u - cell as f32)
        };
        let ([i, j, k], [fx, fy, fz]) = {
            let [(i, fx), (j, fy), (k, fz)] = p.map(place);
            ([i, j, k], [fx, fy, fz])
        };
        let mix = |a: f32, b: f32, f: f32| a + f * (b - a);
        let row = |j: usize, k: usize| {
            let at = i + self.n * (j + self.n * k);
            mix(self.values[at], self.values[at + 1], fx)
        };
        let plane = |k: usize| mix(row(j, k), row(j + 1, k), fy);
        mix(plane(k), plane(k + 1), fz)
    }
}
