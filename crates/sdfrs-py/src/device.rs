//! The GPUs of this machine, for `sdfrs doctor`.

use pyo3::{prelude::*, types::PyDict};
use sdfrs::device;

use crate::{
    call::{self, Progress},
    error::Fault,
};

/// Name, kind, driver, backend, limits and faults of every GPU; the place in the list is its number.
#[pyfunction]
pub fn adapters(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    // Loading drivers can take seconds.
    let found = call::long(py, &Progress::none(), |_| device::adapters().map_err(Fault::from))?;
    found
        .into_iter()
        .map(|adapter| {
            let dict = PyDict::new(py);
            dict.set_item("name", adapter.name)?;
            dict.set_item("kind", adapter.kind)?;
            dict.set_item("driver", adapter.driver)?;
            dict.set_item("backend", adapter.backend)?;
            dict.set_item("max_binding_bytes", adapter.max_binding_bytes)?;
            dict.set_item("max_buffer_bytes", adapter.max_buffer_bytes)?;
            dict.set_item("missing", adapter.missing)?;
            Ok(dict)
        })
        .collect()
}
