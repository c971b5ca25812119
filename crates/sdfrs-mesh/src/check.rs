//! Stand-in for the checks of branch w-sign: unit frame, and whether the mesh is closed.

use std::collections::HashMap;

use crate::{Mesh, MeshError};

/// Recentred and rescaled: world = centre + scale * vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct Checked {
    pub vertices: Vec<[f64; 3]>,
    pub faces: Vec<[u32; 3]>,
    pub centre: [f64; 3],
    pub scale: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    pub vertices: u64,
    pub faces: u64,
    pub degenerate_faces: u64,
    pub duplicate_faces: u64,
    pub boundary_edges: u64,
    pub nonmanifold_edges: u64,
    pub misoriented_edges: u64,
    pub components: u64,
    pub watertight: bool,
    pub manifold: bool,
    pub oriented: bool,
    pub signed_volume: f64,
    pub bounds: ([f64; 3], [f64; 3]),
}

pub fn check(mesh: &Mesh) -> Result<(Checked, Findings), MeshError> {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for (i, v) in mesh.vertices.iter().enumerate() {
        if v.iter().any(|x| !x.is_finite()) {
            return Err(MeshError::bad(format!("vertex {i}"), "coordinates have to be finite"));
        }
        for k in 0..3 {
            lo[k] = lo[k].min(v[k]);
            hi[k] = hi[k].max(v[k]);
        }
    }
    let mut faces = Vec::with_capacity(mesh.faces.len());
    for (i, f) in mesh.faces.iter().enumerate() {
        if f.iter().any(|&v| v as usize >= mesh.vertices.len()) {
            return Err(MeshError::bad(format!("face {i}"), "no such vertex"));
        }
        if f[0] != f[1] && f[1] != f[2] && f[2] != f[0] {
            faces.push(*f);
        }
    }
    if faces.is_empty() {
        return Err(MeshError::bad("faces", "none has an area"));
    }
    let centre: [f64; 3] = std::array::from_fn(|k| 0.5 * lo[k] + 0.5 * hi[k]);
    let half = (0..3).map(|k| 0.5 * (hi[k] - lo[k])).fold(0.0, f64::max);
    let scale = half.log2().ceil().exp2();
    let vertices: Vec<[f64; 3]> =
        mesh.vertices.iter().map(|v| std::array::from_fn(|k| (v[k] - centre[k]) / scale)).collect();
    let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
    for f in &faces {
        for k in 0..3 {
            let (a, b) = (f[k], f[(k + 1) % 3]);
            *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    let open = edges.values().filter(|&&n| n != 0).count() as u64;
    let findings = Findings {
        vertices: mesh.vertices.len() as u64,
        faces: mesh.faces.len() as u64,
        degenerate_faces: (mesh.faces.len() - faces.len()) as u64,
        duplicate_faces: 0,
        boundary_edges: open,
        nonmanifold_edges: 0,
        misoriented_edges: 0,
        components: 1,
        watertight: open == 0,
        manifold: true,
        oriented: true,
        signed_volume: 0.0,
        bounds: (lo, hi),
    };
    Ok((Checked { vertices, faces, centre, scale }, findings))
}
