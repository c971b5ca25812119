//! Tracing rays and rendering pictures: settings in, arrays out.

use numpy::PyReadonlyArray2;
use pyo3::{prelude::*, types::PyDict};
use sdfrs::device::{On, Used};
use sdfrs_core::{Hits, Limits, Rays, Shape, contract};
use sdfrs_trace::{Tracer, camera::Camera, render::Scene, shade::Surface, stats::Summary};

use crate::{
    args::{self, CameraArg, Number, SpanArg, flat, triples},
    call::{self, Progress},
    error::Fault,
    node::Node,
    scene::{self, LightArg},
};

/// What every trace needs besides its rays.
struct Job<'a> {
    shape: &'a Shape,
    tracer: Tracer,
    limits: Limits,
    on: On,
}

impl<'a> Job<'a> {
    fn new(
        node: &'a Bound<'_, Node>,
        tracer: &str,
        parts: &Bound<'_, PyDict>,
        limits: Limits,
        (device, strict): (&str, bool),
    ) -> PyResult<Self> {
        let on = args::on(device, strict)?;
        Ok(Self { shape: &node.get().shape, tracer: args::tracer(tracer, parts)?, limits, on })
    }
}

/// Traces rays given as (N, 3) arrays of one precision.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // one call from one place: trace() in render.py
pub fn trace<'py>(
    py: Python<'py>,
    node: &Bound<'py, Node>,
    tracer: &str,
    parts: &Bound<'py, PyDict>,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    t_min: &Bound<'py, PyAny>,
    t_max: &Bound<'py, PyAny>,
    eps: f64,
    cone: f64,
    max_steps: u32,
    prune: &str,
    device: &str,
    strict: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    fn run<'py, T: Number>(
        py: Python<'py>,
        job: &Job<'_>,
        rays: [PyReadonlyArray2<'py, T>; 2],
        spans: [SpanArg<T>; 2],
        callback: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (origins, mut directions) = (args::rows(&rays[0])?, args::rows(&rays[1])?);
        let progress = Progress { callback, total: origins.len() as u64 };
        let (mut hits, summary, used) = call::long(py, &progress, move |control| {
            contract::check_rays(&origins, &mut directions)?;
            let rays = Rays {
                origins: &origins,
                directions: &directions,
                t_min: spans[0].span(),
                t_max: spans[1].span(),
            };
            Ok(T::trace(job.on, job.shape, &job.tracer, &rays, &job.limits, control)?)
        })?;
        let (distance, witness) = (std::mem::take(&mut hits.distance), std::mem::take(&mut hits.witness));
        let dict = hits_fields(py, hits, &summary, &used)?;
        dict.set_item("distance", flat(py, distance))?;
        dict.set_item("witness", flat(py, witness))?;
        Ok(dict)
    }
    let job =
        Job::new(node, tracer, parts, args::limits(eps, cone, max_steps, prune, false)?, (device, strict))?;
    if let (Ok(o), Ok(d)) = (origins.extract(), directions.extract()) {
        return run::<f32>(py, &job, [o, d], [SpanArg::take(t_min)?, SpanArg::take(t_max)?], progress);
    }
    let rays = [origins.extract()?, directions.extract()?];
    run::<f64>(py, &job, rays, [SpanArg::take(t_min)?, SpanArg::take(t_max)?], progress)
}

/// Traces the rays of a camera.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // one call from one place: trace_stats() in render.py
pub fn trace_camera<'py>(
    py: Python<'py>,
    node: &Bound<'py, Node>,
    camera: CameraArg,
    tracer: &str,
    parts: &Bound<'py, PyDict>,
    t_max: f64,
    eps: f64,
    cone: f64,
    max_steps: u32,
    prune: &str,
    precision: &str,
    device: &str,
    strict: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    fn run<'py, T: Number>(
        py: Python<'py>,
        job: &Job<'_>,
        camera: &Camera,
        t_max: f64,
        callback: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let progress = Progress { callback, total: camera.pixels() };
        let (hits, summary, used) = call::long(py, &progress, |control| {
            let walk = (&job.tracer, &job.limits, t_max);
            Ok(T::trace_camera(job.on, job.shape, camera, walk, control)?)
        })?;
        hits_fields(py, hits, &summary, &used)
    }
    let job =
        Job::new(node, tracer, parts, args::limits(eps, cone, max_steps, prune, false)?, (device, strict))?;
    let camera = camera.get().map_err(Fault::from)?;
    if args::is_f32(precision)? {
        run::<f32>(py, &job, &camera, t_max, progress)
    } else {
        run::<f64>(py, &job, &camera, t_max, progress)
    }
}

