//! Signs on whole and on damaged meshes, against the exact winding number summed here in another way.
//!
//! `cargo test --release -p sdfrs-mesh --test signs -- --ignored` asks a million points of each mesh.
#![allow(clippy::unwrap_used)]

#[path = "/work/wt/sign/crates/sdfrs-mesh/tests/signs/meshes.rs"]
mod meshes;

use meshes::*;
use rayon::prelude::*;
use sdfrs_mesh::Mesh;
use sdfrs_mesh::check::{Checked, check};
use sdfrs_mesh::sign::{Method, SignRule, Signs};
use std::f64::consts::PI;

type Point = [f64; 3];

fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The exact winding number of the mesh as given: solid angles as complex numbers, multiplied, with every turn counted.
fn winding(mesh: &Mesh, p: Point) -> f64 {
    let (mut re, mut im, mut turns) = (1.0_f64, 0.0_f64, 0.0);
    for f in &mesh.faces {
        let [a, b, c] = f.map(|v| minus(mesh.vertices[v as usize], p));
        let (u, v) = (minus(b, a), minus(c, a));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let (la, lb, lc) = (dot(a, a).sqrt(), dot(b, b).sqrt(), dot(c, c).sqrt());
        let (x, y) = (la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb, dot(a, normal));
        let size = x.hypot(y);
        if size == 0.0 {
            continue;
        }
        let (x, y) = (x / size, y / size);
        let next = (re * x - im * y, re * y + im * x);
        if y >= 0.0 && im >= 0.0 && next.1 < 0.0 {
            turns += 1.0;
        } else if y < 0.0 && im < 0.0 && next.1 >= 0.0 {
            turns -= 1.0;
        }
        (re, im) = next;
    }
    (im.atan2(re) / PI) / 2.0 + turns
}

/// Half of them anywhere in a box a fifth larger, half near the faces; in world units, and as the checked mesh has them.
fn points(checked: &Checked, n: usize, seed: u64) -> Vec<(Point, Point)> {
    let mut dice = Dice::new(seed);
    (0..n)
        .map(|i| {
            let unit = if i % 2 == 0 {
                dice.point(1.2)
            } else {
                let [a, b, c] = checked.corners(dice.below(checked.faces.len()));
                let (u, v, off) = (dice.unit(), dice.unit(), dice.point(0.02));
                std::array::from_fn(|k| {
                    a[k] + u * (b[k] - a[k]) + (1.0 - u) * v * (c[k] - a[k]) + off[k] * off[0].abs() * 50.0
                })
            };
            // As world has it: far away a world point has few digits.
            let world: Point = std::array::from_fn(|k| checked.centre[k] + checked.scale * unit[k]);
            (world, std::array::from_fn(|k| (world[k] - checked.centre[k]) / checked.scale))
        })
        .collect()
}

/// A name, the mesh, its undamaged form where the truth is promised, and the method that `Auto` has to pick.
fn damaged(level: u32) -> Vec<(&'static str, Mesh, Option<Mesh>, Method)> {
    use Method::{Pseudonormal, Winding};
    let ball = || icosphere(level);
    let ring = || torus(1.0, 0.4, 20 << (level / 2), 12 << (level / 2));
    let two = both(ball(), &moved(ball(), [0.7, 0.3, 0.2], 0.8));
    let all = [1.0, -2.0, 3.0];
    vec![
        ("1 % missing", holed(ball(), 0.01, 1), Some(ball()), Winding),
        ("5 % missing", holed(ring(), 0.05, 2), Some(ring()), Winding),
        ("20 % missing", holed(ball(), 0.2, 3), None, Winding),
        ("5 % cap missing", beheaded(ball(), 0.05), None, Winding),
        ("25 % cap missing", beheaded(ball(), 0.25), None, Winding),
        ("10 % flipped", flipped(ring(), 0.1, 4), None, Winding),
        ("30 % flipped", flipped(ball(), 0.3, 5), None, Winding),
        ("two overlapping balls", two, None, Winding),
        ("slivers", slivered(ring(), 0.1, 6), None, Winding),
        ("duplicated faces", doubled(ball(), 0.1, 7), Some(ball()), Pseudonormal),
        ("offset 1e6", moved(ring(), all.map(|x| 1e6 * x), 1.0), None, Pseudonormal),
        ("offset 1e8", moved(ring(), all.map(|x| 1e8 * x), 1.0), None, Pseudonormal),
        ("scale 1e-8", moved(ring(), [0.0; 3], 1e-8), None, Pseudonormal),
        ("scale 1e20", moved(ring(), [0.0; 3], 1e20), None, Pseudonormal),
    ]
}

/// What a rule gets wrong.
struct Wrong {
    method: Method,
    /// Points where it doesn't agree with the winding number.
    winding: usize,
    /// Points where it doesn't agree with the undamaged mesh.
    truth: usize,
    /// How far from the undamaged mesh's surface they are at most, of half the box.
    depth: f64,
}

