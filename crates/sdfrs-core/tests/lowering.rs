//! What lowering promises: the right value, each part once, no depth too deep, the same bits for any
//! batch size and instruction set.
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use common::{Random, build, everything, moved, num, values, vec3};
use sdfrs_core::{Program, Scratch, Shape, Value, eval::Isa, op::Op};

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn primitives_are_distances() {
    let p = [0.9, -1.3, 0.4];
    let at = |s: &Shape| values(s, &[p])[0];
    let sphere = build("sphere", &[("radius", num(0.5))], &[]);
    assert_eq!(at(&sphere), distance(p, [0.0; 3]) - 0.5);
    let cube = build("box", &[("size", vec3(1.0, 1.0, 1.0))], &[]);
    assert!((at(&cube) - distance(p, [0.5, -0.5, 0.4])).abs() < 1e-15);
    let cylinder = build("cylinder", &[("radius", num(0.5)), ("height", num(2.0))], &[]);
    let rim = 0.9f64.hypot(0.4) - 0.5;
    assert!((at(&cylinder) - rim.hypot(0.3)).abs() < 1e-15);
    let plane = build("plane", &[("normal", vec3(0.0, 3.0, 4.0)), ("point", vec3(1.0, 1.0, 1.0))], &[]);
    assert!((at(&plane) - (0.6 * -2.3 + 0.8 * -0.6)).abs() < 1e-15);
    let torus = build("torus", &[("major", num(1.0)), ("minor", num(0.25))], &[]);
    assert!((at(&torus) - ((0.9f64.hypot(0.4) - 1.0).hypot(1.3) - 0.25)).abs() < 1e-15);
}

#[test]
fn cone_is_the_distance_to_its_outline() {
    let (r0, r1, half) = (0.8, 0.2, 0.6);
    let cone =
        build("cone", &[("radius", num(r0)), ("height", num(2.0 * half)), ("top_radius", num(r1))], &[]);
    // Outline in the half plane: axis to rim, side, rim to axis.
    let outline = [[0.0, -half], [r0, -half], [r1, half], [0.0, half]];
    let mut random = Random(5);
    for _ in 0..2000 {
        let (q, y) = (random.within(0.0, 1.5), random.within(-1.5, 1.5));
        let to_segment = |a: [f64; 2], b: [f64; 2]| {
            let d = [b[0] - a[0], b[1] - a[1]];
            let s = (((q - a[0]) * d[0] + (y - a[1]) * d[1]) / (d[0] * d[0] + d[1] * d[1])).clamp(0.0, 1.0);
            (q - a[0] - s * d[0]).hypot(y - a[1] - s * d[1])
        };
        let away = (0..3).map(|i| to_segment(outline[i], outline[i + 1])).fold(f64::INFINITY, f64::min);
        let inside = y.abs() < half && q < r0 + (r1 - r0) * (y + half) / (2.0 * half);
        let expected = if inside { -away } else { away };
        let got = values(&cone, &[[q * 0.6, y, q * 0.8]])[0];
        assert!((got - expected).abs() < 1e-12, "at q {q}, y {y}: {got}, not {expected}");
    }
}

/// Repetition equals the minimum over many copies placed by hand.
#[test]
fn repetition_is_the_nearest_copy() {
    let mut random = Random(6);
    let ball = build("sphere", &[("radius", num(0.2))], &[]);
    let bar = build("box", &[("size", vec3(0.9, 0.2, 0.3))], &[]);
    let shapes = [
        ball.clone(),
        moved(&ball, 0.27, -0.1, 0.2),
        moved(&ball, 0.45, 0.3, -0.45),
        build("rotate", &[("angle", num(0.6)), ("axis", vec3(0.0, 1.0, 0.3))], &[&bar]),
        moved(&bar, 0.4, 0.0, 0.1),
    ];
    for (i, s) in shapes.iter().enumerate() {
        for count in [None, Some([1, 2, 0])] {
            let limit = count.map_or(Value::None, Value::Ints3);
            let period = [1.0, 0.0, 1.3];
            let repeated = build("repeat", &[("period", Value::Vec3(period)), ("count", limit)], &[s]);
            let points: Vec<_> = (0..3000).map(|_| random.point(3.0)).collect();
            let got = values(&repeated, &points);
            let mut expected = vec![f64::INFINITY; points.len()];
            let n = |a: usize| count.map_or(6, |c: [i64; 3]| c[a]);
            for cx in -n(0)..=n(0) {
                for cz in -n(2)..=n(2) {
                    let copy = moved(s, cx as f64 * period[0], 0.0, cz as f64 * period[2]);
                    for (e, v) in expected.iter_mut().zip(values(&copy, &points)) {
                        *e = e.min(v);
                    }
                }
            }
            for (k, (a, b)) in got.iter().zip(&expected).enumerate() {
                // Inside an overlap of copies the minimum over copies is the field, too.
                assert!((a - b).abs() < 1e-12, "shape {i}, count {count:?}, {:?}: {a}, not {b}", points[k]);
            }
        }
    }
}

