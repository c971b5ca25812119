//! Grids on the GPU: all of a scene's in one buffer, so that any number of them costs one binding.
//!
//! Each grid lies there in parts (nodes, table of bricks, scales, slopes), found by constants of the scene
//! (ops/texture.wgsl has their order). The buffer is kept while its grids live: moving a texture sends
//! nothing but constants. Law: tests/textures.rs, every kind of storage and every rule against the CPU.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use sdfrs_core::{
    Grid, GridValues,
    grid::{BRICK, BrickValues, Stepping, Store, bricks_along},
};

use crate::{
    buffers::{self, Use},
    device::Device,
    error::GpuError,
};

/// Rows of four constants that describe a grid.
pub const ROWS: usize = 8;

/// Where the parts of a grid start, in words of the buffer.
#[derive(Debug, Clone, Copy, Default)]
pub struct Parts {
    nodes: u64,
    /// The table, then the far values.
    table: u64,
    scale: u64,
    /// A brick's own, then those of its neighbourhood.
    slopes: u64,
}

/// How nodes are stored, as ops/texture.wgsl counts it.
pub fn kind(grid: &Grid) -> u32 {
    match grid.store() {
        Store::Dense(GridValues::F32(_) | GridValues::F64(_)) => 0,
        Store::Dense(GridValues::F16(_)) => 1,
        Store::Sparse(bricks) => match bricks.nodes() {
            BrickValues::F32(_) => 2,
            BrickValues::F16(_) => 3,
            BrickValues::U8 { .. } => 4,
        },
    }
}

/// Which rule a walk steps by. The roots of voxels are a tracer's business; fields step by bricks there.
pub fn rule(grid: &Grid) -> u32 {
    u32::from(grid.stepping() != Stepping::Safe)
}

/// Places of all grids' parts, and the number of words.
pub fn layout(grids: &[Arc<Grid>]) -> Result<(Vec<Parts>, u64), GpuError> {
    let mut at = 0u64;
    let mut take = |words: usize| {
        let first = at;
        at += words as u64;
        first
    };
    let mut all = Vec::new();
    for grid in grids {
        let mut parts = Parts::default();
        match grid.store() {
            Store::Dense(GridValues::F16(v)) => parts.nodes = take(v.len().div_ceil(2)),
            Store::Dense(v) => parts.nodes = take(v.len()),
            Store::Sparse(bricks) => {
                let nodes = bricks.nodes();
                parts.nodes = match nodes {
                    BrickValues::F32(v) => take(v.len()),
                    BrickValues::F16(v) => take(v.len().div_ceil(2)),
                    BrickValues::U8 { codes, .. } => take(codes.len().div_ceil(4)),
                };
                parts.table = take(2 * bricks.words().len());
                if let BrickValues::U8 { scale, .. } = nodes {
                    parts.scale = take(scale.len());
                }
            }
        }
        if rule(grid) != 0 {
            parts.slopes = take(2 * bricks_along(grid.dims()).iter().product::<usize>());
        }
        all.push(parts);
    }
    // Shaders count words in u32.
    if at > u64::from(u32::MAX) {
        return Err(GpuError::Limits { what: "words of grids".into(), asked: at, allowed: u32::MAX.into() });
    }
    Ok((all, at))
}

/// A grid's constants, in the order of ops/texture.wgsl.
pub fn rows(grid: &Grid, parts: &Parts) -> [[f32; 4]; ROWS] {
    let (lo, hi) = grid.bounds();
    let (h, dims, slopes) = (grid.spacing(), grid.dims(), grid.slopes());
    let row = |v: [f64; 3], w: f64| [v[0] as f32, v[1] as f32, v[2] as f32, w as f32];
    let halves = |a: u64, b: u64| [a & 0xffff, a >> 16, b & 0xffff, b >> 16].map(|v| v as f32);
    let edge = h.iter().fold(f32::INFINITY, |m, h| m.min(BRICK as f32 * *h as f32));
    // As in grid/sample.rs: rounding of a position must not carry a step over a brick's wall.
    let slack = std::array::from_fn(|a| {
        let reach = lo[a].abs().max(hi[a].abs()) / h[a];
        f64::from((4.0 * (reach + dims[a] as f64)) as f32 * f32::EPSILON)
    });
    [
        row(dims.map(|n| n as f64), f64::from(kind(grid))),
        row(lo, f64::from(rule(grid))),
        row(hi, slopes.a),
        row(h, slopes.s),
        [slopes.gap as f32, edge, 0.0, 0.0],
        halves(parts.nodes, parts.table),
        halves(parts.scale, parts.slopes),
        row(slack, 0.0),
    ]
}

