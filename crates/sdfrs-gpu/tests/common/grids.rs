//! A torus as grids of every kind of storage.

use super::shapes::{build, num};
use sdfrs_core::{
    Control, Grid,
    bake::{Plan, bake},
};

pub fn baked(band: Option<f64>, wide: bool) -> Grid {
    let shape = build("torus", &[("major", num(0.6)), ("minor", num(0.2))], &[]);
    let plan = Plan { dims: [37, 20, 41], lo: [-1.0, -0.5, -1.1], hi: [1.0, 0.5, 1.1], band, wide };
    bake(&shape, &plan, 1 << 30, &Control::new()).unwrap()
}

/// Dense and sparse, in f64, f32, halves and bytes.
pub fn all() -> Vec<(&'static str, Grid)> {
    let (dense, sparse) = (baked(None, false), baked(Some(0.1), false));
    assert!(sparse.bricks().is_some_and(|b| b.kept() > 0 && b.words().iter().any(|w| w.slot().is_none())));
    vec![
        ("dense f32", dense.clone()),
        ("dense f64", baked(None, true)),
        ("dense f16", dense.to_f16().unwrap()),
        ("bricks f32", sparse.clone()),
        ("bricks f16", sparse.to_f16().unwrap()),
        ("bricks u8", sparse.to_u8(0.15).unwrap()),
    ]
}
