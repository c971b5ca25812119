//! How far a stored value can be from the true distance of its node.

/// In the descent's frame, where no coordinate is larger than `size`.
pub fn bound(size: f64) -> f64 {
    32.0 * size * f64::from(f32::EPSILON)
}
