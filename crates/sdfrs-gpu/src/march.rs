//! Rays through a scene: tiles of them, passes over the rays still active, dispatches of bounded cost.
//!
//! A pass reads the list of active rays and leaves the list of those that go on, so that neighbours in a
//! workgroup are rays with work to do. Twin: `sdfrs_trace::march`. Laws (tests/): strict mode gives the bits
//! of the CPU; the results depend on neither tiles nor passes nor the order of threads.

use std::time::Instant;

use sdfrs_core::{
    Control, Hits, Limits, Rays, Real, Shape, Status,
    contract::{Work, check_spans},
};
use sdfrs_trace::{
    Tracer,
    march::Source,
    voxel::{self, Placed},
};

pub use crate::compiled::{Compiled, From, Settings};
use crate::{
    buffers::{self, Reader, Use},
    compiled::source,
    contract::{Line, Params, Ray, STATUS, Tally},
    device::Device,
    dispatch::{Course, Dispatcher, Ready, tell},
    emit::Patches,
    error::GpuError,
    pipelines::Binding,
    share::Shares,
    tracer::Parts,
};

/// Rays of a tile at most.
const TILE: u64 = 1 << 20;
/// Bytes of a buffer at most: what every adapter can bind.
const BINDING: u64 = 128 << 20;

/// What a tile of rays came to, while it lies on the GPU.
pub struct Traced<'a> {
    pub params: Params,
    pub uniform: &'a wgpu::Buffer,
    pub rays: &'a wgpu::Buffer,
    pub tallies: &'a wgpu::Buffer,
}

/// Traces a batch of rays (finite, unit length: see `contract::check_rays`).
pub fn trace(
    device: &Device,
    shape: &Shape,
    tracer: &Tracer,
    rays: &Rays<f32>,
    limits: &Limits,
    settings: Settings,
    control: &Control,
) -> Result<(Hits<f32>, Course), GpuError> {
    check_spans(rays.origins.len(), &rays.t_min, &rays.t_max, tracer.needs_finite_range())?;
    let range = (0..rays.origins.len())
        .map(|i| f64::from(rays.t_max.at(i)) - f64::from(rays.t_min.at(i)))
        .fold(0.0, f64::max);
    let scene = Compiled::new(device, shape, settings)?;
    let job = Job::new(device, &scene, tracer, limits, range, &From::Host(rays), control)?;
    job.run(Hits::blank(rays.origins.len()), &From::Host(rays), None, |_, _, _| Ok(()))
}

/// A tracer, compiled for a scene.
pub struct Job<'a> {
    device: &'a Device,
    scene: &'a Compiled,
    parts: Parts,
    params: Params,
    modules: Vec<&'static str>,
    control: &'a Control,
}

/// The memory of a tile, and the pipelines bound to it.
struct Memory {
    uniform: wgpu::Buffer,
    rays: wgpu::Buffer,
    lists: wgpu::Buffer,
    tallies: wgpu::Buffer,
    /// Stacks, or lines.
    own: wgpu::Buffer,
    begin: Ready,
    pass: Ready,
    answer: Reader,
    results: Reader,
}

/// What every pass sees in group 0, in order: Params, rays, lists, walkers, tallies, stack.
const GROUP: [Binding; 6] = [
    Binding::Uniform,
    Binding::Read,
    Binding::ReadWrite,
    Binding::ReadWrite,
    Binding::ReadWrite,
    Binding::ReadWrite,
];

impl<'a> Job<'a> {
    pub fn new(
        device: &'a Device,
        scene: &'a Compiled,
        tracer: &Tracer,
        limits: &Limits,
        range: f64,
        from: &From<'_>,
        control: &'a Control,
    ) -> Result<Self, GpuError> {
        tracer.check()?;
        limits.check()?;
        let parts = scene.parts(tracer);
        let eps = limits.eps as f32;
        let params = Params {
            max_steps: limits.max_steps,
            guards: tracer.guards().into(),
            max_level: parts.max_level,
            depth: parts.stack.depth(range, eps.into(), limits.max_steps),
            eps,
            cone: limits.cone as f32,
            factor: parts.factor,
            ..Params::default()
        };
        let modules = scene.modules(&parts, source(from));
        Ok(Self { device, scene, parts, params, modules, control })
    }

    /// Bytes of a ray's stack, or of its line in cells.
    fn own_bytes(&self) -> u64 {
        let line = if self.scene.lines().is_some() { size_of::<Line>() as u64 } else { 0 };
        line.max(u64::from(self.params.depth) * 8)
    }