fn compare(mesh: &Mesh, truth: Option<&Mesh>, rule: SignRule, n: usize) -> Wrong {
    let (checked, findings) = check(mesh).unwrap();
    let signs = Signs::new(&checked, &findings, rule).unwrap();
    let whole = truth.map(|truth| check(truth).unwrap());
    let whole =
        whole.as_ref().map(|(mesh, findings)| (mesh, Signs::new(mesh, findings, SignRule::Winding).unwrap()));
    let points = points(&checked, n, 99);
    let none = || Wrong { method: signs.method(), winding: 0, truth: 0, depth: 0.0 };
    let each = |points: &[(Point, Point)]| {
        let units: Vec<Point> = points.iter().map(|p| p.1).collect();
        let (mut inside, mut wrong) = (vec![false; units.len()], none());
        signs.inside_many(&units, &mut inside);
        for ((world, unit), &inside) in points.iter().zip(&inside) {
            assert_eq!(signs.inside(*unit, signs.nearest(*unit)), inside, "alone and among others");
            let w = winding(mesh, *world);
            wrong.winding += usize::from((w - 0.5).abs() > 1e-9 && inside != (w > 0.5));
            if let Some((whole, whole_signs)) = &whole
                && inside != (winding(truth.unwrap(), *world) > 0.5)
            {
                let p = std::array::from_fn(|k| (world[k] - whole.centre[k]) / whole.scale);
                let off = minus(whole_signs.nearest(p).point, p);
                wrong.truth += 1;
                wrong.depth = wrong.depth.max(dot(off, off).sqrt());
            }
        }
        wrong
    };
    points.par_chunks(500).map(each).reduce(none, |a, b| Wrong {
        winding: a.winding + b.winding,
        truth: a.truth + b.truth,
        depth: a.depth.max(b.depth),
        ..a
    })
}

/// The winding number of a mesh with holes is 1/2 in them: nearer to two missing neighbours than this, it may be wrong.
const SKIN: f64 = 2e-3;

#[test]
fn auto_agrees_with_the_exact_winding_number_on_damaged_meshes() {
    for (name, mesh, truth, method) in damaged(3) {
        let wrong = compare(&mesh, truth.as_ref(), SignRule::Auto, 8_000);
        assert_eq!(
            (wrong.method, wrong.winding),
            (method, 0),
            "{name}: method, wrong against the winding number"
        );
        assert!(
            wrong.depth < SKIN,
            "{name}: {} wrong against the truth, {} off the surface",
            wrong.truth,
            wrong.depth
        );
    }
}

#[test]
#[ignore = "minutes"]
fn a_million_points_of_each_damaged_mesh() {
    for (name, mesh, truth, method) in damaged(3) {
        let wrong = compare(&mesh, truth.as_ref(), SignRule::Auto, 1_000_000);
        let (faces, Wrong { method: got, winding, truth, depth }) = (mesh.faces.len(), wrong);
        println!(
            "{name}: {faces} faces, {got:?}, {winding} wrong, {truth} wrong against the truth, {depth:.1e} off"
        );
        assert_eq!((got, winding), (method, 0), "{name}");
    }
}

#[test]
fn every_rule_is_right_on_a_whole_mesh() {
    for mesh in [icosphere(2), torus(1.0, 0.4, 24, 12), cube(3), soup(&icosphere(2))] {
        for rule in [SignRule::Auto, SignRule::Winding, SignRule::Pseudonormal, SignRule::Parity] {
            assert_eq!(compare(&mesh, None, rule, 4000).winding, 0, "{rule:?}");
        }
        let (checked, findings) = check(&mesh).unwrap();
        let signs = Signs::new(&checked, &findings, SignRule::Unsigned).unwrap();
        assert!(!signs.inside([0.01; 3], signs.nearest([0.01; 3])));
        assert_eq!((signs.method(), signs.confidence([0.01; 3])), (Method::Unsigned, 1.0));
    }
}

#[test]
fn parity_bears_single_holes_and_flipped_faces() {
    let ball = icosphere(3);
    assert_eq!(compare(&flipped(ball.clone(), 0.3, 1), Some(&ball), SignRule::Parity, 4000).truth, 0);
    let wrong = compare(&holed(ball.clone(), 0.01, 1), Some(&ball), SignRule::Parity, 4000).truth;
    assert!(wrong <= 20, "{wrong}");
}

