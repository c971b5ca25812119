//! A field on the GPU: values and gradients at points, twin of the CPU's evaluator.
//!
//! Law (tests/parity.rs): the CPU's f32 bits in strict mode where only + - * / sqrt min max floor are used,
//! and on every driver a few ulp of the scene's size otherwise.

use std::{sync::Arc, time::Instant};

use sdfrs_core::{
    Control, Shape,
    graph::{Form, Graph},
};

use crate::{
    buffers::{self, Reader, Use},
    device::Device,
    emit::{self, Emitted},
    error::GpuError,
    pace::Pace,
    pipelines::{self, Binding, Pipeline},
    scene::Scene,
};

/// Points a workgroup.
const GROUP: u64 = 64;
/// Fewest and most points a submission.
const BATCH: [u64; 2] = [1 << 14, 1 << 20];
const PASS: [Binding; 3] = [Binding::Uniform, Binding::Read, Binding::ReadWrite];

/// A shape ready to be evaluated on a device.
pub struct GpuField {
    device: Arc<Device>,
    emitted: Emitted,
    scene: Scene,
}

/// The buffers of a call.
struct Batch {
    pipeline: Arc<Pipeline>,
    params: wgpu::Buffer,
    points: wgpu::Buffer,
    values: wgpu::Buffer,
    reader: Reader,
    groups: [wgpu::BindGroup; 2],
}

impl GpuField {
    /// The field's values, regrouped as the driver likes.
    pub fn new(device: &Arc<Device>, shape: &Shape) -> Result<Self, GpuError> {
        Self::with(device, shape, Form::Value, false)
    }

    /// Any form of the field; `strict` keeps every operation as rounded.
    pub fn with(device: &Arc<Device>, shape: &Shape, form: Form, strict: bool) -> Result<Self, GpuError> {
        Self::of(device, emit::emit(&Graph::new(shape, form)?, strict)?)
    }

    /// A scene that was emitted already.
    pub fn of(device: &Arc<Device>, emitted: Emitted) -> Result<Self, GpuError> {
        let scene = Scene::new(device, &emitted)?;
        Ok(Self { device: device.clone(), emitted, scene })
    }

    pub fn emitted(&self) -> &Emitted {
        &self.emitted
    }

    /// The field at points.
    pub fn evaluate(&self, points: &[[f32; 3]]) -> Result<Vec<f32>, GpuError> {
        let mut out = vec![0.0; points.len()];
        self.run("evaluate", points, &mut out, 1, &Control::new())?;
        Ok(out)
    }

    /// Gradient and value at points: d/dx, d/dy, d/dz, f.
    pub fn gradient(&self, points: &[[f32; 3]]) -> Result<Vec<[f32; 4]>, GpuError> {
        let mut out = vec![[0.0; 4]; points.len()];
        self.run("evaluate_gradient", points, out.as_flattened_mut(), 4, &Control::new())?;
        Ok(out)
    }

    /// `width` numbers a point, by batches that can be cancelled in between.
    pub fn run(
        &self,
        entry: &str,
        points: &[[f32; 3]],
        out: &mut [f32],
        width: usize,
        control: &Control,
    ) -> Result<(), GpuError> {
        self.device.check()?;
        if points.is_empty() {
            return Ok(());
        }
        let most = BATCH[1].min(points.len() as u64);
        let batch = self.batch(entry, most, width as u64)?;
        // Long scenes start with fewer points: the first batch is a guess, and nothing can cut it short.
        let least = (BATCH[0] * 1000 / (1000 + self.emitted.ops as u64)).max(GROUP);
        let mut pace = Pace::new(least.min(most), most);
        let mut at = 0;
        while at < points.len() {
            if control.is_cancelled() {
                return Err(GpuError::Cancelled);
            }
            let end = points.len().min(at + pace.size() as usize);
            let start = Instant::now();
            self.step(&batch, &points[at..end], &mut out[at * width..end * width], control)?;
            pace.learn((end - at) as u64, start.elapsed());
            control.advance((end - at) as u64);
            at = end;
        }
        Ok(())
    }

    /// The compiled shader of an entry point: `evaluate` or `evaluate_gradient`.
    pub fn pipeline(&self, entry: &str) -> Result<Arc<Pipeline>, GpuError> {
        let text = self.emitted.link(&[sdfrs_shaders::EVALUATE.text], entry)?;
        self.device.pipelines().get(&self.device, &text, entry, &[&PASS, &self.emitted.bindings()])
    }

    fn batch(&self, entry: &str, most: u64, width: u64) -> Result<Batch, GpuError> {
        let device = &*self.device;
        let pipeline = self.pipeline(entry)?;
        let params = buffers::make(device, "parameters", 16, Use::Uniform)?;
        let points = buffers::make(device, "points", 12 * most, Use::Storage)?;
        let values = buffers::make(device, "values", 4 * width * most, Use::Storage)?;
        let reader = Reader::new(device, 4 * width * most)?;
        let own = pipelines::bind(device, &pipeline, 0, &[&params, &points, &values])?;
        let groups = [own, self.scene.bind(device, &pipeline)?];
        Ok(Batch { pipeline, params, points, values, reader, groups })
    }

    fn step(
        &self,
        batch: &Batch,
        points: &[[f32; 3]],
        out: &mut [f32],
        control: &Control,
    ) -> Result<(), GpuError> {
        let device = &*self.device;
        // zero, count, padding.
        let params = [0u32, points.len() as u32, 0, 0];
        buffers::write(device, &batch.params, 0, bytemuck::cast_slice(&params))?;
        buffers::write(device, &batch.points, 0, bytemuck::cast_slice(points))?;
        let bytes = size_of_val(out) as u64;
        let encoder = device.scoped("commands", 0, || {
            let mut encoder = device.raw().create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&batch.pipeline.pipeline);
                for (group, index) in batch.groups.iter().zip(0..) {
                    pass.set_bind_group(index, group, &[]);
                }
                pass.dispatch_workgroups((points.len() as u64).div_ceil(GROUP) as u32, 1, 1);
            }
            batch.reader.copy(&mut encoder, &batch.values, bytes);
            encoder
        })?;
        let submission = device.submit(encoder)?;
        batch.reader.read(device, submission, control, bytes, |bytes| {
            out.copy_from_slice(bytemuck::cast_slice(bytes));
        })
    }
}
