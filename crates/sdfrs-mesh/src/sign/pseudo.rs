//! Signs by the normal of the nearest feature: a face, an edge, a vertex (Baerentzen, Aanaes, Signed distance computation
//! using the angle weighted pseudonormal, 2005), in f64.
//!
//! Departure: the caller's nearest face may be off by its rounding, so which feature of the face is nearest is found
//! again here, and where that is an edge, the face beyond the edge is asked too.

use crate::check::{Checked, Edges};
use glam::DVec3;

const NONE: u32 = u32::MAX;

/// Normals of edges and vertices.
pub struct Pseudo {
    /// The edge of each half-edge.
    edge_of: Vec<u32>,
    /// A half-edge beyond each half-edge.
    across: Vec<u32>,
    edges: Vec<DVec3>,
    vertices: Vec<DVec3>,
}

/// Where on a face its nearest point lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feature {
    Face,
    /// From corner k to the next.
    Edge(usize),
    Corner(usize),
}

/// The nearest point of a face.
#[derive(Debug, Clone, Copy)]
pub struct Foot {
    pub point: DVec3,
    pub squared: f64,
    pub feature: Feature,
}

impl Pseudo {
    pub fn new(mesh: &Checked) -> Self {
        let found = Edges::new(&mesh.faces, mesh.vertices.len());
        let mut edges = vec![DVec3::ZERO; found.surplus.len()];
        let mut vertices = vec![DVec3::ZERO; mesh.vertices.len()];
        let mut last = vec![NONE; found.surplus.len()];
        let mut across = vec![NONE; found.of.len()];
        for (f, face) in mesh.faces.iter().enumerate() {
            let corners = mesh.corners(f).map(DVec3::from);
            let normal = normal(&corners);
            for k in 0..3 {
                let h = 3 * f + k;
                let edge = found.of[h] as usize;
                edges[edge] += normal;
                let other = std::mem::replace(&mut last[edge], h as u32);
                if other != NONE {
                    (across[h], across[other as usize]) = (other, h as u32);
                }
                vertices[face[k] as usize] += normal * angle(&corners, k);
            }
        }
        Self { edge_of: found.of, across, edges, vertices }
    }

    /// Whether `p`, nearest to `face`, is inside.
    pub fn inside(&self, mesh: &Checked, p: [f64; 3], face: u32) -> bool {
        let p = DVec3::from(p);
        let (mut face, mut at) = (face as usize, foot(p, &mesh.corners(face as usize)));
        // Around a vertex it may take several steps, each of which comes nearer.
        for _ in 0..16 {
            let Feature::Edge(k) = at.feature else { break };
            let beyond = self.across[3 * face + k];
            if beyond == NONE {
                break;
            }
            let next = foot(p, &mesh.corners(beyond as usize / 3));
            if !(next.squared < at.squared) {
                break;
            }
            (face, at) = (beyond as usize / 3, next);
        }
        let normal = match at.feature {
            Feature::Face => normal(&mesh.corners(face).map(DVec3::from)),
            Feature::Edge(k) => self.edges[self.edge_of[3 * face + k] as usize],
            Feature::Corner(k) => self.vertices[mesh.faces[face][k] as usize],
        };
        (p - at.point).dot(normal) < 0.0
    }
}

/// The nearest point of a face with an area.
pub fn foot(p: DVec3, corners: &[[f64; 3]; 3]) -> Foot {
    let corners = corners.map(DVec3::from);
    let normal = normal(&corners);
    let mut best = Foot { point: p, squared: f64::INFINITY, feature: Feature::Face };
    let mut within = true;
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let (edge, to) = (b - a, p - a);
        within &= normal.cross(edge).dot(to) >= 0.0;
        let t = to.dot(edge) / edge.length_squared();
        let (point, feature) = match t {
            t if !(t > 0.0) => (a, Feature::Corner(k)),
            t if t >= 1.0 => (b, Feature::Corner((k + 1) % 3)),
            t => (a + edge * t, Feature::Edge(k)),
        };
        let squared = (p - point).length_squared();
        if squared < best.squared {
            best = Foot { point, squared, feature };
        }
    }
    if within {
        let height = normal.dot(p - corners[0]);
        best = Foot { point: p - normal * height, squared: height * height, feature: Feature::Face };
    }
    best
}

/// Of unit length; scaled first, so that no product of a small face's edges vanishes.
fn normal([a, b, c]: &[DVec3; 3]) -> DVec3 {
    let (u, v) = (*b - *a, *c - *a);
    let largest = u.abs().max_element().max(v.abs().max_element());
    (u / largest).cross(v / largest).normalize_or_zero()
}

/// The angle at corner `k`.
fn angle(corners: &[DVec3; 3], k: usize) -> f64 {
    let u = (corners[(k + 1) % 3] - corners[k]).normalize_or_zero();
    let v = (corners[(k + 2) % 3] - corners[k]).normalize_or_zero();
    u.cross(v).length().atan2(u.dot(v))
}