/// Renders a picture.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // one call from one place: render() in render.py
pub fn render<'py>(
    py: Python<'py>,
    node: &Bound<'py, Node>,
    camera: CameraArg,
    lights: Vec<LightArg>,
    background: [f64; 3],
    albedo: [f64; 3],
    tracer: &str,
    parts: &Bound<'py, PyDict>,
    t_max: f64,
    eps: f64,
    cone: f64,
    max_steps: u32,
    prune: &str,
    precision: &str,
    device: &str,
    strict: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    fn run<'py, T: Number>(
        py: Python<'py>,
        job: &Job<'_>,
        scene: &Scene<'_>,
        t_max: f64,
        callback: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let progress = Progress { callback, total: scene.camera.pixels() };
        let (picture, used) = call::long(py, &progress, |control| {
            Ok(T::render(job.on, scene, (&job.tracer, &job.limits, t_max), control)?)
        })?;
        let dict = hits_fields(py, picture.hits, &picture.summary, &used)?;
        dict.set_item("rgb", flat(py, picture.rgb.into_flattened()))?;
        dict.set_item("normals", triples(py, picture.normals)?)?;
        dict.set_item("trace_seconds", picture.timings.trace_seconds)?;
        dict.set_item("shade_seconds", picture.timings.shade_seconds)?;
        Ok(dict)
    }
    let job =
        Job::new(node, tracer, parts, args::limits(eps, cone, max_steps, prune, true)?, (device, strict))?;
    let camera = camera.get().map_err(Fault::from)?;
    let lights = scene::lights(lights);
    let scene =
        Scene { shape: job.shape, camera: &camera, lights: &lights, surface: Surface { albedo, background } };
    if args::is_f32(precision)? {
        run::<f32>(py, &job, &scene, t_max, progress)
    } else {
        run::<f64>(py, &job, &scene, t_max, progress)
    }
}

/// The arrays that maps are made of and the numbers of a trace, by the names of their Python fields.
fn hits_fields<'py, T: Number>(
    py: Python<'py>,
    hits: Hits<T>,
    summary: &Summary,
    used: &Used,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("t", flat(py, hits.t))?;
    dict.set_item("status", flat(py, hits.status))?;
    dict.set_item("steps", flat(py, hits.steps))?;
    dict.set_item("fallbacks", flat(py, hits.fallbacks))?;
    dict.set_item("multiplier", flat(py, hits.multiplier))?;
    dict.set_item("flags", flat(py, hits.flags))?;
    dict.set_item("summary", summary_fields(py, summary)?)?;
    dict.set_item("device", &used.words)?;
    dict.set_item("software", used.software)?;
    Ok(dict)
}

fn summary_fields<'py>(py: Python<'py>, s: &Summary) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let counts = [
        ("rays", s.rays),
        ("hits", s.hits),
        ("misses", s.misses),
        ("out_of_steps", s.out_of_steps),
        ("invalid", s.invalid),
        ("crossings", s.crossings),
        ("precision_limited", s.precision_limited),
        ("inside", s.inside),
        ("p50_steps", s.p50_steps.into()),
        ("p99_steps", s.p99_steps.into()),
        ("max_steps", s.max_steps.into()),
        ("fallbacks", s.fallbacks),
        ("evaluations", s.evaluations),
        ("node_evaluations", s.node_evaluations),
        ("p50_ops", s.p50_ops),
        ("p99_ops", s.p99_ops),
        ("arena_bytes", s.arena_bytes),
    ];
    for (name, value) in counts {
        dict.set_item(name, value)?;
    }
    let figures = [
        ("mean_steps", s.mean_steps),
        ("mean_ops", s.mean_ops),
        ("seconds", s.seconds),
        ("witness", s.witness),
        ("lipschitz_observed", s.lipschitz_observed),
    ];
    for (name, value) in figures {
        dict.set_item(name, value)?;
    }
    dict.set_item("prune", s.prune)?;
    Ok(dict)
}
