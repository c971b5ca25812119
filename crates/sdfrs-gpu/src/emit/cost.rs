//! What a scene costs a driver to compile, in operations of its shader (measured, not derived), and how often its
//! loops go around.

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

/// Most rounds of loops in an evaluation of an op or its gradient, whose constants are `values`.
pub fn loops(op: Op, values: &[f64]) -> u64 {
    let constant = |i: usize| values.get(i).map_or(0, |v| *v as u64);
    match op {
        Op::SphereUnion => values.len() as u64 / 4,
        // Powers by squaring: 8 rounds at most for exponents up to 16, four of them; one by one: two.
        Op::Mandelbulb => constant(1) * (40 + 2 * constant(0)),
        // A slope across a cell takes six samples.
        Op::Texture | Op::TextureSafe | Op::TextureSafeNegated => 6,
        _ => 0,
    }
}
