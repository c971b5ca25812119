//! A scene in the form that rays are walked through: whole, shortened patch by patch of a picture, or as
//! voxels; and the shaders that walk it.
//!
//! Twin: the choices of `sdfrs_trace::voxel::trace` and `sdfrs_trace::march`. Law (tests/contract.rs): every
//! combination of shaders validates.

use std::time::Instant;

use sdfrs_core::{
    Control, Field, Hits, Program, Prune, Shape,
    graph::{Form, Graph},
};
use sdfrs_trace::{
    Tracer,
    march::Source,
    voxel::{self, Placed},
};

use crate::{
    contract::View,
    device::Device,
    dispatch::Ready,
    emit::{
        self, Emitted, Patches,
        patches::{LENGTHS, Raster},
    },
    error::GpuError,
    pipelines::{self, Binding},
    scene::Scene,
    tracer::{self, Parts},
};

/// Operations from which on automatic pruning leaps over empty slabs, or shortens programs; and operations times
/// pixels: below them straight lines are faster (docs/gpu.md has the table).
const WORTH_SKIPPING: (u64, u64) = (100, 12_000_000);
const WORTH_SHORTENING: (u64, u64) = (600, 20_000_000);
/// What the host learns from every dispatch, besides points by the length of their program: rays kept, the
/// largest threshold.
const ANSWER: u64 = 8;

/// Rounds of loops in a step besides those of the field, roughly and at most: searches, leaps, roots.
const STEP_LOOPS: u64 = 128;

/// How the GPU computes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Settings {
    /// Arithmetic in the order it is written: the bits of the CPU's f32 on drivers that round correctly.
    pub strict: bool,
}

/// Where the rays of a call come from.
pub enum From<'a> {
    Host(&'a dyn Source<f32>),
    /// Made by the GPU: axes, the end of every ray.
    Camera(View, f32),
}

