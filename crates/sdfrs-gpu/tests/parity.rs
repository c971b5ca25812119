//! The GPU's fields against the CPU's: every kind of shape, every op of the table, values and gradients.
//!
//! Strict mode is held to the bits; plain mode, whose sums a driver may regroup, to a few ulp.

#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use std::collections::BTreeSet;

use common::shapes::{Random, build, everything, grid, moved, num, primitives, vec3};
use sdfrs_core::{
    Grid, GridValues, Shape,
    graph::{Form, Graph, Node},
    op::Op,
    shape::Kind,
};
use sdfrs_gpu::{
    GpuField,
    emit::{emit, emit_in_parts, emit_interpreted},
};

/// Where two lists of numbers differ in bits; NaNs are one number, and so are zeros.
fn differences(a: &[f32], b: &[f32]) -> Vec<usize> {
    let bits = |v: f32| if v.is_nan() { u32::MAX } else { (v + 0.0).to_bits() };
    (0..a.len()).filter(|&i| bits(a[i]) != bits(b[i])).collect()
}

fn assert_bits(name: &str, points: &[[f32; 3]], gpu: &[f32], cpu: &[f32]) {
    let wrong = differences(gpu, cpu);
    if let Some(&i) = wrong.first() {
        let (p, n) = (points[i], wrong.len());
        panic!("{name}: {n} of {} differ, at {p:?}: GPU {:?}, CPU {:?}", gpu.len(), gpu[i], cpu[i]);
    }
}

/// Every formula step over operands that move, inside its domain and outside of it.
fn formulas() -> Vec<(String, Shape)> {
    let x = build("x", &[], &[]);
    let leaf = |name: &str| build(name, &[], &[]);
    let two = build("const", &[("value", num(2.0))], &[]);
    let mixed =
        build("add", &[], &[&build("mul", &[], &[&x, &two]), &build("mul", &[], &[&leaf("y"), &leaf("z")])]);
    let operands = [mixed, leaf("y"), leaf("z"), leaf("x")];
    let mut all = Vec::new();
    for name in Kind::formula_ops() {
        let arity = match name {
            "x" | "y" | "z" | "const" => continue,
            "length" => 2,
            _ => Op::ALL.iter().find(|op| op.name() == name).unwrap().arity(),
        };
        let children: Vec<&Shape> = operands[..arity].iter().collect();
        all.push((name.to_string(), build(name, &[], &children)));
        if name == "length" {
            all.push((
                "length of three".into(),
                build(name, &[], &[&operands[0], &operands[1], &operands[2]]),
            ));
        }
    }
    for name in ["add", "sub", "mul", "div"] {
        all.push((format!("{name} a constant"), build(name, &[], &[&operands[0], &two])));
    }
    all.push(("const".into(), two));
    all.push(("y".into(), leaf("y")));
    all
}

/// Shapes with ops that `everything` has not: tables, repetition, several grids, of both precisions.
fn others() -> Vec<(String, Shape)> {
    let ball = build("sphere", &[("radius", num(0.2))], &[]);
    let cube = build("box", &[("size", vec3(0.5, 0.3, 0.4))], &[]);
    let mut random = Random(5);
    let balls: Vec<Shape> = (0..40)
        .map(|_| {
            let [x, y, z] = random.point(1.5);
            moved(&ball, x, y, z)
        })
        .collect();
    let swarm = build("union", &[("k", num(0.0))], &balls.iter().collect::<Vec<_>>());
    let endless = sdfrs_core::Value::None;
    let repeat =
        |s: &Shape, count| build("repeat", &[("period", vec3(1.0, 0.0, 1.3)), ("count", count)], &[s]);
    let wide: Vec<f64> = (0..60).map(|i| f64::from(i) * 0.01 - 0.2).collect();
    let wide =
        Grid::new(GridValues::F64(wide.into()), [3, 4, 5], [-1.0, -0.5, -0.7], [0.4, 1.0, 0.9]).unwrap();
    let wide = Shape::texture(wide).unwrap();
    let narrow = Shape::texture(grid(5)).unwrap();
    let both = build("union", &[("k", num(0.0))], &[&wide, &moved(&narrow, 0.5, 0.0, 0.0)]);
    vec![
        ("spheres".into(), swarm),
        ("repeat".into(), repeat(&cube, endless)),
        ("repeat, few".into(), repeat(&cube, sdfrs_core::Value::Ints3([1, 2, 0]))),
        ("two grids".into(), both),
        ("inside out".into(), build("negate", &[], &[&narrow])),
    ]
}