    /// Rays of a tile: whole bands of blocks where the rays are an image's and the memory allows it.
    fn tile(&self, width: Option<u32>) -> u64 {
        let entry = self.parts.walker_bytes.max(32).max(self.own_bytes());
        let most = (BINDING / entry).clamp(1, TILE);
        match width.map(|w| 8 * u64::from(w)) {
            Some(band) if band <= most => most - most % band,
            _ => most,
        }
    }

    /// Traces the rays of blank hits tile by tile; `then` sees each tile while it is on the GPU, and where it begins.
    pub fn run(
        mut self,
        mut hits: Hits<f32>,
        from: &From<'_>,
        width: Option<u32>,
        mut then: impl FnMut(&Traced<'_>, usize, &mut Dispatcher<'_>) -> Result<(), GpuError>,
    ) -> Result<(Hits<f32>, Course), GpuError> {
        let count = hits.t.len();
        let mut dispatcher = Dispatcher::new(self.device, self.control)?;
        if count == 0 {
            return Ok((hits, dispatcher.course));
        }
        let tile = self.tile(width).min(count as u64) as usize;
        if let From::Camera(view, t_max) = from {
            (self.params.view, self.params.t_max) = (*view, *t_max);
        }
        // Blocks of pixels need it wherever the rays come from.
        self.params.view.width = width.unwrap_or_default();
        let memory = self.memory(tile, matches!(from, From::Host(_)))?;
        let mut shares = Shares::new(self.scene.ops()).at_most(self.scene.most_steps(self.device));
        let mut walked = 0.0;
        for base in (0..count).step_by(tile) {
            let start = Instant::now();
            let rays = tile.min(count - base);
            let blocks =
                width.is_some_and(|w| base.is_multiple_of(w as usize) && rays.is_multiple_of(w as usize));
            let params =
                Params { rays: rays as u32, base: base as u32, blocks: blocks.into(), ..self.params };
            if let From::Host(source) = from {
                upload_rays(self.device, &memory.rays, *source, base, rays)?;
                if let Some(placed) = self.scene.lines() {
                    upload_lines(self.device, &memory.own, (*source, placed), base, rays)?;
                }
            }
            self.advance(&memory, params, &mut shares, &mut dispatcher, &mut hits)?;
            let traced =
                Traced { params, uniform: &memory.uniform, rays: &memory.rays, tallies: &memory.tallies };
            self.collect(&memory, &mut hits, base, rays)?;
            walked += start.elapsed().as_secs_f64();
            then(&traced, base, &mut dispatcher)?;
        }
        self.scene.count(&mut hits);
        if self.scene.walks_voxels() {
            // What a root was looked for with.
            hits.threshold = self.params.eps;
        }
        Ok((hits, Course { walked: walked + self.scene.planned(), ..dispatcher.course }))
    }

    fn memory(&self, tile: usize, from_host: bool) -> Result<Memory, GpuError> {
        let (device, tile) = (self.device, tile as u64);
        let storage = |what: &str, bytes: u64| buffers::make(device, what, bytes, Use::Storage);
        let uniform = buffers::make(device, "parameters", size_of::<Params>() as u64, Use::Uniform)?;
        let rays = storage("rays", if from_host { tile * size_of::<Ray>() as u64 } else { 32 })?;
        let lists = storage("lists", self.scene.answer() + 2 * 4 * tile)?;
        let walkers = storage("walks", tile * self.parts.walker_bytes)?;
        let tallies = storage("tallies", tile * size_of::<Tally>() as u64)?;
        let own = storage("stacks", tile * self.own_bytes())?;
        let bound = [&uniform, &rays, &lists, &walkers, &tallies, &own];
        let ready = |entry: &str| self.scene.walk().ready(device, &self.modules, entry, &GROUP, &bound);
        let [begin, pass] = self.scene.entries();
        let (begin, pass) = (ready(begin)?, ready(pass)?);
        let (answer, results) = (
            Reader::new(device, self.scene.answer())?,
            Reader::new(device, tile * size_of::<Tally>() as u64)?,
        );
        Ok(Memory { uniform, rays, lists, tallies, own, begin, pass, answer, results })
    }

