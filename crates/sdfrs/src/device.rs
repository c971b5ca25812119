//! Which device computes, and why: the CPU, or a GPU through `sdfrs_gpu`.
//!
//! `auto` takes a real GPU, never a driver in software, and the CPU wherever the GPU cannot or need not be
//! used: it never fails for want of a device, and says what it took. Whoever names a GPU gets it or an error.
//! Law: tests/python/test_gpu.py.

use std::{fmt, str::FromStr};

use sdfrs_core::{Hits, Limits, Program, Rays, SceneError, Shape, contract, eval, pool};
use sdfrs_trace::{
    Camera, TraceError, Tracer,
    render::{self, Picture, Scene},
    stats::Summary,
    voxel,
};

use crate::Control;

/// What a user asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    Cpu,
    Auto,
    /// Any GPU, or the one with this number.
    Gpu(Option<usize>),
}

impl FromStr for Choice {
    type Err = DeviceError;

    fn from_str(text: &str) -> Result<Self, DeviceError> {
        match (text, text.strip_prefix("gpu:").map(str::parse)) {
            ("cpu", _) => Ok(Choice::Cpu),
            ("auto", _) => Ok(Choice::Auto),
            ("gpu", _) => Ok(Choice::Gpu(None)),
            (_, Some(Ok(index))) => Ok(Choice::Gpu(Some(index))),
            _ => Err(DeviceError::Refused(format!(
                "device: asked for {text:?}, allowed: \"auto\", \"cpu\", \"gpu\", or \"gpu:N\" for the N-th of \
                 `sdfrs doctor`"
            ))),
        }
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Choice::Cpu => f.write_str("cpu"),
            Choice::Auto => f.write_str("auto"),
            Choice::Gpu(None) => f.write_str("gpu"),
            Choice::Gpu(Some(n)) => write!(f, "gpu:{n}"),
        }
    }
}

/// A device that cannot be had, or a trace that failed on it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DeviceError {
    #[error("{0}")]
    Refused(String),
    #[error(transparent)]
    Trace(#[from] TraceError),
}

impl From<SceneError> for DeviceError {
    fn from(e: SceneError) -> Self {
        DeviceError::Trace(e.into())
    }
}

/// What computed, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Used {
    pub words: String,
    /// A GPU driver that runs on the processor.
    pub software: bool,
}

impl Used {
    fn cpu(why: &str) -> Self {
        let words = format!("cpu ({} threads, {}): {why}", pool::threads(), eval::isa().name());
        Used { words, software: false }
    }
}

/// How to compute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct On {
    pub device: Choice,
    /// The bits of the CPU on a GPU, as far as its driver rounds correctly.
    pub strict: bool,
}

/// How to walk: the tracer, its limits, the end of the rays of a camera.
pub type Walk<'a> = (&'a Tracer, &'a Limits, f64);

/// With fewer rays the way to a GPU and back costs more than the CPU takes.
#[cfg(feature = "gpu")]
const FEW: u64 = 1 << 14;

/// Numbers that a device may compute with.
pub trait Number: eval::Native {
    fn trace(
        on: On,
        shape: &Shape,
        tracer: &Tracer,
        rays: &Rays<Self>,
        limits: &Limits,
        control: &Control,
    ) -> Result<(Hits<Self>, Summary, Used), DeviceError>;
    fn trace_camera(
        on: On,
        shape: &Shape,
        camera: &Camera,
        walk: Walk,
        control: &Control,
    ) -> Result<(Hits<Self>, Summary, Used), DeviceError>;
    fn render(
        on: On,
        scene: &Scene,
        walk: Walk,
        control: &Control,
    ) -> Result<(Picture<Self>, Used), DeviceError>;
}

/// A build without GPUs says so.
#[cfg(not(feature = "gpu"))]
macro_rules! either {
    ($on:ident, $rays:expr, $cpu:ident, $gpu:ident) => {
        match $on.device {
            Choice::Cpu => ($cpu()?, Used::cpu("asked for")),
            Choice::Auto => ($cpu()?, Used::cpu("this build has no GPU support")),
            gpu => {
                let message = format!("device: asked for \"{gpu}\", but this build has only \"cpu\"");
                return Err(DeviceError::Refused(message));
            }
        }
    };
}

#[cfg(feature = "gpu")]
macro_rules! either {
    ($on:ident, $rays:expr, $cpu:ident, $gpu:ident) => {
        choose($on, $rays, $cpu, $gpu)?
    };
}

