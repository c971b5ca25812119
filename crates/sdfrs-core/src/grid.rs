//! A field stored at the nodes of a regular grid, interpolated in between.
//!
//! Node-centred, `[z, y, x]`, `a + f*(b-a)` along x, then y, then z; outside its box
//! `max(|p-q|, value(q) - |p-q|)` with `q` the nearest point of the box. The interpolant of samples
//! of a distance has slope up to sqrt(3) and errs by up to half a cell's diagonal (NUMERICS (g)).

use std::sync::Arc;

use crate::{error::SceneError, real::Scalar};

/// Node values as they were given; nothing is rounded on the way in.
#[derive(Debug, Clone, PartialEq)]
pub enum GridValues {
    F32(Arc<[f32]>),
    F64(Arc<[f64]>),
}

impl GridValues {
    pub fn len(&self) -> usize {
        match self {
            GridValues::F32(v) => v.len(),
            GridValues::F64(v) => v.len(),
        }
    }
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    #[inline(always)]
    fn at<T: Scalar>(&self, i: usize) -> T {
        match self {
            GridValues::F32(v) => T::of(f64::from(v[i])),
            GridValues::F64(v) => T::of(v[i]),
        }
    }
}

/// What to make of an interpolated value `v`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Step {
    /// `v` itself.
    Raw,
    /// A distance that is safe to walk: `max(v / a, v - b)`.
    Safe,
    /// The same for the complement: `-safe(-v)`.
    SafeNegated,
}

#[derive(Debug, Clone)]
pub struct Grid {
    values: GridValues,
    /// Nodes along x, y, z.
    dims: [usize; 3],
    lo: [f64; 3],
    hi: [f64; 3],
    spacing: [f64; 3],
    /// Certified slope of the whole field, box and surroundings.
    lipschitz: f64,
    /// Largest slope between neighbouring nodes: at most 1 for samples of a distance.
    axis_slope: f64,
    /// Divisor and subtrahend of the safe step.
    safe: (f64, f64),
}

/// Cell and position in it.
struct Cell<T> {
    base: usize,
    f: [T; 3],
    outside: [T; 3],
    /// Whether the point lies within the box along each axis.
    within: [bool; 3],
}