#[test]
fn unbounded_shapes_are_not_repeated() {
    let plane = build("plane", &[("normal", vec3(1.0, 1.0, 0.0)), ("point", vec3(0.0, 0.0, 0.0))], &[]);
    let args = vec![("period".into(), vec3(1.0, 0.0, 0.0)), ("count".into(), Value::None)];
    let error = Shape::build("repeat", args, vec![plane]).unwrap_err();
    assert!(error.to_string().contains("unbounded along x"), "{error}");
}

#[test]
fn a_union_of_spheres_is_one_op() {
    let ball = build("sphere", &[("radius", num(0.2))], &[]);
    let mut random = Random(7);
    let balls: Vec<Shape> = (0..500)
        .map(|_| {
            let [x, y, z] = random.point(2.0);
            moved(&ball, x, y, z)
        })
        .collect();
    let flat = build("union", &[("k", num(0.0))], &balls.iter().collect::<Vec<_>>());
    let nested =
        balls[1..].iter().fold(balls[0].clone(), |a, b| build("union", &[("k", num(0.0))], &[&a, b]));
    for s in [&flat, &nested] {
        assert_eq!(Program::<f32>::values(s).unwrap().tape().instructions().len(), 1);
    }
    let points: Vec<_> = (0..200).map(|_| random.point(2.0)).collect();
    let mut expected = vec![f64::INFINITY; points.len()];
    for b in &balls {
        for (e, v) in expected.iter_mut().zip(values(b, &points)) {
            *e = e.min(v);
        }
    }
    assert_eq!(values(&flat, &points), expected);
}

#[test]
fn shared_parts_are_evaluated_once() {
    let mut s = build("torus", &[("major", num(1.0)), ("minor", num(0.2))], &[]);
    for _ in 0..60 {
        s = build("union", &[("k", num(0.1))], &[&s, &s]);
    }
    assert!(Program::<f64>::values(&s).unwrap().tape().instructions().len() <= 61);
}

#[test]
fn a_hundred_thousand_levels() {
    let ball = build("sphere", &[("radius", num(0.5))], &[]);
    let ops: [fn(&Shape, usize) -> Shape; 4] = [
        |s, _| moved(s, 1e-5, 0.0, 0.0),
        |s, i| build("union", &[("k", num(0.0))], &[s, &moved(s, 0.0, 1.3f64.powi(i as i32), 0.0)]),
        |s, _| build("dilate", &[("radius", num(1e-6))], &[s]),
        |s, _| build("negate", &[], &[s]),
    ];
    for (kind, op) in ops.iter().enumerate() {
        let deep = if kind == 1 { 40 } else { 100_000 };
        let s = (0..deep).fold(ball.clone(), |s, i| op(&s, i));
        if kind == 1 {
            // Doubling 40 times is more than any tape: refused, not attempted.
            let Err(error) = Program::<f64>::values(&s) else { panic!("a tape of 2^40 spheres") };
            assert!(error.to_string().contains("expands"), "{error}");
            continue;
        }
        assert!(values(&s, &[[2.0, 0.0, 0.0]])[0].is_finite());
        drop(s);
    }
}

#[test]
fn any_batch_gives_the_same_bits() {
    let mut random = Random(8);
    for (name, shape) in everything() {
        let points: Vec<_> = (0..131).map(|_| random.point(2.0)).collect();
        let p: [Vec<f32>; 3] = std::array::from_fn(|i| points.iter().map(|p| p[i] as f32).collect());
        let program = Program::<f32>::values(&shape).unwrap();
        let mut scratch = Scratch::new();
        let mut whole = vec![0.0; points.len()];
        program.evaluate(&mut scratch, [&p[0], &p[1], &p[2]], &mut whole);
        for i in 0..points.len() {
            let mut one = [0.0];
            program.evaluate(&mut scratch, [&p[0][i..=i], &p[1][i..=i], &p[2][i..=i]], &mut one);
            assert_eq!(one[0].to_bits(), whole[i].to_bits(), "{name} at {:?}", points[i]);
        }
    }
}

