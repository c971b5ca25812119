//! Values and slopes at points, one point or a pack of them at a time.
//!
//! Positions and interpolation run over all lanes; corners are fetched lane by lane, two neighbours
//! along x at a time, which is one load of 8 bytes for f32 (EVALUATOR 7: gathers are slower). A point alone
//! is a pack of one, so both have the same bits. Law: `tests::packs_and_points_agree`.

use half::f16;

use super::{
    BRICK, BrickValues, Grid, GridValues, Step, Stepping, Store,
    bricks::widen,
    bricks_along,
    dense::Sample,
    slope::{BLOCK, NODES, Rule},
};
use crate::real::Scalar;

/// Where points lie: cell, position in it, and what is left outside of the box.
struct Place<T, const W: usize> {
    cell: [[u32; W]; 3],
    f: [[T; W]; 3],
    outside: [[T; W]; 3],
}

/// A cell's corners: x fastest, then y, then z.
type Corners<T, const W: usize> = [[T; W]; 8];

impl Grid {
    #[inline(always)]
    fn locate<T: Scalar, const W: usize>(&self, p: [[T; W]; 3]) -> Place<T, W> {
        let zero = T::of(0.0);
        let mut place = Place { cell: [[0; W]; 3], f: [[zero; W]; 3], outside: [[zero; W]; 3] };
        for a in 0..3 {
            let (lo, hi, h) = (T::of(self.lo[a]), T::of(self.hi[a]), T::of(self.spacing[a]));
            let last = T::of((self.dims[a] - 2) as f64);
            for i in 0..W {
                let v = p[a][i];
                let q = T::select_lt(v, lo, lo, T::select_lt(hi, v, hi, v));
                let u = (q - lo) / h;
                // A NaN becomes cell 0 and stays NaN in the weights.
                let n = T::select_lt(u.floor(), last, u.floor(), last);
                let n = T::select_lt(n, zero, zero, n);
                place.cell[a][i] = n.cell();
                place.f[a][i] = u - n;
                place.outside[a][i] = v - q;
            }
        }
        place
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
                let at = cell + place.f[a][i];
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
        self.corners(&place.cell, &mut corners);
        let v = self.stepped(interpolate(&corners, &place.f), step, &place);
        surround(v, &place.outside)
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
        let outside = place.outside.map(|o| o[0]);
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
        let [fx, fy, fz] = place.f.map(|f| f[0]);
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
    for i in 0..W {
        let at = cell[0][i] as usize + sy * cell[1][i] as usize + sz * cell[2][i] as usize;
        for (k, row) in [0, sy, sz, sz + sy].into_iter().enumerate() {
            let [a, b] = pair::<S, T>(v, at + row);
            (out[2 * k][i], out[2 * k + 1][i]) = (a, b);
        }
    }
}

#[inline(always)]
fn interpolate<T: Scalar, const W: usize>(c: &Corners<T, W>, f: &[[T; W]; 3]) -> [T; W] {
    let mut out = [T::of(0.0); W];
    for i in 0..W {
        let (x0, x1) = (mix(c[0][i], c[1][i], f[0][i]), mix(c[2][i], c[3][i], f[0][i]));
        let (x2, x3) = (mix(c[4][i], c[5][i], f[0][i]), mix(c[6][i], c[7][i], f[0][i]));
        out[i] = mix(mix(x0, x1, f[1][i]), mix(x2, x3, f[1][i]), f[2][i]);
    }
    out
}

#[inline(always)]
fn mix<T: Scalar>(a: T, b: T, f: T) -> T {
    a + f * (b - a)
}

#[inline(always)]
fn surround<T: Scalar, const W: usize>(mut v: [T; W], outside: &[[T; W]; 3]) -> [T; W] {
    let zero = T::of(0.0);
    for i in 0..W {
        let d = T::len3(outside[0][i], outside[1][i], outside[2][i]);
        v[i] = T::select_lt(zero, d, d.max(v[i] - d), v[i]);
    }
    v
}
