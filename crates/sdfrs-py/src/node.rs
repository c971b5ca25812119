//! A node of the scene graph as Python holds it; `sdfrs.Shape` and `sdfrs.Expr` wrap it.

use std::{collections::HashSet, sync::OnceLock};

use numpy::PyReadonlyArray2;
use pyo3::{
    IntoPyObjectExt,
    exceptions::PyTypeError,
    prelude::*,
    types::{PyBool, PyFloat, PyInt, PyList, PyString},
};
use sdfrs_core::{Args, Grid, Program, SceneError, Shape, Value};

use crate::{
    args::{Number, flat, rows, triples},
    call::{self, Progress},
    error::{Fault, scene},
    values,
};

type Corners = ([f64; 3], [f64; 3]);

/// An immutable node: a shape or a part of a formula.
#[pyclass(frozen, module = "sdfrs._core")]
pub struct Node {
    pub shape: Shape,
    // Compiled once: many callers ask about a few points at a time.
    f32: OnceLock<Program<f32>>,
    f64: OnceLock<Program<f64>>,
}

impl Node {
    pub fn new(shape: Shape) -> Self {
        Self { shape, f32: OnceLock::new(), f64: OnceLock::new() }
    }
    pub fn program_f32(&self) -> &OnceLock<Program<f32>> {
        &self.f32
    }
    pub fn program_f64(&self) -> &OnceLock<Program<f64>> {
        &self.f64
    }
    /// The program of the field's values.
    fn program<T: Number>(&self) -> Result<&Program<T>, SceneError> {
        let slot = T::program(self);
        match slot.get() {
            Some(program) => Ok(program),
            None => Program::values(&self.shape).map(|program| slot.get_or_init(|| program)),
        }
    }
}

fn value(name: &str, v: &Bound<'_, PyAny>) -> PyResult<Value> {
    if v.is_none() {
        return Ok(Value::None);
    }
    if v.is_instance_of::<PyBool>() {
        return Err(PyTypeError::new_err(format!("{name} must not be a bool")));
    }
    if v.is_instance_of::<PyInt>() {
        return Ok(Value::Int(v.extract().map_err(|_| scene(format!("{name} is too large: {v}")))?));
    }
    if v.is_instance_of::<PyFloat>() {
        return Ok(Value::Num(v.extract()?));
    }
    if v.is_instance_of::<PyString>() {
        return Ok(Value::Text(v.extract()?));
    }
    if let Ok(items) = v.extract::<Vec<Bound<'_, PyAny>>>()
        && items.len() == 3
    {
        if items.iter().all(|i| i.is_instance_of::<PyInt>()) {
            return Ok(Value::Ints3(v.extract()?));
        }
        return Ok(Value::Vec3(v.extract()?));
    }
    Err(PyTypeError::new_err(format!(
        "{name} must be a number, a text, three numbers or None, got {}",
        v.repr()?
    )))
}

#[pymethods]
impl Node {
    /// A node by the name of its op, its arguments and its operands.
    #[staticmethod]
    fn build(op: &str, args: Vec<(String, Bound<'_, PyAny>)>, children: Bound<'_, PyList>) -> PyResult<Self> {
        let args: PyResult<Args> = args.into_iter().map(|(n, v)| value(&n, &v).map(|v| (n, v))).collect();
        let shapes: PyResult<Vec<Shape>> =
            children.iter().map(|c| Ok(c.cast::<Node>()?.get().shape.clone())).collect();
        Ok(Self::new(Shape::build(op, args?, shapes?).map_err(Fault::from)?))
    }

    #[getter]
    fn op(&self) -> &'static str {
        self.shape.op()
    }

