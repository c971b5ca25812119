//! Shapes sampled into grids: every node is the shape's value, every far brick holds a true bound.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Random, build, moved, num, vec3};
use sdfrs_core::{
    Control, Grid, Shape,
    bake::{Plan, bake, total},
    grid::{BRICK, Step, Stepping, bricks_along},
};

const DIMS: [usize; 3] = [53, 41, 38];

fn scene() -> Shape {
    let ball = moved(&build("sphere", &[("radius", num(0.6))], &[]), 0.3, 0.1, 0.0);
    let cut = build("box", &[("size", vec3(0.7, 0.9, 0.5))], &[]);
    build("difference", &[("k", num(0.0))], &[&ball, &cut])
}

fn sample(shape: &Shape, band: Option<f64>) -> Grid {
    let plan = Plan { dims: DIMS, lo: [-1.0, -0.9, -0.8], hi: [1.2, 0.9, 0.8], band, wide: false };
    let control = Control::new();
    let grid = bake(shape, &plan, u64::MAX, &control).unwrap();
    assert!(control.done() <= total(&plan) && control.done() + 2 * 2048 >= total(&plan));
    grid
}

fn node(grid: &Grid, at: [usize; 3]) -> [f64; 3] {
    std::array::from_fn(|a| grid.bounds().0[a] + grid.spacing()[a] * at[a] as f64)
}

#[test]
fn every_node_is_the_shapes_value() {
    let (shape, h) = (scene(), 2.2 / 52.0);
    let (dense, sparse) = (sample(&shape, None), sample(&shape, Some(0.0)));
    let points: Vec<_> = (0..DIMS.iter().product::<usize>())
        .map(|i| [i % DIMS[0], i / DIMS[0] % DIMS[1], i / DIMS[0] / DIMS[1]])
        .collect();
    let values = common::values(&shape, &points.iter().map(|p| node(&dense, *p)).collect::<Vec<_>>());
    let mut far = 0;
    for (at, value) in points.iter().zip(values) {
        let stored: f64 = dense.node(*at);
        assert!((stored - value).abs() <= dense.claim().max_error.max(1e-9), "{stored} {value}");
        let stored: f64 = sparse.node(*at);
        if stored != f64::from(value as f32) {
            far += 1;
            assert!(
                stored.abs() <= value.abs() + 1e-9 && stored * value > 0.0 && value.abs() > 4.0 * h * 0.99
            );
        }
    }
    assert!(far > 10_000, "{far}");
    assert!(dense.claim().max_error > 0.0 && dense.claim().max_error < 1e-7);
}

#[test]
fn a_steep_shape_is_walked_by_its_own_slope() {
    // Three times the distance: both rules divide by it.
    let x = scene();
    let two = build("displace", &[], &[&x, &x]);
    let steep = build("displace", &[], &[&two, &x]);
    assert_eq!(steep.lipschitz(), 3.0);
    let mut random = Random(4);
    for band in [None, Some(0.0)] {
        for stepping in [Stepping::Safe, Stepping::Bricks] {
            let grid = sample(&steep, band).with_stepping(stepping);
            let (mut reach, mut whole) = (0.0, 0.0);
            for _ in 0..2000 {
                let p = random.point(0.7);
                let r: f64 = grid.sample(p, Step::Safe);
                let d = common::values(&x, &[p])[0];
                // The interpolant's zero set is within half a diagonal of the shape's.
                assert!(r.abs() <= d.abs() + grid.diagonal() / 2.0, "{r} {d}");
                (reach, whole) = (reach + r.abs(), whole + d.abs());
            }
            assert!(reach > 0.45 * whole, "{stepping:?}: {reach} of {whole}");
        }
    }
}

#[test]
fn sparse_needs_a_bound_and_sizes_are_checked_first() {
    let x = build("x", &[], &[]);
    let wild = build("mul", &[], &[&x, &build("mul", &[], &[&x, &x])]);
    let plan = Plan { dims: [9; 3], lo: [-1.0; 3], hi: [1.0; 3], band: Some(0.0), wide: false };
    let shape = build("formula", &[("lipschitz", num(3.0))], &[&wild]);
    assert!(bake(&shape, &plan, u64::MAX, &Control::new()).is_ok());
    let spoilt = [
        Plan { dims: [1, 9, 9], ..plan },
        Plan { dims: [70_000, 9, 9], ..plan },
        Plan { dims: [60_000; 3], band: None, ..plan },
        Plan { lo: [2.0; 3], ..plan },
        Plan { hi: [f64::INFINITY; 3], ..plan },
        Plan { band: Some(-1.0), ..plan },
        Plan { band: Some(f64::NAN), ..plan },
    ];
    for plan in spoilt {
        assert!(bake(&shape, &plan, 1 << 30, &Control::new()).is_err(), "{plan:?}");
    }
    let control = Control::new();
    control.cancel();
    assert!(bake(&shape, &plan, u64::MAX, &control).is_err());
}

#[test]
fn bricks_of_a_large_grid_are_few() {
    let plan = Plan { dims: [257; 3], lo: [-1.0; 3], hi: [1.0; 3], band: Some(0.0), wide: false };
    let grid = bake(&scene(), &plan, u64::MAX, &Control::new()).unwrap();
    let all: usize = bricks_along([257; 3]).iter().product();
    let kept = grid.bricks().unwrap().kept();
    assert!(kept * 8 < all && kept > 500, "{kept} of {all}");
    assert_eq!(257, 32 * BRICK + 1);
}

#[test]
fn what_reaches_beyond_the_band_is_refused() {
    let sparse = Shape::texture(sample(&scene(), Some(0.0))).unwrap();
    let dense = Shape::texture(sample(&scene(), None)).unwrap();
    let band = sparse.meta().band;
    assert!(band > 0.1 && band < 1.0 && dense.meta().band == f64::INFINITY);
    let ball = build("sphere", &[("radius", num(0.3))], &[]);
    let ask = |op: &str, name: &str, v: f64, children: Vec<Shape>| {
        Shape::build(op, vec![(name.to_owned(), num(v))], children)
    };
    for (tex, far) in [(&sparse, false), (&dense, true)] {
        for (part, allowed) in [(0.9, true), (1.1, far)] {
            let by = band * part;
            let two = vec![tex.clone(), ball.clone()];
            for made in [
                ask("dilate", "radius", by, vec![tex.clone()]),
                ask("dilate", "radius", -by, vec![tex.clone()]),
                ask("shell", "thickness", 2.0 * by, vec![tex.clone()]),
                ask("union", "k", by, two.clone()),
                ask("difference", "k", by, two),
            ] {
                assert_eq!(made.is_ok(), allowed, "{made:?}");
            }
        }
    }
    let half = build("scale", &[("factors", vec3(0.5, 0.5, 0.5))], &[&sparse]);
    assert_eq!(half.meta().band, band / 2.0);
    let once = ask("dilate", "radius", 0.6 * band, vec![sparse]).unwrap();
    assert!(ask("dilate", "radius", 0.6 * band, vec![once]).is_err());
}