/// f64 exists on the CPU alone.
fn only_cpu(device: Choice) -> Result<Used, DeviceError> {
    match device {
        Choice::Cpu => Ok(Used::cpu("asked for")),
        Choice::Auto => Ok(Used::cpu("GPUs compute in f32, asked for f64")),
        gpu => Err(DeviceError::Refused(format!(
            "device: asked for \"{gpu}\" with precision f64, allowed: f32 (shaders have no f64)"
        ))),
    }
}

impl Number for f64 {
    fn trace(
        on: On,
        shape: &Shape,
        tracer: &Tracer,
        rays: &Rays<f64>,
        limits: &Limits,
        control: &Control,
    ) -> Result<(Hits<f64>, Summary, Used), DeviceError> {
        let used = only_cpu(on.device)?;
        let (hits, summary) = cpu_trace(shape, tracer, rays, limits, control)?;
        Ok((hits, summary, used))
    }

    fn trace_camera(
        on: On,
        shape: &Shape,
        camera: &Camera,
        (tracer, limits, t_max): Walk,
        control: &Control,
    ) -> Result<(Hits<f64>, Summary, Used), DeviceError> {
        let used = only_cpu(on.device)?;
        let (hits, summary) = render::trace_camera(shape, camera, tracer, limits, t_max, control)?;
        Ok((hits, summary, used))
    }

    fn render(
        on: On,
        scene: &Scene,
        (tracer, limits, t_max): Walk,
        control: &Control,
    ) -> Result<(Picture<f64>, Used), DeviceError> {
        let used = only_cpu(on.device)?;
        Ok((render::render(scene, tracer, limits, t_max, control)?, used))
    }
}

impl Number for f32 {
    fn trace(
        on: On,
        shape: &Shape,
        tracer: &Tracer,
        rays: &Rays<f32>,
        limits: &Limits,
        control: &Control,
    ) -> Result<(Hits<f32>, Summary, Used), DeviceError> {
        let cpu = || cpu_trace(shape, tracer, rays, limits, control);
        #[cfg(feature = "gpu")]
        let gpu = |device: &gpu::Device, settings| {
            let (hits, course) = gpu::march::trace(device, shape, tracer, rays, limits, settings, control)?;
            let summary = Summary::of(&hits, course.walked, shape.lipschitz());
            Ok((hits, summary))
        };
        let ((hits, summary), used) = either!(on, rays.origins.len() as u64, cpu, gpu);
        Ok((hits, summary, used))
    }

    fn trace_camera(
        on: On,
        shape: &Shape,
        camera: &Camera,
        walk: Walk,
        control: &Control,
    ) -> Result<(Hits<f32>, Summary, Used), DeviceError> {
        let (tracer, limits, t_max) = walk;
        let cpu = || render::trace_camera(shape, camera, tracer, limits, t_max, control);
        #[cfg(feature = "gpu")]
        let gpu = |device: &gpu::Device, settings| {
            let (hits, summary, _) =
                gpu::render::trace_camera(device, shape, camera, walk, settings, control)?;
            Ok((hits, summary))
        };
        let ((hits, summary), used) = either!(on, camera.pixels(), cpu, gpu);
        Ok((hits, summary, used))
    }

    fn render(
        on: On,
        scene: &Scene,
        walk: Walk,
        control: &Control,
    ) -> Result<(Picture<f32>, Used), DeviceError> {
        let (tracer, limits, t_max) = walk;
        let cpu = || render::render(scene, tracer, limits, t_max, control);
        #[cfg(feature = "gpu")]
        let gpu = |device: &gpu::Device, settings| {
            Ok(gpu::render::render(device, scene, walk, settings, control)?.0)
        };
        Ok(either!(on, scene.camera.pixels(), cpu, gpu))
    }
}

fn cpu_trace<T: eval::Native>(
    shape: &Shape,
    tracer: &Tracer,
    rays: &Rays<T>,
    limits: &Limits,
    control: &Control,
) -> Result<(Hits<T>, Summary), TraceError> {
    let program = Program::<T>::for_tracing(shape)?;
    let start = std::time::Instant::now();
    contract::check_spans(rays.origins.len(), &rays.t_min, &rays.t_max, tracer.needs_finite_range())?;
    let hits = voxel::trace(shape, &program, tracer, rays, limits, control)?;
    let seconds = start.elapsed().as_secs_f64();
    let summary = Summary::of(&hits, seconds, shape.lipschitz());
    Ok((hits, summary))
}

/// The GPU's crate under one name.
#[cfg(feature = "gpu")]
mod gpu {
    pub use sdfrs_gpu::{
        Choice, Device, GpuError,
        march::{self, Settings},
        render,
    };
}

