//! The GPUs of this machine: what there is, in the order of choice, and the instance they belong to.
//!
//! The instance is made on first use and kept: loading drivers takes 0.3 to 2.5 s. Law: a process that was
//! forked after that gets a typed error, at once and without touching a lock.

use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicU32, Ordering},
};

use crate::error::GpuError;

/// What an adapter is, best first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    Discrete,
    Integrated,
    Virtual,
    Other,
    /// A driver that runs shaders on the processor.
    Software,
}

impl Kind {
    pub fn name(self) -> &'static str {
        match self {
            Kind::Discrete => "discrete",
            Kind::Integrated => "integrated",
            Kind::Virtual => "virtual",
            Kind::Other => "other",
            Kind::Software => "software",
        }
    }
}

/// An adapter as `sdfrs doctor` shows it; its index is its place in [`adapters`].
#[derive(Debug, Clone)]
pub struct AdapterInfo {
    pub name: String,
    pub kind: Kind,
    pub driver: String,
    /// Vulkan, Metal or Dx12.
    pub backend: String,
    /// Most bytes that a shader can see in one buffer.
    pub max_binding_bytes: u64,
    pub max_buffer_bytes: u64,
    pub storage_buffers: u32,
    /// Why it cannot be used, where it cannot.
    pub missing: Option<String>,
}

/// The process that loaded the drivers; 0 before.
static OWNER: AtomicU32 = AtomicU32::new(0);
static INSTANCE: Mutex<Option<wgpu::Instance>> = Mutex::new(None);

/// Refuses a process that inherited an opened GPU.
pub(crate) fn check_process() -> Result<(), GpuError> {
    match OWNER.load(Ordering::Acquire) {
        0 => Ok(()),
        pid if pid == std::process::id() => Ok(()),
        parent => Err(GpuError::Forked { parent }),
    }
}

/// All adapters, best first; loads the drivers on the first call.
pub(crate) fn enumerate() -> Result<Vec<wgpu::Adapter>, GpuError> {
    check_process()?;
    // Before anything is loaded: a fork in between must not find a lock that nobody will open.
    OWNER.store(std::process::id(), Ordering::Release);
    let mut slot = INSTANCE.lock().unwrap_or_else(PoisonError::into_inner);
    let instance = slot.get_or_insert_with(|| {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::PRIMARY;
        // Nothing here dispatches indirectly, and validation layers are for those who ask by WGPU_VALIDATION.
        descriptor.flags = wgpu::InstanceFlags::empty().with_env();
        wgpu::Instance::new(descriptor)
    });
    let mut all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    all.sort_by_key(|adapter| kind(&adapter.get_info()));
    Ok(all)
}

pub(crate) fn kind(info: &wgpu::AdapterInfo) -> Kind {
    match info.device_type {
        wgpu::DeviceType::DiscreteGpu => Kind::Discrete,
        wgpu::DeviceType::IntegratedGpu => Kind::Integrated,
        wgpu::DeviceType::VirtualGpu => Kind::Virtual,
        wgpu::DeviceType::Other => Kind::Other,
        wgpu::DeviceType::Cpu => Kind::Software,
    }
}

/// What every adapter must offer: less than WebGPU promises, and more than any driver of today lacks.
const NEEDED: [(&str, u64); 5] = [
    ("storage buffers a shader", 8),
    ("bytes in a binding", 128 << 20),
    ("bytes in a uniform", 64 << 10),
    ("threads in a workgroup", 64),
    ("workgroups along an axis", 65_535),
];

/// The first limit that falls short.
pub(crate) fn check_limits(limits: &wgpu::Limits) -> Result<(), GpuError> {
    let offered = [
        u64::from(limits.max_storage_buffers_per_shader_stage),
        limits.max_storage_buffer_binding_size,
        limits.max_uniform_buffer_binding_size,
        u64::from(limits.max_compute_invocations_per_workgroup),
        u64::from(limits.max_compute_workgroups_per_dimension),
    ];
    match NEEDED.iter().zip(offered).find(|((_, needed), offered)| offered < needed) {
        Some(((what, asked), allowed)) => {
            Err(GpuError::Limits { what: (*what).into(), asked: *asked, allowed })
        }
        None => Ok(()),
    }
}

pub(crate) fn describe(adapter: &wgpu::Adapter) -> AdapterInfo {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    AdapterInfo {
        kind: kind(&info),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        backend: format!("{:?}", info.backend),
        max_binding_bytes: limits.max_storage_buffer_binding_size,
        max_buffer_bytes: limits.max_buffer_size,
        storage_buffers: limits.max_storage_buffers_per_shader_stage,
        missing: check_limits(&limits).err().map(|e| e.to_string()),
        name: info.name,
    }
}

/// The GPUs of this machine, best first, software last.
pub fn adapters() -> Result<Vec<AdapterInfo>, GpuError> {
    Ok(enumerate()?.iter().map(describe).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weak_adapters_are_refused_by_name() {
        assert_eq!(check_limits(&wgpu::Limits::default()), Ok(()));
        let error = check_limits(&wgpu::Limits::downlevel_defaults()).unwrap_err();
        assert!(error.to_string().contains("storage buffers a shader: asked for 8"), "{error}");
    }
}
