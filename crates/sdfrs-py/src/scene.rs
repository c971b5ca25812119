//! Scene files: text in, parts out, and back.

use pyo3::{prelude::*, types::PyDict};
use sdfrs::scene::SceneFile;
use sdfrs_trace::shade::PointLight;

use crate::{
    args::{CameraArg, camera_fields},
    call,
    error::Fault,
    node::Node,
};

/// `sdfrs.PointLight`, field by field.
#[derive(FromPyObject)]
pub struct LightArg {
    position: [f64; 3],
    color: [f64; 3],
    intensity: f64,
}

pub fn lights(lights: Vec<LightArg>) -> Vec<PointLight> {
    let convert = |l: LightArg| PointLight { position: l.position, color: l.color, intensity: l.intensity };
    lights.into_iter().map(convert).collect()
}

type LightParts = ([f64; 3], [f64; 3], f64);
type Parts<'py> =
    (Node, Option<Bound<'py, PyDict>>, Option<Vec<LightParts>>, Option<[f64; 3]>, Option<[f64; 3]>);

/// The text of a scene file.
#[pyfunction]
#[pyo3(signature = (node, camera, lights, background, albedo))]
pub fn scene_to_json(
    py: Python<'_>,
    node: &Bound<'_, Node>,
    camera: Option<CameraArg>,
    lights: Option<Vec<LightArg>>,
    background: Option<[f64; 3]>,
    albedo: Option<[f64; 3]>,
) -> PyResult<String> {
    let file = SceneFile {
        shape: node.get().shape.clone(),
        camera: camera.map(|c| c.get()).transpose().map_err(Fault::from)?,
        lights: lights.map(self::lights),
        background,
        albedo,
    };
    call::short(py, move || Ok(file.to_json_string()))
}

/// The parts of a scene from the text of a file.
#[pyfunction]
pub fn scene_from_json<'py>(py: Python<'py>, text: &str) -> PyResult<Parts<'py>> {
    let file = call::short(py, || Ok(SceneFile::parse(text)?))?;
    let camera = file.camera.as_ref().map(|c| camera_fields(py, c)).transpose()?;
    let lights = file.lights.map(|all| all.iter().map(|l| (l.position, l.color, l.intensity)).collect());
    Ok((Node::new(file.shape), camera, lights, file.background, file.albedo))
}
