//! The solid angle of a triangle (Van Oosterom, Strackee, The solid angle of a plane triangle, 1983), and the
//! generalised winding number as their sum over 4 pi, in f64.
//!
//! Closed by a fan of triangles over its open edges, a mesh has a whole number. So the exact number of an open one is
//! that whole number, which any good guess rounds to, less the fan's: a sum over open edges rather than all faces.

use crate::check::{Checked, Edges};
use crate::{MeshError, Pulse};
use glam::DVec3;
use std::f64::consts::TAU;

/// As (y, x) of half the solid angle: positive where the point looks at the face from behind.
#[inline(always)]
pub fn half_angle(p: DVec3, corners: &[DVec3; 3]) -> (f64, f64) {
    let (a, b, c) = (corners[0] - p, corners[1] - p, corners[2] - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    // By edges: a . (b x c) itself cancels where the face is small and far.
    let y = a.dot((b - a).cross(c - a));
    let x = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    (y, x)
}

/// By all faces.
pub fn winding(mesh: &Checked, p: [f64; 3]) -> f64 {
    let p = DVec3::from(p);
    let sum: f64 = (0..mesh.faces.len())
        .map(|face| {
            let (y, x) = half_angle(p, &mesh.points(face));
            y.atan2(x)
        })
        .sum();
    sum / TAU
}

/// The fan that closes a mesh.
#[derive(Default)]
pub struct Rim {
    apex: DVec3,
    /// Ends in the fan's order, and how often.
    edges: Vec<([DVec3; 2], f64)>,
}

impl Rim {
    pub fn new(mesh: &Checked, pulse: &mut Pulse) -> Result<Self, MeshError> {
        let found = Edges::new(&mesh.faces, mesh.vertices.len(), pulse)?;
        let edges: Vec<([DVec3; 2], f64)> = found
            .surplus
            .iter()
            .map(|&(h, surplus)| {
                let (face, k) = (mesh.points(h as usize / 3), h as usize % 3);
                // The fan's triangles run the other way.
                ([face[(k + 1) % 3], face[k]], f64::from(surplus))
            })
            .collect();
        let middle = edges.iter().map(|(ends, _)| 0.5 * (ends[0] + ends[1])).sum::<DVec3>();
        Ok(Self { apex: middle / edges.len().max(1) as f64, edges })
    }

    /// How many triangles the fan has.
    pub fn len(&self) -> usize {
        self.edges.len()
    }

    /// The exact number, if `guess` is good enough to tell the whole one.
    pub fn exact(&self, p: [f64; 3], guess: f64) -> Option<f64> {
        let p = DVec3::from(p);
        let sum: f64 = self
            .edges
            .iter()
            .map(|&([u, v], times)| {
                let (y, x) = half_angle(p, &[u, v, self.apex]);
                times * y.atan2(x)
            })
            .sum();
        let (fan, whole) = (sum / TAU, (guess + sum / TAU).round());
        ((guess + fan - whole).abs() < 0.1).then_some(whole - fan)
    }
}