impl Grid {
    pub fn new(values: GridValues, dims: [usize; 3], lo: [f64; 3], hi: [f64; 3]) -> Result<Self, SceneError> {
        let bad = |message: String| Err(SceneError::new("texture", message));
        if dims.iter().any(|&n| n < 2) {
            return bad(format!("got {dims:?} nodes along x, y, z, allowed: at least 2 each"));
        }
        let count = dims.iter().try_fold(1usize, |a, &n| a.checked_mul(n));
        if count != Some(values.len()) {
            return bad(format!("got {} values for {dims:?} nodes, allowed: their product", values.len()));
        }
        if lo.iter().chain(&hi).any(|v| !v.is_finite()) || (0..3).any(|i| lo[i] >= hi[i]) {
            return bad(format!("bounds are {lo:?} to {hi:?}, allowed: finite, lo below hi along each axis"));
        }
        let wrong = match &values {
            GridValues::F32(v) => v.iter().position(|v| !v.is_finite()),
            GridValues::F64(v) => v.iter().position(|v| !v.is_finite()),
        };
        if let Some(i) = wrong {
            let (x, y, z) = (i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]);
            return bad(format!("value [z={z}, y={y}, x={x}] is not finite, allowed: finite numbers"));
        }
        let spacing = std::array::from_fn(|i| (hi[i] - lo[i]) / (dims[i] - 1) as f64);
        if (0..3).any(|i| !(spacing[i] > 0.0 && spacing[i].is_finite())) {
            return bad(format!("spacing is {spacing:?}, allowed: finite and above 0"));
        }
        let mut grid =
            Self { values, dims, lo, hi, spacing, lipschitz: 0.0, axis_slope: 0.0, safe: (1.0, 0.0) };
        (grid.lipschitz, grid.axis_slope) = grid.slopes();
        grid.safe = grid.safe_step();
        Ok(grid)
    }

    pub fn values(&self) -> &GridValues {
        &self.values
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
    /// Divisor `a` and subtrahend `b` of the safe step `max(v / a, v - b)`.
    pub fn safe(&self) -> (f64, f64) {
        self.safe
    }
    /// Certified slope of the interpolant and of its continuation outside the box.
    pub fn lipschitz(&self) -> f64 {
        self.lipschitz
    }

    /// Divisor and subtrahend of the safe step `max(v / a, v - b)` to the interpolant's zero set.
    ///
    /// Samples of a distance have slopes of at most 1 between nodes (1e-3 is left for rounding): then
    /// `a` is sqrt(3) and `b` a cell's diagonal. Steeper samples are no distance: only the slope helps.
    fn safe_step(&self) -> (f64, f64) {
        if self.axis_slope <= 1.001 {
            let [hx, hy, hz] = self.spacing;
            let diagonal =
                if hx == hy && hy == hz { 3f64.sqrt() * hx } else { (hx * hx + hy * hy + hz * hz).sqrt() };
            (3f64.sqrt(), diagonal)
        } else {
            (self.lipschitz, f64::INFINITY)
        }
    }

    /// Bound of the whole field's slope, and the largest slope between neighbouring nodes.
    fn slopes(&self) -> (f64, f64) {
        let [nx, ny, nz] = self.dims;
        let (mut steep, mut axis) = (0f64, 0f64);
        let diff =
            |i: usize, j: usize, h: f64| ((self.values.at::<f64>(j) - self.values.at::<f64>(i)) / h).abs();
        for z in 0..nz - 1 {
            for y in 0..ny - 1 {
                for x in 0..nx - 1 {
                    let i = x + nx * (y + ny * z);
                    let (sy, sz) = (nx, nx * ny);
                    let [hx, hy, hz] = self.spacing;
                    let along = |step: usize, a: usize, b: usize, h: f64| {
                        [i, i + a, i + b, i + a + b]
                            .into_iter()
                            .map(|k| diff(k, k + step, h))
                            .fold(0.0, f64::max)
                    };
                    let d = [along(1, sy, sz, hx), along(sy, 1, sz, hy), along(sz, 1, sy, hz)];
                    steep = steep.max(d.iter().map(|v| v * v).sum());
                    axis = d.into_iter().fold(axis, f64::max);
                }
            }
        }
        // Outside a face the field falls or rises by 1 along the normal, by the face's own slope across.
        (steep.max(2.0 * axis * axis + 1.0).sqrt(), axis)
    }

    #[inline(always)]
    fn locate<T: Scalar>(&self, p: [T; 3]) -> Cell<T> {
        let mut index = [0usize; 3];
        let mut cell = Cell { base: 0, f: p, outside: p, within: [true; 3] };
        for a in 0..3 {
            let (lo, hi, h) = (T::of(self.lo[a]), T::of(self.hi[a]), T::of(self.spacing[a]));
            let q = if p[a] < lo {
                lo
            } else if p[a] > hi {
                hi
            } else {
                p[a]
            };
            let u = (q - lo) / h;
            // A NaN becomes cell 0 here and stays NaN in the weights.
            let i = (u.floor().f64() as usize).min(self.dims[a] - 2);
            index[a] = i;
            cell.f[a] = u - T::of(i as f64);
            cell.outside[a] = p[a] - q;
            cell.within[a] = p[a] >= lo && p[a] <= hi;
        }
        cell.base = index[0] + self.dims[0] * (index[1] + self.dims[1] * index[2]);
        cell
    }

    #[inline(always)]
    fn corners<T: Scalar>(&self, base: usize) -> [T; 8] {
        let (sy, sz) = (self.dims[0], self.dims[0] * self.dims[1]);
        let at = [
            base,
            base + 1,
            base + sy,
            base + sy + 1,
            base + sz,
            base + sz + 1,
            base + sz + sy,
            base + sz + sy + 1,
        ];
        match &self.values {
            GridValues::F32(v) => at.map(|i| T::of(f64::from(v[i]))),
            GridValues::F64(v) => at.map(|i| T::of(v[i])),
        }
    }

    #[inline(always)]
    fn stepped<T: Scalar>(&self, v: T, step: Step) -> T {
        let (a, b) = (T::of(self.safe.0), T::of(self.safe.1));
        match step {
            Step::Raw => v,
            Step::Safe => (v / a).max(v - b),
            Step::SafeNegated => (v / a).min(v + b),
        }
    }

    /// The field at a point.
    #[inline(always)]
    pub fn sample<T: Scalar>(&self, p: [T; 3], step: Step) -> T {
        let cell = self.locate(p);
        let v = interpolate(self.corners::<T>(cell.base), cell.f);
        surround(self.stepped(v, step), cell.outside)
    }

    /// The field and its slope at a point.
    pub fn sample_gradient<T: Scalar>(&self, p: [T; 3], step: Step) -> (T, [T; 3]) {
        let cell = self.locate(p);
        let c = self.corners::<T>(cell.base);
        let [fx, fy, fz] = cell.f;
        let mix = |a: T, b: T, f: T| a + f * (b - a);
        let x: [T; 4] = std::array::from_fn(|i| mix(c[2 * i], c[2 * i + 1], fx));
        let (y0, y1) = (mix(x[0], x[1], fy), mix(x[2], x[3], fy));
        let v = mix(y0, y1, fz);
        let dx: [T; 4] = std::array::from_fn(|i| c[2 * i + 1] - c[2 * i]);
        let slope = [
            mix(mix(dx[0], dx[1], fy), mix(dx[2], dx[3], fy), fz),
            mix(x[1] - x[0], x[3] - x[2], fz),
            y1 - y0,
        ];
        let scale = if self.stepped(v, step) == v / T::of(self.safe.0) && step != Step::Raw {
            T::of(self.safe.0)
        } else {
            T::of(1.0)
        };
        let v = self.stepped(v, step);
        let mut g: [T; 3] = std::array::from_fn(|a| slope[a] / (T::of(self.spacing[a]) * scale));
        let d = T::len3(cell.outside[0], cell.outside[1], cell.outside[2]);
        let zero = T::of(0.0);
        if d > zero {
            let away = cell.outside.map(|o| o / d);
            let near = v - d > d;
            for a in 0..3 {
                let across = if cell.within[a] { g[a] } else { zero };
                g[a] = if near { across - away[a] } else { away[a] };
            }
        }
        (surround(v, cell.outside), g)
    }

    /// Bounds of the field over a box given as `[lo, hi]` along each axis.
    pub fn range(&self, p: [[f64; 2]; 3], step: Step) -> (f64, f64) {
        let mut first = [0usize; 3];
        let mut last = [0usize; 3];
        let (mut near, mut far) = (0.0, 0.0);
        for a in 0..3 {
            let node = |v: f64| (v.clamp(self.lo[a], self.hi[a]) - self.lo[a]) / self.spacing[a];
            if p[a][0].is_nan() || p[a][1].is_nan() {
                return (f64::NEG_INFINITY, f64::INFINITY);
            }
            // One node more at both ends: the division rounds.
            first[a] = (node(p[a][0]).floor() as usize).saturating_sub(1);
            last[a] = (node(p[a][1]).ceil() as usize + 1).min(self.dims[a] - 1);
            let out = |v: f64| (self.lo[a] - v).max(v - self.hi[a]).max(0.0);
            let gap = (self.lo[a] - p[a][1]).max(p[a][0] - self.hi[a]).max(0.0);
            near += gap * gap;
            far += out(p[a][0]).max(out(p[a][1])).powi(2);
        }
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                for x in first[0]..=last[0] {
                    let v: f64 = self.values.at(x + self.dims[0] * (y + self.dims[1] * z));
                    (lo, hi) = (lo.min(v), hi.max(v));
                }
            }
        }
        let (lo, hi) = (self.stepped(lo, step), self.stepped(hi, step));
        let (near, far) = (near.sqrt(), far.sqrt());
        if far == 0.0 {
            return (lo, hi);
        }
        let outer = (near.max(lo - far), far.max(hi - near));
        if near > 0.0 { outer } else { (lo.min(outer.0), hi.max(outer.1)) }
    }
}

#[inline(always)]
fn interpolate<T: Scalar>(c: [T; 8], f: [T; 3]) -> T {
    let mix = |a: T, b: T, f: T| a + f * (b - a);
    let (x0, x1) = (mix(c[0], c[1], f[0]), mix(c[2], c[3], f[0]));
    let (x2, x3) = (mix(c[4], c[5], f[0]), mix(c[6], c[7], f[0]));
    mix(mix(x0, x1, f[1]), mix(x2, x3, f[1]), f[2])
}

#[inline(always)]
fn surround<T: Scalar>(v: T, outside: [T; 3]) -> T {
    let d = T::len3(outside[0], outside[1], outside[2]);
    let zero = T::of(0.0);
    if d > zero { d.max(v - d) } else { v }
}
