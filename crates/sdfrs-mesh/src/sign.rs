//! Inside or outside. Stand-in for branch w-sign: pseudonormals only.

use std::collections::HashMap;

use crate::{
    MeshError,
    check::{Checked, Findings},
};

/// How a node's sign is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SignRule {
    /// Pseudonormals for closed, oriented, manifold meshes, else winding numbers.
    #[default]
    Auto,
    Winding,
    Pseudonormal,
    Parity,
    /// Distances without a sign.
    Unsigned,
}

/// What decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    Pseudonormal,
    Winding,
    Parity,
    Unsigned,
}

/// The nearest face of a point, and the closest point on it (unit frame).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    pub face: u32,
    pub point: [f64; 3],
}

pub struct Signs {
    method: Method,
    faces: Vec<[u32; 3]>,
    corners: Vec<[f64; 3]>,
    face_normals: Vec<[f64; 3]>,
    vertex_normals: Vec<[f64; 3]>,
    edge_normals: HashMap<(u32, u32), [f64; 3]>,
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
fn add(a: &mut [f64; 3], b: [f64; 3], s: f64) {
    for k in 0..3 {
        a[k] += s * b[k];
    }
}

impl Signs {
    pub fn new(mesh: &Checked, _findings: &Findings, rule: SignRule) -> Result<Self, MeshError> {
        let mut vertex_normals = vec![[0.0; 3]; mesh.vertices.len()];
        let mut edge_normals: HashMap<(u32, u32), [f64; 3]> = HashMap::new();
        let mut face_normals = Vec::new();
        for f in &mesh.faces {
            let c = f.map(|v| mesh.vertices[v as usize]);
            let n = cross(sub(c[1], c[0]), sub(c[2], c[0]));
            let l = dot(n, n).sqrt().max(1e-300);
            let n = n.map(|x| x / l);
            face_normals.push(n);
            for k in 0..3 {
                let (i, j) = (f[k], f[(k + 1) % 3]);
                add(edge_normals.entry((i.min(j), i.max(j))).or_default(), n, 1.0);
                let (u, v) = (sub(c[(k + 1) % 3], c[k]), sub(c[(k + 2) % 3], c[k]));
                let x = cross(u, v);
                add(&mut vertex_normals[i as usize], n, dot(x, x).sqrt().atan2(dot(u, v)));
            }
        }
        let method = if rule == SignRule::Unsigned { Method::Unsigned } else { Method::Pseudonormal };
        let corners = mesh.vertices.clone();
        Ok(Self { method, faces: mesh.faces.clone(), corners, face_normals, vertex_normals, edge_normals })
    }

    pub fn method(&self) -> Method {
        self.method
    }

    pub fn why(&self) -> String {
        "stand-in".to_owned()
    }

    pub fn inside(&self, p: [f64; 3], nearest: Nearest) -> bool {
        if self.method == Method::Unsigned {
            return false;
        }
        let f = self.faces[nearest.face as usize];
        let c = f.map(|v| self.corners[v as usize]);
        let q = nearest.point;
        // Barycentric coordinates tell the feature.
        let (u, v, w) = (sub(c[1], c[0]), sub(c[2], c[0]), sub(q, c[0]));
        let (uu, uv, vv, wu, wv) = (dot(u, u), dot(u, v), dot(v, v), dot(w, u), dot(w, v));
        let det = uu * vv - uv * uv;
        let (s, t) = ((vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det);
        let on: Vec<usize> = [1.0 - s - t, s, t]
            .iter()
            .enumerate()
            .filter(|(_, b)| **b > 1e-10)
            .map(|(i, _)| i)
            .collect();
        let normal = match on.as_slice() {
            [a] => self.vertex_normals[f[*a] as usize],
            [a, b] => {
                let (i, j) = (f[*a], f[*b]);
                self.edge_normals.get(&(i.min(j), i.max(j))).copied().unwrap_or_default()
            }
            _ => self.face_normals[nearest.face as usize],
        };
        dot(sub(p, q), normal) < 0.0
    }

    pub fn confidence(&self, _p: [f64; 3]) -> f64 {
        1.0
    }
}
