//! Signs by the normal of the nearest feature: a face, an edge, a vertex (Baerentzen, Aanaes, Signed distance computation
//! using the angle weighted pseudonormal, 2005), in f64.
//!
//! Departures: the caller's nearest face may be off by its rounding, so which feature of the face is nearest is found
//! again here, and where that is an edge, the face beyond the edge is asked too. Normals of edges and vertices are made
//! when they are asked for, which is seldom.

use crate::check::{Checked, Edges, NONE};
use crate::{MeshError, Pulse};
use glam::DVec3;

/// What lies beyond each edge of each face.
pub struct Pseudo {
    across: Vec<u32>,
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
    pub fn new(mesh: &Checked, pulse: &mut Pulse) -> Result<Self, MeshError> {
        Ok(Self { across: Edges::new(&mesh.faces, mesh.vertices.len(), pulse)?.across })
    }

    /// Whether `p`, nearest to `face`, is inside.
    pub fn inside(&self, mesh: &Checked, p: [f64; 3], face: u32) -> bool {
        let p = DVec3::from(p);
        let (mut face, mut at) = (face as usize, foot(p, &mesh.points(face as usize)));
        // Around a vertex it may take several steps, each of which comes nearer.
        for _ in 0..16 {
            let Feature::Edge(k) = at.feature else { break };
            let beyond = self.across[3 * face + k];
            if beyond == NONE {
                break;
            }
            let next = foot(p, &mesh.points(beyond as usize / 3));
            if !(next.squared < at.squared) {
                break;
            }
            (face, at) = (beyond as usize / 3, next);
        }
        let normal = match at.feature {
            Feature::Face => normal(&mesh.points(face)),
            Feature::Edge(k) => self.edge(mesh, face, k),
            Feature::Corner(k) => self.corner(mesh, face, k),
        };
        (p - at.point).dot(normal) < 0.0
    }

    /// The sum of the normals on both sides of an edge.
    fn edge(&self, mesh: &Checked, face: usize, k: usize) -> DVec3 {
        let own = normal(&mesh.points(face));
        match self.across[3 * face + k] {
            NONE => own,
            beyond => own + normal(&mesh.points(beyond as usize / 3)),
        }
    }

    /// The sum of the normals around a corner, each by the angle that its face has there.
    fn corner(&self, mesh: &Checked, face: usize, k: usize) -> DVec3 {
        let vertex = mesh.faces[face][k];
        let mut sum = weighted(mesh, face, k);
        // Around by the edge that leaves the corner; from an open end back by the one that enters.
        for start in [k, (k + 2) % 3] {
            let (mut from, mut edge) = (face, start);
            for _ in 0..mesh.faces.len() {
                let beyond = self.across[3 * from + edge];
                if beyond == NONE {
                    break;
                }
                let (next, entered) = (beyond as usize / 3, beyond as usize % 3);
                if next == face {
                    return sum;
                }
                let Some(at) = (0..3).find(|&at| mesh.faces[next][at] == vertex) else { break };
                sum += weighted(mesh, next, at);
                // Of the two edges at the vertex, the one by which it wasn't entered.
                (from, edge) = (next, if entered == at { (at + 2) % 3 } else { at });
            }
        }
        sum
    }
}

fn weighted(mesh: &Checked, face: usize, k: usize) -> DVec3 {
    let corners = mesh.points(face);
    normal(&corners) * angle(&corners, k)
}

/// The nearest point of a face with an area.
pub fn foot(p: DVec3, corners: &[DVec3; 3]) -> Foot {
    let normal = normal(corners);
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
