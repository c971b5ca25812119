//! The law of fusing: a program of pairs and chains gives every bit of the one without, and its runs
//! and chains reach into the next pack as they should.
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use common::{Random, build, everything, moved, num, vec3};
use sdfrs_core::{
    Program, Real, Scratch, Shape,
    graph::{Form, Graph, INPUTS},
    op::{Op, execute},
    tape::Tape,
};

/// A random formula: every step takes earlier values, most of them once.
fn formula(random: &mut Random, steps: usize) -> Shape {
    let mut values: Vec<Shape> = ["x", "y", "z"].iter().map(|n| build(n, &[], &[])).collect();
    for _ in 0..steps {
        let pick = |random: &mut Random, values: &mut Vec<Shape>| {
            let i = random.within(0.0, values.len() as f64) as usize;
            if i > 2 && random.within(0.0, 1.0) < 0.7 { values.swap_remove(i) } else { values[i].clone() }
        };
        let a = pick(random, &mut values);
        let b = pick(random, &mut values);
        let constant = build("const", &[("value", num(random.within(-2.0, 2.0)))], &[]);
        let ops =
            ["add", "sub", "mul", "mul", "min", "max", "neg", "square", "sqrt", "mul_c", "add_c", "cut"];
        let next = match ops[random.within(0.0, ops.len() as f64) as usize] {
            op @ ("neg" | "square" | "sqrt") => build(op, &[], &[&a]),
            "mul_c" => build("mul", &[], &[&a, &constant]),
            "add_c" => build("add", &[], &[&a, &constant]),
            "cut" => build("max", &[], &[&a, &build("neg", &[], &[&b])]),
            op => build(op, &[], &[&a, &b]),
        };
        values.push(next);
    }
    values.into_iter().reduce(|a, b| build("add", &[], &[&a, &b])).unwrap()
}

/// A random tree of twenty primitives, joined in every way.
fn csg(random: &mut Random) -> Shape {
    let mut shapes: Vec<Shape> = (0..20)
        .map(|i| {
            let shape = match i % 4 {
                0 => build("sphere", &[("radius", num(0.4))], &[]),
                1 => build("box", &[("size", vec3(0.8, 0.6, 0.7))], &[]),
                2 => build("torus", &[("major", num(0.5)), ("minor", num(0.1))], &[]),
                _ => build("cylinder", &[("radius", num(0.2)), ("height", num(1.4))], &[]),
            };
            let [x, y, z] = random.point(1.0);
            moved(&shape, x, y, z)
        })
        .collect();
    while shapes.len() > 1 {
        let b = shapes.pop().unwrap();
        let i = random.within(0.0, shapes.len() as f64) as usize;
        let op = ["union", "difference", "intersection"][random.within(0.0, 3.0) as usize];
        let k = if random.unit() < 0.5 { 0.0 } else { 0.1 };
        shapes[i] = build(op, &[("k", num(k))], &[&shapes[i], &b]);
    }
    shapes.remove(0)
}

/// The graph's ops one by one, one point after the other.
#[allow(unsafe_code)]
fn plain<T: Real<S = T> + sdfrs_core::Scalar>(shape: &Shape, points: &[[f64; 3]]) -> Vec<T> {
    let tape = Tape::<T>::plain(&Graph::new(shape, Form::Value).unwrap());
    let mut slots = vec![T::of(0.0); tape.slots()];
    let one = |p: &[f64; 3]| {
        for axis in 0..INPUTS as usize {
            slots[axis] = T::of(p[axis]);
        }
        for ins in tape.instructions() {
            // SAFETY: the tape is checked, and there is one value for each of its slots.
            unsafe { execute::<T>(ins, slots.as_mut_ptr(), 1, &tape.tables()) };
        }
        slots[tape.root()]
    };
    points.iter().map(one).collect()
}

macro_rules! same {
    ($t:ty, $shape:expr, $name:expr, $points:expr) => {{
        // Which NaN it is, nobody promises.
        let bits = |v: &[$t]| v.iter().map(|v| if v.is_nan() { 0 } else { v.to_bits() }).collect::<Vec<_>>();
        let expected = bits(&plain::<$t>($shape, $points));
        let program = Program::<$t>::values($shape).unwrap();
        let p: [Vec<$t>; 3] = std::array::from_fn(|i| $points.iter().map(|p| p[i] as $t).collect());
        for n in [1, 16, 33, 300] {
            let mut out = vec![0.0; n];
            program.evaluate(&mut Scratch::new(), [&p[0][..n], &p[1][..n], &p[2][..n]], &mut out);
            assert_eq!(bits(&out), expected[..n], "{} at {n} points", $name);
        }
        program
    }};
}

#[test]
fn a_fused_program_has_the_bits_of_the_plain_one() {
    let mut random = Random(3);
    let points: Vec<_> = (0..300).map(|_| random.point(1.5)).collect();
    let mut shapes = everything();
    let [x, y, z] = ["x", "y", "z"].map(|n| build(n, &[], &[]));
    let area = build("sub", &[], &[&build("mul", &[], &[&x, &y]), &build("mul", &[], &[&y, &z])]);
    shapes.push(("area".to_string(), area));
    for i in 0..60 {
        shapes.push(("formula".to_string(), formula(&mut random, 10 + 2 * i)));
    }
    for _ in 0..20 {
        shapes.push(("csg".to_string(), csg(&mut random)));
    }
    let mut seen = Vec::new();
    let (mut runs, mut chains) = (0, 0);
    for (name, shape) in &shapes {
        same!(f32, shape, name, &points);
        let program = same!(f64, shape, name, &points);
        for ins in program.tape().instructions() {
            seen.push(ins.op);
            runs += usize::from(ins.run > 1 && !ins.op.joins());
            chains += usize::from(ins.run > 1 && ins.op.joins());
        }
    }
    let forgotten: Vec<_> = Op::FUSED.iter().filter(|op| !seen.contains(op)).collect();
    assert!(forgotten.is_empty(), "no program here has {forgotten:?}");
    assert!(runs > 20 && chains > 20, "{runs} runs, {chains} chains");
}

/// Parts that many others need, far apart in the program, and 20,000 steps in a row.
#[test]
fn long_formulas_are_arranged_in_time() {
    let x = build("x", &[], &[]);
    let mut early = build("min", &[], &[&x, &build("y", &[], &[])]);
    let mut value = build("sin", &[], &[&x]);
    for i in 0..20_000 {
        let step = build("const", &[("value", num(1.0 + f64::from(i % 7)))], &[]);
        value = build(["add", "mul", "div"][i as usize % 3], &[], &[&value, &step]);
        if i % 1000 == 0 {
            early = build("max", &[], &[&early, &value]);
        }
    }
    let start = std::time::Instant::now();
    same!(f64, &build("add", &[], &[&early, &value]), "long", &[[0.3, 0.4, 0.5]; 300]);
    assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
}
