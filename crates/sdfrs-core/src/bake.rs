//! A shape sampled into a grid: densely, or in bricks near its surface.
//!
//! Nodes are evaluated in f64 and rounded once. A brick farther from the surface than the shape's
//! Lipschitz bound lets a value reach keeps no nodes: with `f` at its middle and `r` half its diagonal,
//! `|f| - L r` bounds the magnitude in all of it. Law: `tests/baking.rs`, every node is the shape's value.

use std::sync::Arc;

use rayon::prelude::*;

use crate::{
    contract::Control,
    error::SceneError,
    eval::{Program, Scratch},
    grid::{
        BRICK, BrickValues, Bricks, Claim, Grid, GridValues, Store, Word, bricks_along,
        slope::{BLOCK, NODES, diagonal},
    },
    pool,
    shape::Shape,
};

/// Points evaluated by one call.
const PIECE: usize = 2048;
/// Cells on both sides of the surface whose nodes are kept unless a band is given.
const BAND: f64 = 4.0;

/// What to sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Nodes along x, y, z.
    pub dims: [usize; 3],
    pub lo: [f64; 3],
    pub hi: [f64; 3],
    /// None: all nodes. Else bricks where the field may be this close to 0, in its units; 0 is 4 cells.
    pub band: Option<f64>,
    /// Dense values as they were computed, in f64.
    pub wide: bool,
}

impl Plan {
    /// Bytes of a dense grid; of a sparse one those of its table.
    pub fn bytes(&self) -> u64 {
        let product = |n: [usize; 3]| n.iter().fold(1u64, |a, &b| a.saturating_mul(b as u64));
        match self.band {
            None => product(self.dims).saturating_mul(if self.wide { 8 } else { 4 }),
            Some(_) => product(bricks_along(self.dims.map(|n| n.max(2)))).saturating_mul(40),
        }
    }
}

/// Nodes, or bricks of a sparse plan: what `control` counts.
pub fn total(plan: &Plan) -> u64 {
    let n = if plan.band.is_some() { bricks_along(plan.dims) } else { plan.dims };
    n.iter().map(|&n| n as u64).product()
}

/// Samples a shape; `most_bytes` is what the samples may take.
pub fn bake(shape: &Shape, plan: &Plan, most_bytes: u64, control: &Control) -> Result<Grid, SceneError> {
    check(plan, most_bytes)?;
    let lip = shape.lipschitz();
    let program = Program::<f64>::values(shape)?;
    let job = Job { program, plan: *plan, control };
    let (store, error) = match plan.band {
        None => job.dense()?,
        Some(_) if !(lip.is_finite() && lip > 0.0) => {
            let message = "no finite Lipschitz bound is known, allowed for sparse textures: shapes with one; \
                           declare it by with_lipschitz(L)";
            return Err(SceneError::new(shape.op(), message));
        }
        Some(band) => job.sparse(lip, band, most_bytes)?,
    };
    // Rounding of the evaluation itself is far below that of the samples.
    let lipschitz = (lip.is_finite() && lip > 0.0).then_some(lip * (1.0 + 1e-9));
    let claim = Claim { lipschitz, max_error: error };
    Grid::until(store, plan.dims, plan.lo, plan.hi, claim, &|| control.is_cancelled())
}

fn check(plan: &Plan, most_bytes: u64) -> Result<(), SceneError> {
    let bad = |message: String| Err(SceneError::new("to_texture", message));
    if plan.dims.iter().any(|n| !(2..=1 << 16).contains(n)) {
        return bad(format!("resolution is {:?}, allowed: 2 to 65536 nodes along each axis", plan.dims));
    }
    if plan.bytes() > most_bytes {
        return bad(format!(
            "resolution {:?} needs {} MiB, allowed: {} MiB (half of the memory)",
            plan.dims,
            plan.bytes() >> 20,
            most_bytes >> 20
        ));
    }
    let finite = plan.lo.iter().chain(&plan.hi).all(|v| v.is_finite());
    if !finite || (0..3).any(|a| !(plan.lo[a] < plan.hi[a])) {
        return bad(format!("bounds are {:?} to {:?}, allowed: finite, lo below hi", plan.lo, plan.hi));
    }
    if plan.band.is_some_and(|b| !(b >= 0.0 && b.is_finite())) {
        return bad(format!("band is {:?}, allowed: a finite number of at least 0", plan.band));
    }
    Ok(())
}

