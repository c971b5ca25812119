//! From a scene and a camera to a picture on the GPU: trace, then normals, then light, tile by tile.
//!
//! Twin: `sdfrs_trace::render`. In strict mode the rays come from there, bit for bit; otherwise the GPU makes
//! them. Law (tests/parity.rs): the hits of the CPU, exceptions on silhouettes.

use std::time::Instant;

use sdfrs_core::{Control, Hits, Limits, Shape};
use sdfrs_trace::{
    TraceError, Tracer,
    camera::Camera,
    render::{CameraRays, Picture, Scene, Timings},
    shade::PointLight,
    stats::Summary,
};

use crate::{
    camera,
    compiled::{Compiled, From as Rays, Settings, source},
    device::Device,
    dispatch::{Course, Dispatcher},
    emit::patches::Raster,
    error::GpuError,
    march::{Job, Traced},
    shade::Shader,
    tracer::parts_of,
};

impl From<TraceError> for GpuError {
    fn from(error: TraceError) -> Self {
        match error {
            TraceError::Scene(error) => error.into(),
            TraceError::Cancelled => GpuError::Cancelled,
        }
    }
}

/// A camera's rays: made here in strict mode, there otherwise.
struct View {
    rays: CameraRays<f32>,
    view: crate::contract::View,
    pixels: usize,
    t_max: f32,
    strict: bool,
}

impl View {
    fn new(camera: &Camera, tracer: &Tracer, t_max: f64, strict: bool) -> Result<Self, GpuError> {
        let rays = CameraRays::<f32>::new(camera, tracer, t_max)?;
        let view = camera::view(&rays.frame, camera.width, camera.height);
        // Fits: checked with the image's size.
        Ok(Self { rays, view, pixels: camera.pixels() as usize, t_max: t_max as f32, strict })
    }
    fn raster(&self, tracer: &Tracer, limits: &Limits) -> Raster {
        let (width, height) = (self.view.width, self.view.height);
        let (eps, cone, skip) = (limits.eps, limits.cone, parts_of(tracer).can_leap());
        Raster { frame: self.rays.frame, width, height, t_max: self.t_max, eps, cone, skip }
    }
    fn source(&self) -> Rays<'_> {
        if self.strict { Rays::Host(&self.rays) } else { Rays::Camera(self.view, self.t_max) }
    }
}

/// Traces all rays of a camera from t = 0, without shading.
pub fn trace_camera(
    device: &Device,
    shape: &Shape,
    camera: &Camera,
    (tracer, limits, t_max): (&Tracer, &Limits, f64),
    settings: Settings,
    control: &Control,
) -> Result<(Hits<f32>, Summary, Course), GpuError> {
    let view = View::new(camera, tracer, t_max, settings.strict)?;
    let raster = view.raster(tracer, limits);
    let scene = Compiled::for_picture(device, shape, (raster, limits.prune), settings, control)?;
    let job = Job::new(device, &scene, tracer, limits, view.t_max.into(), &view.source(), control)?;
    let (hits, course) =
        job.run(Hits::blank(view.pixels), &view.source(), Some(camera.width), |_, _, _| Ok(()))?;
    let summary = Summary::of(&hits, course.walked, shape.lipschitz());
    Ok((hits, summary, course))
}

/// Renders a picture.
pub fn render(
    device: &Device,
    what: &Scene,
    (tracer, limits, t_max): (&Tracer, &Limits, f64),
    settings: Settings,
    control: &Control,
) -> Result<(Picture<f32>, Course), GpuError> {
    what.surface.check()?;
    what.lights.iter().try_for_each(PointLight::check)?;
    let view = View::new(what.camera, tracer, t_max, settings.strict)?;
    let raster = view.raster(tracer, limits);
    let scene = Compiled::for_picture(device, what.shape, (raster, limits.prune), settings, control)?;
    let job = Job::new(device, &scene, tracer, limits, view.t_max.into(), &view.source(), control)?;
    let mut shader = Shader::new(device, &scene, source(&view.source()), what.lights, &what.surface)?;
    let mut normals = vec![[0f32; 3]; view.pixels];
    let mut rgb = vec![[0u8; 3]; view.pixels];
    let mut shade_seconds = 0.0;
    let shade = |traced: &Traced<'_>, base: usize, dispatcher: &mut Dispatcher<'_>| {
        let (start, part) = (Instant::now(), base..base + traced.params.rays as usize);
        let done = shader.tile(traced, dispatcher, control, &mut normals[part.clone()], &mut rgb[part]);
        shade_seconds += start.elapsed().as_secs_f64();
        done
    };
    let (hits, course) =
        job.run(Hits::picture(view.pixels), &view.source(), Some(what.camera.width), shade)?;
    let picture = Picture {
        width: what.camera.width,
        height: what.camera.height,
        normals,
        rgb,
        summary: Summary::of(&hits, course.walked, what.shape.lipschitz()),
        hits,
        timings: Timings { trace_seconds: course.walked, shade_seconds },
    };
    Ok((picture, course))
}
