//! Meshes: files and arrays in, baked textures and what was found out.

use std::time::Instant;

use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::{prelude::*, types::PyDict};
use sdfrs::texture::{Ear, Stored, from_mesh};
use sdfrs_core::Shape;
use sdfrs_mesh::{
    Mesh, MeshError,
    bake::{Baked, Resolution, Settings},
    read,
    sign::SignRule,
};

use crate::{
    args::rows,
    call::{self, Progress},
    error::Fault,
    node::Node,
    texture::{cube, most_bytes, stepping, stored},
};

/// Triangles that Python holds on to.
#[pyclass(frozen, module = "sdfrs._core")]
pub struct Triangles {
    mesh: Mesh,
}

fn bad(element: &str, message: impl Into<String>) -> PyErr {
    Fault::Mesh(MeshError::bad(element, message).to_string()).into()
}

#[pymethods]
impl Triangles {
    /// Triangles of a file; the ending of its name says the format.
    #[staticmethod]
    fn read(py: Python<'_>, path: std::path::PathBuf) -> PyResult<Self> {
        call::long(py, &Progress::none(), move |control| {
            Ok(Self { mesh: read::read_until(&path, &Ear(control))? })
        })
    }

    /// Vertices (N, 3), and faces as the vertices of all polygons one after the other, with each one's count.
    #[staticmethod]
    fn of_arrays(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        corners: PyReadonlyArray1<'_, i64>,
        counts: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        if vertices.shape()[1] != 3 {
            return Err(bad("vertices", format!("shape {:?} given; (N, 3) is allowed", vertices.shape())));
        }
        let (vertices, corners) = (rows(&vertices)?, corners.as_array().to_vec());
        // One number where all polygons have as many corners.
        let counts = match counts.extract::<u32>() {
            Ok(n) => vec![n; corners.len() / n.max(1) as usize],
            Err(_) => counts.extract::<PyReadonlyArray1<'_, u32>>()?.as_array().to_vec(),
        };
        call::long(py, &Progress::none(), move |control| {
            let mesh = sdfrs::polygons::of_polygons(vertices, &corners, &counts, &Ear(control))?;
            Ok(Self { mesh })
        })
    }

    #[getter]
    fn vertices(&self) -> usize {
        self.mesh.vertices.len()
    }
    #[getter]
    fn faces(&self) -> usize {
        self.mesh.faces.len()
    }
}

/// `sdfrs.mesh_to_sdf_texture`'s settings, by name.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct MeshSettings {
    resolution: [u32; 3],
    cube: bool,
    bounds: Option<([f64; 3], [f64; 3])>,
    padding: f64,
    sign: String,
    sparse: bool,
    band: Option<f64>,
    dtype: String,
    stepping: String,
    confidence: bool,
}

impl MeshSettings {
    fn get(&self) -> PyResult<(Settings, Stored)> {
        let sign = match self.sign.as_str() {
            "auto" => SignRule::Auto,
            "winding" => SignRule::Winding,
            "pseudonormal" => SignRule::Pseudonormal,
            "parity" => SignRule::Parity,
            "unsigned" => SignRule::Unsigned,
            other => {
                return Err(bad(
                    "sign",
                    format!("{other:?} given; auto, winding, pseudonormal, parity and unsigned are allowed"),
                ));
            }
        };
        let resolution =
            if self.cube { Resolution::Cube(self.resolution[0]) } else { Resolution::Each(self.resolution) };
        let settings = Settings {
            resolution,
            bounds: self.bounds,
            padding: self.padding,
            sign,
            sparse: self.sparse,
            band: self.band,
            confidence: self.confidence,
            budget_bytes: most_bytes(),
            ..Settings::default()
        };
        Ok((settings, stored(&self.dtype).map_err(Fault::from)?))
    }
}

/// Bakes triangles; returns the texture and what was found, by the names of `sdfrs.MeshReport`.
#[pyfunction]
pub fn mesh_to_texture<'py>(
    py: Python<'py>,
    triangles: &Bound<'py, Triangles>,
    settings: MeshSettings,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Node, Bound<'py, PyDict>)> {
    let (given, stored) = settings.get()?;
    let stepping = stepping(&settings.stepping).map_err(Fault::from)?;
    let total = settings.resolution.iter().map(|&n| u64::from(n)).product();
    let mesh = &triangles.get().mesh;
    let progress = Progress { callback: progress, total };
    let start = Instant::now();
    let (node, baked) = call::long(py, &progress, move |control| {
        let (grid, baked) = from_mesh(mesh, &given, stored, control)?;
        Ok((Node::new(Shape::texture(grid.with_stepping(stepping))?), baked))
    })?;
    let report = report(py, baked, start.elapsed().as_secs_f64())?;
    Ok((node, report))
}

fn report(py: Python<'_>, baked: Baked, seconds: f64) -> PyResult<Bound<'_, PyDict>> {
    let (dict, f) = (PyDict::new(py), &baked.findings);
    let counts = [
        ("vertices", f.vertices),
        ("faces", f.faces),
        ("degenerate_faces", f.degenerate_faces),
        ("duplicate_faces", f.duplicate_faces),
        ("boundary_edges", f.boundary_edges),
        ("nonmanifold_edges", f.nonmanifold_edges),
        ("misoriented_edges", f.misoriented_edges),
        ("components", f.components),
    ];
    for (name, value) in counts {
        dict.set_item(name, value)?;
    }
    for (name, value) in [("watertight", f.watertight), ("manifold", f.manifold), ("oriented", f.oriented)] {
        dict.set_item(name, value)?;
    }
    dict.set_item("signed_volume", f.signed_volume)?;
    dict.set_item("bounds", f.bounds)?;
    dict.set_item("sign", baked.method.name())?;
    dict.set_item("why", &baked.why)?;
    let dims = baked.dims.map(|n| n as usize);
    dict.set_item("confidence", baked.confidence.map(|v| cube(py, v, dims)).transpose()?)?;
    dict.set_item("seconds", seconds)?;
    Ok(dict)
}