/// Runs on the GPU where that is asked for, or possible and worth it; else on the CPU, saying why.
#[cfg(feature = "gpu")]
fn choose<R>(
    on: On,
    rays: u64,
    cpu: impl FnOnce() -> Result<R, TraceError>,
    gpu: impl FnOnce(&gpu::Device, gpu::Settings) -> Result<R, gpu::GpuError>,
) -> Result<(R, Used), DeviceError> {
    use gpu::{Device, GpuError};
    let settings = gpu::Settings { strict: on.strict };
    let run = |device: std::sync::Arc<Device>, why: &str| {
        Ok::<_, GpuError>((gpu(&device, settings)?, used_gpu(&device, why)))
    };
    let asked = match on.device {
        Choice::Cpu => return Ok((cpu()?, Used::cpu("asked for"))),
        Choice::Auto if rays < FEW => {
            return Ok((cpu()?, Used::cpu("few rays, the way to a GPU costs more")));
        }
        Choice::Auto => {
            let done =
                Device::request(gpu::Choice::Auto).and_then(|device| run(device, "the first real GPU"));
            return match done {
                Err(GpuError::Scene(e)) => Err(e.into()),
                Err(GpuError::Cancelled) => Err(TraceError::Cancelled.into()),
                Err(why) => Ok((cpu()?, Used::cpu(&why.to_string()))),
                Ok(done) => Ok(done),
            };
        }
        Choice::Gpu(None) => gpu::Choice::Any,
        Choice::Gpu(Some(n)) => gpu::Choice::Index(n),
    };
    Device::request(asked).and_then(|device| run(device, "asked for")).map_err(|e| match e {
        GpuError::Scene(e) => e.into(),
        GpuError::Cancelled => TraceError::Cancelled.into(),
        other => DeviceError::Refused(format!("device: {other}")),
    })
}

#[cfg(feature = "gpu")]
fn used_gpu(device: &gpu::Device, why: &str) -> Used {
    let info = device.info();
    let words = format!("gpu {} ({}, {}, {}): {why}", info.name, info.kind.name(), info.backend, info.driver);
    Used { words, software: device.is_software() }
}

/// A GPU of this machine, as `sdfrs doctor` shows it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Adapter {
    pub name: String,
    /// discrete, integrated, virtual, other or software.
    pub kind: &'static str,
    pub driver: String,
    pub backend: String,
    pub max_binding_bytes: u64,
    pub max_buffer_bytes: u64,
    /// Why it cannot be used, where it cannot.
    pub missing: Option<String>,
}

/// The GPUs of this machine in the order of their numbers; best first, drivers in software last.
#[cfg(feature = "gpu")]
pub fn adapters() -> Result<Vec<Adapter>, DeviceError> {
    let all = sdfrs_gpu::adapters().map_err(|e| DeviceError::Refused(e.to_string()))?;
    let adapter = |info: sdfrs_gpu::AdapterInfo| Adapter {
        kind: info.kind.name(),
        name: info.name,
        driver: info.driver,
        backend: info.backend,
        max_binding_bytes: info.max_binding_bytes,
        max_buffer_bytes: info.max_buffer_bytes,
        missing: info.missing,
    };
    Ok(all.into_iter().map(adapter).collect())
}

/// None: this build has no GPU support.
#[cfg(not(feature = "gpu"))]
pub fn adapters() -> Result<Vec<Adapter>, DeviceError> {
    Ok(Vec::new())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_or_refused() {
        for (text, choice) in [
            ("cpu", Choice::Cpu),
            ("auto", Choice::Auto),
            ("gpu", Choice::Gpu(None)),
            ("gpu:0", Choice::Gpu(Some(0))),
            ("gpu:12", Choice::Gpu(Some(12))),
        ] {
            assert_eq!(text.parse(), Ok(choice));
            assert_eq!(choice.to_string(), text);
        }
        for text in ["", "GPU", "cuda", "gpu:", "gpu:-1", "gpu:1.5", "gpu:99999999999999999999"] {
            let error = text.parse::<Choice>().unwrap_err().to_string();
            assert!(error.contains(&format!("{text:?}")) && error.contains("allowed"), "{error}");
        }
    }

    #[test]
    fn f64_stays_on_the_cpu() {
        assert!(
            only_cpu(Choice::Cpu).is_ok() && only_cpu(Choice::Auto).is_ok_and(|u| u.words.contains("f64"))
        );
        assert!(only_cpu(Choice::Gpu(None)).unwrap_err().to_string().contains("f32"));
    }
}
