//! What a scene keeps on the GPU: its constants and its grids, the bindings of group 1.
//!
//! All grids lie in one buffer, headers first: any number of them costs one binding. The buffer is kept
//! for as long as its grids live, so that moving a texture sends nothing but constants.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use sdfrs_core::{Grid, GridValues};

use crate::{
    buffers::{self, Use},
    device::Device,
    emit::Emitted,
    error::GpuError,
    pipelines::{self, Pipeline},
};

/// Words of a grid's header; their order stands in ops/texture.wgsl.
pub const HEADER: u32 = 16;

/// A scene's buffers.
#[derive(Debug)]
pub struct Scene {
    consts: wgpu::Buffer,
    grids: Arc<wgpu::Buffer>,
}

impl Scene {
    pub fn new(device: &Device, emitted: &Emitted) -> Result<Self, GpuError> {
        let consts = buffers::upload(
            device,
            "a scene's constants",
            bytemuck::cast_slice(&emitted.consts),
            Use::Storage,
        )?;
        Ok(Self { consts, grids: device.grids().get(device, &emitted.grids)? })
    }

    /// Other constants for the same text.
    pub fn update(&self, device: &Device, consts: &[f32]) -> Result<(), GpuError> {
        buffers::write(device, &self.consts, 0, bytemuck::cast_slice(consts))
    }

    /// The bind group 1 of a pipeline whose second group is [`pipelines::SCENE`].
    pub fn bind(&self, device: &Device, pipeline: &Pipeline) -> Result<wgpu::BindGroup, GpuError> {
        pipelines::bind(device, pipeline, 1, &[&self.consts, &self.grids])
    }
}

/// Uploaded grids of a device.
#[derive(Default)]
pub(crate) struct Grids {
    kept: Mutex<Vec<(Vec<Weak<Grid>>, Arc<wgpu::Buffer>)>>,
}

impl Grids {
    /// The buffer of a list of grids, uploaded unless it is there.
    fn get(&self, device: &Device, grids: &[Arc<Grid>]) -> Result<Arc<wgpu::Buffer>, GpuError> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|(owners, _)| owners.iter().all(|grid| grid.strong_count() > 0));
        let same = |owners: &[Weak<Grid>]| {
            owners.len() == grids.len() && owners.iter().zip(grids).all(|(a, b)| a.as_ptr() == Arc::as_ptr(b))
        };
        if let Some((_, buffer)) = kept.iter().find(|(owners, _)| same(owners)) {
            return Ok(buffer.clone());
        }
        let buffer = Arc::new(pack(device, grids)?);
        kept.push((grids.iter().map(Arc::downgrade).collect(), buffer.clone()));
        Ok(buffer)
    }
}

/// Headers, then values.
fn pack(device: &Device, grids: &[Arc<Grid>]) -> Result<wgpu::Buffer, GpuError> {
    let mut first = grids.len() as u64 * u64::from(HEADER);
    let mut headers = Vec::new();
    let mut starts = Vec::new();
    for grid in grids {
        headers.extend(header(grid, first));
        starts.push(first);
        first += grid.values().len() as u64;
    }
    // Words are counted in u32, which is what shaders index by.
    if first > u64::from(u32::MAX) {
        return Err(GpuError::Limits {
            what: "nodes of grids".into(),
            asked: first,
            allowed: u32::MAX.into(),
        });
    }
    let buffer = buffers::make(device, "grids", 4 * first, Use::Storage)?;
    buffers::write(device, &buffer, 0, bytemuck::cast_slice(&headers))?;
    for (grid, start) in grids.iter().zip(starts) {
        send(device, &buffer, 4 * start, grid.values())?;
    }
    Ok(buffer)
}

/// The words of ops/texture.wgsl.
fn header(grid: &Grid, first: u64) -> [u32; HEADER as usize] {
    let (lo, hi) = grid.bounds();
    let (divisor, subtrahend) = grid.safe();
    let floats = lo.into_iter().chain(hi).chain(grid.spacing()).chain([divisor, subtrahend]);
    let mut words = grid.dims().into_iter().map(|n| n as u32).chain([first as u32]).chain(
        // A subtrahend may be infinite, which shaders need not understand.
        floats.map(|v| (v as f32).clamp(-crate::emit::FAR, crate::emit::FAR).to_bits()),
    );
    std::array::from_fn(|_| words.next().unwrap_or(0))
}

/// Values converted at a time.
const PORTION: usize = 1 << 20;

fn send(device: &Device, buffer: &wgpu::Buffer, at: u64, values: &GridValues) -> Result<(), GpuError> {
    match values {
        GridValues::F32(v) => buffers::write(device, buffer, at, bytemuck::cast_slice(v)),
        GridValues::F64(v) => {
            for (portion, i) in v.chunks(PORTION).zip(0u64..) {
                let single: Vec<f32> = portion.iter().map(|v| *v as f32).collect();
                buffers::write(device, buffer, at + 4 * i * PORTION as u64, bytemuck::cast_slice(&single))?;
            }
            Ok(())
        }
    }
}
