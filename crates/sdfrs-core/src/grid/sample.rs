//! Values and slopes at points, one point or a pack of them at a time.
//!
//! Positions and interpolation run over all lanes, one operation at a time (loops over axes and lanes at once become
//! vectors of three axes); corners are fetched lane by lane, two neighbours along x at a time, which is one load of 8
//! bytes for f32 (`lane::neighbours`). A point alone is a pack of one, so both have the same bits.
//! Law: `tests::packs_and_points_agree`.

use half::f16;

use super::{
    BRICK, BrickValues, Grid, GridValues, Step, Stepping, Store,
    bricks::widen,
    bricks_along,
    dense::Sample,
    slope::{BLOCK, NODES, Rule},
};
use crate::{
    lane::{Pack, neighbours},
    real::{Real, Scalar},
};

/// Where points lie: cell, position in it, and what is left outside of the box.
struct Place<T, const W: usize> {
    cell: [[u32; W]; 3],
    f: [Pack<T, W>; 3],
    outside: [Pack<T, W>; 3],
}

/// A cell's corners: x fastest, then y, then z.
type Corners<T, const W: usize> = [[T; W]; 8];

impl Grid {
    #[inline(always)]
    fn locate<T: Scalar, const W: usize>(&self, p: [[T; W]; 3]) -> Place<T, W> {
        // Written out: as a loop LLVM makes vectors of three axes of it, sixteen times.
        let [x, y, z] = [self.along(0, Pack(p[0])), self.along(1, Pack(p[1])), self.along(2, Pack(p[2]))];
        Place { cell: [x.0, y.0, z.0], f: [x.1, y.1, z.1], outside: [x.2, y.2, z.2] }
    }

    /// The same along one axis.
    #[inline(always)]
    fn along<T: Scalar, const W: usize>(
        &self,
        a: usize,
        v: Pack<T, W>,
    ) -> ([u32; W], Pack<T, W>, Pack<T, W>) {
        let (zero, lo, hi) = (Pack::c(0.0), Pack::c(self.lo[a]), Pack::c(self.hi[a]));
        let q = Pack::select_lt(v, lo, lo, Pack::select_lt(hi, v, hi, v));
        let u = (q - lo) / Pack::c(self.spacing[a]);
        // A NaN becomes the last cell and stays NaN in the weights.
        let (floor, last) = (u.floor(), Pack::c((self.dims[a] - 2) as f64));
        let n = Pack::select_lt(floor, last, floor, last);
        let n = Pack::select_lt(n, zero, zero, n);
        let mut cell = [0; W];
        for i in 0..W {
            cell[i] = n.0[i].cell();
        }
        (cell, u - n, v - q)
    }

    /// Corners of the points' cells. Not inlined: loads gain nothing from wider instructions, and there is
    /// one copy of all kinds of storage instead of one for each op and instruction set.
    #[inline(never)]
    fn corners<T: Scalar, const W: usize>(&self, cell: &[[u32; W]; 3], out: &mut Corners<T, W>) {
        match &self.store {
            Store::Dense(GridValues::F16(v)) => fetch::<f16, T, W>(v, self.dims, cell, out),
            Store::Dense(GridValues::F32(v)) => fetch::<f32, T, W>(v, self.dims, cell, out),
            Store::Dense(GridValues::F64(v)) => fetch::<f64, T, W>(v, self.dims, cell, out),
            Store::Sparse(bricks) => {
                let count = bricks_along(self.dims);
                for i in 0..W {
                    let [x, y, z] = [0, 1, 2].map(|a| cell[a][i] as usize);
                    let brick = x / BRICK + count[0] * (y / BRICK + count[1] * (z / BRICK));
                    let word = bricks.words()[brick];
                    let Some(slot) = word.slot() else {
                        for c in out.iter_mut() {
                            c[i] = T::of(f64::from(word.value()));
                        }
                        continue;
                    };
                    let base = x % BRICK + NODES * (y % BRICK + NODES * (z % BRICK));
                    let at = slot * BLOCK + base;
                    let mut put = |k: usize, [a, b]: [T; 2]| (out[2 * k][i], out[2 * k + 1][i]) = (a, b);
                    for (k, row) in ROWS.into_iter().enumerate() {
                        let at = at + row;
                        put(
                            k,
                            match bricks.nodes() {
                                BrickValues::F16(v) => pair(v, at),
                                BrickValues::F32(v) => pair(v, at),
                                BrickValues::U8 { codes, scale } => {
                                    [codes[at], codes[at + 1]].map(|c| widen(c, scale[slot]))
                                }
                            },
                        );
                    }
                }
            }
        }
    }

