//! How far a stored value can be from the true distance of its node.
//!
//! In the descent's frame nodes are within 1 and the mesh within C along each axis; u = 2^-24, L is the longest edge, d the
//! distance, so that |p - F| <= d + L for a triangle's foot F. Rounding moves the point against the triangle by
//! - sqrt(3) u: the node's coordinates;
//! - sqrt(3) u C: the foot's;
//! - (sqrt(3) + 1 + 3 sqrt(3)) u (d + L): the rows of the rotation, the difference p - F, three products and their sums;
//! - 9 u (d + L): the edges' lengths and normals, and the products with them;
//! - 2.5 u d: squares, their sum, the root.
//!
//! The scale back to world units is a power of two, and the filters leave as much room on either side, so no triangle
//! that is nearest goes missing. In all u (2 + 2 C + 17 L + 20 d), rounded up; measured: a twentieth of that.
//! Law: `tests/exact.rs`.

const U: f64 = (f32::EPSILON / 2.0) as f64;

/// Part of the bound that doesn't grow with the distance: what filters leave for either side of a comparison, on top of
/// parts of the squares.
pub fn slack(size: f64, longest: f64) -> f64 {
    U * (2.0 + 2.0 * size + 18.0 * longest)
}

/// For nodes at most `farthest` from the mesh.
pub fn bound(size: f64, longest: f64, farthest: f64) -> f64 {
    slack(size, longest) + 20.0 * U * farthest
}
