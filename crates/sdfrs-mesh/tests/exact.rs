//! Law: every stored value is the distance of its node, up to `max_error`; brute force in f64 is the judge.

#![allow(clippy::unwrap_used, clippy::panic)] // A helper that fails is a test that fails.

mod common;

use common::*;
use sdfrs_mesh::{Mesh, sign::SignRule};

/// 20,000 nodes of `dims`; returns the error in ulp of the box's longest side.
fn hold(name: &str, mesh: &Mesh, dims: [u32; 3], closed: bool) -> f64 {
    let mut settings = settings(dims);
    if !closed {
        settings.sign = SignRule::Unsigned;
    }
    let (baked, values) = dense(mesh, &settings);
    let side = (0..3).map(|k| baked.hi[k] - baked.lo[k]).fold(0.0, f64::max);
    let ulp = side * f64::from(f32::EPSILON);
    let (error, wrong) = compare(mesh, &baked, &values, 20_000, if closed { 2_000 } else { 0 }, ulp);
    eprintln!(
        "{name} {dims:?}: {:.2} ulp of the box, allowed {:.2}, {wrong} wrong",
        error / ulp,
        baked.max_error / ulp
    );
    assert!(error <= baked.max_error, "{name} {dims:?}: {error} is more than {}", baked.max_error);
    assert!(error <= 2.0 * ulp, "{name} {dims:?}: {} ulp", error / ulp);
    assert_eq!(wrong, 0, "{name} {dims:?}: signs");
    error / ulp
}

const ODD: [u32; 3] = [33, 64, 17];
const CUBE: [u32; 3] = [128; 3];

#[test]
fn sphere() {
    hold("icosphere", &icosphere(4), CUBE, true);
    hold("icosphere", &icosphere(4), ODD, true);
    // More triangles than nodes.
    hold("icosphere", &icosphere(5), [16, 16, 16], true);
}

#[test]
fn torus_knot() {
    hold("knot", &knot(200, 16), CUBE, true);
    hold("knot", &knot(200, 16), ODD, true);
}

#[test]
fn box_of_twelve() {
    hold("box", &cube([1.0, 0.3, 2.0]), CUBE, true);
    hold("box", &cube([1.0, 0.3, 2.0]), [5, 100, 2], true);
}

#[test]
fn slivers() {
    hold("needles", &needles(3_000), CUBE, false);
    hold("needles", &needles(3_000), ODD, false);
}

#[test]
fn one_huge_triangle() {
    hold("huge and tiny", &huge_and_tiny(3_000), CUBE, false);
    hold("huge and tiny", &huge_and_tiny(3_000), ODD, false);
}

#[test]
fn any_soup() {
    hold("soup", &soup(3_000), CUBE, false);
    hold("soup", &soup(3_000), ODD, false);
}

/// A node in the middle of a sphere has all triangles at one distance.
#[test]
fn centre_of_a_sphere() {
    let mesh = icosphere(4);
    let mut settings = settings([65; 3]);
    settings.bounds = Some(([-0.02; 3], [0.02; 3]));
    let (baked, values) = dense(&mesh, &settings);
    let (error, wrong) = compare(&mesh, &baked, &values, 5_000, 500, 0.0);
    assert!(error <= baked.max_error && wrong == 0, "{error}, {wrong} wrong signs");
}

/// Boxes that cut the mesh, miss it, are flat or long.
#[test]
fn bounds_anywhere() {
    let mesh = knot(200, 16);
    for (lo, hi, dims) in [
        ([-1.0, -3.0, -0.1], [0.2, 2.0, 0.1], [40, 30, 50]),
        ([5.0, 5.0, 5.0], [6.0, 5.5, 7.0], [33, 20, 10]),
        ([-4.0, -4.0, -2.0], [4.0, 4.0, 2.0], [3, 500, 4]),
        ([-100.0; 3], [300.0; 3], [50, 50, 50]),
        ([2.9, 0.0, 0.0], [2.9001, 0.0001, 0.0001], [20, 20, 20]),
    ] {
        let mut settings = settings(dims);
        settings.bounds = Some((lo, hi));
        let (baked, values) = dense(&mesh, &settings);
        let (error, wrong) = compare(&mesh, &baked, &values, 3_000, 300, baked.max_error);
        assert!(
            error <= baked.max_error && wrong == 0,
            "{lo:?}: {error} > {}, {wrong} wrong",
            baked.max_error
        );
    }
}

/// Nodes 1,000 times closer along one axis than along another.
#[test]
fn uneven_spacing() {
    let mesh = icosphere(3);
    for lengths in [[1.5, 0.0015, 1.5], [0.01, 1.5, 0.1], [1.5, 1.5, 0.002]] {
        let mut settings = settings([40; 3]);
        settings.bounds = Some((lengths.map(|l: f64| -l), lengths));
        let (baked, values) = dense(&mesh, &settings);
        let (error, wrong) = compare(&mesh, &baked, &values, 3_000, 300, baked.max_error);
        assert!(
            error <= baked.max_error && wrong == 0,
            "{lengths:?}: {error} > {}, {wrong}",
            baked.max_error
        );
    }
}