struct Job<'a> {
    program: Program<f64>,
    plan: Plan,
    control: &'a Control,
}

/// A worker's memory.
struct Worker {
    scratch: Scratch<f64>,
    p: [Vec<f64>; 3],
    out: Vec<f64>,
}

impl Worker {
    fn new() -> Self {
        Self { scratch: Scratch::new(), p: Default::default(), out: Vec::new() }
    }
    /// Values at points, each given as its three coordinates.
    fn values(&mut self, program: &Program<f64>, points: impl Iterator<Item = [f64; 3]>) -> &[f64] {
        self.p.iter_mut().for_each(Vec::clear);
        for p in points {
            for a in 0..3 {
                self.p[a].push(p[a]);
            }
        }
        self.out.resize(self.p[0].len(), 0.0);
        let [x, y, z] = &self.p;
        program.evaluate(&mut self.scratch, [x, y, z], &mut self.out);
        &self.out
    }
}

impl Job<'_> {
    fn node(&self, at: [usize; 3]) -> [f64; 3] {
        let Plan { dims, lo, hi, .. } = self.plan;
        std::array::from_fn(|a| lo[a] + (hi[a] - lo[a]) / (dims[a] - 1) as f64 * at[a] as f64)
    }

    fn stopped(&self) -> Result<(), SceneError> {
        if self.control.is_cancelled() { Err(SceneError::new("to_texture", "cancelled")) } else { Ok(()) }
    }

    /// All nodes, and the largest rounding.
    fn dense(&self) -> Result<(Store, f64), SceneError> {
        let n = self.plan.dims.iter().product();
        if self.plan.wide {
            let mut out = room(n)?;
            let error = self.fill(&mut out, |v| v)?;
            return Ok((Store::Dense(GridValues::F64(Arc::new(out))), error));
        }
        let mut out = room(n)?;
        let error = self.fill(&mut out, |v| v as f32)?;
        Ok((Store::Dense(GridValues::F32(Arc::new(out))), error))
    }

    fn fill<S: Copy + Send + Sync + Into<f64>>(
        &self,
        out: &mut [S],
        round: impl Fn(f64) -> S + Sync,
    ) -> Result<f64, SceneError> {
        let [nx, ny, _] = self.plan.dims;
        let piece = |worker: &mut Worker, (i, out): (usize, &mut [S])| {
            self.stopped()?;
            let nodes = i * PIECE..i * PIECE + out.len();
            let at = |k: usize| self.node([k % nx, k / nx % ny, k / nx / ny]);
            let values = worker.values(&self.program, nodes.map(at));
            let mut worst = 0f64;
            for (to, v) in out.iter_mut().zip(values) {
                *to = round(*v);
                worst = worst.max((*v - (*to).into()).abs());
            }
            self.control.advance(out.len() as u64);
            Ok(worst)
        };
        pool::install(|| {
            let pieces = out.par_chunks_mut(PIECE).enumerate();
            pieces.map_init(Worker::new, piece).try_reduce(|| 0.0, |a: f64, b| Ok(a.max(b)))
        })
    }

    /// Bricks where the field may be within the band, and the largest rounding.
    fn sparse(&self, lip: f64, band: f64, most_bytes: u64) -> Result<(Store, f64), SceneError> {
        let count = bricks_along(self.plan.dims);
        let h = [0, 1, 2].map(|a| self.node([1; 3])[a] - self.plan.lo[a]);
        let size = h.map(|h| h * BRICK as f64);
        let radius = size.iter().map(|v| v * v).sum::<f64>().sqrt() / 2.0;
        let band = if band == 0.0 { BAND * lip * h.iter().fold(0.0, |a: f64, b| a.max(*b)) } else { band };
        if band < diagonal(h) * lip {
            let message = format!(
                "band is {band}, allowed: at least {}, what a cell's diagonal spans",
                diagonal(h) * lip
            );
            return Err(SceneError::new("to_texture", message));
        }
        let total: usize = count.iter().product();
        let mut far: Vec<f32> = room(total)?;
        let middles = |worker: &mut Worker, (i, out): (usize, &mut [f32])| {
            self.stopped()?;
            let at = |k: usize| {
                let b = [k % count[0], k / count[0] % count[1], k / count[0] / count[1]];
                std::array::from_fn(|a| self.plan.lo[a] + size[a] * (b[a] as f64 + 0.5))
            };
            let values = worker.values(&self.program, (i * PIECE..i * PIECE + out.len()).map(at));
            for (to, v) in out.iter_mut().zip(values) {
                let least = v.abs() - lip * radius * (1.0 + 1e-9);
                // NaN keeps its brick, whose nodes then say where it is.
                *to = if least > band {
                    ((least as f32).next_down().min(f32::MAX)).copysign(*v as f32)
                } else {
                    0.0
                };
            }
            self.control.advance(out.len() as u64 / 2);
            Ok(())
        };
        pool::install(|| {
            far.par_chunks_mut(PIECE).enumerate().map_init(Worker::new, middles).collect::<Result<(), _>>()
        })?;
        let kept: Vec<usize> = (0..total).filter(|&i| far[i] == 0.0).collect();
        let bytes = (kept.len() as u64).saturating_mul(BLOCK as u64 * 4);
        if bytes > most_bytes || kept.len() >= Word::SLOTS as usize {
            let message = format!(
                "the bricks near the surface need {} MiB, allowed: {} MiB",
                bytes >> 20,
                most_bytes >> 20
            );
            return Err(SceneError::new("to_texture", message));
        }
        let mut words: Vec<Word> = far.into_iter().map(Word::far).collect();
        for (slot, i) in (0..).zip(&kept) {
            words[*i] = Word::kept(slot);
        }
        let (nodes, worst) = self.blocks(&kept, count, total)?;
        Ok((Store::Sparse(Bricks::new(words, BrickValues::F32(Arc::new(nodes)))), worst))
    }

    /// The nodes of the kept bricks.
    fn blocks(&self, kept: &[usize], count: [usize; 3], total: usize) -> Result<(Vec<f32>, f64), SceneError> {
        let mut nodes: Vec<f32> = room(kept.len() * BLOCK)?;
        let share = total as f64 / 2.0 / kept.len().max(1) as f64;
        let block = |worker: &mut Worker, (slot, out): (usize, &mut [f32])| {
            self.stopped()?;
            let i = kept[slot];
            let b = [i % count[0], i / count[0] % count[1], i / count[0] / count[1]];
            let at = |k: usize| {
                let local = [k % NODES, k / NODES % NODES, k / NODES / NODES];
                self.node(std::array::from_fn(|a| b[a] * BRICK + local[a]))
            };
            let values = worker.values(&self.program, (0..BLOCK).map(at));
            let mut worst = 0f64;
            for (to, v) in out.iter_mut().zip(values) {
                *to = *v as f32;
                worst = worst.max((*v - f64::from(*to)).abs());
            }
            let (from, to) = (slot as f64 * share, (slot + 1) as f64 * share);
            self.control.advance(to as u64 - from as u64);
            Ok(worst)
        };
        let worst = pool::install(|| {
            let blocks = nodes.par_chunks_mut(BLOCK).enumerate();
            blocks.map_init(Worker::new, block).try_reduce(|| 0.0, |a: f64, b| Ok(a.max(b)))
        })?;
        Ok((nodes, worst))
    }
}

/// Memory for `n` zeros, or an error instead of an abort.
fn room<T: Default + Clone>(n: usize) -> Result<Vec<T>, SceneError> {
    let mut probe: Vec<T> = Vec::new();
    probe
        .try_reserve_exact(n)
        .map_err(|_| SceneError::new("to_texture", format!("{n} numbers find no memory")))?;
    drop(probe);
    // The system hands out zeros when a page is first touched: writing them here would take a while.
    Ok(vec![T::default(); n])
}
