//! The words that host and device exchange, byte for byte.
//!
//! Twin: shaders/contract.wgsl, shade/direct.wgsl, pass/shade.wgsl and voxel/walk.wgsl. Law (tests/contract.rs): every
//! offset and size equals what naga finds in the linked text.

use bytemuck::{Pod, Zeroable};

/// Bits of a status in [`Tally::outcome`]; the flags follow.
pub const STATUS: u32 = 0xff;

/// What a dispatch is told.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Params {
    /// Zero, which no compiler knows.
    pub zero: u32,
    /// Rays of this tile, and where it begins in the whole.
    pub rays: u32,
    pub base: u32,
    /// The part of the list of active rays that this dispatch advances.
    pub first: u32,
    pub count: u32,
    /// Which half of the lists is read.
    pub half_read: u32,
    /// Evaluations that a ray may spend in this dispatch, and in all.
    pub steps: u32,
    pub max_steps: u32,
    pub guards: u32,
    pub max_level: u32,
    /// Entries of a ray's stack.
    pub depth: u32,
    /// Whether the tile is whole rows of an image, stepped in blocks of pixels.
    pub blocks: u32,
    pub eps: f32,
    pub cone: f32,
    /// omega or beta.
    pub factor: f32,
    pub t_max: f32,
    pub view: View,
    pub albedo: [f32; 3],
    /// Packed as r | g << 8 | b << 16.
    pub background: u32,
}

/// A camera's axes, and the height of a pixel, each as the sum of two numbers.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub struct View {
    pub origin: [f32; 3],
    pub scale: f32,
    pub forward: [f32; 3],
    pub scale_low: f32,
    pub right: [f32; 3],
    pub width: u32,
    pub up: [f32; 3],
    pub height: u32,
    pub origin_low: [f32; 3],
    pub perspective: u32,
    pub forward_low: [f32; 3],
    pub unused: u32,
    pub right_low: [f32; 3],
    pub unused_too: u32,
    pub up_low: [f32; 3],
    pub unused_three: u32,
}

/// A ray that comes from the host; the direction has unit length.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Ray {
    pub origin: [f32; 3],
    pub t_min: f32,
    pub direction: [f32; 3],
    pub t_max: f32,
}

/// A ray in the cells of a texture, for the walk from voxel to voxel.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Line {
    pub o: [f32; 3],
    pub t_min: f32,
    pub d: [f32; 3],
    pub t_max: f32,
    /// Length in the texture's space of a step of length 1.
    pub speed: f32,
    pub unused: f32,
    pub unused_too: f32,
    pub unused_three: f32,
}

/// What a ray's walk has come to.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Tally {
    pub steps: u32,
    pub fallbacks: u32,
    pub accepted: u32,
    pub ratios: f32,
    pub t: f32,
    pub r: f32,
    pub witness: f32,
    /// Status in the low byte, flags in the next.
    pub outcome: u32,
}

impl Tally {
    /// Mean over the accepted steps of length / radius; 1 where there was none.
    pub fn multiplier(&self) -> f32 {
        if self.accepted == 0 { 1.0 } else { self.ratios / self.accepted as f32 }
    }
}

/// A lamp: its colour times its intensity and the share of the lamps.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Light {
    pub position: [f32; 3],
    pub unused: f32,
    pub color: [f32; 3],
    pub unused_too: f32,
}

/// A pixel's normal and colour.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Shaded {
    pub normal: [f32; 3],
    /// Packed as r | g << 8 | b << 16.
    pub rgb: u32,
}
