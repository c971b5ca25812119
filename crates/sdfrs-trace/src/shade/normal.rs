//! Normals: the field's exact gradient at the hit, by dual numbers, at unit length.
//!
//! Where the gradient is zero or not a number the normal faces the ray, so that shading has a
//! direction everywhere. Law: on a sphere it is the direction from the centre (tests in `render`).

use sdfrs_core::{Real, Scalar};

/// The gradient at unit length, or the way back along the ray where it has no direction.
#[inline(always)]
pub fn unit<R: Real>(g: [R; 3], direction: [R; 3]) -> [R; 3] {
    let [x, y, z] = g;
    let infinity = R::splat(R::S::INFINITY);
    let (zero, one) = (R::c(0.0), R::c(1.0));
    let largest = x.abs().max(y.abs()).max(z.abs());
    // 1 where all three are finite and one of them is not zero.
    let mut usable = R::select_lt(zero, largest, one, zero);
    usable = R::select_lt(x.abs(), infinity, usable, zero);
    usable = R::select_lt(y.abs(), infinity, usable, zero);
    usable = R::select_lt(z.abs(), infinity, usable, zero);
    // Scaled first: squares of a tiny gradient would vanish.
    let (x, y, z) = (x / largest, y / largest, z / largest);
    let length = R::len3(x, y, z);
    let half = R::c(0.5);
    [
        R::select_lt(half, usable, x / length, -direction[0]),
        R::select_lt(half, usable, y / length, -direction[1]),
        R::select_lt(half, usable, z / length, -direction[2]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gradient_without_direction_faces_the_ray() {
        let d = [0.0, 0.6, 0.8];
        for g in [[0.0; 3], [f64::NAN, 1.0, 0.0], [1.0, 0.0, f64::NAN], [f64::INFINITY, 0.0, 0.0]] {
            assert_eq!(unit(g, d), [-0.0, -0.6, -0.8]);
        }
        assert_eq!(unit([1e-30f32, 0.0, 0.0], [0.0, 0.0, 1.0]), [1.0, 0.0, 0.0]);
        assert_eq!(unit([0.0, -3e38f32, 0.0], [0.0, 0.0, 1.0]), [0.0, -1.0, 0.0]);
    }
}