#[test]
fn auto_sees_what_pseudonormals_would_get_wrong() {
    let method = |mesh: &Mesh| {
        let (checked, findings) = check(mesh).unwrap();
        let signs = Signs::new(&checked, &findings, SignRule::Auto).unwrap();
        (signs.method(), signs.why())
    };
    let ball = icosphere(3);
    let small = moved(ball.clone(), [0.05, 0.0, 0.0], 0.5);
    // A cavity is fine; a ball within a ball is not, nor are two that overlap, or one turned against the other.
    assert_eq!(method(&both(ball.clone(), &flipped(small.clone(), 1.0, 1))).0, Method::Pseudonormal);
    let (winding, why) = method(&both(ball.clone(), &small));
    assert_eq!(winding, Method::Winding);
    assert!(why.contains("overlap") && why.contains("from 0 to 2"), "{why}");
    let apart = moved(ball.clone(), [3.0, 0.0, 0.0], 1.0);
    assert_eq!(method(&both(ball.clone(), &apart)).0, Method::Pseudonormal);
    assert_eq!(method(&both(ball.clone(), &flipped(apart, 1.0, 1))).0, Method::Winding);
    let touching = moved(ball.clone(), [1.9, 0.0, 0.0], 1.0);
    assert_eq!(method(&both(ball.clone(), &touching)).0, Method::Winding);

    let (pseudonormal, why) = method(&flipped(ball.clone(), 1.0, 1));
    assert_eq!(pseudonormal, Method::Pseudonormal);
    assert!(why.contains("inwards"), "{why}");
    let (_, why) = method(&holed(ball, 0.05, 1));
    assert!(why.contains("open edges"), "{why}");
}

#[test]
fn columns_agree_with_the_winding_number_at_every_node() {
    let ball = icosphere(2);
    let two = both(ball.clone(), &moved(ball.clone(), [0.7, 0.3, 0.2], 0.8));
    let cases = [
        (two, SignRule::Auto),
        (torus(1.0, 0.4, 24, 12), SignRule::Auto),
        (flipped(ball.clone(), 1.0, 1), SignRule::Auto),
        (flipped(ball, 0.3, 1), SignRule::Parity),
        (cube(4), SignRule::Winding),
    ];
    for (case, (mesh, rule)) in cases.iter().enumerate() {
        let (checked, findings) = check(mesh).unwrap();
        let signs = Signs::new(&checked, &findings, *rule).unwrap();
        let axis =
            |n: usize| -> Vec<f64> { (0..n).map(|i| 2.5 * i as f64 / (n - 1) as f64 - 1.25).collect() };
        // The cube's planes go through the nodes of the first: ties everywhere.
        let axes = [axis(21), axis(27), axis(33)];
        let columns = signs.columns([&axes[0], &axes[1], &axes[2]], 1 << 24).unwrap();
        for (i, x) in axes[0].iter().enumerate() {
            for (j, y) in axes[1].iter().enumerate() {
                for (k, z) in axes[2].iter().enumerate() {
                    let p = [*x, *y, *z];
                    let foot = signs.nearest(p);
                    if (0..3).all(|a| (foot.point[a] - p[a]).abs() < 1e-12) {
                        continue;
                    }
                    let inside = columns.inside(i, j, k);
                    assert_eq!(inside, signs.inside(p, foot), "case {case}: {p:?}");
                }
            }
        }
    }
}

#[test]
fn columns_are_refused_where_they_would_lie_or_fill_the_memory() {
    let axis: Vec<f64> = (0..64).map(|i| i as f64 / 32.0 - 1.0).collect();
    let axes: [&[f64]; 3] = [&axis, &axis, &axis];
    let ball = icosphere(3);
    let (checked, findings) = check(&ball).unwrap();
    let signs = Signs::new(&checked, &findings, SignRule::Auto).unwrap();
    assert!(signs.columns(axes, 1 << 24).is_some());
    assert!(signs.columns(axes, 20_000).is_none());
    let (checked, findings) = check(&holed(ball, 0.05, 1)).unwrap();
    let signs = Signs::new(&checked, &findings, SignRule::Auto).unwrap();
    assert!(signs.columns(axes, 1 << 24).is_none());
}

#[test]
fn confidence_is_how_far_the_winding_number_is_from_a_half() {
    let mesh = beheaded(icosphere(3), 0.25);
    let (checked, findings) = check(&mesh).unwrap();
    let signs = Signs::new(&checked, &findings, SignRule::Auto).unwrap();
    let mut worst: f64 = 0.0;
    for (world, unit) in points(&checked, 4000, 5) {
        let w = winding(&mesh, world);
        assert!((signs.winding(unit) - w).abs() < 1e-9);
        worst = worst.max((signs.confidence(unit) - (2.0 * w - 1.0).abs().min(1.0)).abs());
    }
    assert!(worst < 0.02, "{worst}");
    assert!(worst > 0.0, "the fast number is no exact one");
}

fn main() {
    for (name, mesh, truth, method) in damaged(3).into_iter().skip(7) {
        let wrong = compare(&mesh, truth.as_ref(), SignRule::Auto, 1_000_000);
        let (faces, Wrong { method: got, winding, truth, depth }) = (mesh.faces.len(), wrong);
        println!(
            "{name}: {faces} faces, {got:?}, {winding} wrong, {truth} wrong against the truth, {depth:.1e} off"
        );
        assert_eq!((got, winding), (method, 0), "{name}");
    }
}
