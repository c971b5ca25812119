//! Memory on the GPU: made within its limits, filled and read back.

use std::sync::{Arc, Mutex, PoisonError};

use sdfrs_core::Control;

use crate::{device::Device, error::GpuError};

/// What a buffer is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    /// Read or written by shaders.
    Storage,
    Uniform,
}

/// A buffer of at least 16 bytes; refused before the driver is asked where the adapter cannot hold it.
pub fn make(device: &Device, what: &str, bytes: u64, usage: Use) -> Result<wgpu::Buffer, GpuError> {
    let limits = device.limits();
    let (allowed, usage) = match usage {
        Use::Storage => (limits.max_storage_buffer_binding_size, wgpu::BufferUsages::STORAGE),
        Use::Uniform => (limits.max_uniform_buffer_binding_size, wgpu::BufferUsages::UNIFORM),
    };
    let allowed = allowed.min(limits.max_buffer_size);
    let size = bytes.max(16).next_multiple_of(4);
    if size > allowed {
        return Err(GpuError::Limits { what: format!("{what}: bytes in one buffer"), asked: bytes, allowed });
    }
    let usage = usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
    raw(device, what, size, usage)
}

fn raw(device: &Device, what: &str, size: u64, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer, GpuError> {
    let descriptor = wgpu::BufferDescriptor { label: Some(what), size, usage, mapped_at_creation: false };
    device.scoped(what, size, || device.raw().create_buffer(&descriptor))
}

/// A buffer with the given contents.
pub fn upload(device: &Device, what: &str, data: &[u8], usage: Use) -> Result<wgpu::Buffer, GpuError> {
    let buffer = make(device, what, data.len() as u64, usage)?;
    write(device, &buffer, 0, data)?;
    Ok(buffer)
}

/// Most bytes on their way at a time: they wait in memory of the driver's own.
const PORTION: usize = 64 << 20;

/// Writes bytes, a multiple of four of them, to a place in a buffer.
pub fn write(device: &Device, buffer: &wgpu::Buffer, offset: u64, data: &[u8]) -> Result<(), GpuError> {
    let mut at = offset;
    for portion in data.chunks(PORTION) {
        device
            .scoped("an upload", portion.len() as u64, || device.queue().write_buffer(buffer, at, portion))?;
        at += portion.len() as u64;
        if data.len() > PORTION {
            // Hands the portion over before the next is copied.
            let done = device.submit(device.raw().create_command_encoder(&Default::default()))?;
            device.wait(done, &Control::new())?;
        }
    }
    Ok(())
}

/// Memory that the processor reads; made once and used again by readers of many small parts.
pub struct Reader {
    staging: wgpu::Buffer,
}

impl Reader {
    pub fn new(device: &Device, bytes: u64) -> Result<Self, GpuError> {
        let allowed = device.limits().max_buffer_size;
        let size = bytes.max(16).next_multiple_of(4);
        if size > allowed {
            return Err(GpuError::Limits { what: "bytes to read back".into(), asked: bytes, allowed });
        }
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        Ok(Self { staging: raw(device, "what is read back", size, usage)? })
    }

    /// Adds the copy of `bytes` from the start of a buffer to the commands before they are submitted.
    pub fn copy(&self, encoder: &mut wgpu::CommandEncoder, from: &wgpu::Buffer, bytes: u64) {
        encoder.copy_buffer_to_buffer(from, 0, &self.staging, 0, bytes);
    }

    /// What the copy brought, once its submission is through.
    pub fn read(
        &self,
        device: &Device,
        submission: wgpu::SubmissionIndex,
        control: &Control,
        bytes: u64,
        take: impl FnOnce(&[u8]),
    ) -> Result<(), GpuError> {
        let refused = |message: String| GpuError::Refused { what: "reading back".into(), message };
        let answer = Arc::new(Mutex::new(None));
        let slot = answer.clone();
        let slice = self.staging.slice(..bytes);
        device.scoped("reading back", 0, || {
            slice.map_async(wgpu::MapMode::Read, move |result| {
                *slot.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
            })
        })?;
        let waited = device.wait(submission, control);
        if waited.is_err() {
            // Cancels the mapping, so that the memory can be used again.
            self.staging.unmap();
            return waited;
        }
        let answer = answer.lock().unwrap_or_else(PoisonError::into_inner).take();
        match answer {
            Some(Ok(())) => {}
            Some(Err(error)) => return Err(refused(error.to_string())),
            None => return Err(refused("the driver finished without an answer".into())),
        }
        let taken = slice.get_mapped_range().map(|view| take(&view)).map_err(|e| refused(e.to_string()));
        self.staging.unmap();
        taken
    }
}