    /// Corners of one cell.
    pub(super) fn corners_of<T: Scalar>(&self, cell: [usize; 3]) -> [T; 8] {
        let mut out = [[T::of(0.0); 1]; 8];
        self.corners(&cell.map(|v| [v as u32]), &mut out);
        out.map(|c| c[0])
    }

    /// Slopes of the points' bricks, alone and with their neighbours.
    #[inline(never)]
    fn slopes_at<T: Scalar, const W: usize>(&self, cell: &[[u32; W]; 3]) -> [[T; W]; 2] {
        let count = bricks_along(self.dims);
        let mut out = [[T::of(0.0); W]; 2];
        for i in 0..W {
            let [x, y, z] = [0, 1, 2].map(|a| cell[a][i] as usize / BRICK);
            let brick = x + count[0] * (y + count[1] * z);
            let [own, near] = self.slopes_of(brick);
            (out[0][i], out[1][i]) = (own.wide(), near.wide());
        }
        out
    }

    /// Steps from interpolated values.
    #[inline(always)]
    fn stepped<T: Scalar, const W: usize>(&self, mut v: [T; W], step: Step, place: &Place<T, W>) -> [T; W] {
        let rule = Rule::<T>::new(&self.slopes);
        if step == Step::Raw {
            return v;
        }
        let sign = if step == Step::Safe { T::of(1.0) } else { T::of(-1.0) };
        if self.stepping == Stepping::Safe {
            for i in 0..W {
                v[i] = rule.safe(v[i] * sign) * sign;
            }
            return v;
        }
        let [own, near] = self.slopes_at::<T, W>(&place.cell);
        let one = T::of(1.0);
        for i in 0..W {
            let (mut wall, mut edge) = (T::INFINITY, T::INFINITY);
            for a in 0..3 {
                let (h, size) = (T::of(self.spacing[a]), T::of(BRICK as f64));
                let cell = T::of(f64::from(place.cell[a][i] % BRICK as u32));
                let at = cell + place.f[a].0[i];
                // Rounding of the position must not carry the step over the wall.
                let reach = self.lo[a].abs().max(self.hi[a].abs()) / self.spacing[a];
                let slack = T::of(4.0 * (reach + self.dims[a] as f64)) * T::EPS;
                wall = wall.min((at.min(size - at) - slack) * h);
                edge = edge.min(size * h);
            }
            let wall = wall.max(T::of(0.0));
            v[i] = rule.bricks(v[i], own[i], wall, near[i], (wall + edge) * (one - T::EPS));
        }
        v
    }

    /// The field at a pack of points.
    #[inline(always)]
    pub fn sample_lanes<T: Scalar, const W: usize>(&self, p: [[T; W]; 3], step: Step) -> [T; W] {
        let place = self.locate(p);
        let mut corners = [[T::of(0.0); W]; 8];
        match &self.store {
            // What is traced most stays where the lanes are: results needn't go through memory.
            Store::Dense(GridValues::F32(v)) => fetch::<f32, T, W>(v, self.dims, &place.cell, &mut corners),
            _ => self.corners(&place.cell, &mut corners),
        }
        let v = self.stepped(interpolate(&corners, &place.f), step, &place);
        surround(Pack(v), place.outside).0
    }

    /// The field at a point.
    #[inline(always)]
    pub fn sample<T: Scalar>(&self, p: [T; 3], step: Step) -> T {
        self.sample_lanes(p.map(|v| [v]), step)[0]
    }

    /// The field and its slope at a point: the interpolant's own slope for raw values; for those that
    /// are walked the slope over a cell's width, which is continuous from voxel to voxel (for normals).
    pub fn sample_gradient<T: Scalar>(&self, p: [T; 3], step: Step) -> (T, [T; 3]) {
        let place = self.locate(p.map(|v| [v]));
        let inside = if step == Step::Raw { self.slope_inside(&place) } else { self.slope_across(p) };
        let v = self.sample(p, step);
        let outside = place.outside.map(|o| o.0[0]);
        let d = T::len3(outside[0], outside[1], outside[2]);
        let zero = T::of(0.0);
        if !(d > zero) {
            return (v, inside);
        }
        let away = outside.map(|o| o / d);
        // On the box's side of the field the value falls by 1 along the way out, by the face's slope across.
        let near = v > d;
        let g = std::array::from_fn(|a| {
            let across = if outside[a] == zero { inside[a] } else { zero };
            if near { across - away[a] } else { away[a] }
        });
        (v, g)
    }

