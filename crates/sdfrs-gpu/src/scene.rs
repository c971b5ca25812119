//! What a scene keeps on the GPU: constants, grids and the table of patches, the bindings of group 1.

use std::sync::Arc;

use crate::{
    buffers::{self, Use},
    device::Device,
    emit::{Emitted, Patches},
    error::GpuError,
    pipelines::{self, Pipeline},
};

/// A scene's buffers.
#[derive(Debug)]
pub struct Scene {
    consts: wgpu::Buffer,
    grids: Arc<wgpu::Buffer>,
    /// Which program runs where.
    patches: Option<wgpu::Buffer>,
}

impl Scene {
    pub fn new(device: &Device, emitted: &Emitted) -> Result<Self, GpuError> {
        if let Some(allowed) = device.most_loops().filter(|most| emitted.loops > *most) {
            let what = "rounds of loops in an evaluation on a driver in software".into();
            return Err(GpuError::Limits { what, asked: emitted.loops, allowed });
        }
        let usage = if emitted.is_uniform() { Use::Uniform } else { Use::Storage };
        let data = bytemuck::cast_slice(&emitted.consts);
        let consts = buffers::upload(device, "a scene's constants", data, usage)?;
        let table =
            |p: &Patches| buffers::upload(device, "patches", bytemuck::cast_slice(&p.table), Use::Storage);
        let patches = emitted.patches.as_ref().map(table).transpose()?;
        Ok(Self { consts, grids: device.grids().get(device, &emitted.grids)?, patches })
    }

    /// Other constants for the same text.
    pub fn update(&self, device: &Device, consts: &[f32]) -> Result<(), GpuError> {
        buffers::write(device, &self.consts, 0, bytemuck::cast_slice(consts))
    }

    /// The bind group 1 of a pipeline that was made with [`Emitted::bindings`].
    pub fn bind(&self, device: &Device, pipeline: &Pipeline) -> Result<wgpu::BindGroup, GpuError> {
        let own = [&self.consts, &self.grids];
        let all: Vec<&wgpu::Buffer> = own.into_iter().chain(&self.patches).collect();
        pipelines::bind(device, pipeline, 1, &all)
    }
}
