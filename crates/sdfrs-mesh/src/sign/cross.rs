//! Does a vertical line pass through a face, and is a point above it? Exactly, by adaptive predicates (Shewchuk,
//! Adaptive precision floating-point arithmetic and fast robust geometric predicates, 1997).
//!
//! A line through an edge or a vertex is moved by (e, e^2) for an e smaller than anything (Edelsbrunner, Muecke,
//! Simulation of simplicity, 1990): it passes through one of the faces there, or through none, and a closed mesh is left
//! as often as it is entered. Vertical faces are never met.

use robust::{Coord, Coord3D, orient2d, orient3d};

pub type Face = [[f64; 3]; 3];

fn flat(p: [f64; 3]) -> Coord<f64> {
    Coord { x: p[0], y: p[1] }
}

/// 1 for a face that looks up, -1 for one that looks down, 0 for a vertical one.
#[inline]
pub fn facing(face: &Face) -> i32 {
    sign(orient2d(flat(face[0]), flat(face[1]), flat(face[2])))
}

/// Whether the line at `at` passes through a face that looks `facing`.
#[inline]
pub fn meets(face: &Face, facing: i32, at: [f64; 2]) -> bool {
    let p = Coord { x: at[0], y: at[1] };
    (0..3).all(|k| {
        let (a, b) = (flat(face[k]), flat(face[(k + 1) % 3]));
        let side = match sign(orient2d(a, b, p)) {
            // The derivatives of the area by e and, where that is none, by e^2.
            0 if a.y != b.y => sign(a.y - b.y),
            0 => sign(b.x - a.x),
            side => side,
        };
        side == facing
    })
}

/// Whether `p` is above the plane of a face that looks `facing`.
#[inline]
pub fn above(face: &Face, facing: i32, p: [f64; 3]) -> bool {
    let deep = |[x, y, z]: [f64; 3]| Coord3D { x, y, z };
    // Positive below a face that looks up.
    sign(orient3d(deep(face[0]), deep(face[1]), deep(face[2]), deep(p))) == -facing
}

fn sign(x: f64) -> i32 {
    i32::from(x > 0.0) - i32::from(x < 0.0)
}
