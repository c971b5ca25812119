//! Law: a sparse grid has the dense grid's nodes wherever it keeps a brick, keeps all that lie within the band, and
//! bounds the rest from below.

#![allow(clippy::unwrap_used, clippy::panic)] // A helper that fails is a test that fails.

mod common;

use common::*;
use sdfrs_mesh::{
    Mesh,
    bake::{Baked, Resolution, Settings, Sparse, Values, bake},
    sign::SignRule,
};

fn sparse(mesh: &Mesh, settings: &Settings) -> (Baked, Sparse) {
    let baked = bake(mesh, &Settings { sparse: true, ..settings.clone() }, &()).unwrap();
    let Values::Sparse(sparse) = baked.values.clone() else { panic!("asked for a sparse grid") };
    (baked, sparse)
}

/// The nodes of all bricks against a dense grid that reaches as far as the last brick.
fn hold(name: &str, mesh: &Mesh, settings: &Settings) {
    let (baked, sparse) = sparse(mesh, settings);
    let dims = baked.dims;
    let step: [f64; 3] = std::array::from_fn(|k| (baked.hi[k] - baked.lo[k]) / (dims[k] - 1) as f64);
    let band = settings.band.unwrap_or(4.0 * step.iter().fold(0.0, |a: f64, &b| a.max(b))) as f32;
    assert_eq!(sparse.bricks, dims.map(|n| (n - 1).div_ceil(8) as u32));
    let wide = sparse.bricks.map(|b| 8 * b + 1);
    let hi = std::array::from_fn(|k| baked.lo[k] + step[k] * f64::from(wide[k] - 1));
    let wider =
        Settings { resolution: Resolution::Each(wide), bounds: Some((baked.lo, hi)), ..settings.clone() };
    let (exact, values) = dense(mesh, &Settings { band: None, ..wider });
    let slack = (exact.max_error + baked.max_error) as f32;
    let value = |p: [u32; 3]| values[(p[0] + wide[0] * (p[1] + wide[1] * p[2])) as usize];
    let (mut kept, mut within) = (0, 0);
    let [bx, by, bz] = sparse.bricks;
    for b in 0..bx * by * bz {
        let at = [b % bx, b / bx % by, b / bx / by].map(|i| 8 * i);
        let nodes = (0..729).map(|n| [n % 9, n / 9 % 9, n / 81]);
        let near = |n: &[u32; 3]| value(std::array::from_fn(|k| at[k] + n[k])).abs() < band - slack;
        // The far walls are the next bricks' own nodes.
        let own = nodes.clone().filter(|n| n.iter().all(|&i| i < 8)).any(|n| near(&n));
        within += usize::from(own || band < 3.0 * step[0] as f32 && nodes.clone().any(|n| near(&n)));
        let word = sparse.words[b as usize];
        let Some(brick) = word.slot() else {
            assert!(!own, "{name}: brick {at:?} is within the band and not kept");
            let far = word.value();
            for n in nodes {
                let v = value(std::array::from_fn(|k| at[k] + n[k]));
                assert!(
                    far.abs() <= v.abs() + slack && v.signum() == far.signum(),
                    "{name}: {at:?} {n:?}: {far} {v}"
                );
            }
            continue;
        };
        kept += 1;
        for n in nodes {
            let got = sparse.nodes[brick * 729 + (n[0] + 9 * (n[1] + 9 * n[2])) as usize];
            let v = value(std::array::from_fn(|k| at[k] + n[k]));
            let want = v.clamp(-band, band);
            assert!((got - want).abs() <= slack, "{name}: {at:?} {n:?}: {got}, not {want}");
        }
    }
    assert_eq!(kept * 729, sparse.nodes.len(), "{name}: bricks that no place points to");
    assert!(kept <= within + within / 50 + 1, "{name}: {kept} bricks kept, {within} are within the band");
}

#[test]
fn bricks_hold_the_dense_nodes() {
    hold("sphere", &icosphere(4), &settings([97; 3]));
    hold("knot", &knot(200, 16), &settings([130, 121, 60]));
    hold("box", &cube([1.0, 0.7, 0.3]), &settings([64, 80, 48]));
    // Cut by the bounds on all sides.
    let bounds = Some(([-0.9, -0.2, -1.1], [0.9, 1.4, 0.3]));
    hold("cut", &icosphere(4), &Settings { bounds, ..settings([70, 66, 51]) });
}

#[test]
fn any_band() {
    for band in [0.02, 0.3, 5.0] {
        hold("sphere", &icosphere(3), &Settings { band: Some(band), ..settings([60; 3]) });
    }
}

#[test]
fn other_signs() {
    for sign in [SignRule::Winding, SignRule::Parity, SignRule::Unsigned] {
        hold("sphere", &icosphere(3), &Settings { sign, ..settings([60; 3]) });
        // Few cells: the band reaches the box's far faces, whose bricks go on past the grid.
        hold("coarse", &icosphere(3), &Settings { sign, ..settings([24; 3]) });
    }
}

/// Far bricks are bounded well enough to be worth their step: half of the distance at least.
#[test]
fn bounds_are_worth_having() {
    let (baked, sparse) = sparse(&icosphere(4), &settings([257; 3]));
    let (mut bound, mut distance) = (0.0, 0.0);
    let [bx, by, _] = sparse.bricks.map(u64::from);
    for (b, word) in sparse.words.iter().enumerate().filter(|(_, word)| word.slot().is_none()) {
        let b = b as u64;
        let p = node(&baked, [b % bx, b / bx % by, b / bx / by].map(|i| 8 * i + 4));
        bound += f64::from(word.value().abs());
        distance += (p.length() - 1.0).abs();
    }
    assert!(bound > 0.5 * distance, "{} of the distance", bound / distance);
}
