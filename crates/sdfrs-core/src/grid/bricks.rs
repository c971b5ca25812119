//! Samples near the surface alone: bricks of 8^3 cells with a node more along each axis, so that every
//! cell finds its corners in one brick, and a table that says where a brick's nodes are.
//!
//! A brick that is not kept has one number: its sign is the field's there, its magnitude at most the
//! field's anywhere in the brick. Nodes are f32, f16 or bytes; bytes count steps of a scale that each brick
//! has for itself. Scales are powers of two apart and a node that bricks share is rounded by the coarsest
//! of them, so that the interpolant stays continuous. Law: `tests::shared_nodes_agree`.

use std::sync::Arc;

use half::f16;

use super::{
    bricks_along,
    dense::{Sample, reserve, round},
    slope::{BLOCK, NODES},
};
use crate::{error::SceneError, real::Scalar};

/// In the table: the brick keeps no nodes.
pub const FAR: u32 = u32::MAX;
/// The byte that stands for 0.
const ZERO: f32 = 128.0;
/// Most steps of a byte to either side.
const STEPS: f64 = 127.0;

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
    /// Where a brick's nodes are, in bricks; [`FAR`] where it has none.
    table: Arc<Vec<u32>>,
    /// The value of a brick without nodes; 0 elsewhere.
    far: Arc<Vec<f32>>,
    nodes: BrickValues,
}

impl Bricks {
    /// Parts as they come from a baker or a file; [`Grid::with_claim`](super::Grid::with_claim) checks them.
    pub fn new(table: Vec<u32>, mut far: Vec<f32>, nodes: BrickValues) -> Self {
        for (far, _) in far.iter_mut().zip(&table).filter(|(_, slot)| **slot != FAR) {
            *far = 0.0;
        }
        Self { table: Arc::new(table), far: Arc::new(far), nodes }
    }

    pub fn table(&self) -> &[u32] {
        &self.table
    }
    pub fn far(&self) -> &[f32] {
        &self.far
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
        nodes as u64 + 8 * self.table.len() as u64
    }
    /// Magnitudes up to this are kept: nearer than every brick without nodes, and than where nodes were cut.
    pub fn band(&self) -> f32 {
        let far = self.far.iter().filter(|v| **v != 0.0).fold(f32::INFINITY, |m, v| m.min(v.abs()));
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
        let slot = self.table[i];
        (slot != FAR).then_some(slot as usize)
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
        if total != Some(self.table.len()) || self.far.len() != self.table.len() {
            return bad(format!(
                "got a table of {} and {} far values, allowed: {count:?} bricks for {dims:?} nodes",
                self.table.len(),
                self.far.len()
            ));
        }
        if !self.nodes.len().is_multiple_of(BLOCK) {
            return bad(format!("got {} nodes, allowed: {BLOCK} for each kept brick", self.nodes.len()));
        }
        let kept = self.kept();
        let wrong = self.table.iter().position(|&s| s != FAR && s as usize >= kept);
        if let Some(i) = wrong {
            return bad(format!("brick {i} is at {}, allowed: below {kept}, the bricks kept", self.table[i]));
        }
        let wrong = (0..self.far.len()).find(|&i| {
            self.table[i] == FAR && !(self.far[i].is_finite() && self.far[i].abs() >= f32::MIN_POSITIVE)
        });
        if let Some(i) = wrong {
            return bad(format!("far value {i} is {}, allowed: finite and not 0", self.far[i]));
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
    pub fn to_f16(&self) -> Result<(Bricks, f64), SceneError> {
        let (mut out, mut worst) = (Vec::new(), 0f64);
        reserve(&mut out, self.nodes.len())?;
        for slot in 0..self.kept() {
            for i in 0..BLOCK {
                let (value, error) = round(self.node(slot, i))?;
                worst = worst.max(error);
                out.push(value);
            }
        }
        Ok((Bricks { nodes: BrickValues::F16(Arc::new(out)), ..self.clone() }, worst))
    }

    /// Clamped to `band` and rounded to bytes, and the largest error within the band.
    pub fn to_u8(&self, dims: [usize; 3], band: f64) -> Result<(Bricks, f64), SceneError> {
        if !(band > 0.0 && band.is_finite()) {
            return Err(SceneError::new(
                "texture",
                format!("band is {band}, allowed: a finite number above 0"),
            ));
        }
        let (kept, count) = (self.kept(), bricks_along(dims));
        let (mut codes, mut scale) = (Vec::new(), Vec::new());
        reserve(&mut codes, self.nodes.len())?;
        reserve(&mut scale, kept)?;
        codes.resize(self.nodes.len(), 0u8);
        let clamped = |slot: usize, i: usize| self.node::<f64>(slot, i).clamp(-band, band);
        let most: Vec<f64> =
            (0..kept).map(|slot| (0..BLOCK).fold(0.0, |m: f64, i| m.max(clamped(slot, i).abs()))).collect();
        scale.extend(most.iter().map(|most| ladder(band, *most)));
        self.coarsen(count, &most, ladder(band, band), &mut scale);
        let mut worst = 0f64;
        for (i, slot) in self.table.iter().enumerate().filter(|(_, s)| **s != FAR) {
            let (slot, steps) = (*slot as usize, self.around(i, count, &scale));
            for node in 0..BLOCK {
                // A shared node takes the coarsest step of its bricks: then it is the same in all of them.
                let p = [node % NODES, node / NODES % NODES, node / NODES / NODES];
                let class = p.map(|v| {
                    if v == 0 {
                        0
                    } else if v == NODES - 1 {
                        2
                    } else {
                        1
                    }
                });
                let step = f64::from(steps[class[0] + 3 * (class[1] + 3 * class[2])]);
                let value = clamped(slot, node);
                let rounded = (value / step).round() * step;
                worst = worst.max((rounded - value).abs());
                codes[slot * BLOCK + node] =
                    (rounded / f64::from(scale[slot]) + f64::from(ZERO)).round() as u8;
            }
        }
        let nodes = BrickValues::U8 { codes: Arc::new(codes), scale: Arc::new(scale) };
        Ok((Bricks { nodes, ..self.clone() }, worst))
    }

    /// Coarser scales where a coarser neighbour may round a shared node beyond a byte's reach.
    fn coarsen(&self, count: [usize; 3], most: &[f64], coarsest: f32, scale: &mut [f32]) {
        let mut changed = true;
        while changed {
            changed = false;
            for (i, slot) in self.table.iter().enumerate().filter(|(_, s)| **s != FAR) {
                let slot = *slot as usize;
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
