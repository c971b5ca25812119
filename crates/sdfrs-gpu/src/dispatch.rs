//! One dispatch after the other: submitted, waited for, timed.
//!
//! The GPU's own clock where the adapter has one, else the wall's, which holds the way there and back too.
//! Law (tests/march.rs): dispatches are short, once the first one has been measured.

use std::time::{Duration, Instant};

use sdfrs_core::Control;

use crate::{
    buffers::{self, Reader},
    device::Device,
    error::GpuError,
    pipelines::Pipeline,
};

/// Threads of a workgroup, as the shaders say.
const GROUP: u32 = 64;
/// Workgroups along the first axis.
const ROW: u32 = 32_768;

/// What the dispatches of a call came to.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Course {
    pub dispatches: u32,
    pub passes: u32,
    /// Seconds the GPU was busy, by its own clock if `by_timestamps`.
    pub seconds: f64,
    pub longest: Duration,
    /// Seconds of the wall's clock from the first ray to the last result, pipelines and shading not counted.
    pub walked: f64,
    pub by_timestamps: bool,
}

/// A pipeline with all that its shader sees.
pub struct Ready {
    pub pipeline: std::sync::Arc<Pipeline>,
    pub groups: Vec<wgpu::BindGroup>,
}

/// Runs dispatches and adds up what they cost.
pub struct Dispatcher<'a> {
    device: &'a Device,
    control: &'a Control,
    clock: Option<Clock>,
    pub course: Course,
}

impl<'a> Dispatcher<'a> {
    pub fn new(device: &'a Device, control: &'a Control) -> Result<Self, GpuError> {
        let clock = Clock::new(device)?;
        let course = Course { by_timestamps: clock.is_some(), ..Course::default() };
        Ok(Self { device, control, clock, course })
    }

    /// Runs `threads` threads, then reads the first bytes of a buffer, and says what it cost.
    pub fn run(
        &mut self,
        ready: &Ready,
        threads: u32,
        answer: &Reader,
        from: &wgpu::Buffer,
        bytes: u64,
        take: impl FnOnce(&[u8]),
    ) -> Result<Duration, GpuError> {
        if self.control.is_cancelled() {
            return Err(GpuError::Cancelled);
        }
        let start = Instant::now();
        let groups = threads.div_ceil(GROUP);
        let row = groups.clamp(1, ROW);
        let mut encoder = self.device.raw().create_command_encoder(&Default::default());
        {
            let timestamp_writes = self.clock.as_ref().map(Clock::writes);
            let descriptor = wgpu::ComputePassDescriptor { label: None, timestamp_writes };
            let mut pass = encoder.begin_compute_pass(&descriptor);
            pass.set_pipeline(&ready.pipeline.pipeline);
            for (i, group) in (0..).zip(&ready.groups) {
                pass.set_bind_group(i, group, &[]);
            }
            pass.dispatch_workgroups(row, groups.div_ceil(row), 1);
        }
        answer.copy(&mut encoder, from, bytes);
        if let Some(clock) = &self.clock {
            clock.resolve(&mut encoder);
        }
        let submission = self.device.submit(encoder)?;
        answer.read(self.device, submission.clone(), self.control, bytes, take)?;
        let busy = match &self.clock {
            Some(clock) => clock.read(self.device, submission, self.control)?,
            None => start.elapsed(),
        };
        self.course.dispatches += 1;
        self.course.seconds += busy.as_secs_f64();
        self.course.longest = self.course.longest.max(busy);
        Ok(busy)
    }
}

/// The GPU's clock around a dispatch.
struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    reader: Reader,
    /// Seconds a tick.
    period: f64,
}

/// Two ticks of 8 bytes.
const TICKS: u64 = 16;

impl Clock {
    /// None where the adapter has no clock, or one that stands still.
    fn new(device: &Device) -> Result<Option<Self>, GpuError> {
        let raw = device.raw();
        let period = f64::from(device.queue().get_timestamp_period()) * 1e-9;
        if !raw.features().contains(wgpu::Features::TIMESTAMP_QUERY) || period <= 0.0 {
            return Ok(None);
        }
        let queries = wgpu::QuerySetDescriptor { label: None, ty: wgpu::QueryType::Timestamp, count: 2 };
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        let buffer = wgpu::BufferDescriptor { label: None, size: TICKS, usage, mapped_at_creation: false };
        let (queries, resolved) = device
            .scoped("the clock", TICKS, || (raw.create_query_set(&queries), raw.create_buffer(&buffer)))?;
        Ok(Some(Self { queries, resolved, reader: Reader::new(device, TICKS)?, period }))
    }

    fn writes(&self) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
        self.reader.copy(encoder, &self.resolved, TICKS);
    }

    fn read(
        &self,
        device: &Device,
        submission: wgpu::SubmissionIndex,
        control: &Control,
    ) -> Result<Duration, GpuError> {
        let mut ticks = [0u64; 2];
        self.reader.read(device, submission, control, TICKS, |bytes| {
            for (tick, eight) in ticks.iter_mut().zip(bytes.as_chunks::<8>().0) {
                *tick = u64::from_le_bytes(*eight);
            }
        })?;
        // A clock that ran backwards between two cores says nothing.
        let seconds = ticks[1].saturating_sub(ticks[0]) as f64 * self.period;
        Ok(Duration::try_from_secs_f64(seconds).unwrap_or_default())
    }
}

/// Writes the parameters that the next dispatch reads.
pub fn tell<P: bytemuck::Pod>(device: &Device, uniform: &wgpu::Buffer, params: &P) -> Result<(), GpuError> {
    buffers::write(device, uniform, 0, bytemuck::bytes_of(params))
}
