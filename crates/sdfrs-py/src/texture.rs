//! Textures: arrays and bricks in, grids out and back, meshes and shapes baked.
//!
//! Large samples leave in slabs, so that a file can be written without a second copy of them all.

use std::{ops::Range, sync::Arc};

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray3};
use pyo3::{IntoPyObjectExt, exceptions::PyTypeError, prelude::*, types::PyDict};
use sdfrs::texture::{Stored, from_shape};
use sdfrs_core::{
    Grid, GridValues, SceneError, Shape,
    bake::{Plan, total},
    grid::{BrickValues, Bricks, Claim, Stepping, Store, Sweep, bricks_along, f16, slope::BLOCK},
};
use sdfrs_trace::budget::physical_memory;

use crate::{
    args::flat,
    call::{self, Progress},
    error::{Fault, scene},
    node::Node,
};

/// What a texture knows besides its samples, by keyword.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Facts {
    lo: [f64; 3],
    hi: [f64; 3],
    lipschitz: Option<f64>,
    max_error: f64,
    stepping: String,
}

impl Facts {
    fn claim(&self) -> Claim {
        Claim { lipschitz: self.lipschitz, max_error: self.max_error }
    }
    fn shape(&self, store: Store, dims: [usize; 3]) -> Result<Shape, Fault> {
        let grid = Grid::with_claim(store, dims, self.lo, self.hi, self.claim())?;
        Ok(Shape::texture(grid.with_stepping(stepping(&self.stepping)?))?)
    }
}

pub fn stepping(name: &str) -> Result<Stepping, SceneError> {
    Stepping::from_name(name).ok_or_else(|| {
        let message = format!("stepping is {name:?}, allowed: {}", Stepping::NAMES.join(", "));
        SceneError::new("texture", message)
    })
}

/// What samples are to be stored as.
pub fn stored(dtype: &str) -> Result<Stored, SceneError> {
    Stored::from_name(dtype).ok_or_else(|| {
        let message = format!("dtype is {dtype:?}, allowed: float16, float32, float64, uint8");
        SceneError::new("texture", message)
    })
}

/// Bytes that samples may take: half of the memory.
#[pyfunction]
#[pyo3(name = "memory_for_samples")]
pub fn most_bytes() -> u64 {
    physical_memory() / 2
}

/// A dense texture of samples [z, y, x].
#[pyfunction]
pub fn texture_dense(py: Python<'_>, values: &Bound<'_, PyAny>, facts: Facts) -> PyResult<Node> {
    fn take<T: numpy::Element + Copy>(v: &PyReadonlyArray3<'_, T>) -> ([usize; 3], Vec<T>) {
        let [nz, ny, nx] = [0, 1, 2].map(|a| v.as_array().shape()[a]);
        ([nx, ny, nz], v.as_array().iter().copied().collect())
    }
    let (dims, values) = if let Ok(v) = values.extract::<PyReadonlyArray3<'_, f32>>() {
        let (dims, v) = take(&v);
        (dims, GridValues::F32(Arc::new(v)))
    } else if let Ok(v) = values.extract::<PyReadonlyArray3<'_, f64>>() {
        let (dims, v) = take(&v);
        (dims, GridValues::F64(Arc::new(v)))
    } else if let Ok(v) = values.extract::<PyReadonlyArray3<'_, f16>>() {
        let (dims, v) = take(&v);
        (dims, GridValues::F16(Arc::new(v)))
    } else {
        return Err(PyTypeError::new_err("values must be a 3-dimensional float16, float32 or float64 array"));
    };
    call::short(py, || Ok(Node::new(facts.shape(Store::Dense(values), dims)?)))
}

