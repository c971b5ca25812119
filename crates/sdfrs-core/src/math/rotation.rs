//! Rotation matrices, rows first.

use super::Math;

pub type Matrix = [[f64; 3]; 3];

/// Rotation by `angle` radians about an axis, right-handed (Rodrigues).
pub fn rotation(angle: f64, axis: &[f64; 3]) -> Matrix {
    let len = (axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]).sqrt();
    let [x, y, z] = axis.map(|v| v / len);
    let (s, c) = (angle.m_sin(), angle.m_cos());
    let m = 1.0 - c;
    [
        [m * x * x + c, m * x * y - z * s, m * x * z + y * s],
        [m * x * y + z * s, m * y * y + c, m * y * z - x * s],
        [m * x * z - y * s, m * y * z + x * s, m * z * z + c],
    ]
}
