//! The frame in which all work is done, and which faces have an area.

use crate::{Mesh, MeshError, Pulse};
use glam::DVec3;

/// world = centre + scale * unit
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    pub centre: [f64; 3],
    pub scale: f64,
}

/// Which vertices `faces` have.
pub fn used(mesh: &Mesh, faces: &[[u32; 3]], pulse: &mut Pulse) -> Result<Vec<bool>, MeshError> {
    let mut used = vec![false; mesh.vertices.len()];
    for face in faces {
        pulse.beat()?;
        for &v in face {
            used[v as usize] = true;
        }
    }
    Ok(used)
}

/// The box of the `used` vertices; inside out where there are none.
pub fn bounds(mesh: &Mesh, used: &[bool]) -> ([f64; 3], [f64; 3]) {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for (p, _) in mesh.vertices.iter().zip(used).filter(|(_, used)| **used) {
        for axis in 0..3 {
            lo[axis] = lo[axis].min(p[axis]);
            hi[axis] = hi[axis].max(p[axis]);
        }
    }
    (lo, hi)
}

impl Frame {
    /// Halves first: the sum of two coordinates may be beyond f64.
    pub fn around((lo, hi): ([f64; 3], [f64; 3])) -> Self {
        let centre = std::array::from_fn(|axis| 0.5 * lo[axis] + 0.5 * hi[axis]);
        let half = (0..3).map(|axis| 0.5 * hi[axis] - 0.5 * lo[axis]).fold(0.0, f64::max);
        Self { centre, scale: power_of_two(half) }
    }

    pub fn unit(&self, p: [f64; 3]) -> [f64; 3] {
        // Adding zero makes -0 +0: one place, one bit pattern.
        std::array::from_fn(|axis| (p[axis] - self.centre[axis]) / self.scale + 0.0)
    }
}

/// The smallest power of two that isn't less than `x`; 1 for zero, the largest that f64 has at its end, and the
/// smallest with all its digits at the other.
fn power_of_two(x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let floor = f64::from_bits(x.to_bits() & 0x7ff0_0000_0000_0000).max(f64::MIN_POSITIVE);
    let up = if floor < x { 2.0 * floor } else { floor };
    if up.is_finite() { up } else { floor }
}

/// Whether a face has an area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flat {
    No,
    /// Two corners in one place.
    Collapsed,
    /// Three corners on a line, as far as f64 can tell.
    Needle,
}

pub fn flatness(corners: &[[f64; 3]; 3]) -> Flat {
    let [a, b, c] = corners;
    if a == b || b == c || c == a {
        return Flat::Collapsed;
    }
    // Halves: a difference may be beyond f64.
    let half =
        |p: &[f64; 3], q: &[f64; 3]| DVec3::from_array(std::array::from_fn(|i| 0.5 * q[i] - 0.5 * p[i]));
    let mut edges = [half(a, b), half(b, c), half(c, a)];
    let longest = edges.iter().map(|e| e.abs().max_element()).fold(0.0, f64::max);
    if longest == 0.0 {
        return Flat::Collapsed;
    }
    // Only where fourth powers would leave f64.
    if !(1e-60..1e60).contains(&longest) {
        edges = edges.map(|e| e / longest);
    }
    let [u, v, w] = edges.map(|e| e.length_squared());
    // The product of the longer two of three; the shortest may be as good as zero.
    let sides = (u * v).max(v * w).max(w * u);
    // The error of the cross product is about 4 eps of that: below a few times as much the normal points anywhere.
    let limit = 32.0 * f64::EPSILON;
    if edges[0].cross(edges[1]).length_squared() <= limit * limit * sides { Flat::Needle } else { Flat::No }
}
