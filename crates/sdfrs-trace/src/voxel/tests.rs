#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use sdfrs_core::{
    Control, Grid, GridValues, Limits, Program, Prune, Rays, Shape, Span, Value,
    bake::{Plan, bake},
    grid::{Claim, Store},
};

use super::*;

const LIMITS: Limits = Limits { eps: 1e-9, cone: 0.0, max_steps: 4000, prune: Prune::Off };

fn csg() -> Shape {
    let ball = Shape::build("sphere", vec![("radius".into(), Value::Num(0.7))], vec![]).unwrap();
    let size = ("size".into(), Value::Vec3([1.0, 0.5, 1.4]));
    let cut = Shape::build("box", vec![size], vec![]).unwrap();
    Shape::build("difference", vec![("k".into(), Value::Num(0.0))], vec![ball, cut]).unwrap()
}

fn baked(band: Option<f64>) -> Grid {
    let plan = Plan { dims: [60, 50, 55], lo: [-1.0; 3], hi: [1.0, 0.9, 1.0], band, wide: band.is_none() };
    bake(&csg(), &plan, u64::MAX, &Control::new()).unwrap()
}

/// Rays from all around towards points near the middle, some missing.
fn rays(n: usize) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let mut state = 5u64;
    let mut unit = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    };
    let (mut origins, mut directions) = (Vec::new(), Vec::new());
    for i in 0..n {
        let o: [f64; 3] = std::array::from_fn(|_| 3.0 * unit());
        let mut d: [f64; 3] = std::array::from_fn(|a| unit() - o[a]);
        if i % 10 == 0 {
            // Along an axis, on walls between cells too.
            d = [0.0; 3];
            d[i / 10 % 3] = if o[i / 10 % 3] > 0.0 { -1.0 } else { 1.0 };
        }
        let len = d.iter().map(|v| v * v).sum::<f64>().sqrt();
        origins.push(o);
        directions.push(d.map(|v| v / len));
    }
    (origins, directions)
}

fn run<T: Native>(shape: &Shape, rays: &(Vec<[f64; 3]>, Vec<[f64; 3]>), limits: &Limits) -> Hits<T> {
    let program = Program::<T>::for_tracing(shape).unwrap();
    let [origins, directions] =
        [&rays.0, &rays.1].map(|v| v.iter().map(|v| v.map(T::of)).collect::<Vec<_>>());
    let rays = Rays {
        origins: &origins,
        directions: &directions,
        t_min: Span::All(T::of(0.0)),
        t_max: Span::All(T::of(20.0)),
    };
    let tracer = Tracer::from_parts("basic", None, None, None, None, true).unwrap();
    trace(shape, &program, &tracer, &rays, limits, &Control::new()).unwrap()
}

#[test]
fn hits_are_those_of_a_patient_march() {
    let rays = rays(4000);
    for band in [None, Some(0.0)] {
        let grid = baked(band);
        let exact = Shape::texture(grid.with_stepping(Stepping::Voxel)).unwrap();
        let walked = Shape::texture(grid.with_stepping(Stepping::Safe)).unwrap();
        let fine = Limits { eps: 1e-11, max_steps: 100_000, ..LIMITS };
        let (a, b) = (run::<f64>(&exact, &rays, &LIMITS), run::<f64>(&walked, &rays, &fine));
        let (mut hits, mut steps) = (0, [0u64; 2]);
        for i in 0..rays.0.len() {
            // A march ends 1e-11 before the surface, and calls a hit what passes as near by it.
            let near = (a.t[i] - b.t[i]).abs() < 1e-7 || a.t[i] == b.t[i];
            assert!(near || b.status[i] == Status::OutOfSteps as u8, "{i}: {} {}", a.t[i], b.t[i]);
            hits += usize::from(a.status[i] == Status::Hit as u8);
            steps = [steps[0] + u64::from(a.steps[i]), steps[1] + u64::from(b.steps[i])];
        }
        assert!(hits > 1000 && hits < 3900, "{hits}");
        assert!(steps[0] < steps[1], "{steps:?}");
        // In f32 all but what grazes is the same within a hundredth of a cell.
        let c = run::<f32>(&exact, &rays, &LIMITS);
        let off = |i: &usize| a.status[*i] != c.status[*i] || (a.t[*i] - f64::from(c.t[*i])).abs() > 3e-4;
        let wrong = (0..rays.0.len()).filter(|i| a.t[*i].is_finite() && off(i)).count();
        assert!(wrong <= 4, "{wrong}");
    }
}

#[test]
fn placements_keep_the_parameter() {
    let grid = baked(None).with_stepping(Stepping::Voxel);
    let build = |op: &str, args: Vec<(&str, Value)>, s: Shape| {
        Shape::build(op, args.into_iter().map(|(n, v)| (n.to_owned(), v)).collect(), vec![s]).unwrap()
    };
    let place = |s: Shape| {
        let s = build("scale", vec![("factors", Value::Vec3([1.5, 0.8, 1.1]))], s);
        let s = build("rotate", vec![("angle", Value::Num(0.7)), ("axis", Value::Vec3([1.0, 2.0, -0.5]))], s);
        build("translate", vec![("offset", Value::Vec3([0.3, -0.2, 0.6]))], s)
    };
    let exact = place(Shape::texture(grid.clone()).unwrap());
    assert!(placed(&exact).is_some());
    let walked = place(Shape::texture(grid.with_stepping(Stepping::Safe)).unwrap());
    assert!(placed(&walked).is_none());
    let rays = rays(1000);
    let fine = Limits { eps: 1e-11, max_steps: 100_000, ..LIMITS };
    let (a, b) = (run::<f64>(&exact, &rays, &LIMITS), run::<f64>(&walked, &rays, &fine));
    let hits = a.t.iter().filter(|t| t.is_finite()).count();
    assert!(hits > 300, "{hits}");
    for i in 0..1000 {
        assert!((a.t[i] - b.t[i]).abs() < 1e-6 || a.t[i] == b.t[i], "{i}: {} {}", a.t[i], b.t[i]);
    }
}

#[test]
fn starts_inside_cut_solids_and_budgets() {
    // Solid everywhere: the box itself is the surface.
    let values = GridValues::F64(Arc::new(vec![-1.0; 27]));
    let claim = Claim { lipschitz: Some(1.0), max_error: 0.0 };
    let grid = Grid::with_claim(Store::Dense(values), [3; 3], [-1.0; 3], [1.0; 3], claim).unwrap();
    let solid = Shape::texture(grid.with_stepping(Stepping::Voxel)).unwrap();
    let all = (vec![[0.0, 0.0, 5.0], [0.1, 0.2, 0.3], [9.0, 9.0, 5.0]], vec![[0.0, 0.0, -1.0]; 3]);
    let hits = run::<f64>(&solid, &all, &LIMITS);
    assert_eq!(hits.t, [4.0, 0.0, f64::INFINITY]);
    assert_eq!(hits.status, [1, 1, 0]);
    assert_eq!(hits.flags, [0, FLAG_INSIDE, 0]);
    let shape = Shape::texture(baked(None).with_stepping(Stepping::Voxel)).unwrap();
    let hits = run::<f64>(
        &shape,
        &(vec![[0.9, 0.85, 3.0]], vec![[0.0, 0.0, -1.0]]),
        &Limits { max_steps: 1, ..LIMITS },
    );
    assert_eq!((hits.status[0], hits.steps[0]), (Status::OutOfSteps as u8, 1));
}