    /// Walks the rays of a tile to their ends.
    fn advance(
        &self,
        memory: &Memory,
        params: Params,
        shares: &mut Shares,
        dispatcher: &mut Dispatcher<'_>,
        hits: &mut Hits<f32>,
    ) -> Result<(), GpuError> {
        let device = self.device;
        let bytes = self.scene.answer();
        let mut counted = Counted::new(self.scene.patches());
        buffers::write(device, &memory.lists, 0, &vec![0; bytes as usize])?;
        tell(device, &memory.uniform, &params)?;
        dispatcher.run(&memory.begin, params.rays, &memory.answer, &memory.lists, bytes, |_| ())?;
        shares.restart();
        let (mut live, mut half_read) = (params.rays, 0);
        while live > 0 {
            buffers::write(device, &memory.lists, 0, &[0; 4])?;
            let (mut first, mut kept, mut reported) = (0, 0, 0);
            while first < live {
                let share = shares.share(live - first);
                let now = Params { first, count: share.rays, steps: share.steps, half_read, ..params };
                tell(device, &memory.uniform, &now)?;
                let mut answer = [0u32; 2];
                let cost = dispatcher.run(
                    &memory.pass,
                    share.rays,
                    &memory.answer,
                    &memory.lists,
                    bytes,
                    |bytes| {
                        let words: &[u32] = bytemuck::cast_slice(bytes);
                        answer.copy_from_slice(&words[..2]);
                        counted.take(&words[2..], &mut hits.work);
                    },
                )?;
                shares.learn(share, share.rays == live, cost);
                first += share.rays;
                kept = answer[0];
                hits.threshold = hits.threshold.max(f32::from_bits(answer[1]));
                let ended = first.saturating_sub(kept);
                self.control.advance(u64::from(ended.saturating_sub(reported)));
                reported = reported.max(ended);
            }
            dispatcher.course.passes += 1;
            (live, half_read) = (kept, 1 - half_read);
        }
        Ok(())
    }

    /// Reads what became of a tile's rays.
    fn collect(
        &self,
        memory: &Memory,
        hits: &mut Hits<f32>,
        base: usize,
        rays: usize,
    ) -> Result<(), GpuError> {
        let bytes = (rays * size_of::<Tally>()) as u64;
        let mut encoder = self.device.raw().create_command_encoder(&Default::default());
        memory.results.copy(&mut encoder, &memory.tallies, bytes);
        let submission = self.device.submit(encoder)?;
        memory.results.read(self.device, submission, self.control, bytes, |bytes| {
            for (i, tally) in bytemuck::cast_slice::<u8, Tally>(bytes).iter().enumerate() {
                put(hits, base + i, tally);
            }
        })
    }
}

/// Points by the length of the program they ran, as counters that never go back to 0 but around.
struct Counted<'a> {
    lengths: &'a [u64],
    before: Vec<u32>,
}

impl<'a> Counted<'a> {
    fn new(patches: Option<&'a Patches>) -> Self {
        let lengths = patches.map_or(&[][..], |patches| &patches.lengths);
        Self { lengths, before: vec![0; lengths.len()] }
    }

    /// Adds what was counted since the last time.
    fn take(&mut self, counters: &[u32], work: &mut Work) {
        for ((ops, before), now) in self.lengths.iter().zip(&mut self.before).zip(counters) {
            let points = now.wrapping_sub(std::mem::replace(before, *now));
            if points > 0 {
                work.add(*ops, points.into());
            }
        }
    }
}

fn put(hits: &mut Hits<f32>, i: usize, tally: &Tally) {
    let status = tally.outcome & STATUS;
    hits.t[i] = if status == Status::Miss as u32 { f32::INFINITY } else { tally.t };
    // Both fit: the status has two bits, the flags have three.
    (hits.status[i], hits.flags[i]) = (status as u8, (tally.outcome >> 8) as u8);
    (hits.steps[i], hits.fallbacks[i]) = (tally.steps, tally.fallbacks);
    hits.multiplier[i] = tally.multiplier();
    // One that is no number is left out.
    hits.steepest = Real::max(tally.witness, hits.steepest);
    // A picture has neither.
    if let (Some(distance), Some(witness)) = (hits.distance.get_mut(i), hits.witness.get_mut(i)) {
        (*distance, *witness) = (tally.r, tally.witness);
    }
}

fn upload_rays(
    device: &Device,
    buffer: &wgpu::Buffer,
    source: &dyn Source<f32>,
    base: usize,
    count: usize,
) -> Result<(), GpuError> {
    let rays: Vec<Ray> = (base..base + count)
        .map(|i| source.ray(i))
        .map(|r| Ray { origin: r.origin, t_min: r.t_min, direction: r.direction, t_max: r.t_max })
        .collect();
    buffers::write(device, buffer, 0, bytemuck::cast_slice(&rays))
}

fn upload_lines(
    device: &Device,
    buffer: &wgpu::Buffer,
    (source, placed): (&dyn Source<f32>, &Placed),
    base: usize,
    count: usize,
) -> Result<(), GpuError> {
    let line = |i: usize| {
        let ray = source.ray(i);
        let voxel::Line { o, d, speed } = placed.line(&ray);
        Line { o, t_min: ray.t_min, d, t_max: ray.t_max, speed, ..Line::default() }
    };
    let lines: Vec<Line> = (base..base + count).map(line).collect();
    buffers::write(device, buffer, 0, bytemuck::cast_slice(&lines))
}
