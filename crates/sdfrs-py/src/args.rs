//! Settings as Python passes them, as the crates want them.

use std::sync::OnceLock;

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::{IntoPyObjectExt, exceptions::PyTypeError, prelude::*, types::PyDict};
use sdfrs::device::{self, Choice, On};
use sdfrs_core::{Limits, Program, Prune, SceneError, Span, eval::Native};
use sdfrs_trace::{
    Tracer,
    camera::{Camera, Kind},
};

use crate::{
    call,
    error::{Fault, scene},
    node::Node,
};

/// f32 and f64, here and in numpy.
pub trait Number: Native + device::Number + numpy::Element {
    /// Where a node keeps its program of this precision.
    fn program(node: &Node) -> &OnceLock<Program<Self>>;
}
impl Number for f32 {
    fn program(node: &Node) -> &OnceLock<Program<f32>> {
        node.program_f32()
    }
}
impl Number for f64 {
    fn program(node: &Node) -> &OnceLock<Program<f64>> {
        node.program_f64()
    }
}

/// `sdfrs.Camera`, field by field.
#[derive(FromPyObject)]
pub struct CameraArg {
    kind: String,
    origin: [f64; 3],
    target: [f64; 3],
    up: [f64; 3],
    fov: Option<f64>,
    extent: Option<f64>,
    width: u32,
    height: u32,
}

impl CameraArg {
    pub fn get(&self) -> Result<Camera, SceneError> {
        let kind = match (self.kind.as_str(), self.fov, self.extent) {
            ("pinhole", Some(fov_deg), _) => Kind::Pinhole { fov_deg },
            ("orthographic", _, Some(extent)) => Kind::Orthographic { extent },
            (kind, ..) => {
                let message = format!(
                    "got {kind:?} without its size, allowed: pinhole with fov, orthographic with extent"
                );
                return Err(SceneError::new("camera kind", message));
            }
        };
        let (origin, target, up) = (self.origin, self.target, self.up);
        let camera = Camera { kind, origin, target, up, width: self.width, height: self.height };
        camera.check()?;
        Ok(camera)
    }
}

/// A camera as the keyword arguments of `sdfrs.Camera`.
pub fn camera_fields<'py>(py: Python<'py>, camera: &Camera) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    match camera.kind {
        Kind::Pinhole { fov_deg } => {
            dict.set_item("kind", "pinhole")?;
            dict.set_item("fov", fov_deg)?;
        }
        Kind::Orthographic { extent } => {
            dict.set_item("kind", "orthographic")?;
            dict.set_item("extent", extent)?;
        }
    }
    dict.set_item("origin", camera.origin)?;
    dict.set_item("target", camera.target)?;
    dict.set_item("up", camera.up)?;
    dict.set_item("width", camera.width)?;
    dict.set_item("height", camera.height)?;
    Ok(dict)
}

/// Refuses a camera that cannot be.
#[pyfunction]
pub fn camera_check(camera: CameraArg) -> PyResult<()> {
    camera.get().map(|_| ()).map_err(|e| Fault::from(e).into())
}

/// Origins and directions of all rays, (H*W, 3) each.
#[pyfunction]
pub fn camera_rays<'py>(
    py: Python<'py>,
    camera: CameraArg,
    precision: &str,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    fn rays<'py, T: Number>(
        py: Python<'py>,
        camera: Camera,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (o, d) = call::short(py, || Ok(camera.rays::<T>()?))?;
        Ok((triples(py, o)?, triples(py, d)?))
    }
    let camera = camera.get().map_err(Fault::from)?;
    if is_f32(precision)? { rays::<f32>(py, camera) } else { rays::<f64>(py, camera) }
}

/// "f32" or "f64".
pub fn is_f32(precision: &str) -> PyResult<bool> {
    match precision {
        "f32" => Ok(true),
        "f64" => Ok(false),
        other => Err(scene(format!("precision must be 'f32' or 'f64', got {other:?}"))),
    }
}

/// Where to compute, and how exactly.
pub fn on(device: &str, strict: bool) -> PyResult<On> {
    let device: Choice = device.parse().map_err(Fault::from)?;
    Ok(On { device, strict })
}

/// The parameters of a tracer, by name; those that its class lacks are absent.
pub fn tracer(name: &str, parts: &Bound<'_, PyDict>) -> PyResult<Tracer> {
    fn get<'py, T: FromPyObjectOwned<'py>>(parts: &Bound<'py, PyDict>, name: &str) -> PyResult<Option<T>> {
        parts.get_item(name)?.map(|v| v.extract::<T>().map_err(Into::into)).transpose()
    }
    let form: Option<String> = get(parts, "form")?;
    let tracer = Tracer::from_parts(
        name,
        get(parts, "omega")?,
        get(parts, "beta")?,
        form.as_deref(),
        get(parts, "max_level")?,
        get(parts, "guards")?.unwrap_or(true),
    );
    tracer.map_err(|e| Fault::from(e).into())
}

/// `skip`: whether automatic pruning may step over empty cells.
pub fn limits(eps: f64, cone: f64, max_steps: u32, prune: &str, skip: bool) -> PyResult<Limits> {
    let prune = match prune {
        "auto" => Prune::Auto { skip },
        "off" => Prune::Off,
        "exact" => Prune::Exact,
        "skip" => Prune::Skip,
        other => {
            return Err(scene(format!("prune must be 'auto', 'off', 'exact' or 'skip', got {other:?}")));
        }
    };
    let limits = Limits { eps, cone, max_steps, prune };
    limits.check().map_err(Fault::from)?;
    Ok(limits)
}

/// Rows of an (N, 3) array, copied: Python may change it while we compute.
pub fn rows<T: Number>(array: &PyReadonlyArray2<'_, T>) -> PyResult<Vec<[T; 3]>> {
    let flat = array.as_slice().map_err(|_| PyTypeError::new_err("the array must be C-contiguous"))?;
    match flat.as_chunks::<3>() {
        (rows, []) if array.shape()[1] == 3 => Ok(rows.to_vec()),
        _ => Err(scene(format!("the array must have shape (N, 3), got {:?}", array.shape()))),
    }
}

/// A number for all rays, or an array with one for each.
pub enum SpanArg<T> {
    All(T),
    Each(Vec<T>),
}

impl<T: Number> SpanArg<T> {
    pub fn take(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(array) = value.extract::<PyReadonlyArray1<'_, T>>() {
            return Ok(SpanArg::Each(array.as_array().to_vec()));
        }
        Ok(SpanArg::All(T::of(value.extract::<f64>()?)))
    }
    pub fn span(&self) -> Span<'_, T> {
        match self {
            SpanArg::All(v) => Span::All(*v),
            SpanArg::Each(v) => Span::Each(v),
        }
    }
}

/// A vector as a numpy array, without a copy.
pub fn flat<T: numpy::Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyArray1<T>> {
    PyArray1::from_vec(py, values)
}

/// Triples as an (N, 3) numpy array, without a copy.
pub fn triples<T: numpy::Element>(py: Python<'_>, values: Vec<[T; 3]>) -> PyResult<Bound<'_, PyAny>> {
    let n = values.len();
    flat(py, values.into_flattened()).reshape([n, 3])?.into_bound_py_any(py)
}
