//! A field stored at the nodes of a regular grid, interpolated in between.
//!
//! Node-centred, `[z, y, x]`, `a + f*(b-a)` along x, then y, then z; outside its box
//! `max(|p-q|, value(q) - |p-q|)` with `q` the nearest point of the box. Samples lie densely in one
//! array ([`dense`]) or, near the surface alone, in bricks ([`bricks`]); beyond these a brick holds one
//! signed number that bounds the field's magnitude from below. How far a walk may step is in [`slope`].
//! Laws: `tests.rs`; no step passes the interpolant's zero set, packs give the scalar's bits.

pub mod bricks;
mod convert;
pub mod dense;
mod range;
mod sample;
pub mod slope;
pub mod voxel;

use crate::error::SceneError;
pub use bricks::{BrickValues, Bricks, Word};
pub use convert::Sweep;
pub use dense::GridValues;
pub use half::f16;
use slope::Slopes;

/// Cells along an edge of a brick.
pub const BRICK: usize = 8;

/// What to make of an interpolated value `v`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Step {
    /// `v` itself.
    Raw,
    /// A distance that is safe to walk, by the grid's [`Stepping`].
    Safe,
    /// The same for the complement: `-safe(-v)`.
    SafeNegated,
}

/// How a walk turns values into steps; all are safe, and the surface is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stepping {
    /// One rule for the whole grid: `max(v / sqrt 3, v - sqrt 3 h)` for samples of a distance.
    #[default]
    Safe,
    /// Each brick's own slope bound as well, where that reaches farther.
    Bricks,
    /// The root of each voxel's cubic, for a texture that is traced by itself; elsewhere as `Bricks`.
    Voxel,
}

impl Stepping {
    pub const NAMES: [&'static str; 3] = ["safe", "bricks", "voxel"];

    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
    pub fn from_name(name: &str) -> Option<Self> {
        [Stepping::Safe, Stepping::Bricks, Stepping::Voxel].into_iter().find(|s| s.name() == name)
    }
}

/// Where the samples are.
#[derive(Debug, Clone, PartialEq)]
pub enum Store {
    Dense(GridValues),
    Sparse(Bricks),
}

/// What whoever made the samples knows of them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Claim {
    /// Samples are those of a field of this slope, each wrong by at most `max_error`; None: unknown.
    pub lipschitz: Option<f64>,
    /// Largest difference of a sample and the field it stands for, in the field's units.
    pub max_error: f64,
}

#[derive(Debug, Clone)]
pub struct Grid {
    store: Store,
    /// Nodes along x, y, z.
    dims: [usize; 3],
    lo: [f64; 3],
    hi: [f64; 3],
    spacing: [f64; 3],
    claim: Claim,
    slopes: Slopes,
    stepping: Stepping,
    /// A solid reaches the box's faces, where it ends: the field jumps there.
    cut: bool,
}

impl Grid {
    /// A grid of samples of whatever it is: their slopes are measured.
    pub fn new(values: GridValues, dims: [usize; 3], lo: [f64; 3], hi: [f64; 3]) -> Result<Self, SceneError> {
        Self::with_claim(Store::Dense(values), dims, lo, hi, Claim::default())
    }

    /// A grid of samples about which something is known.
    pub fn with_claim(
        store: Store,
        dims: [usize; 3],
        lo: [f64; 3],
        hi: [f64; 3],
        claim: Claim,
    ) -> Result<Self, SceneError> {
        Self::until(store, dims, lo, hi, claim, &|| false)
    }

