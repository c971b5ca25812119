//! Samples near the surface alone: bricks of 8^3 cells with a node more along each axis, so that every
//! cell finds its corners in one brick, and a table that says where a brick's nodes are.
//!
//! A brick that is not kept has one number: its sign is the field's there, its magnitude at most the
//! field's anywhere in the brick. Nodes are f32, f16 or bytes; bytes count steps of a scale that each brick
//! has for itself. Scales are powers of two apart and a node that bricks share is rounded by the coarsest
//! of them, so that the interpolant stays continuous. Law: `tests::shared_nodes_agree`.

use std::sync::Arc;

use half::f16;
use rayon::prelude::*;

use super::{
    bricks_along,
    dense::{Sample, Stop, halves, reserve, trade},
    slope::{BLOCK, NODES},
};
use crate::{error::SceneError, pool, real::Scalar};

/// In files' tables: the brick keeps no nodes.
pub const FAR: u32 = u32::MAX;
/// The byte that stands for 0.
const ZERO: f32 = 128.0;
/// Most steps of a byte to either side.
const STEPS: f64 = 127.0;

/// What is known of a brick, in one word: odd, where its nodes are, counted in bricks; even, the value it has
/// instead, whose last bit is cleared: a bound may be less.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
pub struct Word(u32);

impl Word {
    /// Slots lie below this.
    pub const SLOTS: u32 = 1 << 31;

    pub fn kept(slot: u32) -> Self {
        debug_assert!(slot < Self::SLOTS);
        Self(slot << 1 | 1)
    }
    pub fn far(value: f32) -> Self {
        Self(value.to_bits() & !1)
    }
    pub fn of_bits(bits: u32) -> Self {
        Self(bits)
    }
    pub fn bits(self) -> u32 {
        self.0
    }
    /// Where the nodes are, counted in bricks.
    #[inline(always)]
    pub fn slot(self) -> Option<usize> {
        (self.0 & 1 == 1).then_some((self.0 >> 1) as usize)
    }
    /// The value of a brick without nodes; 0 for others.
    #[inline(always)]
    pub fn value(self) -> f32 {
        if self.0 & 1 == 0 { f32::from_bits(self.0) } else { 0.0 }
    }
    /// As files have it: the slot or [`FAR`].
    pub fn entry(self) -> u32 {
        if self.0 & 1 == 1 { self.0 >> 1 } else { FAR }
    }
}

/// Nodes of the kept bricks, 9 x 9 x 9 each, x fastest.
#[derive(Debug, Clone, PartialEq)]
pub enum BrickValues {
    F16(Arc<Vec<f16>>),
    F32(Arc<Vec<f32>>),
    /// `(code - 128) * scale[slot]`.
    U8 {
        codes: Arc<Vec<u8>>,
        scale: Arc<Vec<f32>>,
    },
}

