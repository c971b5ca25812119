//! Which shaders make a tracer, and what a ray's walk needs in memory.
//!
//! Twin: the choice of step machines in `sdfrs_trace::march`. Law (tests/contract.rs): every combination
//! validates, and its `Walker` has the size that stands here.

use sdfrs_trace::{Form, SearchForm, Tracer};

/// The parts of a tracer.
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    /// Shader modules, besides those that every tracer has.
    pub modules: &'static [&'static str],
    /// omega or beta.
    pub factor: f32,
    pub max_level: u32,
    /// Size of a walk between two passes.
    pub walker_bytes: u64,
    pub stack: Stack,
}

impl Parts {
    /// Whether it is a guarded stepper, which may leap over slabs in which nothing is.
    pub fn can_leap(&self) -> bool {
        self.modules.contains(&"tracer/guarded")
    }
}

/// How many spans a ray may have to remember.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stack {
    None,
    /// So many at most.
    Spans(u32),
    /// One a halving of the range.
    Halvings,
    /// One a step: the listing's segments may grow.
    Steps,
}

/// Twin of the CPU's longest stack; a listing that outgrows it ends out of steps.
const LONGEST_STACK: u32 = 1 << 16;

impl Stack {
    /// Entries that a ray of `range` needs at most: a segment is pushed with half its parent's length, and only
    /// while that is above the threshold.
    pub fn depth(self, range: f64, eps: f64, max_steps: u32) -> u32 {
        match self {
            Stack::None => 0,
            Stack::Spans(n) => n,
            Stack::Halvings => ((range / eps).log2().ceil().max(0.0) as u32 + 3).min(max_steps),
            Stack::Steps => max_steps.min(LONGEST_STACK),
        }
    }
}

const fn parts(modules: &'static [&'static str], factor: f64, walker_bytes: u64) -> Parts {
    Parts { modules, factor: factor as f32, max_level: 0, walker_bytes, stack: Stack::None }
}

/// The walk from voxel to voxel; `by_host`: the host leads rays to the cells.
pub fn voxels(by_host: bool) -> Parts {
    let modules: &[_] = if by_host {
        &["voxel/walk", "voxel/root", "voxel/lines"]
    } else {
        &["voxel/walk", "voxel/root", "voxel/placed"]
    };
    parts(modules, 0.0, 16)
}

/// The shaders of a tracer.
pub fn parts_of(tracer: &Tracer) -> Parts {
    macro_rules! guarded {
        ($rule:literal) => {
            &["tracer/no_stack", "tracer/crossing", $rule, "tracer/guarded"]
        };
    }
    macro_rules! letter {
        ($($module:literal),+) => {
            &["tracer/no_stack", "tracer/letter/listing", $($module),+]
        };
    }
    match *tracer {
        Tracer::Basic { guards: true } => parts(guarded!("tracer/basic"), 0.0, 56),
        Tracer::Basic { guards: false } => parts(letter!("tracer/letter/basic"), 0.0, 16),
        Tracer::Relaxed { omega, guards: true, .. } => parts(guarded!("tracer/relaxed"), omega, 56),
        Tracer::Relaxed { omega, form: Form::Y2023, .. } => {
            parts(letter!("tracer/letter/relaxed"), omega, 20)
        }
        Tracer::Relaxed { omega, form: Form::Y2018, .. } => {
            parts(letter!("tracer/letter/relaxed_2018", "tracer/letter/retry"), omega, 28)
        }
        Tracer::Enhanced { omega, guards: true, .. } => parts(guarded!("tracer/enhanced"), omega, 56),
        Tracer::Enhanced { omega, form: Form::Y2023, .. } => {
            parts(letter!("tracer/letter/enhanced"), omega, 20)
        }
        Tracer::Enhanced { omega, form: Form::Y2018, .. } => {
            parts(letter!("tracer/letter/enhanced_2018", "tracer/letter/retry"), omega, 28)
        }
        Tracer::AutoRelaxed { beta, guards: true } => parts(guarded!("tracer/auto_relaxed"), beta, 56),
        Tracer::AutoRelaxed { beta, guards: false } => parts(letter!("tracer/letter/auto_relaxed"), beta, 24),
        Tracer::BinarySearch { form, max_level, guards } => search(form, max_level, guards),
        Tracer::CoverageSearch { .. } => {
            let modules =
                &["tracer/stack", "tracer/search", "tracer/coverage_search", "tracer/coverage_spans"];
            Parts { stack: Stack::Spans(32), ..parts(modules, 0.0, 44) }
        }
    }
}

fn search(form: SearchForm, max_level: u32, guards: bool) -> Parts {
    match (form, guards) {
        (SearchForm::Stackless, _) => {
            let modules = &["tracer/no_stack", "tracer/search", "tracer/wide", "tracer/binary_stackless"];
            Parts { max_level, ..parts(modules, 0.0, 24) }
        }
        (SearchForm::Stack, _) => {
            let modules = &["tracer/stack", "tracer/search", "tracer/binary_halves", "tracer/binary_stack"];
            let stack = if guards { Stack::Halvings } else { Stack::Steps };
            Parts { stack, ..parts(modules, 0.0, 16) }
        }
        (SearchForm::Split, true) => {
            let modules = &["tracer/stack", "tracer/search", "tracer/binary_split"];
            Parts { stack: Stack::Halvings, ..parts(modules, 0.0, 44) }
        }
        (SearchForm::Split, false) => {
            let modules =
                &["tracer/stack", "tracer/search", "tracer/letter/binary_split", "tracer/binary_stack"];
            Parts { stack: Stack::Steps, ..parts(modules, 0.0, 16) }
        }
    }
}
