//! Meshes whole and damaged, made here: no file is needed.

#![allow(dead_code)]

use sdfrs_mesh::Mesh;
use std::collections::HashMap;
use std::f64::consts::TAU;

/// A small generator of numbers (xorshift with a multiplier): the same ones every time.
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    pub fn point(&mut self, reach: f64) -> [f64; 3] {
        std::array::from_fn(|_| reach * (2.0 * self.unit() - 1.0))
    }
}

/// An icosahedron, each face split `level` times in four, on the unit sphere: 20 * 4^level faces.
pub fn icosphere(level: u32) -> Mesh {
    let t = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    for (a, b) in [(1.0, t), (-1.0, t), (1.0, -t), (-1.0, -t)] {
        vertices.extend([[a, b, 0.0], [0.0, a, b], [b, 0.0, a]]);
    }
    let norm = |p: [f64; 3]| {
        let l = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
        p.map(|x| x / l)
    };
    let mut vertices: Vec<[f64; 3]> = vertices.into_iter().map(norm).collect();
    let mut faces = hull_of_icosahedron(&vertices);
    for _ in 0..level {
        let mut middle: HashMap<(u32, u32), u32> = HashMap::new();
        let mut split = Vec::with_capacity(4 * faces.len());
        for [a, b, c] in faces {
            let mut mid = |u: u32, v: u32| {
                *middle.entry((u.min(v), u.max(v))).or_insert_with(|| {
                    let (p, q) = (vertices[u as usize], vertices[v as usize]);
                    vertices.push(norm(std::array::from_fn(|i| p[i] + q[i])));
                    (vertices.len() - 1) as u32
                })
            };
            let (ab, bc, ca) = (mid(a, b), mid(b, c), mid(c, a));
            split.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        faces = split;
    }
    Mesh { vertices, faces }
}

fn hull_of_icosahedron(v: &[[f64; 3]]) -> Vec<[u32; 3]> {
    let near = |i: usize, j: usize| (0..3).map(|k| (v[i][k] - v[j][k]).powi(2)).sum::<f64>() < 1.2;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(k, i) {
                    let [a, b, c] = [v[i], v[j], v[k]];
                    let det = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
                        + a[2] * (b[0] * c[1] - b[1] * c[0]);
                    faces.push(if det > 0.0 { [i, j, k] } else { [i, k, j] }.map(|x| x as u32));
                }
            }
        }
    }
    faces
}

/// A ball with its vertices drawn out or pressed in at random: sharp spikes, deep pits, uneven fans, and no face meets
/// another.
pub fn spiky(level: u32, seed: u64) -> Mesh {
    let (mut mesh, mut dice) = (icosphere(level), Dice::new(seed));
    for v in &mut mesh.vertices {
        let r = 0.15 + 0.85 * dice.unit() * dice.unit();
        *v = v.map(|x| r * x);
    }
    mesh
}

/// Around the z axis.
pub fn torus(major: f64, minor: f64, around: u32, across: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..around {
        for j in 0..across {
            let (u, v) = (TAU * f64::from(i) / f64::from(around), TAU * f64::from(j) / f64::from(across));
            let r = major + minor * v.cos();
            mesh.vertices.push([r * u.cos(), r * u.sin(), minor * v.sin()]);
            let at = |i: u32, j: u32| (i % around) * across + j % across;
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// The cube from -1 to 1, each side n x n squares, its vertices shared.
pub fn cube(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let mut names: HashMap<[u32; 3], u32> = HashMap::new();
    for (axis, high) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
        let mut name = |i: u32, j: u32| {
            let mut at = [0; 3];
            at[axis] = if high { n } else { 0 };
            at[(axis + 1) % 3] = i;
            at[(axis + 2) % 3] = j;
            *names.entry(at).or_insert_with(|| {
                mesh.vertices.push(at.map(|x| 2.0 * f64::from(x) / f64::from(n) - 1.0));
                (mesh.vertices.len() - 1) as u32
            })
        };
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let q = [name(i, j), name(i + 1, j), name(i + 1, j + 1), name(i, j + 1)];
            let halves = [[q[0], q[1], q[2]], [q[0], q[2], q[3]]];
            mesh.faces.extend(halves.map(|[a, b, c]| if high { [a, b, c] } else { [a, c, b] }));
        }
    }
    mesh
}

pub fn moved(mut mesh: Mesh, by: [f64; 3], scale: f64) -> Mesh {
    for v in &mut mesh.vertices {
        *v = std::array::from_fn(|i| v[i] * scale + by[i]);
    }
    mesh
}

pub fn both(mut a: Mesh, b: &Mesh) -> Mesh {
    let first = a.vertices.len() as u32;
    a.vertices.extend(&b.vertices);
    a.faces.extend(b.faces.iter().map(|f| f.map(|v| v + first)));
    a
}

/// Without a random share of its faces.
pub fn holed(mut mesh: Mesh, share: f64, seed: u64) -> Mesh {
    let mut dice = Dice::new(seed);
    mesh.faces.retain(|_| dice.unit() >= share);
    mesh
}

/// Without its top: that share of its faces, the highest ones.
pub fn beheaded(mut mesh: Mesh, share: f64) -> Mesh {
    let height = |m: &Mesh, f: &[u32; 3]| f.iter().map(|&v| m.vertices[v as usize][2]).sum::<f64>();
    let mut heights: Vec<f64> = mesh.faces.iter().map(|f| height(&mesh, f)).collect();
    heights.sort_by(f64::total_cmp);
    let limit = heights[((1.0 - share) * heights.len() as f64) as usize];
    let faces = std::mem::take(&mut mesh.faces);
    mesh.faces = faces.into_iter().filter(|f| height(&mesh, f) < limit).collect();
    mesh
}

/// With a random share of its faces turned round.
pub fn flipped(mut mesh: Mesh, share: f64, seed: u64) -> Mesh {
    let mut dice = Dice::new(seed);
    for f in &mut mesh.faces {
        if dice.unit() < share {
            f.swap(1, 2);
        }
    }
    mesh
}

/// With a share of its faces there twice.
pub fn doubled(mut mesh: Mesh, share: f64, seed: u64) -> Mesh {
    let mut dice = Dice::new(seed);
    let again: Vec<_> =
        mesh.faces.iter().filter(|_| dice.unit() < share).map(|&[a, b, c]| [b, c, a]).collect();
    mesh.faces.extend(again);
    mesh
}

/// Each face with vertices of its own, as in an STL file.
pub fn soup(mesh: &Mesh) -> Mesh {
    let vertices = mesh.faces.iter().flatten().map(|&v| mesh.vertices[v as usize]).collect();
    Mesh { vertices, faces: (0..mesh.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect() }
}

/// With faces of no area: repeated corners, and edges split by a vertex on them, on one side only, with a sliver that
/// fills the gap.
pub fn slivered(mut mesh: Mesh, share: f64, seed: u64) -> Mesh {
    let mut dice = Dice::new(seed);
    let mut more = Vec::new();
    for f in &mut mesh.faces {
        if dice.unit() < share {
            let [a, b, c] = *f;
            let (p, q) = (mesh.vertices[a as usize], mesh.vertices[b as usize]);
            let t = 0.2 + 0.6 * dice.unit();
            mesh.vertices.push(std::array::from_fn(|i| p[i] + t * (q[i] - p[i])));
            let m = (mesh.vertices.len() - 1) as u32;
            *f = [a, m, c];
            more.extend([[m, b, c], [a, b, m], [a, a, c]]);
        }
    }
    mesh.faces.extend(more);
    mesh
}
