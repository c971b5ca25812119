//! What a scene costs a driver to compile, in operations of its shader; measured, not derived.

use sdfrs_core::op::Op;

/// Operations of an op once it is inlined, roughly.
pub fn cost(op: Op) -> usize {
    match op {
        Op::Sin | Op::Cos | Op::Exp | Op::Log | Op::Atan | Op::Atan2 => 35,
        Op::Tan | Op::Asin | Op::Acos => 50,
        Op::Sphere => 10,
        Op::Box => 30,
        Op::Torus | Op::Ellipsoid => 15,
        Op::Cylinder | Op::Capsule => 25,
        Op::Cone => 45,
        Op::Gyroid => 200,
        Op::SphereUnion => 25,
        Op::Mandelbulb | Op::Texture | Op::TextureSafe | Op::TextureSafeNegated => 150,
        Op::Smin | Op::Smax | Op::Repeat => 9,
        Op::Dot | Op::Length3 | Op::MulMulAdd | Op::MulMulSub => 6,
        _ => 2,
    }
}
