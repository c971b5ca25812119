//! Where the errors of the crates become those of the package: the only place that knows both.
//!
//! The classes live in `sdfrs._errors`; they are looked up once.

use pyo3::{
    prelude::*,
    sync::PyOnceLock,
    types::{PyString, PyType},
};
use sdfrs::device::DeviceError;
use sdfrs::texture::TextureError;
use sdfrs_core::{FormatError, SceneError};
use sdfrs_mesh::MeshError;
use sdfrs_trace::TraceError;

/// What a call can end with, apart from errors that Python itself raised.
#[derive(Debug)]
pub enum Fault {
    Scene(String),
    Format(String),
    Device(String),
    Mesh(String),
    Internal(String),
}

impl From<SceneError> for Fault {
    fn from(e: SceneError) -> Self {
        Fault::Scene(e.to_string())
    }
}

impl From<FormatError> for Fault {
    fn from(e: FormatError) -> Self {
        Fault::Format(e.to_string())
    }
}

impl From<MeshError> for Fault {
    fn from(e: MeshError) -> Self {
        Fault::Mesh(e.to_string())
    }
}

impl From<TextureError> for Fault {
    fn from(e: TextureError) -> Self {
        match e {
            TextureError::Mesh(e) => e.into(),
            TextureError::Scene(e) => e.into(),
        }
    }
}

impl From<TraceError> for Fault {
    fn from(e: TraceError) -> Self {
        match e {
            TraceError::Scene(e) => e.into(),
            // Calls cancel only on an error of Python's, which is raised in place of this one.
            TraceError::Cancelled => Fault::Internal("cancelled".into()),
        }
    }
}

impl From<DeviceError> for Fault {
    fn from(e: DeviceError) -> Self {
        match e {
            DeviceError::Trace(e) => e.into(),
            refused => Fault::Device(refused.to_string()),
        }
    }
}

impl From<Fault> for PyErr {
    fn from(fault: Fault) -> Self {
        Python::attach(|py| match fault {
            Fault::Scene(message) => raise(py, &SCENE, "SceneError", &message),
            Fault::Format(message) => raise(py, &FORMAT, "FormatError", &message),
            Fault::Device(message) => raise(py, &DEVICE, "DeviceError", &message),
            Fault::Mesh(message) => raise(py, &MESH, "MeshError", &message),
            Fault::Internal(message) => raise(py, &INTERNAL, "InternalError", &message),
        })
    }
}

static SCENE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static FORMAT: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static DEVICE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static MESH: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static INTERNAL: PyOnceLock<Py<PyType>> = PyOnceLock::new();

fn raise(py: Python<'_>, slot: &PyOnceLock<Py<PyType>>, name: &str, message: &str) -> PyErr {
    match slot.import(py, "sdfrs._errors", name) {
        Ok(class) => PyErr::from_type(class.clone(), PyString::new(py, message).unbind()),
        Err(error) => error,
    }
}

/// A scene error with the words of the bindings.
pub fn scene(message: impl Into<String>) -> PyErr {
    Fault::Scene(message.into()).into()
}
