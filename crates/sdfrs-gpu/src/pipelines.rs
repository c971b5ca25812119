//! Compiled shaders, kept by their text: what was compiled once is not compiled again.
//!
//! Law (tests/parity.rs): moving an object changes constants, not the text, so nothing is compiled;
//! [`Pipelines::compiled`] counts.

use std::{
    collections::HashMap,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use crate::{device::Device, error::GpuError};

/// Most pipelines kept; the one that was used longest ago goes first.
const MOST: usize = 128;

/// What a shader sees at a place of a bind group.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Binding {
    Uniform,
    Read,
    ReadWrite,
}

/// A compiled shader with the layouts of its bind groups.
#[derive(Debug)]
pub struct Pipeline {
    pub pipeline: wgpu::ComputePipeline,
    /// Group 0 is the pass's own, group 1 the scene's.
    pub layouts: Vec<wgpu::BindGroupLayout>,
}

#[derive(PartialEq, Eq, Hash, Clone)]
struct Key {
    text: Arc<str>,
    entry: String,
    groups: Vec<Vec<Binding>>,
}

#[derive(Default)]
struct Slot {
    /// Locked while it compiles: others who ask for the same text wait, those with another do not.
    made: Mutex<Option<Arc<Pipeline>>>,
    used: AtomicU64,
}

/// The pipelines of a device.
#[derive(Default)]
pub struct Pipelines {
    slots: Mutex<HashMap<Key, Arc<Slot>>>,
    clock: AtomicU64,
    compiled: AtomicU64,
}

impl Pipelines {
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// How many shaders were compiled so far.
    pub fn compiled(&self) -> u64 {
        self.compiled.load(Ordering::Relaxed)
    }

    /// The pipeline of an entry point of a text; `groups` names what it sees, group by group.
    pub fn get(
        &self,
        device: &Device,
        text: &str,
        entry: &str,
        groups: &[&[Binding]],
    ) -> Result<Arc<Pipeline>, GpuError> {
        let groups = groups.iter().map(|g| g.to_vec()).collect();
        let key = Key { text: text.into(), entry: entry.into(), groups };
        let slot = self.slot(key.clone());
        let mut made = slot.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = made.as_ref() {
            return Ok(pipeline.clone());
        }
        let pipeline = Arc::new(compile(device, &key)?);
        self.compiled.fetch_add(1, Ordering::Relaxed);
        *made = Some(pipeline.clone());
        Ok(pipeline)
    }

    fn slot(&self, key: Key) -> Arc<Slot> {
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        let now = self.clock.fetch_add(1, Ordering::Relaxed);
        if slots.len() >= MOST && !slots.contains_key(&key) {
            let oldest = slots.iter().min_by_key(|(_, slot)| slot.used.load(Ordering::Relaxed));
            if let Some(oldest) = oldest.map(|(key, _)| key.clone()) {
                slots.remove(&oldest);
            }
        }
        let slot = slots.entry(key).or_default();
        slot.used.store(now, Ordering::Relaxed);
        slot.clone()
    }
}

fn compile(device: &Device, key: &Key) -> Result<Pipeline, GpuError> {
    let layouts: Vec<_> = key.groups.iter().map(|group| layout(device, group)).collect::<Result<_, _>>()?;
    let made = device.scoped(&key.entry, 0, || {
        let source = wgpu::ShaderSource::Wgsl(key.text.as_ref().into());
        let module = device
            .raw()
            .create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(&key.entry), source });
        let borrowed: Vec<_> = layouts.iter().map(Some).collect();
        let layout = device.raw().create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(&key.entry),
            bind_group_layouts: &borrowed,
            immediate_size: 0,
        });
        device.raw().create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(&key.entry),
            layout: Some(&layout),
            module: &module,
            entry_point: Some(&key.entry),
            compilation_options: Default::default(),
            cache: None,
        })
    });
    match made {
        Ok(pipeline) => Ok(Pipeline { pipeline, layouts }),
        Err(GpuError::Refused { what, message }) => Err(GpuError::Shader { name: what, message }),
        Err(error) => Err(error),
    }
}

fn layout(device: &Device, group: &[Binding]) -> Result<wgpu::BindGroupLayout, GpuError> {
    let entries: Vec<_> = group
        .iter()
        .zip(0..)
        .map(|(binding, at)| wgpu::BindGroupLayoutEntry {
            binding: at,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: match binding {
                    Binding::Uniform => wgpu::BufferBindingType::Uniform,
                    Binding::Read => wgpu::BufferBindingType::Storage { read_only: true },
                    Binding::ReadWrite => wgpu::BufferBindingType::Storage { read_only: false },
                },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        })
        .collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries };
    device.scoped("a layout", 0, || device.raw().create_bind_group_layout(&descriptor))
}

/// The bind group `index` of a pipeline: its buffers in order.
pub fn bind(
    device: &Device,
    pipeline: &Pipeline,
    index: usize,
    buffers: &[&wgpu::Buffer],
) -> Result<wgpu::BindGroup, GpuError> {
    let entries: Vec<_> = buffers
        .iter()
        .zip(0..)
        .map(|(buffer, binding)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    device.scoped("a bind group", 0, || {
        device.raw().create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.layouts[index],
            entries: &entries,
        })
    })
}