/// Scenes of one op each that only tapes name: pairs which they fuse.
fn pairs() -> Vec<(String, Graph)> {
    Op::FUSED
        .iter()
        .map(|&op| {
            let n = op.constants().unwrap() as u32;
            let mut graph = Graph::default();
            graph.nodes.push(Node { op, a: [0, 1, 2, 1], k: 0, n });
            graph.consts = vec![1.7, 0.3];
            graph.root = 3;
            (op.name().to_string(), graph)
        })
        .collect()
}

#[test]
fn fused_pairs_have_the_cpus_bits() {
    let Some(device) = common::device() else { return };
    let points = common::points(100, 2.0);
    for (name, graph) in pairs() {
        let field = GpuField::of(&device, emit(&graph, true).unwrap()).unwrap();
        let cpu = common::run(&graph, &points);
        assert_bits(&name, &points, &field.evaluate(&points).unwrap(), &cpu);
        let values: Vec<f32> = field.gradient(&points).unwrap().iter().map(|g| g[3]).collect();
        assert_bits(&name, &points, &values, &cpu);
    }
}

fn all_shapes() -> Vec<(String, Shape)> {
    everything().into_iter().chain(others()).chain(formulas()).collect()
}

/// An op is in the table twice where the lowering has a shorter form: what it emits is what must be there.
#[test]
fn every_op_is_compared() {
    let mut seen = BTreeSet::new();
    for (_, shape) in all_shapes() {
        for form in [Form::Value, Form::Walk] {
            if !(shape.is_expr() && form == Form::Walk)
                && (form == Form::Value || shape.lipschitz().is_finite())
            {
                seen.extend(Graph::new(&shape, form).unwrap().nodes.iter().map(|n| n.op));
            }
        }
    }
    seen.extend(pairs().iter().map(|(_, graph)| graph.nodes[0].op));
    let missing: Vec<_> = Op::shared().filter(|op| !seen.contains(op)).map(|op| op.name()).collect();
    assert!(missing.is_empty(), "no scene of this test has {missing:?}");
}

#[test]
fn values_have_the_cpus_bits_in_strict_mode() {
    let Some(device) = common::device() else { return };
    let points = common::points(300, 2.0);
    for (name, shape) in all_shapes() {
        let field = GpuField::with(&device, &shape, Form::Value, true).unwrap();
        let cpu = common::values(&shape, &points);
        assert_bits(&name, &points, &field.evaluate(&points).unwrap(), &cpu);
    }
}

/// A comparison is worth what it can find.
#[test]
fn a_grown_scene_differs() {
    let Some(device) = common::device() else { return };
    let points = common::points(300, 2.0);
    let shape = build("torus", &[("major", num(0.8)), ("minor", num(0.25))], &[]);
    let grown = build("dilate", &[("radius", num(1e-6))], &[&shape]);
    let field = GpuField::with(&device, &grown, Form::Value, true).unwrap();
    let wrong = differences(&field.evaluate(&points).unwrap(), &common::values(&shape, &points));
    assert!(wrong.len() > points.len() / 2, "only {} of {} differ", wrong.len(), points.len());
}

