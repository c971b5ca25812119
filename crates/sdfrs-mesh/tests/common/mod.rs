//! Meshes, and distances and signs by brute force in f64, written without a look at the descent.
#![allow(dead_code)]

use std::{collections::HashMap, f64::consts::PI};

use glam::DVec3;
use rayon::prelude::*;
use sdfrs_mesh::{
    Mesh,
    bake::{Baked, Resolution, Settings, Values, bake},
};

/// Numbers between 0 and 1 (xorshift64*).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() * n as f64) as usize
    }
    pub fn point(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
}

fn mesh(vertices: &[DVec3], faces: Vec<[u32; 3]>) -> Mesh {
    Mesh { vertices: vertices.iter().map(|v| v.to_array()).collect(), faces }
}

/// 20 * 4^level faces of a unit sphere.
pub fn icosphere(level: usize) -> Mesh {
    let t = (1.0 + 5f64.sqrt()) / 2.0;
    let mut v: Vec<DVec3> = [
        [-1.0, t, 0.0],
        [1.0, t, 0.0],
        [-1.0, -t, 0.0],
        [1.0, -t, 0.0],
        [0.0, -1.0, t],
        [0.0, 1.0, t],
        [0.0, -1.0, -t],
        [0.0, 1.0, -t],
        [t, 0.0, -1.0],
        [t, 0.0, 1.0],
        [-t, 0.0, -1.0],
        [-t, 0.0, 1.0],
    ]
    .map(|p| DVec3::from_array(p).normalize())
    .to_vec();
    let mut f: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..level {
        let mut middles = HashMap::new();
        let mut next = Vec::new();
        for [a, b, c] in f {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    v.push(((v[i as usize] + v[j as usize]) * 0.5).normalize());
                    v.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            next.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        f = next;
    }
    mesh(&v, f)
}

/// A (2, 3) torus knot, closed, outwards.
pub fn knot(along: u32, around: u32) -> Mesh {
    let curve = |s: f64| {
        let r = 2.0 + (3.0 * s).cos();
        DVec3::new(r * (2.0 * s).cos(), r * (2.0 * s).sin(), (3.0 * s).sin())
    };
    let mut v = Vec::new();
    for i in 0..along {
        let s = 2.0 * PI * f64::from(i) / f64::from(along);
        let c = curve(s);
        let t = (curve(s + 1e-4) - curve(s - 1e-4)).normalize();
        let n = c.cross(t).normalize();
        let b = t.cross(n);
        for j in 0..around {
            let a = 2.0 * PI * f64::from(j) / f64::from(around);
            v.push(c + 0.4 * (a.cos() * n + a.sin() * b));
        }
    }
    let mut f = Vec::new();
    for i in 0..along {
        for j in 0..around {
            let at = |i: u32, j: u32| (i % along) * around + j % around;
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            f.extend([[a, c, b], [a, d, c]]);
        }
    }
    mesh(&v, f)
}

/// Triangles of length 1 and width 1e-4 (some flat to 1e-9), anywhere.
pub fn needles(count: usize) -> Mesh {
    let mut r = Random(7);
    let (mut v, mut f) = (Vec::new(), Vec::new());
    for i in 0..count as u32 {
        let (p, d) = (r.point(), r.point());
        let width = if i % 5 == 0 { 1e-9 } else { 1e-4 };
        v.extend([p, p + d, p + r.next() * d + width * r.point()]);
        f.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh(&v, f)
}

/// One triangle through everything, and many small ones.
pub fn huge_and_tiny(count: usize) -> Mesh {
    let mut r = Random(9);
    let mut v = vec![DVec3::new(-3.0, -2.0, -0.1), DVec3::new(3.0, -2.5, 0.2), DVec3::new(0.1, 3.0, 0.0)];
    let mut f = vec![[0, 1, 2]];
    for i in 1..=count as u32 {
        let p = r.point();
        v.extend([p, p + 0.01 * r.point(), p + 0.01 * r.point()]);
        f.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh(&v, f)
}

/// Triangles of any shape and size, crossing each other.
pub fn soup(count: usize) -> Mesh {
    let mut r = Random(11);
    let (mut v, mut f) = (Vec::new(), Vec::new());
    for i in 0..count as u32 {
        let (p, size) = (r.point(), 10f64.powf(-3.0 * r.next()));
        v.extend([p, p + size * r.point(), p + size * r.point()]);
        f.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh(&v, f)
}

/// A box of 12 triangles.
pub fn cube(half: [f64; 3]) -> Mesh {
    let v: Vec<DVec3> = (0..8)
        .map(|i| DVec3::from_array(std::array::from_fn(|k| if i >> k & 1 == 1 { half[k] } else { -half[k] })))
        .collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    mesh(&v, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

fn segment2(a: DVec3, b: DVec3, p: DVec3) -> f64 {
    let d = b - a;
    let l = d.length_squared();
    let t = if l > 0.0 { ((p - a).dot(d) / l).clamp(0.0, 1.0) } else { 0.0 };
    (a + t * d - p).length_squared()
}

/// From the plane where the point is over the triangle, else from the nearest edge.
pub fn triangle2([a, b, c]: [DVec3; 3], p: DVec3) -> f64 {
    let edges = segment2(a, b, p).min(segment2(b, c, p)).min(segment2(c, a, p));
    let n = (b - a).cross(c - a);
    let over = [(a, b), (b, c), (c, a)].iter().all(|(u, v)| n.cross(*v - *u).dot(p - *u) > 0.0);
    if over && n.length_squared() > 0.0 {
        // The corner of the longest normal is as good as any; the nearest one loses the fewest digits.
        let base =
            [a, b, c].into_iter().min_by(|u, v| (*u - p).length().total_cmp(&(*v - p).length())).unwrap();
        let z = (p - base).dot(n.normalize());
        return edges.min(z * z);
    }
    edges
}

/// The mesh, ready for many points.
pub struct Oracle {
    tris: Vec<([DVec3; 3], DVec3, f64)>,
}

impl Oracle {
    pub fn new(mesh: &Mesh) -> Self {
        let tri = |f: &[u32; 3]| {
            let t = f.map(|v| DVec3::from_array(mesh.vertices[v as usize]));
            let mid = (t[0] + t[1] + t[2]) / 3.0;
            (t, mid, t.iter().map(|v| (*v - mid).length()).fold(0.0, f64::max) * (1.0 + 1e-9))
        };
        Self { tris: mesh.faces.iter().map(tri).collect() }
    }

    pub fn distance(&self, p: DVec3) -> f64 {
        let mut best = f64::INFINITY;
        for (t, mid, radius) in &self.tris {
            let reach = best + radius;
            if (p - *mid).length_squared() <= reach * reach {
                best = best.min(triangle2(*t, p).sqrt());
            }
        }
        best
    }

    /// Van Oosterom and Strackee's solid angles.
    pub fn inside(&self, p: DVec3) -> bool {
        let mut sum = 0.0;
        for (t, _, _) in &self.tris {
            let [a, b, c] = t.map(|v| v - p);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            let det = a.dot(b.cross(c));
            sum += 2.0 * det.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
        }
        sum / (4.0 * PI) > 0.5
    }
}

pub fn settings(dims: [u32; 3]) -> Settings {
    Settings { resolution: Resolution::Each(dims), ..Settings::default() }
}

pub fn dense(mesh: &Mesh, settings: &Settings) -> (Baked, Vec<f32>) {
    let baked = bake(mesh, settings, &()).unwrap();
    let Values::Dense(values) = baked.values.clone() else { panic!("asked for a dense grid") };
    (baked, values)
}

/// Node `i` in world units.
pub fn node(baked: &Baked, i: [u64; 3]) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|k| {
        let t = i[k] as f64 / (baked.dims[k] - 1) as f64;
        baked.lo[k] + (baked.hi[k] - baked.lo[k]) * t
    }))
}

/// The worst error over `count` nodes, and how many signs are wrong where |d| > `sure`; signs for closed meshes only.
pub fn compare(
    mesh: &Mesh,
    baked: &Baked,
    values: &[f32],
    count: usize,
    signs: usize,
    sure: f64,
) -> (f64, usize) {
    let oracle = Oracle::new(mesh);
    let mut random = Random(3);
    let [nx, ny, nz] = baked.dims;
    let picks: Vec<[u64; 3]> = (0..count)
        .map(|_| {
            [random.below(nx as usize), random.below(ny as usize), random.below(nz as usize)]
                .map(|i| i as u64)
        })
        .collect();
    picks
        .par_iter()
        .enumerate()
        .map(|(i, &at)| {
            let p = node(baked, at);
            let got = f64::from(values[(at[0] + nx * (at[1] + ny * at[2])) as usize]);
            let want = oracle.distance(p);
            let error = (got.abs() - want).abs();
            let wrong = i < signs && want > sure && (got < 0.0) != oracle.inside(p);
            (error, usize::from(wrong))
        })
        .reduce(|| (0.0, 0), |a, b| (a.0.max(b.0), a.1 + b.1))
}
