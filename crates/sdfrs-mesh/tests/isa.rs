//! Law: the bits depend on neither the instruction set nor the number of threads nor the run.

#![allow(clippy::unwrap_used, clippy::panic)] // A helper that fails is a test that fails.

mod common;

use common::*;
use sdfrs_core::eval::Isa;
use sdfrs_mesh::{
    Mesh,
    bake::{Settings, Values, bake},
    sign::SignRule,
};

fn bits(mesh: &Mesh, settings: &Settings, threads: usize) -> Values {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| bake(mesh, settings, &()).unwrap().values)
}

fn hold(name: &str, mesh: &Mesh, settings: &Settings) {
    let want = bits(mesh, &Settings { isa: Some(Isa::Baseline), ..settings.clone() }, 1);
    for isa in Isa::available() {
        for threads in [1, 4] {
            let got = bits(mesh, &Settings { isa: Some(isa), ..settings.clone() }, threads);
            assert!(got == want, "{name}: {} with {threads} threads differs", isa.name());
        }
    }
    // That the comparison can fail: a mesh that is larger by a millionth.
    let grown = mesh.vertices.iter().map(|v| v.map(|x| x * (1.0 + 1e-6))).collect();
    let grown = Mesh { vertices: grown, faces: mesh.faces.clone() };
    assert!(bits(&grown, settings, 1) != want, "{name}: another mesh is no different");
}

#[test]
fn one_answer() {
    hold("knot", &knot(150, 12), &settings([65, 40, 33]));
    hold("soup", &soup(500), &Settings { sign: SignRule::Unsigned, ..settings([40, 64, 50]) });
    hold("sparse", &knot(150, 12), &Settings { sparse: true, ..settings([130; 3]) });
    hold("band", &icosphere(4), &Settings { band: Some(0.1), ..settings([64; 3]) });
}