/// What tracers walk: parts divided by their bounds, textures by their safe step.
#[test]
fn walks_have_the_cpus_bits_in_strict_mode() {
    let Some(device) = common::device() else { return };
    let points = common::points(300, 2.0);
    let tex = Shape::texture(grid(9)).unwrap();
    let hole = build("difference", &[("k", num(0.0))], &[&moved(&tex, 0.3, 0.0, 0.1), &tex]);
    let shapes =
        primitives().into_iter().map(|(n, s)| (n.to_string(), s)).chain([("hole".to_string(), hole)]);
    for (name, shape) in shapes {
        let field = GpuField::with(&device, &shape, Form::Walk, true).unwrap();
        let cpu = common::walk(&shape, &points);
        assert_bits(&name, &points, &field.evaluate(&points).unwrap(), &cpu);
    }
}

/// Plain mode: 8 ulp of the largest number around, which is all that regrouped sums can lose.
#[test]
fn plain_mode_is_within_a_few_ulp() {
    let Some(device) = common::device() else { return };
    let points = common::points(300, 2.0);
    for (name, shape) in primitives().into_iter().map(|(n, s)| (n.to_string(), s)).chain(others()) {
        let field = GpuField::new(&device, &shape).unwrap();
        let (gpu, cpu) = (field.evaluate(&points).unwrap(), common::values(&shape, &points));
        for (i, (a, b)) in gpu.iter().zip(&cpu).enumerate() {
            assert!((a - b).abs() <= 8.0 * 4.0 * f32::EPSILON, "{name} at {:?}: GPU {a}, CPU {b}", points[i]);
        }
    }
}

/// Gradients follow the CPU's branch by branch; their arithmetic is free.
#[test]
fn gradients_agree() {
    let Some(device) = common::device() else { return };
    // Random points alone: on a plane of symmetry the last bit decides which side's gradient it is.
    let points: Vec<_> = common::points(250, 2.0)[..250].to_vec();
    let few = |name: &str| !name.contains('(') || name.contains("(box)") || name.contains("(texture)");
    for (name, shape) in all_shapes().into_iter().filter(|(name, _)| few(name)) {
        let field = GpuField::with(&device, &shape, Form::Value, true).unwrap();
        let (gpu, cpu) = (field.gradient(&points).unwrap(), common::gradients(&shape, &points));
        let values: [Vec<f32>; 2] = [&gpu, &cpu].map(|g| g.iter().map(|g| g[3]).collect());
        assert_bits(&name, &points, &values[0], &values[1]);
        for (i, (a, b)) in gpu.iter().zip(&cpu).enumerate() {
            let size = b[..3].iter().fold(1f32, |m, v| m.max(v.abs()));
            let same = (0..3).all(|k| (a[k] - b[k]).abs() <= 2e-4 * size || (a[k].is_nan() && b[k].is_nan()));
            assert!(same || !size.is_finite(), "{name} at {:?}: GPU {a:?}, CPU {b:?}", points[i]);
        }
    }
}

/// Scenes longer than a function: values cross from part to part.
#[test]
fn long_scenes_are_split() {
    let Some(device) = common::device() else { return };
    let points = common::points(200, 2.0);
    let graph = Graph::new(&many(40, &mut Random(3)), Form::Value).unwrap();
    let shape = many(40, &mut Random(3));
    for part in [1, 7, 50] {
        let emitted = emit_in_parts(&graph, true, part).unwrap();
        assert!(emitted.text.contains("field_part0(p)") && emitted.text.contains("field_gradient_s0"));
        let field = GpuField::of(&device, emitted).unwrap();
        assert_bits("40 boxes", &points, &field.evaluate(&points).unwrap(), &common::values(&shape, &points));
        let (gpu, cpu) = (field.gradient(&points[..50]).unwrap(), common::gradients(&shape, &points[..50]));
        for (a, b) in gpu.iter().zip(&cpu) {
            assert!((0..3).all(|k| (a[k] - b[k]).abs() <= 1e-4), "GPU {a:?}, CPU {b:?}");
        }
    }
}