/// A sparse texture: `table` and `far` with one value a brick (x fastest), nodes of the kept bricks, and
/// where these are bytes a scale for each.
#[pyfunction]
pub fn texture_sparse(
    py: Python<'_>,
    dims: [usize; 3],
    table: PyReadonlyArray1<'_, u32>,
    far: PyReadonlyArray1<'_, f32>,
    nodes: &Bound<'_, PyAny>,
    scale: Option<PyReadonlyArray1<'_, f32>>,
    facts: Facts,
) -> PyResult<Node> {
    let list = |v: &PyReadonlyArray1<'_, f32>| v.as_array().to_vec();
    let nodes = if let Ok(v) = nodes.extract::<PyReadonlyArray1<'_, f32>>() {
        BrickValues::F32(Arc::new(list(&v)))
    } else if let Ok(v) = nodes.extract::<PyReadonlyArray1<'_, f16>>() {
        BrickValues::F16(Arc::new(v.as_array().to_vec()))
    } else if let (Ok(v), Some(scale)) = (nodes.extract::<PyReadonlyArray1<'_, u8>>(), &scale) {
        BrickValues::U8 { codes: Arc::new(v.as_array().to_vec()), scale: Arc::new(list(scale)) }
    } else {
        return Err(PyTypeError::new_err(
            "nodes must be a flat float16 or float32 array, or bytes with a scale",
        ));
    };
    if dims.iter().any(|n| !(2..=1 << 20).contains(n)) {
        return Err(scene(format!(
            "texture: got {dims:?} nodes along x, y, z, allowed: 2 to {} each",
            1 << 20
        )));
    }
    let (table, far) = (table.as_slice()?, far.as_slice()?);
    let bricks = Bricks::of_table(table, far, nodes).map_err(Fault::from)?;
    call::short(py, || Ok(Node::new(facts.shape(Store::Sparse(bricks), dims)?)))
}

/// Samples a shape; `band` None is a dense texture, 0 a sparse one of the usual width.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // one call from one place: Shape.to_texture
pub fn texture_of_shape(
    py: Python<'_>,
    node: &Bound<'_, Node>,
    dims: [usize; 3],
    lo: [f64; 3],
    hi: [f64; 3],
    band: Option<f64>,
    dtype: &str,
    stepping: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<Node> {
    let stored = stored(dtype).map_err(Fault::from)?;
    let stepping = self::stepping(stepping).map_err(Fault::from)?;
    let plan = Plan { dims, lo, hi, band, wide: false };
    let shape = node.get().shape.clone();
    let progress = Progress { callback: progress, total: total(&plan) };
    call::long(py, &progress, move |control| {
        let grid = from_shape(&shape, &plan, stored, most_bytes(), control)?;
        Ok(Node::new(Shape::texture(grid.with_stepping(stepping))?))
    })
}

/// Numbers about a texture, by name.
#[pyfunction]
pub fn texture_facts<'py>(py: Python<'py>, node: &Bound<'py, Node>) -> PyResult<Bound<'py, PyDict>> {
    let grid = node.get().grid()?;
    let dict = PyDict::new(py);
    let (lo, hi) = grid.bounds();
    dict.set_item("dims", grid.dims())?;
    dict.set_item("lo", lo)?;
    dict.set_item("hi", hi)?;
    dict.set_item("spacing", grid.spacing())?;
    dict.set_item("lipschitz", grid.claim().lipschitz)?;
    dict.set_item("max_error", grid.claim().max_error)?;
    dict.set_item("stepping", grid.stepping().name())?;
    dict.set_item("nbytes", grid.nbytes())?;
    let (dtype, kept) = match grid.store() {
        Store::Dense(values) => (values.dtype(), None),
        Store::Sparse(bricks) => (bricks.nodes().dtype(), Some(bricks.kept())),
    };
    let name = match dtype {
        "f16" => "float16",
        "f32" => "float32",
        "f64" => "float64",
        _ => "uint8",
    };
    dict.set_item("dtype", name)?;
    dict.set_item("bricks", bricks_along(grid.dims()))?;
    dict.set_item("kept", kept)?;
    Ok(dict)
}

/// Samples from `first` to `last` (not included), flat: layers of a dense texture along z, kept bricks of a sparse one,
/// 9 x 9 x 9 each.
#[pyfunction]
pub fn texture_samples<'py>(
    py: Python<'py>,
    node: &Bound<'py, Node>,
    first: usize,
    last: usize,
) -> PyResult<Bound<'py, PyAny>> {
    fn part<'py, T: numpy::Element + Copy>(
        py: Python<'py>,
        values: &[T],
        unit: usize,
        span: Range<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let span = within(span, values.len() / unit);
        PyArray1::from_slice(py, &values[unit * span.start..unit * span.end]).into_bound_py_any(py)
    }
    let (grid, span) = (node.get().grid()?, first..last);
    let layer = grid.dims()[0] * grid.dims()[1];
    match grid.store() {
        Store::Dense(GridValues::F16(v)) => part(py, v, layer, span),
        Store::Dense(GridValues::F32(v)) => part(py, v, layer, span),
        Store::Dense(GridValues::F64(v)) => part(py, v, layer, span),
        Store::Sparse(bricks) => match bricks.nodes() {
            BrickValues::F16(v) => part(py, v, BLOCK, span),
            BrickValues::F32(v) => part(py, v, BLOCK, span),
            BrickValues::U8 { codes, .. } => part(py, codes, BLOCK, span),
        },
    }
}

