//! A baked mesh is the shape it is the skin of, in every kind of storage, within the claimed error.
#![allow(clippy::unwrap_used)]

use sdfrs::{
    Control, Grid, Shape, Value,
    mesh::{
        Mesh,
        bake::{Resolution, Settings},
        sign::SignRule,
    },
    texture::{Stored, from_mesh, from_shape},
};
use sdfrs_core::{bake::Plan, grid::Step};

/// The skin of the box from -1 to 1.
fn cube() -> Mesh {
    let vertices = (0..8).map(|i| [i >> 2, i >> 1 & 1, i & 1].map(|v| f64::from(2 * v - 1))).collect();
    let sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let faces = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { vertices, faces }
}

fn solid() -> Shape {
    Shape::build("box", vec![("size".into(), Value::Vec3([2.0; 3]))], vec![]).unwrap()
}

fn settings(sparse: bool) -> Settings {
    let bounds = Some(([-1.5, -1.6, -1.7], [1.5, 1.6, 1.7]));
    Settings { resolution: Resolution::Each([40, 41, 42]), bounds, sparse, ..Settings::default() }
}

fn nodes(grid: &Grid) -> impl Iterator<Item = ([usize; 3], f64)> {
    let [nx, ny, nz] = grid.dims();
    (0..nx * ny * nz).map(move |i| {
        let at = [i % nx, i / nx % ny, i / nx / ny];
        (at, grid.node(at))
    })
}

#[test]
fn meshes_and_shapes_give_the_same_grids() {
    let (lo, hi) = settings(false).bounds.unwrap();
    for sparse in [false, true] {
        for stored in [Stored::F32, Stored::F16, Stored::U8] {
            if stored == Stored::U8 && !sparse {
                continue;
            }
            let (mesh, baked) = from_mesh(&cube(), &settings(sparse), stored, &Control::new()).unwrap();
            let plan = Plan { dims: [40, 41, 42], lo, hi, band: sparse.then_some(0.0), wide: false };
            let shape = from_shape(&solid(), &plan, stored, u64::MAX, &Control::new()).unwrap();
            let exact = Plan { band: None, wide: true, ..plan };
            let exact = from_shape(&solid(), &exact, Stored::F64, u64::MAX, &Control::new()).unwrap();
            assert!(baked.findings.watertight && baked.findings.manifold);
            for grid in [mesh, shape] {
                let (error, band) = (grid.claim().max_error, grid.band().min(0.3));
                assert!(error > 0.0 && error < 0.01, "{error}");
                for (at, v) in nodes(&grid) {
                    let want: f64 = exact.node(at);
                    assert!(v.abs() <= want.abs() + error, "{stored:?} {at:?}: {v} {want}");
                    assert!(want.abs() >= band || (v - want).abs() <= error, "{stored:?} {at:?}: {v} {want}");
                }
                let inside: f32 = grid.sample([0.1, 0.0, -0.2], Step::Raw);
                let outside: f32 = grid.sample([1.3, 0.0, -0.2], Step::Raw);
                assert!(inside < 0.0 && outside > 0.0);
            }
        }
    }
}

#[test]
fn what_has_no_sense_is_refused() {
    let fails = |mesh: &Mesh, settings: Settings, stored: Stored, word: &str| {
        let error = from_mesh(mesh, &settings, stored, &Control::new()).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    };
    let one = Mesh { faces: vec![[0, 1, 2]], ..cube() };
    fails(&one, settings(false), Stored::F32, "one triangle");
    let unsigned = Settings { sign: SignRule::Unsigned, ..settings(false) };
    assert!(from_mesh(&one, &unsigned, Stored::F32, &Control::new()).is_ok());
    fails(&cube(), Settings { band: Some(1e-6), ..settings(true) }, Stored::F32, "diagonal");
    fails(&cube(), settings(false), Stored::U8, "sparse");
    fails(&cube(), settings(true), Stored::F64, "float64");
    let control = Control::new();
    control.cancel();
    assert!(from_mesh(&cube(), &settings(false), Stored::F32, &control).is_err());
}