/// Boxes at random places, each its own op, and the minima of all.
fn many(n: usize, random: &mut Random) -> Shape {
    let boxes: Vec<Shape> = (0..n)
        .map(|_| {
            let size = vec3(random.within(0.05, 0.2), random.within(0.05, 0.2), random.within(0.05, 0.2));
            let [x, y, z] = random.point(1.8);
            moved(&build("box", &[("size", size)], &[]), x, y, z)
        })
        .collect();
    build("union", &[("k", num(0.0))], &boxes.iter().collect::<Vec<_>>())
}

/// What is too long to compile is interpreted; what an interpreter computes has the same bits.
#[test]
fn interpreted_scenes_have_the_same_bits() {
    let Some(device) = common::device() else { return };
    let points = common::points(100, 2.0);
    let one_of_each = |n: &str| matches!(n, "union(torus)" | "scale(box)" | "twist(texture)" | "shell(cone)");
    let shapes = all_shapes().into_iter().filter(|(n, _)| !n.contains('(') || one_of_each(n));
    for (name, shape) in shapes {
        let graph = Graph::new(&shape, Form::Value).unwrap();
        let field = GpuField::of(&device, emit_interpreted(&graph, true).unwrap()).unwrap();
        assert_bits(&name, &points, &field.evaluate(&points).unwrap(), &common::values(&shape, &points));
    }
}

#[test]
fn long_scenes_are_interpreted_by_one_text() {
    let Some(device) = common::device() else { return };
    let points = common::points(30, 2.0);
    let fields = [2600, 3000].map(|n| {
        let shape = many(n, &mut Random(n as u64));
        let field = GpuField::with(&device, &shape, Form::Value, true).unwrap();
        assert!(!field.emitted().compiled);
        assert_bits("boxes", &points, &field.evaluate(&points).unwrap(), &common::values(&shape, &points));
        let (gpu, cpu) = (field.gradient(&points[..20]).unwrap(), common::gradients(&shape, &points[..20]));
        for (a, b) in gpu.iter().zip(&cpu) {
            assert!((0..3).all(|k| (a[k] - b[k]).abs() <= 1e-4), "GPU {a:?}, CPU {b:?}");
        }
        field
    });
    assert_eq!(fields[0].emitted().text, fields[1].emitted().text);
}

/// Moving an object, or changing its size, is a matter of constants.
#[test]
fn moving_an_object_compiles_nothing() {
    let Some(device) = common::device() else { return };
    let ball = build("sphere", &[("radius", num(0.4))], &[]);
    let cube = build("box", &[("size", vec3(0.5, 0.3, 0.41))], &[]);
    let tex = Shape::texture(grid(6)).unwrap();
    let scene = |x: f64| {
        let turned = build("rotate", &[("angle", num(x)), ("axis", vec3(0.0, 1.0, 0.3))], &[&cube]);
        let parts = [moved(&ball, x, 0.1, 0.2), turned, moved(&tex, 0.7, x, 0.2)];
        build("union", &[("k", num(0.07))], &parts.iter().collect::<Vec<_>>())
    };
    let points = common::points(64, 2.0);
    let first = GpuField::new(&device, &scene(0.3)).unwrap();
    let at_first = first.evaluate(&points).unwrap();
    let key = first.emitted().key;
    for x in [0.31, 0.5, 0.9] {
        let field = GpuField::new(&device, &scene(x)).unwrap();
        assert_eq!(field.emitted().text, first.emitted().text);
        assert_eq!(field.emitted().key, key);
        // Other tests compile meanwhile: the pipeline itself is what must be the same.
        assert!(std::sync::Arc::ptr_eq(
            &field.pipeline("evaluate").unwrap(),
            &first.pipeline("evaluate").unwrap()
        ));
        assert_ne!(field.evaluate(&points).unwrap(), at_first);
    }
}