/// Uploaded grids of a device.
#[derive(Default)]
pub(crate) struct Grids {
    kept: Mutex<Vec<Kept>>,
}

/// A buffer and the grids in it.
struct Kept {
    owners: Vec<Weak<Grid>>,
    buffer: Arc<wgpu::Buffer>,
}

impl Grids {
    /// The buffer of a list of grids, uploaded unless it is there.
    pub fn get(&self, device: &Device, grids: &[Arc<Grid>]) -> Result<Arc<wgpu::Buffer>, GpuError> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|kept| kept.owners.iter().all(|grid| grid.strong_count() > 0));
        let same = |owners: &[Weak<Grid>]| {
            owners.len() == grids.len() && owners.iter().zip(grids).all(|(a, b)| a.as_ptr() == Arc::as_ptr(b))
        };
        if let Some(found) = kept.iter().find(|kept| same(&kept.owners)) {
            return Ok(found.buffer.clone());
        }
        let buffer = Arc::new(upload(device, grids)?);
        kept.push(Kept { owners: grids.iter().map(Arc::downgrade).collect(), buffer: buffer.clone() });
        Ok(buffer)
    }
}

fn upload(device: &Device, grids: &[Arc<Grid>]) -> Result<wgpu::Buffer, GpuError> {
    let (parts, words) = layout(grids)?;
    let buffer = buffers::make(device, "grids", 4 * words, Use::Storage)?;
    let send = Send { device, buffer: &buffer };
    for (grid, parts) in grids.iter().zip(parts) {
        match grid.store() {
            Store::Dense(GridValues::F32(v)) => send.words(parts.nodes, v)?,
            Store::Dense(GridValues::F64(v)) => send.each(parts.nodes, v, 1, |v| (v[0] as f32).to_bits())?,
            Store::Dense(GridValues::F16(v)) => send.each(parts.nodes, v, 2, halves)?,
            Store::Sparse(bricks) => {
                match bricks.nodes() {
                    BrickValues::F32(v) => send.words(parts.nodes, v)?,
                    BrickValues::F16(v) => send.each(parts.nodes, v, 2, halves)?,
                    BrickValues::U8 { codes, scale } => {
                        send.each(parts.nodes, codes, 4, bytes)?;
                        send.words(parts.scale, scale)?;
                    }
                }
                let words = bricks.words();
                send.each(parts.table, words, 1, |w| w[0].entry())?;
                send.each(parts.table + words.len() as u64, words, 1, |w| w[0].value().to_bits())?;
            }
        }
        if rule(grid) != 0 {
            let all: Vec<usize> = (0..bricks_along(grid.dims()).iter().product()).collect();
            send.each(parts.slopes, &all, 1, |b| grid.slopes_of(b[0])[0].to_bits())?;
            send.each(parts.slopes + all.len() as u64, &all, 1, |b| grid.slopes_of(b[0])[1].to_bits())?;
        }
    }
    Ok(buffer)
}

fn halves(v: &[sdfrs_core::grid::f16]) -> u32 {
    v.iter().rev().fold(0, |word, half| word << 16 | u32::from(half.to_bits()))
}

fn bytes(v: &[u8]) -> u32 {
    v.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte))
}

/// Words converted at a time.
const PORTION: usize = 1 << 20;

struct Send<'a> {
    device: &'a Device,
    buffer: &'a wgpu::Buffer,
}

impl Send<'_> {
    fn words<T: bytemuck::Pod>(&self, at: u64, values: &[T]) -> Result<(), GpuError> {
        buffers::write(self.device, self.buffer, 4 * at, bytemuck::cast_slice(values))
    }

    /// `per` values a word.
    fn each<T>(&self, at: u64, values: &[T], per: usize, word: impl Fn(&[T]) -> u32) -> Result<(), GpuError> {
        for (portion, i) in values.chunks(PORTION * per).zip(0u64..) {
            let words: Vec<u32> = portion.chunks(per).map(&word).collect();
            self.words(at + i * PORTION as u64, &words)?;
        }
        Ok(())
    }
}
