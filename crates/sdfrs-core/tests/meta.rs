//! Bounds by rule hold: no pair of points is steeper than a node's Lipschitz bound, no solid point
//! lies outside its box, and intervals contain the values of every point of their box.
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use common::{Random, everything, values};
use sdfrs_core::{Program, Scratch, Shape, eval::interval};

const REACH: f64 = 2.5;
/// Turning these fields about an axis has no certified slope far from them.
const UNBOUNDED_SLOPE: [&str; 4] = ["twist(ellipsoid)", "bend(ellipsoid)", "twist(texture)", "bend(texture)"];

#[test]
fn no_pair_is_steeper_than_the_bound() {
    let mut random = Random(1);
    for (name, shape) in everything() {
        // The Mandelbulb's estimate and the field around a solid cut by a texture's box are known to jump.
        if name == "mandelbulb" {
            continue;
        }
        let n = 20_000;
        let a: Vec<_> = (0..n).map(|_| random.point(REACH)).collect();
        let b: Vec<_> = a
            .iter()
            .map(|p| {
                let h = 10f64.powf(random.within(-6.0, 0.0));
                let d = random.point(h);
                [p[0] + d[0], p[1] + d[1], p[2] + d[2]]
            })
            .collect();
        if !shape.lipschitz().is_finite() {
            assert!(UNBOUNDED_SLOPE.contains(&name.as_str()), "{name} has no bound");
            continue;
        }
        let (fa, fb) = (values(&shape, &a), values(&shape, &b));
        for i in 0..n {
            let dist = (0..3).map(|k| (a[i][k] - b[i][k]).powi(2)).sum::<f64>().sqrt();
            let (rise, allowed) = ((fa[i] - fb[i]).abs(), shape.lipschitz() * dist * (1.0 + 1e-9) + 1e-13);
            assert!(
                rise <= allowed,
                "{name}: {:?} to {:?} rises {rise} over {dist}, bound {}",
                a[i],
                b[i],
                shape.lipschitz()
            );
        }
    }
}

#[test]
fn no_solid_point_lies_outside_the_box() {
    let mut random = Random(2);
    for (name, shape) in everything() {
        let (lo, hi) = shape.bounds();
        let points: Vec<_> = (0..20_000).map(|_| random.point(REACH)).collect();
        for (p, v) in points.iter().zip(values(&shape, &points)) {
            let inside = (0..3).all(|i| p[i] >= lo[i] - 1e-9 && p[i] <= hi[i] + 1e-9);
            assert!(v > 0.0 || inside, "{name}: {p:?} is solid ({v}) outside {lo:?} to {hi:?}");
        }
    }
}

#[test]
fn a_bound_is_a_number_however_deep_the_turns() {
    let mut shape = everything()[1].1.clone();
    for i in 0..4 {
        let op = if i % 2 == 0 { "twist" } else { "bend" };
        shape = common::build(op, &[("rate", common::num(0.3))], &[&shape]);
        assert!(shape.lipschitz() >= 1.0, "{op} at depth {i}: {}", shape.lipschitz());
    }
    let refused = Program::<f64>::for_tracing(&shape).map(|_| ()).unwrap_err();
    assert!(refused.to_string().contains("with_lipschitz"), "{refused}");
}

#[test]
fn boxes_are_not_idle() {
    // The law above holds trivially for infinite boxes: bounded shapes must stay bounded.
    for (name, shape) in everything() {
        let (lo, hi) = shape.bounds();
        let finite = lo.iter().chain(&hi).all(|v| v.is_finite());
        let unbounded = name.starts_with("plane") || name.starts_with("gyroid") || name.starts_with("negate");
        assert_eq!(finite, !unbounded, "{name}: {lo:?} to {hi:?}");
    }
}

#[test]
fn intervals_contain_every_value() {
    let mut random = Random(3);
    for (name, shape) in everything() {
        for _ in 0..60 {
            let (c, h) = (random.point(REACH), 10f64.powf(random.within(-3.0, 0.3)));
            let lo = c.map(|v| v - h);
            let hi = c.map(|v| v + h);
            let (least, most) = interval(&shape, lo, hi).unwrap();
            let points: Vec<[f64; 3]> =
                (0..100).map(|_| std::array::from_fn(|i| random.within(lo[i], hi[i]))).collect();
            for (p, v) in points.iter().zip(values(&shape, &points)) {
                assert!(least <= v && v <= most, "{name}: {v} at {p:?} is outside {least} to {most}");
            }
        }
    }
}

fn has_texture(shape: &Shape) -> bool {
    shape.op() == "texture" || shape.children().iter().any(has_texture)
}

#[test]
fn intervals_shrink_with_their_box() {
    for (name, shape) in everything() {
        let width = |h: f64| {
            let (a, b) =
                interval(&shape, [0.81 - h, 0.57 - h, 0.33 - h], [0.81 + h, 0.57 + h, 0.33 + h]).unwrap();
            b - a
        };
        // A texture's range is that of whole cells.
        if name != "mandelbulb" && !has_texture(&shape) {
            assert!(width(1e-4) < 0.02, "{name}: {} wide", width(1e-4));
        }
    }
}

#[test]
fn duals_give_the_slope_and_the_bits_of_the_value() {
    let mut random = Random(4);
    for (name, shape) in everything() {
        let points: Vec<_> = (0..500).map(|_| random.point(REACH)).collect();
        let p: [Vec<f64>; 3] = std::array::from_fn(|i| points.iter().map(|p| p[i]).collect());
        let mut g: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; points.len()]);
        let [v, gx, gy, gz] = &mut g;
        Program::<f64>::values(&shape).unwrap().gradient(
            &mut Scratch::new(),
            [&p[0], &p[1], &p[2]],
            [v, gx, gy, gz],
        );
        assert!(
            g[0].iter().zip(values(&shape, &points)).all(|(a, b)| a.to_bits() == b.to_bits()),
            "{name}: values"
        );
        let h = 1e-6;
        let mut wrong = 0;
        for axis in 0..3 {
            let shifted = |by: f64| -> Vec<[f64; 3]> {
                points
                    .iter()
                    .map(|p| {
                        let mut p = *p;
                        p[axis] += by;
                        p
                    })
                    .collect()
            };
            let (up, down) = (values(&shape, &shifted(h)), values(&shape, &shifted(-h)));
            for i in 0..points.len() {
                let slope = (up[i] - down[i]) / (2.0 * h);
                wrong += usize::from((slope - g[axis + 1][i]).abs() > 1e-4 * (1.0 + slope.abs()));
            }
        }
        // Points next to a crease differ; of the fractal's many more.
        let allowed = if name == "mandelbulb" { 300 } else { 8 };
        assert!(wrong <= allowed, "{name}: {wrong} of 1500 slopes differ from differences");
    }
}