    /// The same, given up with an error once `stop` says so: large grids take a while to measure.
    pub fn until(
        store: Store,
        dims: [usize; 3],
        lo: [f64; 3],
        hi: [f64; 3],
        claim: Claim,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, SceneError> {
        let bad = |message: String| Err(SceneError::new("texture", message));
        if dims.iter().any(|&n| n < 2) {
            return bad(format!("got {dims:?} nodes along x, y, z, allowed: at least 2 each"));
        }
        if dims.iter().any(|&n| n > 1 << 20) {
            return bad(format!("got {dims:?} nodes along x, y, z, allowed: at most {} each", 1 << 20));
        }
        if lo.iter().chain(&hi).any(|v| !v.is_finite()) || (0..3).any(|i| lo[i] >= hi[i]) {
            return bad(format!("bounds are {lo:?} to {hi:?}, allowed: finite, lo below hi along each axis"));
        }
        let spacing: [f64; 3] = std::array::from_fn(|i| (hi[i] - lo[i]) / (dims[i] - 1) as f64);
        if (0..3).any(|i| !(spacing[i] > 0.0 && spacing[i].is_finite())) {
            return bad(format!("spacing is {spacing:?}, allowed: finite and above 0"));
        }
        let claimed = claim.lipschitz.unwrap_or(1.0);
        if !(claimed > 0.0 && claimed.is_finite() && claim.max_error >= 0.0 && claim.max_error.is_finite()) {
            return bad(format!(
                "the claim is a slope of {claimed} and an error of {}, allowed: finite, a slope above 0",
                claim.max_error
            ));
        }
        match &store {
            Store::Dense(values) => values.check(dims)?,
            Store::Sparse(bricks) => bricks.check(dims)?,
        }
        let slopes = slope::measure(&store, dims, spacing, &claim, stop);
        if stop() {
            return bad("cancelled".into());
        }
        let cut = matches!(&store, Store::Dense(values) if values.cut(dims));
        Ok(Self { store, dims, lo, hi, spacing, claim, slopes, stepping: Stepping::Safe, cut })
    }

    /// The same samples, walked by another rule.
    pub fn with_stepping(&self, stepping: Stepping) -> Self {
        Self { stepping, ..self.clone() }
    }

    pub fn stepping(&self) -> Stepping {
        self.stepping
    }
    pub fn store(&self) -> &Store {
        &self.store
    }
    /// The samples of a dense grid.
    pub fn dense(&self) -> Option<&GridValues> {
        match &self.store {
            Store::Dense(values) => Some(values),
            Store::Sparse(_) => None,
        }
    }
    /// The bricks of a sparse grid.
    pub fn bricks(&self) -> Option<&Bricks> {
        match &self.store {
            Store::Dense(_) => None,
            Store::Sparse(bricks) => Some(bricks),
        }
    }
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        (self.lo, self.hi)
    }
    pub fn spacing(&self) -> [f64; 3] {
        self.spacing
    }
    pub fn claim(&self) -> Claim {
        self.claim
    }
    /// Certified slope of the interpolant and of its continuation outside the box; jumps between the
    /// bricks of a sparse grid apart, which are jumps between lower bounds.
    pub fn lipschitz(&self) -> f64 {
        self.slopes.whole
    }
    /// Magnitudes up to this are the field's own; infinite for dense grids.
    pub fn band(&self) -> f64 {
        self.bricks().map_or(f64::INFINITY, |b| b.band().into())
    }
    /// Slope of what a walk sees, infinite where values or steps jump (sparse grids, per-brick rules, solids that the box cuts):
    /// what may be concluded from one sample about its neighbourhood.
    pub fn strict_slope(&self, step: Step) -> f64 {
        let jumps =
            self.cut || self.bricks().is_some() || (step != Step::Raw && self.stepping != Stepping::Safe);
        let Slopes { whole, a, s, .. } = self.slopes;
        match step {
            _ if jumps => f64::INFINITY,
            Step::Raw => whole,
            // Divided by less than 1 (samples of a flat field) steps are steeper than values.
            _ => whole * (1.0f64).max(1.0 / a).max(1.0 / s),
        }
    }
    /// Slope bounds of a brick, alone and with its neighbours.
    #[inline(always)]
    pub fn slopes_of(&self, brick: usize) -> [f32; 2] {
        let at = match &self.store {
            Store::Dense(_) => Some(brick),
            Store::Sparse(bricks) => bricks.slot(brick),
        };
        match at {
            Some(at) => [self.slopes.bricks[at], self.slopes.near[at]],
            None => [self.slopes.top(); 2],
        }
    }
    /// How steep it is, and the numbers of its rules.
    pub fn slopes(&self) -> &Slopes {
        &self.slopes
    }
    /// Bytes of the samples and of what finds them.
    pub fn nbytes(&self) -> u64 {
        match &self.store {
            Store::Dense(values) => values.nbytes(),
            Store::Sparse(bricks) => bricks.nbytes(),
        }
    }
    /// Length of a cell's diagonal.
    pub fn diagonal(&self) -> f64 {
        slope::diagonal(self.spacing)
    }
}

/// Bricks that cover the cells of a grid.
pub fn bricks_along(dims: [usize; 3]) -> [usize; 3] {
    dims.map(|n| (n - 1).div_ceil(BRICK))
}

/// The place of a value in a grid, for messages.
fn place(i: usize, dims: [usize; 3]) -> String {
    let (x, y, z) = (i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]);
    format!("[z={z}, y={y}, x={x}]")
}

#[cfg(test)]
mod tests;