    /// Partial derivatives of the cell's interpolant.
    fn slope_inside<T: Scalar>(&self, place: &Place<T, 1>) -> [T; 3] {
        let mut corners = [[T::of(0.0); 1]; 8];
        self.corners(&place.cell, &mut corners);
        let c = corners.map(|c| c[0]);
        let [fx, fy, fz] = place.f.map(|f| f.0[0]);
        let mix = |a: T, b: T, f: T| a + f * (b - a);
        let x: [T; 4] = std::array::from_fn(|i| mix(c[2 * i], c[2 * i + 1], fx));
        let (y0, y1) = (mix(x[0], x[1], fy), mix(x[2], x[3], fy));
        let dx: [T; 4] = std::array::from_fn(|i| c[2 * i + 1] - c[2 * i]);
        let slope = [
            mix(mix(dx[0], dx[1], fy), mix(dx[2], dx[3], fy), fz),
            mix(x[1] - x[0], x[3] - x[2], fz),
            y1 - y0,
        ];
        std::array::from_fn(|a| slope[a] / T::of(self.spacing[a]))
    }

    /// Differences of values half a cell to both sides, inside the box.
    fn slope_across<T: Scalar>(&self, p: [T; 3]) -> [T; 3] {
        let (lo, hi) = (self.lo.map(T::of), self.hi.map(T::of));
        let p: [T; 3] = std::array::from_fn(|a| p[a].max(lo[a]).min(hi[a]));
        std::array::from_fn(|a| {
            let half = T::of(self.spacing[a] * 0.5);
            let (mut b, mut c) = (p, p);
            (b[a], c[a]) = ((p[a] - half).max(lo[a]), (p[a] + half).min(hi[a]));
            (self.sample(c, Step::Raw) - self.sample(b, Step::Raw)) / (c[a] - b[a])
        })
    }
}

/// From a cell's first row of corners to the others, in a brick.
const ROWS: [usize; 4] = [0, NODES, NODES * NODES, NODES * NODES + NODES];

/// Two neighbours along x, in one load where both fit a register.
#[inline(always)]
fn pair<S: Sample, T: Scalar>(v: &[S], at: usize) -> [T; 2] {
    match v.get(at..at + 2) {
        Some(&[a, b]) => [a.wide(), b.wide()],
        // Cells lie inside the grid, which the constructor has compared with the array's length.
        _ => [T::of(0.0); 2],
    }
}

#[inline(always)]
fn fetch<S: Sample, T: Scalar, const W: usize>(
    v: &[S],
    dims: [usize; 3],
    cell: &[[u32; W]; 3],
    out: &mut Corners<T, W>,
) {
    let (sy, sz) = (dims[0], dims[0] * dims[1]);
    let mut at = [0; W];
    for i in 0..W {
        at[i] = cell[0][i] as usize + sy * cell[1][i] as usize + sz * cell[2][i] as usize;
    }
    // Of one length, so that one comparison serves all.
    let n = v.len().saturating_sub(sz + sy);
    let row = |from: usize| v.get(from..from + n).unwrap_or_default();
    neighbours([row(0), row(sy), row(sz), row(sz + sy)], &at, out);
}

#[inline(always)]
fn interpolate<T: Scalar, const W: usize>(c: &Corners<T, W>, [fx, fy, fz]: &[Pack<T, W>; 3]) -> [T; W] {
    let row = [mix(c[0], c[1], *fx), mix(c[2], c[3], *fx), mix(c[4], c[5], *fx), mix(c[6], c[7], *fx)];
    let plane = [mix(row[0].0, row[1].0, *fy), mix(row[2].0, row[3].0, *fy)];
    mix(plane[0].0, plane[1].0, *fz).0
}

#[inline(always)]
fn mix<T: Scalar, const W: usize>(a: [T; W], b: [T; W], f: Pack<T, W>) -> Pack<T, W> {
    Pack(a) + f * (Pack(b) - Pack(a))
}

#[inline(always)]
fn surround<T: Scalar, const W: usize>(v: Pack<T, W>, [x, y, z]: [Pack<T, W>; 3]) -> Pack<T, W> {
    let d = Pack::len3(x, y, z);
    Pack::select_lt(Pack::c(0.0), d, d.max(v - d), v)
}
