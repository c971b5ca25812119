//! The solid angle of a triangle (Van Oosterom, Strackee, The solid angle of a plane triangle, 1983), and the
//! generalised winding number as their sum over 4 pi, in f64.

use crate::check::Checked;
use glam::DVec3;

/// As (y, x) of half the solid angle: positive where the point looks at the face from behind.
#[inline(always)]
pub fn half_angle(p: DVec3, corners: &[[f64; 3]; 3]) -> (f64, f64) {
    let [a, b, c] = corners.map(|v| DVec3::from(v) - p);
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
            let (y, x) = half_angle(p, &mesh.corners(face));
            y.atan2(x)
        })
        .sum();
    sum / std::f64::consts::TAU
}
