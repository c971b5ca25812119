//! How fast fields change when a point turns about an axis: what twist and bend pay for.
//!
//! The gradient of a true distance points away from a solid point q, so its moment about an axis is
//! at most the solid's radius about it, however far the point. Fields that are only bounds of a
//! distance have no such limit: they must be declared (`with_lipschitz`).

use super::Aabb;
use crate::shape::{Kind, Shape, value::Axis};

const NONE: [f64; 3] = [f64::INFINITY; 3];
/// Axis, and the two across it.
const ACROSS: [[Axis; 2]; 3] = [[Axis::Y, Axis::Z], [Axis::X, Axis::Z], [Axis::X, Axis::Y]];

pub fn swing(kind: &Kind, children: &[Shape], bounds: &Aabb) -> [f64; 3] {
    let radius = ACROSS.map(|[a, b]| bounds.radius(a, b));
    let child = |f: &dyn Fn(&super::Meta) -> [f64; 3]| children.first().map_or(NONE, |c| f(c.meta()));
    let most = |i: usize| children.iter().map(|c| c.meta().swing[i]).fold(0.0, f64::max);
    match kind {
        Kind::Sphere { .. } => [0.0; 3],
        Kind::Torus { .. } | Kind::Cylinder { .. } | Kind::Cone { .. } => [radius[0], 0.0, radius[2]],
        Kind::Box { .. } | Kind::RoundedBox { .. } | Kind::Capsule { .. } | Kind::Mandelbulb { .. } => radius,
        Kind::Plane { normal, .. } => std::array::from_fn(|i| {
            let across = ACROSS[i].iter().any(|a| normal[*a as usize] != 0.0);
            if across { f64::INFINITY } else { 0.0 }
        }),
        Kind::Union { .. } | Kind::Intersection { .. } | Kind::Difference { .. } => std::array::from_fn(most),
        Kind::Negate {}
        | Kind::Dilate { .. }
        | Kind::Shell { .. }
        | Kind::WithBounds { .. }
        | Kind::Mirror { .. } => child(&|m| m.swing),
        Kind::WithLipschitz { .. } => child(&|m| m.swing),
        Kind::Translate { offset } => child(&|m| shifted(m, offset)),
        Kind::Elongate { amount } => child(&|m| shifted(m, amount)),
        Kind::Repeat { period, count } => {
            let far = |i: usize| {
                if period[i] > 0.0 {
                    count.map_or(f64::INFINITY, |c| (c[i] + 1) as f64 * period[i])
                } else {
                    0.0
                }
            };
            child(&|m| shifted(m, &std::array::from_fn(far)))
        }
        Kind::Rotate { angle, axis } => child(&|m| {
            let r = crate::math::rotation(*angle, axis);
            std::array::from_fn(|i| {
                (0..3).filter(|&j| r[i][j] != 0.0).map(|j| r[i][j].abs() * m.swing[j]).sum()
            })
        }),
        Kind::Scale { factors } => child(&|m| {
            let least = factors.iter().fold(f64::INFINITY, |a, b| a.min(*b));
            std::array::from_fn(|i| {
                let [a, b] = ACROSS[i].map(|a| factors[a as usize]);
                if a == b { m.swing[i] * least } else { f64::INFINITY }
            })
        }),
        Kind::Twist { .. } => child(&|m| [f64::INFINITY, m.swing[1], f64::INFINITY]),
        _ => NONE,
    }
}

/// Seen from an axis farther away.
fn shifted(m: &super::Meta, by: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let [a, b] = ACROSS[i].map(|a| by[a as usize]);
        m.swing[i] + if a == 0.0 && b == 0.0 { 0.0 } else { m.lip * a.hypot(b) }
    })
}
