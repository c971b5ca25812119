//! The Python module `sdfrs._core`: takes arguments, computes without the GIL, gives results.
//!
//! Nothing is decided here: names, defaults, documentation and friendly checks live in `python/sdfrs`,
//! algorithms in the other crates. Law: `tests/python`.

mod args;
mod call;
mod device;
mod error;
mod mesh;
mod node;
mod scene;
mod texture;
mod trace;
mod values;

use pyo3::prelude::*;
use sdfrs_core::{eval, pool};

/// Threads that compute from now on; 0 is the default (SDFRS_THREADS, else all cores).
#[pyfunction]
fn set_threads(count: usize) {
    pool::set_threads(count);
}

/// Threads in use.
#[pyfunction]
fn threads() -> usize {
    pool::threads()
}

/// The widest instruction set of this processor that the evaluator knows.
#[pyfunction]
fn simd_level() -> &'static str {
    eval::isa().name()
}

/// All instruction sets that the evaluator knows, on any processor.
#[pyfunction]
fn simd_levels() -> [&'static str; eval::Isa::ALL.len()] {
    eval::Isa::ALL.map(eval::Isa::name)
}

/// What `sdfrs` is built on: nodes, files, tracing and rendering, without the friendly checks.
#[pymodule(gil_used = false)]
mod _core {
    #[pymodule_export]
    use crate::{
        args::{camera_check, camera_rays},
        device::adapters,
        mesh::{Triangles, mesh_to_texture},
        node::Node,
        scene::{scene_from_json, scene_to_json},
        set_threads, simd_level, simd_levels,
        texture::{
            most_bytes, texture_changed, texture_dense, texture_facts, texture_of_shape, texture_samples,
            texture_scale, texture_slopes, texture_sparse, texture_table, texture_unfolded,
        },
        threads,
        trace::{render, trace, trace_camera},
    };

    #[pymodule_export]
    #[allow(non_upper_case_globals)] // Python's name for it
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
