//! How steep a grid is, brick by brick, and how far a walk may step from an interpolated value.
//!
//! A cell's trilinear interpolant has partial derivatives that are bilinear means of the differences
//! along its edges, so the norm of the largest ones bounds its slope (NUMERICS (g)). With `v` the value
//! at `p`, `Z` the interpolant's zero set, `a` the largest slope of any cell, `s` such that samples
//! differ by at most `s` times their distance plus `2 e`, these are lower bounds of `dist(p, Z)`:
//!
//! 1. `v / a`, since the straight way to `Z` falls by `v`.
//! 2. `(v - 2 e) / s - diagonal`: at `z` in `Z` the weighted samples of a cell cancel, so
//!    `v = sum w_i w'_j (d_i - d_j) <= s (|p - z| + |x_i - p| + |x_j - z|) + 2 e` in the mean, and the
//!    mean distance of a point to its cell's corners is at most half a diagonal.
//! 3. In a brick of slope `b` whose faces are `e` away: `min(v / b, v / a + e (1 - b / a))`. A zero in the
//!    brick is at least `v / b` away. To reach any other the way leaves the brick after `e' >= e`, where the
//!    value is still `v - b e'` or more, and rule 1 counts from there: `e' + (v - b e') / a`, which grows with `e'`.
//! 4. Rule 3 for the brick and its 26 neighbours together: `e` is a brick's edge longer.
//!
//! A brick that keeps no samples holds a value that bounds the interpolant's magnitude over all of it:
//! rules 1 and 2 grow with `v`, so they hold for less, with `a` the bound of cells that nobody stored.
//! Law: `tests::steps_never_pass_the_zero_set`.

use std::sync::Arc;

use rayon::prelude::*;

use super::{BRICK, BrickValues, Bricks, Claim, GridValues, Store, bricks_along, dense::Sample};
use crate::{pool, real::Scalar};

/// Nodes along an edge of a brick.
pub const NODES: usize = BRICK + 1;
/// Nodes of a brick.
pub const BLOCK: usize = NODES * NODES * NODES;
/// Samples whose slopes, diagonals included, are at most this count as those of a distance.
const DISTANCE: f64 = 1.001;

#[derive(Debug, Clone, PartialEq)]
pub struct Slopes {
    /// Bound of the whole field, box and surroundings.
    pub whole: f64,
    /// Divisor of rule 1.
    pub a: f64,
    /// Divisor and subtrahend of rule 2; the latter is infinite where there is no such rule.
    pub s: f64,
    pub gap: f64,
    /// Slopes of the bricks, and of each with its neighbours: all of a dense grid, in a sparse one those that keep
    /// nodes, in the order of their slots ([`Grid::slopes_of`](super::Grid::slopes_of)).
    pub bricks: Arc<Vec<f32>>,
    pub near: Arc<Vec<f32>>,
}

impl Slopes {
    /// No brick has more; those without nodes have this.
    #[inline(always)]
    pub fn top(&self) -> f32 {
        (self.a as f32).next_up()
    }
}

pub fn diagonal([hx, hy, hz]: [f64; 3]) -> f64 {
    if hx == hy && hy == hz { 3f64.sqrt() * hx } else { (hx * hx + hy * hy + hz * hz).sqrt() }
}

/// Largest slopes found in some cells.
#[derive(Debug, Clone, Copy, Default)]
struct Found {
    /// Square of a cell's slope.
    steep: f64,
    /// Between neighbours along an axis.
    axis: f64,
    /// Between any two nodes of a cell.
    pair: f64,
}

impl Found {
    fn with(self, o: Found) -> Found {
        Found { steep: self.steep.max(o.steep), axis: self.axis.max(o.axis), pair: self.pair.max(o.pair) }
    }
}

