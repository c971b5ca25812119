//! A triangle as the kernels want it: a frame in which it lies in the plane z = 0 with its longest edge on the x axis,
//! the foot of the third corner at the origin.
//!
//! The longest edge has acute angles at both ends, so the foot lies on it. The line from the third corner through the
//! foot projects onto itself, hence no point on one side of it has its closest point on the other: by |x| each half is
//! a right triangle with corners (0, 0), (w, 0) and (0, h), and of its edges only the base (for y < 0) and the
//! hypotenuse (for y >= 0) can be closest. That is 43 operations for a squared distance, with no division or branch.
//! Frames are computed in f64 and rounded once.

use glam::DVec3;

use crate::lanes::Halves;

#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct Tri {
    /// The foot.
    pub origin: [f32; 3],
    /// Rows of the rotation into the frame.
    pub e: [[f32; 3]; 3],
    pub halves: Halves,
    /// The middle of the triangle's box, each axis times its weight (see `Bound`).
    pub mid: [f32; 3],
    /// The largest weighted L1 distance of a corner from the middle, rounded up.
    pub reach: f32,
}

/// Rounded up, with room for the rounding of what it is compared with.
pub fn up(x: f64) -> f32 {
    (x * (1.0 + 1e-6)) as f32 + f32::MIN_POSITIVE
}

/// A unit vector at right angles to `e`.
fn perpendicular(e: DVec3) -> DVec3 {
    e.any_orthonormal_vector()
}

impl Tri {
    pub fn new(corners: [DVec3; 3], weights: DVec3) -> Self {
        let edge = |k: usize| (corners[(k + 1) % 3] - corners[k]).length_squared();
        let first = (1..3).fold(0, |best, k| if edge(k) > edge(best) { k } else { best });
        let (a, b, c) = (corners[first], corners[(first + 1) % 3], corners[(first + 2) % 3]);
        let base = (b - a).length();
        let e1 = if base > 0.0 { (b - a) / base } else { DVec3::X };
        let foot = (c - a).dot(e1).clamp(0.0, base);
        let (height, e2) = upright(c - a, e1, foot);
        let e3 = e1.cross(e2);
        let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
        let mid = (lo + hi) * 0.5;
        let reach = corners.iter().map(|v| ((*v - mid).abs() * weights).element_sum()).fold(0.0, f64::max);
        Self {
            origin: (a + foot * e1).as_vec3().to_array(),
            e: [e1, e2, e3].map(|e| e.as_vec3().to_array()),
            halves: Halves::new([base - foot, foot], height),
            mid: (mid * weights).as_vec3().to_array(),
            reach: up(reach),
        }
    }
}

/// How far `c` stands off the line along `e1`, and in which direction. Cleaned of `e1` twice: in a sliver the first
/// difference cancels nearly all digits.
fn upright(c: DVec3, e1: DVec3, foot: f64) -> (f64, DVec3) {
    let off = c - foot * e1;
    let off = off - off.dot(e1) * e1;
    let height = off.length();
    if !(height > 1e-30) {
        return (0.0, perpendicular(e1));
    }
    let e2 = off / height;
    let e2 = e2 - e2.dot(e1) * e1;
    match e2.try_normalize() {
        Some(e2) if e2.dot(e1).abs() < 1e-12 => (height, e2),
        _ => (0.0, perpendicular(e1)),
    }
}

/// Triangles of a cluster in an oriented box, flat along their mean normal.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct Slab {
    pub middle: [f32; 3],
    /// Half axes.
    pub axes: [[f32; 3]; 3],
    /// A corner of the mesh in it, near the middle.
    pub corner: [f32; 3],
    /// The middle, each axis times its weight.
    pub mid: [f32; 3],
    /// Weighted L1 length of all half axes together, rounded up.
    pub reach: f32,
}

impl Slab {
    /// Around all `corners` (three a triangle).
    pub fn new(corners: &[DVec3], weights: DVec3) -> Self {
        let normal: DVec3 = corners.chunks_exact(3).map(|t| (t[1] - t[0]).cross(t[2] - t[0])).sum();
        let e3 = normal.try_normalize().unwrap_or(DVec3::Z);
        let (u, v) = e3.any_orthonormal_pair();
        let e1 = longest(corners, u, v);
        let e2 = e3.cross(e1);
        let first = corners.first().copied().unwrap_or_default();
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for c in corners {
            let d = *c - first;
            let local = DVec3::new(d.dot(e1), d.dot(e2), d.dot(e3));
            (lo, hi) = (lo.min(local), hi.max(local));
        }
        // Room for rounding to f32: of the axes, and of the middle.
        let size = corners.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max);
        let (mid, half) = ((lo + hi) * 0.5, (hi - lo) * (0.5 * (1.0 + 1e-6)) + 3e-7 * size);
        let middle = first + mid.x * e1 + mid.y * e2 + mid.z * e3;
        let axes = [half.x * e1, half.y * e2, half.z * e3];
        let reach: f64 = axes.iter().map(|a| (a.abs() * weights).element_sum()).sum();
        let nearest = |best: DVec3, c: &DVec3| {
            if (*c - middle).length_squared() < (best - middle).length_squared() { *c } else { best }
        };
        let corner = corners.iter().fold(first, nearest);
        Self {
            middle: middle.as_vec3().to_array(),
            axes: axes.map(|a| a.as_vec3().to_array()),
            corner: corner.as_vec3().to_array(),
            mid: (middle * weights).as_vec3().to_array(),
            reach: up(reach),
        }
    }
}

/// The direction in the plane of `u` and `v` along which the corners spread most: the principal axis of their moments.
fn longest(corners: &[DVec3], u: DVec3, v: DVec3) -> DVec3 {
    let n = corners.len().max(1) as f64;
    let mean = corners.iter().sum::<DVec3>() / n;
    let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
    for c in corners {
        let (x, y) = ((*c - mean).dot(u), (*c - mean).dot(v));
        (uu, uv, vv) = (uu + x * x, uv + x * y, vv + y * y);
    }
    let angle = 0.5 * (2.0 * uv).atan2(uu - vv);
    (angle.cos() * u + angle.sin() * v).normalize_or(u)
}
