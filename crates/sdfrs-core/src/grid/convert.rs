//! One kind of grid from another: halves, bytes, and dense ones from sparse ones.

use std::sync::Arc;

use super::{
    BRICK, Bricks, Claim, Grid, GridValues, Store, bricks_along,
    dense::{Stop, reserve},
    slope::NODES,
};
use crate::{error::SceneError, real::Scalar};

impl Grid {
    /// The same grid rounded to halves; the claim's error grows by the largest rounding.
    pub fn to_f16(&self) -> Result<Grid, SceneError> {
        self.clone().into_f16(&|| false)
    }

    /// The same sparse grid clamped to `band` and rounded to bytes.
    pub fn to_u8(&self, band: f64) -> Result<Grid, SceneError> {
        self.clone().into_u8(band, &|| false)
    }

    /// `to_f16` without a second copy of the samples, where nobody else holds them.
    pub fn into_f16(self, stop: Stop) -> Result<Grid, SceneError> {
        self.restored(
            |store| match store {
                Store::Dense(values) => values.into_f16(stop).map(|(v, e)| (Store::Dense(v), e)),
                Store::Sparse(bricks) => bricks.into_f16(stop).map(|(v, e)| (Store::Sparse(v), e)),
            },
            stop,
        )
    }

    /// `to_u8` in the same way.
    pub fn into_u8(self, band: f64, stop: Stop) -> Result<Grid, SceneError> {
        let dims = self.dims;
        self.restored(
            |store| match store {
                Store::Sparse(bricks) => bricks.into_u8(dims, band, stop).map(|(v, e)| (Store::Sparse(v), e)),
                Store::Dense(_) => {
                    let message = "a dense grid, allowed: sparse ones (bytes only reach over a narrow band)";
                    Err(SceneError::new("texture", message))
                }
            },
            stop,
        )
    }

    fn restored(
        self,
        convert: impl FnOnce(Store) -> Result<(Store, f64), SceneError>,
        stop: Stop,
    ) -> Result<Grid, SceneError> {
        let Grid { store, dims, lo, hi, claim, stepping, .. } = self;
        let (store, error) = convert(store)?;
        let claim = Claim { max_error: claim.max_error + error, ..claim };
        Ok(Grid { stepping, ..Grid::until(store, dims, lo, hi, claim, stop)? })
    }

    /// A dense grid in f32 (f64 stays). Where a sparse one kept no nodes, the values are the largest
    /// that no sample near the surface contradicts: each node at most a step away from its neighbours.
    pub fn to_dense(&self) -> Result<Grid, SceneError> {
        let Store::Sparse(bricks) = &self.store else { return Ok(self.clone()) };
        let values = GridValues::F32(Arc::new(self.unfold(bricks)?));
        let grid = Grid::with_claim(Store::Dense(values), self.dims, self.lo, self.hi, self.claim)?;
        Ok(Grid { stepping: self.stepping, ..grid })
    }

    /// All nodes: kept ones as they are, the others by `max(far, neighbour - distance)`, in two sweeps of
    /// 13 neighbours each. The field has slope `s` at most, so its magnitude is at least that.
    fn unfold(&self, bricks: &Bricks) -> Result<Vec<f32>, SceneError> {
        let [nx, ny, nz] = self.dims;
        let mut out = Vec::new();
        reserve(&mut out, nx * ny * nz)?;
        out.resize(nx * ny * nz, 0f32);
        let mut free = Vec::new();
        reserve(&mut free, nx * ny * nz)?;
        free.resize(nx * ny * nz, true);
        self.scatter(bricks, &mut out, &mut free);
        let slope = self.claim.lipschitz.unwrap_or(self.slopes.s);
        let steps: Vec<([isize; 3], f32)> = (0..13)
            .map(|k: isize| {
                let d = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
                let long = (0..3).map(|a| (d[a] as f64 * self.spacing[a]).powi(2)).sum::<f64>().sqrt();
                (d, (slope * long) as f32)
            })
            .collect();
        let mut sweep = |sign: isize| {
            for i in 0..nx * ny * nz {
                let i = if sign > 0 { i } else { nx * ny * nz - 1 - i };
                if !free[i] {
                    continue;
                }
                let at = [i % nx, i / nx % ny, i / nx / ny].map(|v| v as isize);
                let mut best = out[i].abs();
                for (d, long) in &steps {
                    let q: [isize; 3] = std::array::from_fn(|a| at[a] + sign * d[a]);
                    if (0..3).all(|a| q[a] >= 0 && (q[a] as usize) < self.dims[a]) {
                        let j = q[0] as usize + nx * (q[1] as usize + ny * q[2] as usize);
                        best = best.max(out[j].abs() - long);
                    }
                }
                out[i] = best.copysign(out[i]);
            }
        };
        sweep(1);
        sweep(-1);
        Ok(out)
    }

    /// Far values and kept nodes, each to its place; a node of both kinds of bricks is a kept one.
    fn scatter(&self, bricks: &Bricks, out: &mut [f32], free: &mut [bool]) {
        let ([nx, ny, nz], count) = (self.dims, bricks_along(self.dims));
        for keep in [false, true] {
            for i in (0..bricks.words().len()).filter(|&i| bricks.slot(i).is_some() == keep) {
                let first =
                    [i % count[0], i / count[0] % count[1], i / count[0] / count[1]].map(|b| b * BRICK);
                let far = bricks.words()[i].value();
                for z in first[2]..nz.min(first[2] + NODES) {
                    for y in first[1]..ny.min(first[1] + NODES) {
                        for x in first[0]..nx.min(first[0] + NODES) {
                            let to = x + nx * (y + ny * z);
                            let node = (x - first[0]) + NODES * ((y - first[1]) + NODES * (z - first[2]));
                            match bricks.slot(i) {
                                Some(slot) => (out[to], free[to]) = (bricks.node(slot, node), false),
                                None if far.abs() > out[to].abs() => out[to] = far,
                                None => {}
                            }
                        }
                    }
                }
            }
        }
    }

    /// The value of a node.
    pub fn node<T: Scalar>(&self, [x, y, z]: [usize; 3]) -> T {
        match &self.store {
            Store::Dense(values) => values.at(x + self.dims[0] * (y + self.dims[1] * z)),
            Store::Sparse(bricks) => {
                let count = bricks_along(self.dims);
                let at = [x, y, z];
                let b: [usize; 3] = std::array::from_fn(|a| (at[a] / BRICK).min(count[a] - 1));
                let i = b[0] + count[0] * (b[1] + count[1] * b[2]);
                let [lx, ly, lz]: [usize; 3] = std::array::from_fn(|a| at[a] - b[a] * BRICK);
                match bricks.slot(i) {
                    Some(slot) => bricks.node(slot, lx + NODES * (ly + NODES * lz)),
                    None => T::of(f64::from(bricks.words()[i].value())),
                }
            }
        }
    }
}