/// The shader module that gives the rays.
pub fn source(from: &From<'_>) -> &'static str {
    match from {
        From::Host(_) => "source/batch",
        From::Camera(..) => "source/camera",
    }
}

/// A scene's text, and what it brings with it.
pub struct Text {
    emitted: Emitted,
    scene: Scene,
}

impl Text {
    fn new(device: &Device, emitted: Emitted) -> Result<Self, GpuError> {
        let scene = Scene::new(device, &emitted)?;
        Ok(Self { emitted, scene })
    }

    /// An entry point of the named modules over this scene, bound to the pass's own buffers.
    pub fn ready(
        &self,
        device: &Device,
        modules: &[&str],
        entry: &str,
        bindings: &[Binding],
        buffers: &[&wgpu::Buffer],
    ) -> Result<Ready, GpuError> {
        let text = self.emitted.link(&texts(modules), entry)?;
        let pipeline = device.pipelines().get(device, &text, entry, &[bindings, &self.emitted.bindings()])?;
        let own = pipelines::bind(device, &pipeline, 0, buffers)?;
        let groups = vec![own, self.scene.bind(device, &pipeline)?];
        Ok(Ready { pipeline, groups })
    }
}

/// A texture that stands alone and is walked from voxel to voxel.
struct Voxels {
    text: Text,
    placed: Placed,
    /// Lines in cells are made by the host: the bits of the CPU.
    by_host: bool,
}

/// A scene in the form that tracers walk, on a device.
pub struct Compiled {
    field: Text,
    voxels: Option<Voxels>,
    /// Operations of the CPU's program for a point, so that both devices count alike.
    ops: u64,
    /// Seconds that shortening programs took.
    planned: f64,
}

impl Compiled {
    /// The whole scene for every ray.
    pub fn new(device: &Device, shape: &Shape, settings: Settings) -> Result<Self, GpuError> {
        let program = Program::<f32>::for_tracing(shape)?;
        let emitted = emit::emit(&Graph::new(shape, Form::Walk)?, settings.strict)?;
        let all = Self::of(device, emitted, program.ops())?;
        match voxel::placed(shape) {
            Some(placed) => all.by_voxels(device, placed, settings),
            None => Ok(all),
        }
    }

    /// Programs shortened patch by patch of a picture, where that is asked for or pays.
    pub fn for_picture(
        device: &Device,
        shape: &Shape,
        (raster, prune): (Raster, Prune),
        settings: Settings,
        control: &Control,
    ) -> Result<Self, GpuError> {
        if voxel::placed(shape).is_some() {
            return Self::new(device, shape, settings);
        }
        let program = Program::<f32>::for_tracing(shape)?;
        let graph = Graph::new(shape, Form::Walk)?;
        let start = Instant::now();
        // Leaps depend on the cells, which are not the CPU's: strict mode takes them where they are asked for.
        let prune = if settings.strict && prune == (Prune::Auto { skip: true }) {
            Prune::Auto { skip: false }
        } else {
            prune
        };
        let prune = settle(prune, &program, &raster);
        let raster = Raster { skip: raster.skip && prune == Prune::Skip, ..raster };
        let patches = match Field::pruner(&program).filter(|_| prune != Prune::Off) {
            Some(pruner) => emit::emit_patches(&graph, pruner, &raster, settings.strict, control)?,
            None => None,
        };
        let planned = start.elapsed().as_secs_f64();
        let emitted = patches.map_or_else(|| emit::emit(&graph, settings.strict), Ok)?;
        Ok(Self { planned, ..Self::of(device, emitted, program.ops())? })
    }

    /// A scene emitted already, whose program on the CPU has so many operations.
    pub fn of(device: &Device, emitted: Emitted, ops: u64) -> Result<Self, GpuError> {
        Ok(Self { field: Text::new(device, emitted)?, voxels: None, ops, planned: 0.0 })
    }

    fn by_voxels(self, device: &Device, placed: Placed, settings: Settings) -> Result<Self, GpuError> {
        let text = Text::new(device, emit::emit_voxels(&placed, settings.strict)?)?;
        Ok(Self { voxels: Some(Voxels { text, placed, by_host: settings.strict }), ..self })
    }

    /// The field itself.
    pub fn field(&self) -> &Text {
        &self.field
    }
    /// What rays are walked through.
    pub fn walk(&self) -> &Text {
        self.voxels.as_ref().map_or(&self.field, |voxels| &voxels.text)
    }
    pub fn walks_voxels(&self) -> bool {
        self.voxels.is_some()
    }
    /// The texture whose cells the host has to lead rays to.
    pub fn lines(&self) -> Option<&Placed> {
        self.voxels.as_ref().filter(|voxels| voxels.by_host).map(|voxels| &voxels.placed)
    }
    /// Which shortened program runs where.
    pub fn patches(&self) -> Option<&Patches> {
        self.field.emitted.patches.as_ref()
    }
    /// Operations of the whole field for a point.
    pub fn ops(&self) -> u64 {
        self.ops
    }
    /// Steps that a dispatch may take: a driver in software ends loops that go around too often.
    pub fn most_steps(&self, device: &Device) -> u32 {
        let rounds = self.walk().emitted.loops + STEP_LOOPS;
        let most = device.most_loops().map_or(u64::from(u32::MAX), |most| most / rounds);
        most.clamp(1, u32::MAX.into()) as u32
    }
    /// Seconds that shortening programs took.
    pub fn planned(&self) -> f64 {
        self.planned
    }

    /// The parts of what walks: a tracer, unless it is voxels.
    pub fn parts(&self, tracer: &Tracer) -> Parts {
        match &self.voxels {
            Some(voxels) => tracer::voxels(voxels.by_host),
            None => tracer::parts_of(tracer),
        }
    }

    /// The entry points of a march: before the first pass, and a pass.
    pub fn entries(&self) -> [&'static str; 2] {
        if self.walks_voxels() { ["voxels_begin", "voxels_pass"] } else { ["march_begin", "march_pass"] }
    }

    /// The modules of a march, by name.
    pub fn modules(&self, parts: &Parts, source: &'static str) -> Vec<&'static str> {
        if self.walks_voxels() {
            voxel_modules(parts, source)
        } else {
            modules(parts, source, self.patches())
        }
    }

    /// Bytes that the host reads after a dispatch: a counter for each length of program.
    pub fn answer(&self) -> u64 {
        ANSWER + 4 * self.patches().map_or(1, |_| LENGTHS as u64)
    }

    /// Completes what was run: the whole program for every step, or the probes and the memory of shortened ones.
    pub fn count(&self, hits: &mut Hits<f32>) {
        let steps = hits.steps.iter().map(|n| u64::from(*n)).sum();
        match self.patches() {
            _ if self.walks_voxels() => hits.work.add(1, steps),
            None => hits.work.add(self.ops, steps),
            Some(patches) => {
                hits.work.prune = if patches.skip { Prune::Skip } else { Prune::Exact };
                hits.work.node_evaluations += patches.probed;
                hits.work.arena_bytes = patches.bytes;
            }
        }
    }
}

/// What is pruned of a picture: nothing where that would cost more than it saves.
fn settle(asked: Prune, program: &Program<f32>, raster: &Raster) -> Prune {
    let (ops, pixels) = (program.ops(), u64::from(raster.width) * u64::from(raster.height));
    let worth = |(least, all): (u64, u64)| ops >= least && ops * pixels >= all;
    let Some(pruner) = Field::pruner(program) else { return Prune::Off };
    // The interpreter gives nothing for programs that stay as long as they are.
    match asked {
        Prune::Skip => Prune::Skip,
        Prune::Off => Prune::Off,
        _ if !pruner.has_choices() => Prune::Off,
        Prune::Exact => Prune::Exact,
        Prune::Auto { skip: true } if raster.skip && worth(WORTH_SKIPPING) => Prune::Skip,
        Prune::Auto { .. } if worth(WORTH_SHORTENING) => Prune::Exact,
        Prune::Auto { .. } => Prune::Off,
    }
}

/// The modules of a march, by name.
pub fn modules(parts: &Parts, source: &'static str, patches: Option<&Patches>) -> Vec<&'static str> {
    let common = ["contract", "number", source, "source/pair", "pass/lists", "pass/march"];
    let tracer = ["tracer/walk", "tracer/tally"];
    let field: &[_] = match patches {
        None => &["field/whole", "tracer/no_leap"],
        Some(Patches { skip: false, .. }) => &["field/patches", "field/counted", "tracer/no_leap"],
        Some(_) => &["field/patches", "field/counted", "tracer/leap"],
    };
    common.iter().chain(&tracer).chain(field).chain(parts.modules).copied().collect()
}

/// The modules of a walk from voxel to voxel, by name.
pub fn voxel_modules(parts: &Parts, source: &'static str) -> Vec<&'static str> {
    let common = ["contract", "number", source, "source/pair", "pass/lists", "pass/voxels", "field/whole"];
    common.iter().chain(parts.modules).copied().collect()
}

/// The modules' texts by name.
pub fn texts(modules: &[&str]) -> Vec<&'static str> {
    let of = |name: &&str| sdfrs_shaders::ALL.iter().find(|m| m.name == *name);
    // The linker names what is missing; a test links all combinations.
    modules.iter().filter_map(of).map(|m| m.text).collect()
}