    /// Arguments by name, as `build` takes them.
    #[getter]
    fn args<'py>(&self, py: Python<'py>) -> PyResult<Vec<(&'static str, Bound<'py, PyAny>)>> {
        let convert = |v: Value| match v {
            Value::Num(v) => v.into_bound_py_any(py),
            Value::Int(v) => v.into_bound_py_any(py),
            Value::Vec3([x, y, z]) => (x, y, z).into_bound_py_any(py),
            Value::Ints3([x, y, z]) => (x, y, z).into_bound_py_any(py),
            Value::Text(v) => v.into_bound_py_any(py),
            Value::None => Ok(py.None().into_bound(py)),
        };
        self.shape.args().into_iter().map(|(name, v)| Ok((name, convert(v)?))).collect()
    }

    #[getter]
    fn children(&self) -> Vec<Node> {
        self.shape.children().iter().map(|shape| Node::new(shape.clone())).collect()
    }

    #[getter]
    fn is_expr(&self) -> bool {
        self.shape.is_expr()
    }

    #[getter]
    fn depends_on_point(&self) -> bool {
        self.shape.depends_on_point()
    }

    /// Whether a texture is part of it: what its walks see is then no measure of a declared bound.
    #[getter]
    fn textured(&self) -> bool {
        let (mut seen, mut stack) = (HashSet::new(), vec![&self.shape]);
        while let Some(shape) = stack.pop() {
            if seen.insert(shape.ptr_id()) {
                if shape.grid().is_some() {
                    return true;
                }
                stack.extend(shape.children());
            }
        }
        false
    }

    #[getter]
    fn lipschitz(&self) -> f64 {
        self.shape.lipschitz()
    }

    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        corners(py, self.shape.bounds())
    }

    /// Values at points, (N, 3) -> (N,).
    fn values<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        fn run<'py, T: Number>(
            py: Python<'py>,
            node: &Node,
            points: Vec<[T; 3]>,
        ) -> PyResult<Bound<'py, PyAny>> {
            let few = points.len() <= values::FEW;
            let work = move |control: &_| Ok(values::values(node.program()?, &points, control));
            let out = if few {
                call::short(py, || work(&Default::default()))
            } else {
                call::long(py, &Progress::none(), work)
            };
            flat(py, out?).into_bound_py_any(py)
        }
        match points.extract::<PyReadonlyArray2<'_, f32>>() {
            Ok(array) => run(py, self, rows(&array)?),
            Err(_) => run(py, self, rows(&points.extract::<PyReadonlyArray2<'_, f64>>()?)?),
        }
    }

    /// Slopes at points, (N, 3) -> (N, 3).
    fn gradient<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        fn run<'py, T: Number>(
            py: Python<'py>,
            node: &Node,
            points: Vec<[T; 3]>,
        ) -> PyResult<Bound<'py, PyAny>> {
            let few = points.len() <= values::FEW;
            let work = move |control: &_| Ok(values::gradients(node.program()?, &points, control));
            let out = if few {
                call::short(py, || work(&Default::default()))
            } else {
                call::long(py, &Progress::none(), work)
            };
            triples(py, out?)
        }
        match points.extract::<PyReadonlyArray2<'_, f32>>() {
            Ok(array) => run(py, self, rows(&array)?),
            Err(_) => run(py, self, rows(&points.extract::<PyReadonlyArray2<'_, f64>>()?)?),
        }
    }

    /// Bounds of the values over a box.
    fn interval(&self, py: Python<'_>, lo: [f64; 3], hi: [f64; 3]) -> PyResult<(f64, f64)> {
        call::short(py, || Ok(sdfrs_core::eval::interval(&self.shape, lo, hi)?))
    }
}

impl Node {
    pub fn grid(&self) -> PyResult<&Grid> {
        match self.shape.grid() {
            Some(grid) => Ok(grid),
            None => Err(PyTypeError::new_err(format!("{} is not a texture", self.shape.op()))),
        }
    }
}

/// Two corners as tuples of floats.
fn corners<'py>(py: Python<'py>, (lo, hi): Corners) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let tuple = |[x, y, z]: [f64; 3]| (x, y, z).into_bound_py_any(py);
    Ok((tuple(lo)?, tuple(hi)?))
}