/// Values and gradients, in both precisions, at batch lengths that end inside and at the end of packs.
#[test]
fn any_instruction_set_gives_the_same_bits() {
    let sets: Vec<Isa> = Isa::available().collect();
    assert!(sets.contains(&Isa::Baseline));
    macro_rules! same {
        ($t:ty, $shape:expr, $name:expr, $points:expr) => {{
            let program = Program::<$t>::values($shape).unwrap();
            let p: [Vec<$t>; 3] = std::array::from_fn(|i| $points.iter().map(|p| p[i] as $t).collect());
            let mut scratch = Scratch::new();
            for n in [1, 16, 100, 300] {
                let q = [&p[0][..n], &p[1][..n], &p[2][..n]];
                let mut run = |isa: Isa| {
                    let mut all: [Vec<$t>; 5] = std::array::from_fn(|_| vec![0.0; n]);
                    let [v, w, x, y, z] = &mut all;
                    program.evaluate_on(isa, &mut scratch, q, v);
                    program.gradient_on(isa, &mut scratch, q, [w, x, y, z]);
                    // Which NaN it is, nobody promises.
                    all.map(|v| {
                        v.iter().map(|v| if v.is_nan() { 0 } else { v.to_bits() }).collect::<Vec<_>>()
                    })
                };
                let expected = run(Isa::Baseline);
                assert_eq!(expected[0], expected[1], "{}: a dual's value", $name);
                for isa in &sets {
                    assert_eq!(run(*isa), expected, "{} on {} at {n} points", $name, isa.name());
                }
            }
        }};
    }
    let mut random = Random(9);
    for (name, shape) in everything() {
        let points: Vec<_> = (0..300).map(|_| random.point(2.0)).collect();
        same!(f32, &shape, name, points);
        same!(f64, &shape, name, points);
    }
}

#[test]
fn a_texture_is_walked_by_its_safe_step_wherever_it_stands() {
    let tex = Shape::texture(common::grid(9)).unwrap();
    let far = build("sphere", &[("radius", num(0.01))], &[]);
    let far = moved(&far, 50.0, 0.0, 0.0);
    let at = |s: &Shape| {
        let program = Program::<f64>::for_tracing(s).unwrap();
        let mut out = [0.0];
        program.evaluate(&mut Scratch::new(), [&[0.7], &[0.1], &[0.2]], &mut out);
        out[0]
    };
    let v = values(&tex, &[[0.7, 0.1, 0.2]])[0];
    let safe = f64::max(v / 3f64.sqrt(), v - 3f64.sqrt() * 0.25);
    assert_eq!(at(&tex), safe);
    assert_eq!(at(&build("union", &[("k", num(0.0))], &[&tex, &far])), safe);
    assert_eq!(at(&moved(&tex, 0.0, 0.0, 0.0)), safe);
    assert_eq!(at(&build("with_lipschitz", &[("lipschitz", num(1.0))], &[&tex])), v);
    assert_eq!(at(&build("with_lipschitz", &[("lipschitz", num(2.0))], &[&tex])), v / 2.0);
    // A steep part is slowed by its own bound, not its neighbours.
    let steep = build("with_lipschitz", &[("lipschitz", num(4.0))], &[&far]);
    assert_eq!(at(&build("union", &[("k", num(0.0))], &[&tex, &moved(&steep, 9e3, 0.0, 0.0)])), safe);
    // A smooth blend mixes values: there the whole field is divided by its slope instead.
    let blended = build("union", &[("k", num(0.1))], &[&tex, &far]);
    assert_eq!(at(&blended), v / blended.lipschitz());
}

/// A sphere looks the same from all sides: a turn costs no coordinates, and spheres that turn together stay one union.
#[test]
fn a_turned_sphere_is_only_moved() {
    let ball = build("sphere", &[("radius", num(0.3))], &[]);
    let turn = |s: &Shape| build("rotate", &[("angle", num(0.7)), ("axis", vec3(1.0, 2.0, -0.5))], &[s]);
    let balls =
        build("union", &[("k", num(0.0))], &[&moved(&ball, 1.0, 0.2, 0.0), &moved(&ball, 0.0, -0.9, 0.4)]);
    let turned = build("union", &[("k", num(0.0))], &[&turn(&turn(&balls)), &ball]);
    let program = Program::<f64>::values(&turned).unwrap();
    let ops: Vec<_> = program.tape().instructions().iter().map(|i| i.op).collect();
    assert_eq!(ops, [Op::SphereUnion, Op::Sphere, Op::Min]);
    // By a cube's rounded corner the same turn is seen as coordinates.
    let cubes = build("rounded_box", &[("size", vec3(0.6, 0.6, 0.6)), ("radius", num(0.3))], &[]);
    let cubes =
        build("union", &[("k", num(0.0))], &[&moved(&cubes, 1.0, 0.2, 0.0), &moved(&cubes, 0.0, -0.9, 0.4)]);
    let cubes = build("union", &[("k", num(0.0))], &[&turn(&turn(&cubes)), &ball]);
    let mut random = common::Random(6);
    let points: Vec<_> = (0..300).map(|_| random.point(2.0)).collect();
    for ((a, b), p) in
        common::values(&turned, &points).iter().zip(common::values(&cubes, &points)).zip(&points)
    {
        assert!((a - b).abs() < 1e-14, "{p:?}: {a} and {b}");
    }
}