impl BrickValues {
    pub fn len(&self) -> usize {
        match self {
            BrickValues::F16(v) => v.len(),
            BrickValues::F32(v) => v.len(),
            BrickValues::U8 { codes, .. } => codes.len(),
        }
    }
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// The name of the type in files and in Python.
    pub fn dtype(&self) -> &'static str {
        match self {
            BrickValues::F16(_) => "f16",
            BrickValues::F32(_) => "f32",
            BrickValues::U8 { .. } => "u8",
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Bricks {
    /// One a brick, x fastest.
    words: Arc<Vec<Word>>,
    nodes: BrickValues,
}

impl Bricks {
    /// Parts as they come from a baker; [`Grid::with_claim`](super::Grid::with_claim) checks them.
    pub fn new(words: Vec<Word>, nodes: BrickValues) -> Self {
        Self { words: Arc::new(words), nodes }
    }

    /// Parts as they come from a file: slots or [`FAR`], and the values of bricks without nodes.
    pub fn of_table(table: &[u32], far: &[f32], nodes: BrickValues) -> Result<Self, SceneError> {
        let bad = |message: String| Err(SceneError::new("texture", message));
        if table.len() != far.len() {
            return bad(format!(
                "got a table of {} bricks and {} far values, allowed: as many",
                table.len(),
                far.len()
            ));
        }
        if let Some(i) = table.iter().position(|&slot| slot != FAR && slot >= Word::SLOTS) {
            return bad(format!("brick {i} is at {}, allowed: below {}", table[i], Word::SLOTS));
        }
        let word = |(&slot, &far): (&u32, &f32)| if slot == FAR { Word::far(far) } else { Word::kept(slot) };
        Ok(Self::new(table.iter().zip(far).map(word).collect(), nodes))
    }

    /// What is known of all bricks.
    pub fn words(&self) -> &[Word] {
        &self.words
    }
    pub fn nodes(&self) -> &BrickValues {
        &self.nodes
    }
    /// Bricks that keep their nodes.
    pub fn kept(&self) -> usize {
        self.nodes.len() / BLOCK
    }
    pub fn nbytes(&self) -> u64 {
        let nodes = match &self.nodes {
            BrickValues::F16(v) => 2 * v.len(),
            BrickValues::F32(v) => 4 * v.len(),
            BrickValues::U8 { codes, scale } => codes.len() + 4 * scale.len(),
        };
        nodes as u64 + 4 * self.words.len() as u64
    }
    /// Magnitudes up to this are kept: nearer than every brick without nodes, and than where nodes were cut.
    pub fn band(&self) -> f32 {
        let far = self.words.iter().filter(|w| w.slot().is_none());
        let far = far.fold(f32::INFINITY, |m, w| m.min(w.value().abs()));
        let most = match &self.nodes {
            BrickValues::F16(v) => v.iter().fold(0.0, |m: f32, v| m.max(v.to_f32().abs())),
            BrickValues::F32(v) => v.iter().fold(0.0, |m: f32, v| m.max(v.abs())),
            BrickValues::U8 { scale, .. } => scale.iter().fold(0.0, |m: f32, v| m.max(v * STEPS as f32)),
        };
        far.min(most)
    }
    /// Where brick `i` keeps its nodes, counted in bricks.
    #[inline(always)]
    pub fn slot(&self, i: usize) -> Option<usize> {
        self.words[i].slot()
    }
    /// A node of a kept brick.
    #[inline(always)]
    pub fn node<T: Scalar>(&self, slot: usize, node: usize) -> T {
        let i = slot * BLOCK + node;
        match &self.nodes {
            BrickValues::F16(v) => v[i].wide(),
            BrickValues::F32(v) => v[i].wide(),
            BrickValues::U8 { codes, scale } => widen(codes[i], scale[slot]),
        }
    }

    pub(super) fn check(&self, dims: [usize; 3]) -> Result<(), SceneError> {
        let bad = |message: String| Err(SceneError::new("texture", message));
        let count = bricks_along(dims);
        let total = count.iter().try_fold(1usize, |a, &n| a.checked_mul(n));
        if total != Some(self.words.len()) {
            return bad(format!(
                "got a table of {}, allowed: {count:?} bricks for {dims:?} nodes",
                self.words.len()
            ));
        }
        if !self.nodes.len().is_multiple_of(BLOCK) {
            return bad(format!("got {} nodes, allowed: {BLOCK} for each kept brick", self.nodes.len()));
        }
        let kept = self.kept();
        for (i, word) in self.words.iter().enumerate() {
            match word.slot() {
                Some(slot) if slot >= kept => {
                    return bad(format!("brick {i} is at {slot}, allowed: below {kept}, the bricks kept"));
                }
                None if !(word.value().is_finite() && word.value().abs() >= f32::MIN_POSITIVE) => {
                    return bad(format!("far value {i} is {}, allowed: finite and not 0", word.value()));
                }
                _ => {}
            }
        }
        let wrong = match &self.nodes {
            BrickValues::F16(v) => v.iter().position(|v| !v.is_finite()),
            BrickValues::F32(v) => v.iter().position(|v| !v.is_finite()),
            BrickValues::U8 { scale, .. } if scale.len() != kept => {
                return bad(format!("got {} scales, allowed: {kept}, one a brick", scale.len()));
            }
            BrickValues::U8 { scale, .. } => {
                scale.iter().position(|v| !(v.is_finite() && *v >= 0.0)).map(|i| i * BLOCK)
            }
        };
        match wrong {
            Some(i) => bad(format!("kept brick {} is not finite, allowed: finite numbers", i / BLOCK)),
            None => Ok(()),
        }
    }

    /// Rounded to halves, and the largest error that made.
    pub(super) fn into_f16(self, stop: Stop) -> Result<(Bricks, f64), SceneError> {
        let Bricks { words, nodes } = self;
        if let BrickValues::F16(_) = nodes {
            return Ok((Bricks { words, nodes }, 0.0));
        }
        let (nodes, worst) = halves(floats(nodes), stop)?;
        Ok((Bricks { words, nodes: BrickValues::F16(Arc::new(nodes)) }, worst))
    }

    /// Clamped to `band` and rounded to bytes, and the largest error within the band.
    pub(super) fn into_u8(
        self,
        dims: [usize; 3],
        band: f64,
        stop: Stop,
    ) -> Result<(Bricks, f64), SceneError> {
        if !(band > 0.0 && band.is_finite()) {
            return Err(SceneError::new(
                "texture",
                format!("band is {band}, allowed: a finite number above 0"),
            ));
        }
        let (kept, count) = (self.kept(), bricks_along(dims));
        let nodes = floats(self.nodes);
        let table = Bricks { words: self.words, nodes: BrickValues::F32(Arc::default()) };
        let largest = |block: &[f32]| f64::from(block.iter().fold(0f32, |m, v| m.max(v.abs()))).min(band);
        let most: Vec<f64> = pool::install(|| nodes.par_chunks_exact(BLOCK).map(largest).collect());
        let mut scale: Vec<f32> = Vec::new();
        reserve(&mut scale, kept)?;
        scale.extend(most.iter().map(|most| ladder(band, *most)));
        let owners = table.owners(kept);
        table.coarsen(&owners, count, &most, ladder(band, band), &mut scale);
        let round = |slot: usize, block: &[f32], codes: &mut [u8]| {
            encode(block, band, &table.around(owners[slot], count, &scale), scale[slot], codes)
        };
        let (codes, worst) = trade(nodes, BLOCK, stop, round)?;
        let nodes = BrickValues::U8 { codes: Arc::new(codes), scale: Arc::new(scale) };
        Ok((Bricks { nodes, ..table }, worst))
    }

    /// The brick of each slot.
    pub(super) fn owners(&self, kept: usize) -> Vec<usize> {
        let mut owners = vec![0; kept];
        for (i, word) in self.words.iter().enumerate() {
            if let Some(slot) = word.slot() {
                owners[slot] = i;
            }
        }
        owners
    }

    /// Coarser scales where a coarser neighbour may round a shared node beyond a byte's reach.
    fn coarsen(&self, owners: &[usize], count: [usize; 3], most: &[f64], coarsest: f32, scale: &mut [f32]) {
        let mut changed = true;
        while changed {
            changed = false;
            for (slot, &i) in owners.iter().enumerate() {
                if scale[slot] >= coarsest {
                    continue;
                }
                let about = self.around(i, count, scale).into_iter().fold(0.0, f32::max);
                while scale[slot] < coarsest
                    && f64::from(scale[slot]) * STEPS < most[slot] + f64::from(about) / 2.0
                {
                    scale[slot] *= 2.0;
                    changed = true;
                }
            }
        }
    }

    /// For each of 27 places in brick `i` (low wall, inside, high wall along each axis) the coarsest scale
    /// of the bricks that share its nodes.
    fn around(&self, i: usize, count: [usize; 3], scale: &[f32]) -> [f32; 27] {
        let at = [i % count[0], i / count[0] % count[1], i / count[0] / count[1]];
        let neighbour = |d: [usize; 3]| {
            let mut j = [0; 3];
            for a in 0..3 {
                j[a] = (at[a] + d[a]).checked_sub(1).filter(|v| *v < count[a])?;
            }
            self.slot(j[0] + count[0] * (j[1] + count[1] * j[2])).map(|slot| scale[slot])
        };
        let all: [f32; 27] = std::array::from_fn(|k| neighbour([k % 3, k / 3 % 3, k / 9]).unwrap_or(0.0));
        std::array::from_fn(|k| {
            let class = [k % 3, k / 3 % 3, k / 9];
            let mut most = 0f32;
            for (n, v) in all.iter().enumerate() {
                let d = [n % 3, n / 3 % 3, n / 9];
                if (0..3).all(|a| d[a] == 1 || d[a] == class[a]) {
                    most = most.max(*v);
                }
            }
            most
        })
    }
}

/// Nodes as f32, without a copy where they are that and nobody else holds them.
fn floats(nodes: BrickValues) -> Vec<f32> {
    match nodes {
        BrickValues::F32(v) => Arc::unwrap_or_clone(v),
        BrickValues::F16(v) => v.iter().map(|v| v.wide()).collect(),
        BrickValues::U8 { codes, scale } => {
            codes.iter().enumerate().map(|(i, code)| widen(*code, scale[i / BLOCK])).collect()
        }
    }
}

/// A brick's nodes as bytes, and the largest error. A shared node takes the coarsest step of its bricks: then it is the
/// same in all of them.
fn encode(block: &[f32], band: f64, steps: &[f32; 27], scale: f32, codes: &mut [u8]) -> f64 {
    // To the nearest whole number, as long as there are few digits before the point.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    let class = |v: usize| usize::from(v > 0) + usize::from(v == NODES - 1);
    let mut worst = 0f64;
    for (row, (block, codes)) in block.chunks_exact(NODES).zip(codes.chunks_exact_mut(NODES)).enumerate() {
        let first = 3 * (class(row % NODES) + 3 * class(row / NODES));
        for (x, (value, code)) in block.iter().zip(codes).enumerate() {
            let step = f64::from(steps[first + class(x)]);
            let value = f64::from(*value).clamp(-band, band);
            let rounded = (value / step + WHOLE - WHOLE) * step;
            worst = worst.max((rounded - value).abs());
            // Steps are powers of two apart: the quotient is whole.
            *code = (rounded / f64::from(scale) + f64::from(ZERO)) as u8;
        }
    }
    worst
}

/// `(code - 128) * scale`, rounded once in f32.
#[inline(always)]
pub fn widen<T: Scalar>(code: u8, scale: f32) -> T {
    ((f32::from(code) - ZERO) * scale).wide()
}

/// The finest of `band / 127 * 2^-k` whose 127 steps reach `most`; a power of two times an f32.
fn ladder(band: f64, most: f64) -> f32 {
    // Few digits, so that any number of steps is exact in f32.
    let coarsest = f32::from_bits(((band / STEPS) as f32).to_bits().div_ceil(1 << 8) << 8);
    let mut step = coarsest;
    for _ in 0..24 {
        if f64::from(step / 2.0) * STEPS < most || step / 2.0 < f32::MIN_POSITIVE * 1e6 {
            break;
        }
        step /= 2.0;
    }
    step
}