/// Layers `first` to `last` (not included) of a sparse texture made dense, flat: swept upwards, or those that this gave
/// swept downwards; `beside` is the last layer that the same sweep has made.
#[pyfunction]
pub fn texture_unfolded<'py>(
    py: Python<'py>,
    node: &Bound<'py, Node>,
    first: usize,
    last: usize,
    swept: Option<PyReadonlyArray1<'py, f32>>,
    beside: Option<PyReadonlyArray1<'py, f32>>,
) -> PyResult<Numbers<'py>> {
    let grid = node.get().grid()?;
    let span = within(first..last, grid.dims()[2]);
    let (mut values, way) = match &swept {
        Some(swept) => (swept.as_slice()?.to_vec(), Sweep::Down),
        None => (vec![0.0; grid.dims()[0] * grid.dims()[1] * span.len()], Sweep::Up),
    };
    let beside = beside.as_ref().map(|beside| beside.as_slice()).transpose()?;
    grid.unfold_layers(span.start, &mut values, beside, way).map_err(Fault::from)?;
    Ok(flat(py, values))
}

/// A span of what there are `all` of.
fn within(span: Range<usize>, all: usize) -> Range<usize> {
    let start = span.start.min(all);
    start..span.end.clamp(start, all)
}

type Numbers<'py> = Bound<'py, PyArray1<f32>>;

/// Where a sparse texture's bricks `first` to `last` (not included) are, and what those without nodes hold.
#[pyfunction]
pub fn texture_table<'py>(
    py: Python<'py>,
    node: &Bound<'py, Node>,
    first: usize,
    last: usize,
) -> PyResult<(Bound<'py, PyArray1<u32>>, Numbers<'py>)> {
    let words = sparse(node.get())?.words();
    let words = &words[within(first..last, words.len())];
    let slots = words.iter().map(|w| w.entry()).collect();
    Ok((flat(py, slots), flat(py, words.iter().map(|w| w.value()).collect())))
}

/// The scales of bytes; None for other bricks.
#[pyfunction]
pub fn texture_scale<'py>(py: Python<'py>, node: &Bound<'py, Node>) -> PyResult<Option<Numbers<'py>>> {
    Ok(match sparse(node.get())?.nodes() {
        BrickValues::U8 { scale, .. } => Some(flat(py, scale.to_vec())),
        _ => None,
    })
}

/// Slope bounds of bricks `first` to `last` (not included), x fastest.
#[pyfunction]
pub fn texture_slopes<'py>(
    py: Python<'py>,
    node: &Bound<'py, Node>,
    first: usize,
    last: usize,
) -> PyResult<Numbers<'py>> {
    let grid = node.get().grid()?;
    let bricks = within(first..last, bricks_along(grid.dims()).iter().product());
    Ok(flat(py, bricks.map(|i| grid.slopes_of(i)[0]).collect()))
}

/// The same texture as a dense one, in another number type or with another way to step.
#[pyfunction]
pub fn texture_changed(
    py: Python<'_>,
    node: &Bound<'_, Node>,
    dense: bool,
    stepping: Option<&str>,
) -> PyResult<Node> {
    let grid = node.get().grid()?;
    let new = stepping.map(self::stepping).transpose().map_err(Fault::from)?;
    let [nx, ny, nz] = grid.dims().map(|n| n as u64);
    let bytes = nx.saturating_mul(ny).saturating_mul(nz).saturating_mul(5);
    if dense && bytes > most_bytes() {
        let allowed = most_bytes() >> 20;
        return Err(scene(format!(
            "to_dense: needs {} MiB, allowed: {allowed} MiB (half of the memory)",
            bytes >> 20
        )));
    }
    call::short(py, || {
        let grid = if dense { grid.to_dense()? } else { grid.clone() };
        Ok(Node::new(Shape::texture(grid.with_stepping(new.unwrap_or(grid.stepping())))?))
    })
}

fn sparse(node: &Node) -> PyResult<&Bricks> {
    match node.grid()?.bricks() {
        Some(bricks) => Ok(bricks),
        None => Err(PyTypeError::new_err("the texture is dense")),
    }
}

/// A flat array given as [z, y, x].
pub fn cube<'py, T: numpy::Element>(
    py: Python<'py>,
    values: Vec<T>,
    [nx, ny, nz]: [usize; 3],
) -> PyResult<Bound<'py, PyAny>> {
    flat(py, values).reshape([nz, ny, nx])?.into_bound_py_any(py)
}