/// Slopes of a grid; nothing of use once `stop` says so.
pub fn measure(
    store: &Store,
    dims: [usize; 3],
    spacing: [f64; 3],
    claim: &Claim,
    stop: &(dyn Fn() -> bool + Sync),
) -> Slopes {
    let count = bricks_along(dims);
    let (mut bricks, most) = match (store, claim.lipschitz) {
        // Unclaimed grids are measured in f64 whatever they are stored as: their slopes decide steps.
        (Store::Dense(_), None) | (Store::Dense(GridValues::F64(_)), _) => {
            survey::<f64>(store, dims, spacing, true, stop)
        }
        (_, known) => survey::<f32>(store, dims, spacing, known.is_none(), stop),
    };
    let (a, s, gap, whole) = rules(store, spacing, claim, most);
    let mut slopes = Slopes { whole, a, s, gap, bricks: Arc::default(), near: Arc::default() };
    for b in &mut bricks {
        *b = b.min(slopes.top()).max(f32::MIN_POSITIVE);
    }
    let near = match store {
        Store::Dense(_) => spread(&bricks, count),
        Store::Sparse(sparse) => neighbours(sparse, &bricks, slopes.top(), count),
    };
    (slopes.bricks, slopes.near) = (Arc::new(bricks), Arc::new(near));
    slopes
}

/// `a`, `s`, the subtrahend of rule 2, and the slope of the whole field.
fn rules(store: &Store, h: [f64; 3], claim: &Claim, most: Found) -> (f64, f64, f64, f64) {
    let diagonal = diagonal(h);
    // Outside a face the field falls or rises by 1 along the normal, by the face's own slope across.
    let whole = most.steep.max(2.0 * most.axis * most.axis + 1.0).sqrt();
    let sparse = matches!(store, Store::Sparse(_));
    let claimed = match claim.lipschitz {
        Some(l) => Some(l),
        None if most.pair <= DISTANCE => None,
        // Ways along edges are at most sqrt(3) times as long as straight ones.
        None if sparse => Some(3f64.sqrt() * most.axis.max(1.0)),
        None => return (whole, 1.0, f64::INFINITY, whole),
    };
    let Some(s) = claimed else { return (3f64.sqrt(), 1.0, diagonal, whole) };
    let noise = 2.0 * claim.max_error;
    let bound = h.iter().map(|h| (s + noise / h).powi(2)).sum::<f64>().sqrt();
    // A floor, for grids that hardly change: a step must be a number, and larger divisors are safe.
    let a = if sparse { bound } else { bound.min(most.steep.sqrt()).max(1e-3 * bound) };
    (a, s, diagonal + noise / s, whole)
}

/// The slope of each brick that keeps samples, and the largest slopes of all.
fn survey<T: Scalar>(
    store: &Store,
    dims: [usize; 3],
    spacing: [f64; 3],
    pairs: bool,
    stop: &(dyn Fn() -> bool + Sync),
) -> (Vec<f32>, Found) {
    let count = bricks_along(dims);
    let inverse = Inverse::<T>::new(spacing);
    let owners = match store {
        Store::Dense(_) => None,
        Store::Sparse(bricks) => Some(bricks.owners(bricks.kept())),
    };
    let one = |block: &mut Vec<T>, (i, out): (usize, &mut f32)| {
        if stop() {
            return Found::default();
        }
        let brick = owners.as_ref().map_or(i, |owners| owners[i]);
        let at = [brick % count[0], brick / count[0] % count[1], brick / count[0] / count[1]];
        fill(store, dims, at, i, block);
        let found = inverse.steepest(block, pairs);
        *out = (found.steep.sqrt() as f32).next_up();
        found
    };
    let all = owners.as_ref().map_or_else(|| count.iter().product(), Vec::len);
    let mut out = vec![0f32; all];
    let most = pool::install(|| {
        let bricks = out.par_iter_mut().enumerate();
        bricks.map_init(|| vec![T::of(0.0); BLOCK], one).reduce(Found::default, Found::with)
    });
    (out, most)
}

