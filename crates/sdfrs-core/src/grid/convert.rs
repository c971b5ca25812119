//! One kind of grid from another: halves, bytes, and dense ones from sparse ones.

use std::{ops::Range, sync::Arc};

use super::{
    BRICK, Bricks, Claim, Grid, GridValues, Store, bricks_along,
    dense::{Stop, reserve},
    slope::NODES,
};
use crate::{error::SceneError, real::Scalar};

/// Which way through the layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sweep {
    Up,
    Down,
}

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

    /// All nodes of a sparse grid.
    fn unfold(&self, bricks: &Bricks) -> Result<Vec<f32>, SceneError> {
        let mut out = Vec::new();
        reserve(&mut out, self.dims.iter().product())?;
        out.resize(self.dims.iter().product(), 0f32);
        let layers = 0..self.dims[2];
        self.scatter(bricks, layers.clone(), &mut out);
        self.sweep(bricks, layers.clone(), &mut out, None, Sweep::Up)?;
        self.sweep(bricks, layers, &mut out, None, Sweep::Down)?;
        Ok(out)
    }

    /// The layers from `first` on of what `to_dense` makes of a sparse grid, for those who have no room for all: once
    /// upwards, layer after layer, then with what that gave downwards, from the last. `beside` is the layer before, or the
    /// one after, as this made it. Nothing where there is no such layer, or for a dense grid.
    pub fn unfold_layers(
        &self,
        first: usize,
        values: &mut [f32],
        beside: Option<&[f32]>,
        way: Sweep,
    ) -> Result<(), SceneError> {
        let (layer, Store::Sparse(bricks)) = (self.dims[0] * self.dims[1], &self.store) else {
            return Ok(());
        };
        let count = values.len() / layer;
        let fits =
            values.len() == count * layer && first.checked_add(count).is_some_and(|n| n <= self.dims[2]);
        if !fits || beside.is_some_and(|beside| beside.len() != layer) {
            let message = format!(
                "{} values from layer {first} on, allowed: whole ones of {layer}, {} in all",
                values.len(),
                self.dims[2]
            );
            return Err(SceneError::new("texture", message));
        }
        if way == Sweep::Up {
            self.scatter(bricks, first..first + count, values);
        }
        self.sweep(bricks, first..first + count, values, beside, way)
    }

    /// Kept nodes stay as they are, the others become `max(far, neighbour - distance)`, in two sweeps of 13 neighbours
    /// each. The field has slope `s` at most, so its magnitude is at least that.
    fn sweep(
        &self,
        bricks: &Bricks,
        layers: Range<usize>,
        values: &mut [f32],
        beside: Option<&[f32]>,
        way: Sweep,
    ) -> Result<(), SceneError> {
        let [nx, ny, _] = self.dims;
        let slope = self.claim.lipschitz.unwrap_or(self.slopes.s);
        let steps: Vec<([isize; 3], f32)> = (0..13)
            .map(|k: isize| {
                let d = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
                let long = (0..3).map(|a| (d[a] as f64 * self.spacing[a]).powi(2)).sum::<f64>().sqrt();
                (d, (slope * long) as f32)
            })
            .collect();
        let mut free = Vec::new();
        reserve(&mut free, nx * ny)?;
        let sign = if way == Sweep::Up { 1 } else { -1 };
        for turn in 0..layers.len() {
            let own = if way == Sweep::Up { turn } else { layers.len() - 1 - turn };
            self.free(bricks, layers.start + own, &mut free);
            // The layer that is done already, and this one.
            let (done, rest) = match way {
                Sweep::Up => {
                    let (below, rest) = values.split_at_mut(own * nx * ny);
                    (if own > 0 { Some(&below[(own - 1) * nx * ny..]) } else { beside }, rest)
                }
                Sweep::Down => {
                    let (rest, above) = values.split_at_mut((own + 1) * nx * ny);
                    let done = if turn > 0 { Some(&above[..nx * ny]) } else { beside };
                    (done, &mut rest[own * nx * ny..])
                }
            };
            let out = &mut rest[..nx * ny];
            for i in 0..nx * ny {
                let i = if sign > 0 { i } else { nx * ny - 1 - i };
                if !free[i] {
                    continue;
                }
                let at = [i % nx, i / nx].map(|v| v as isize);
                let mut best = out[i].abs();
                for (d, long) in &steps {
                    let q: [isize; 2] = std::array::from_fn(|a| at[a] + sign * d[a]);
                    let inside = (0..2).all(|a| q[a] >= 0 && (q[a] as usize) < self.dims[a]);
                    let from = if d[2] == 0 { Some(&*out) } else { done };
                    if let Some(from) = from.filter(|_| inside) {
                        best = best.max(from[q[0] as usize + nx * q[1] as usize].abs() - long);
                    }
                }
                out[i] = best.copysign(out[i]);
            }
        }
        Ok(())
    }

    /// The bricks that have nodes of a layer, by their place.
    fn bricks_of(&self, z: usize) -> impl Iterator<Item = (usize, [usize; 3])> + '_ {
        let count = bricks_along(self.dims);
        // The first layer of a brick is the last one of the brick before.
        let from = if z.is_multiple_of(BRICK) { (z / BRICK).saturating_sub(1) } else { z / BRICK };
        (from..=(z / BRICK).min(count[2] - 1)).flat_map(move |k| {
            (0..count[0] * count[1]).map(move |i| {
                let first = [i % count[0], i / count[0], k].map(|b| b * BRICK);
                (i + count[0] * count[1] * k, first)
            })
        })
    }

    /// Which nodes of a layer no brick keeps.
    fn free(&self, bricks: &Bricks, z: usize, free: &mut Vec<bool>) {
        let [nx, ny, _] = self.dims;
        free.clear();
        free.resize(nx * ny, true);
        for (_, first) in self.bricks_of(z).filter(|(i, _)| bricks.slot(*i).is_some()) {
            for y in first[1]..ny.min(first[1] + NODES) {
                free[nx * y + first[0]..nx * y + nx.min(first[0] + NODES)].fill(false);
            }
        }
    }

    /// Far values and kept nodes, each to its place; a node of both kinds of bricks is a kept one.
    fn scatter(&self, bricks: &Bricks, layers: Range<usize>, out: &mut [f32]) {
        let [nx, ny, _] = self.dims;
        for z in layers.clone() {
            let out = &mut out[(z - layers.start) * nx * ny..][..nx * ny];
            out.fill(0.0);
            for keep in [false, true] {
                for (i, first) in self.bricks_of(z).filter(|(i, _)| bricks.slot(*i).is_some() == keep) {
                    let far = bricks.words()[i].value();
                    for y in first[1]..ny.min(first[1] + NODES) {
                        for x in first[0]..nx.min(first[0] + NODES) {
                            let to = &mut out[x + nx * y];
                            let node = (x - first[0]) + NODES * ((y - first[1]) + NODES * (z - first[2]));
                            match bricks.slot(i) {
                                Some(slot) => *to = bricks.node(slot, node),
                                None if far.abs() > to.abs() => *to = far,
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
