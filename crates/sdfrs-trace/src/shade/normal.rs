//! Normals: the field's exact gradient at the hit, by dual numbers, at unit length.
//!
//! Where the gradient is zero or not a number the normal faces the ray, so that shading has a
//! direction everywhere. Law: on a sphere it is the direction from the centre (tests in `render`).

use sdfrs_core::{Real, Scalar};

/// 1 where a gradient has a direction: all three are finite and one of them is not zero; 0 elsewhere.
#[inline(always)]
pub fn aimed<R: Real>([x, y, z]: [R; 3]) -> R {
    let infinity = R::splat(R::S::INFINITY);
    let (zero, one) = (R::c(0.0), R::c(1.0));
    let largest = x.abs().max(y.abs()).max(z.abs());
    let mut aimed = R::select_lt(zero, largest, one, zero);
    aimed = R::select_lt(x.abs(), infinity, aimed, zero);
    aimed = R::select_lt(y.abs(), infinity, aimed, zero);
    R::select_lt(z.abs(), infinity, aimed, zero)
}

/// The gradient at unit length, or the way back along the ray where it has no direction.
#[inline(always)]
pub fn unit<R: Real>(g: [R; 3], direction: [R; 3]) -> [R; 3] {
    let [x, y, z] = g;
    let aimed = aimed(g);
    let scale = moderate(x.abs().max(y.abs()).max(z.abs()));
    let (x, y, z) = (x * scale, y * scale, z * scale);
    let length = R::len3(x, y, z);
    let half = R::c(0.5);
    [
        R::select_lt(half, aimed, x / length, -direction[0]),
        R::select_lt(half, aimed, y / length, -direction[1]),
        R::select_lt(half, aimed, z / length, -direction[2]),
    ]
}

/// What a vector with this largest component is multiplied by before it is squared, so that nothing overflows or
/// vanishes: a power of two, mostly 1, so nothing is rounded either, and nothing divided.
#[inline(always)]
pub fn moderate<R: Real>(largest: R) -> R {
    // Exponents of f32 go from -149 to 127, those of f64 from -1074 to 1023.
    let step = if size_of::<R::S>() == 4 { 1 } else { 8 };
    let power = |exponent: i32| R::c(2f64.powi(step * exponent));
    let (small, large) = (power(-50), power(50));
    R::select_lt(largest, small, power(100), R::select_lt(large, largest, power(-100), R::c(1.0)))
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

    #[test]
    fn vectors_of_any_size_have_a_direction() {
        fn run<T: Scalar>(exponents: std::ops::Range<i32>) {
            let of = |v: f64| T::of(v);
            let ahead = [of(1.0), of(0.0), of(0.0)];
            let want = [of(2.0 / 7.0), of(-3.0 / 7.0), of(6.0 / 7.0)];
            for exponent in exponents {
                // Of the smallest numbers the reciprocal would be infinite.
                let power = 2f64.powi(exponent / 2) * 2f64.powi(exponent - exponent / 2);
                let n = unit([of(2.0 * power), of(-3.0 * power), of(6.0 * power)], ahead);
                for (n, want) in n.iter().zip(want) {
                    assert!((*n - want).abs() <= T::EPS, "2^{exponent}: {n:?} for {want:?}");
                }
            }
        }
        // From the smallest to the largest numbers.
        run::<f32>(-149..125);
        run::<f64>(-1074..1021);
    }
}