/// A brick's nodes, those in `slot` of a sparse grid; beyond the grid its last ones again, so that no slope is added.
fn fill<T: Scalar>(store: &Store, dims: [usize; 3], at: [usize; 3], slot: usize, block: &mut [T]) {
    match store {
        Store::Dense(GridValues::F16(v)) => copy(v, dims, at.map(|b| b * BRICK), dims, block),
        Store::Dense(GridValues::F32(v)) => copy(v, dims, at.map(|b| b * BRICK), dims, block),
        Store::Dense(GridValues::F64(v)) => copy(v, dims, at.map(|b| b * BRICK), dims, block),
        Store::Sparse(bricks) => {
            let inside = std::array::from_fn(|a| (dims[a] - at[a] * BRICK).min(NODES));
            let nodes = slot * BLOCK..(slot + 1) * BLOCK;
            match bricks.nodes() {
                BrickValues::F16(v) => copy(&v[nodes], [NODES; 3], [0; 3], inside, block),
                BrickValues::F32(v) => copy(&v[nodes], [NODES; 3], [0; 3], inside, block),
                BrickValues::U8 { .. } => {
                    for (j, to) in block.iter_mut().enumerate() {
                        let p = [j % NODES, j / NODES % NODES, j / NODES / NODES];
                        let [x, y, z]: [usize; 3] = std::array::from_fn(|a| p[a].min(inside[a] - 1));
                        *to = bricks.node(slot, x + NODES * (y + NODES * z));
                    }
                }
            }
        }
    }
}

/// A block of nodes from `first` on; beyond `end` the last ones again.
fn copy<S: Sample, T: Scalar>(
    v: &[S],
    dims: [usize; 3],
    first: [usize; 3],
    end: [usize; 3],
    block: &mut [T],
) {
    let mut rows = block.chunks_exact_mut(NODES);
    for z in 0..NODES {
        for y in 0..NODES {
            let Some(row) = rows.next() else { return };
            let (z, y) = ((first[2] + z).min(end[2] - 1), (first[1] + y).min(end[1] - 1));
            let from = &v[dims[0] * (y + dims[1] * z)..][first[0]..end[0].min(first[0] + NODES)];
            for (x, to) in row.iter_mut().enumerate() {
                *to = from[x.min(from.len() - 1)].wide();
            }
        }
    }
}

/// One over the lengths of a cell's edges and diagonals.
struct Inverse<T> {
    edge: [T; 3],
    /// Diagonals of the faces across x, y, z.
    face: [T; 3],
    body: T,
}

impl<T: Scalar> Inverse<T> {
    fn new(h: [f64; 3]) -> Self {
        let over = |v: f64| T::of(1.0 / v);
        Self {
            edge: h.map(over),
            face: [over(h[1].hypot(h[2])), over(h[0].hypot(h[2])), over(h[0].hypot(h[1]))],
            body: over(diagonal(h)),
        }
    }

    /// Largest slopes of a block's cells, what rounding may have taken added.
    fn steepest(&self, block: &[T], pairs: bool) -> Found {
        let (mut steep, mut axis, mut pair) = ([T::of(0.0); BRICK], [T::of(0.0); BRICK], [T::of(0.0); BRICK]);
        let row = |y: usize, z: usize| &block[NODES * (y + NODES * z)..][..NODES];
        for z in 0..BRICK {
            for y in 0..BRICK {
                let (a, b, c, d) = (row(y, z), row(y + 1, z), row(y, z + 1), row(y + 1, z + 1));
                for x in 0..BRICK {
                    let gap = |p: T, q: T| (p - q).abs();
                    let most = |p: [T; 4]| p[0].max(p[1]).max(p[2].max(p[3]));
                    let n = x + 1;
                    let dx = most([gap(a[n], a[x]), gap(b[n], b[x]), gap(c[n], c[x]), gap(d[n], d[x])])
                        * self.edge[0];
                    let dy = most([gap(b[x], a[x]), gap(b[n], a[n]), gap(d[x], c[x]), gap(d[n], c[n])])
                        * self.edge[1];
                    let dz = most([gap(c[x], a[x]), gap(c[n], a[n]), gap(d[x], b[x]), gap(d[n], b[n])])
                        * self.edge[2];
                    steep[x] = steep[x].max(dx * dx + dy * dy + dz * dz);
                    axis[x] = axis[x].max(dx.max(dy).max(dz));
                    if pairs {
                        let yz = most([gap(a[x], d[x]), gap(b[x], c[x]), gap(a[n], d[n]), gap(b[n], c[n])])
                            * self.face[0];
                        let xz = most([gap(a[x], c[n]), gap(a[n], c[x]), gap(b[x], d[n]), gap(b[n], d[x])])
                            * self.face[1];
                        let xy = most([gap(a[x], b[n]), gap(a[n], b[x]), gap(c[x], d[n]), gap(c[n], d[x])])
                            * self.face[2];
                        let through =
                            most([gap(a[x], d[n]), gap(a[n], d[x]), gap(b[x], c[n]), gap(b[n], c[x])])
                                * self.body;
                        pair[x] = pair[x].max(yz.max(xz).max(xy.max(through)));
                    }
                }
            }
        }
        let top = |v: [T; BRICK]| v.into_iter().fold(0.0, |m: f64, v| m.max(v.f64()));
        let margin = 1.0 + 16.0 * T::EPS.f64();
        let axis = top(axis) * margin;
        Found { steep: top(steep) * margin, axis, pair: axis.max(top(pair) * margin) }
    }
}

