//! The Python module `sdfrs._core`: takes arguments, computes without the GIL, gives results.
//!
//! Nothing is decided here: names, defaults, documentation and friendly checks live in `python/sdfrs`,
//! algorithms in the other crates. Law: `tests/python`.

mod args;
mod call;
mod error;
mod node;
mod scene;
mod trace;
mod values;

use pyo3::prelude::*;
use sdfrs_core::pool;

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
    sdfrs_core::eval::isa().name()
}

#[pymodule(gil_used = false)]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<node::Node>()?;
    module.add_function(wrap_pyfunction!(set_threads, module)?)?;
    module.add_function(wrap_pyfunction!(threads, module)?)?;
    module.add_function(wrap_pyfunction!(simd_level, module)?)?;
    module.add_function(wrap_pyfunction!(args::camera_check, module)?)?;
    module.add_function(wrap_pyfunction!(args::camera_rays, module)?)?;
    module.add_function(wrap_pyfunction!(scene::scene_to_json, module)?)?;
    module.add_function(wrap_pyfunction!(scene::scene_from_json, module)?)?;
    module.add_function(wrap_pyfunction!(trace::trace, module)?)?;
    module.add_function(wrap_pyfunction!(trace::trace_camera, module)?)?;
    module.add_function(wrap_pyfunction!(trace::render, module)?)?;
    Ok(())
}