/// The largest value of each brick and its 26 neighbours: along x, then y, then z.
fn spread(bricks: &[f32], count: [usize; 3]) -> Vec<f32> {
    let strides = [1, count[0], count[0] * count[1]];
    let mut now = bricks.to_vec();
    for axis in 0..3 {
        let before = now.clone();
        for (i, v) in now.iter_mut().enumerate() {
            let at = i / strides[axis] % count[axis];
            if at > 0 {
                *v = v.max(before[i - strides[axis]]);
            }
            if at + 1 < count[axis] {
                *v = v.max(before[i + strides[axis]]);
            }
        }
    }
    now
}

/// The same for the bricks that keep nodes, in the order of their slots; the others have `top`.
fn neighbours(sparse: &Bricks, slopes: &[f32], top: f32, count: [usize; 3]) -> Vec<f32> {
    let one = |&brick: &usize| {
        let at = [brick % count[0], brick / count[0] % count[1], brick / count[0] / count[1]];
        let from = at.map(|b| b.saturating_sub(1));
        let to: [usize; 3] = std::array::from_fn(|a| (at[a] + 1).min(count[a] - 1));
        let mut most = 0f32;
        for z in from[2]..=to[2] {
            for y in from[1]..=to[1] {
                for x in from[0]..=to[0] {
                    let slot = sparse.slot(x + count[0] * (y + count[1] * z));
                    most = most.max(slot.map_or(top, |slot| slopes[slot]));
                }
            }
        }
        most
    };
    sparse.owners(slopes.len()).iter().map(one).collect()
}

/// Numbers of the rules in a walk's precision.
pub(super) struct Rule<T> {
    a: T,
    s: T,
    gap: T,
}

impl<T: Scalar> Rule<T> {
    #[inline(always)]
    pub fn new(slopes: &Slopes) -> Self {
        Self { a: T::of(slopes.a), s: T::of(slopes.s), gap: T::of(slopes.gap) }
    }

    /// Rules 1 and 2; rule 1 alone where the value is negative.
    #[inline(always)]
    pub fn safe(&self, v: T) -> T {
        (v / self.a).max(v / self.s - self.gap)
    }

    /// All rules, for both signs: `b` and `n` are the slopes, `e` and `far` the distances to the walls.
    #[inline(always)]
    pub fn bricks(&self, v: T, b: T, e: T, n: T, far: T) -> T {
        let one = T::of(1.0);
        let m = v.abs();
        let own = (m / b).min(m / self.a + e * (one - b / self.a));
        let wide = (m / n).min(m / self.a + far * (one - n / self.a));
        // A bound with all digits used may be too large by its rounding.
        let best = own.max(wide) * (one - T::of(8.0) * T::EPS);
        let step = self.safe(m).max(best);
        T::select_lt(v, T::of(0.0), -step, step)
    }
}
