//! All nodes of a grid in one array, x fastest.

use crate::{
    descent::{Far, Sink},
    grid::{Cell, Grid, place},
    shared::Shared,
};

#[derive(Clone, Copy)]
pub struct Dense<'a> {
    out: Shared<'a>,
    /// How far apart nodes lie in the array, along the descent's axes.
    stride: [usize; 3],
    /// World units a unit of the descent.
    scale: f32,
    /// No value is larger (world units).
    band: f32,
}

impl<'a> Dense<'a> {
    pub fn new(values: &'a mut [f32], grid: &Grid, dims: [u32; 3], scale: f32, band: f32) -> Self {
        let world = [1, dims[0] as usize, dims[0] as usize * dims[1] as usize];
        Self { out: Shared::new(values), stride: grid.axes.map(|k| world[k]), scale, band }
    }

    fn at(&self, index: [u32; 3]) -> usize {
        (0..3).map(|a| index[a] as usize * self.stride[a]).sum()
    }

    #[allow(unsafe_code)]
    fn write(&self, at: usize, values: &[f32]) {
        // SAFETY: cells are disjoint, and each is one task's.
        unsafe { self.out.write(at, values) }
    }
}

impl Sink for Dense<'_> {
    fn fork(&self) -> Self {
        *self
    }

    fn leaf(&mut self, cell: &Cell, values: &[f32; 16]) {
        let values = values.map(|v| (v * self.scale).min(self.band).max(-self.band));
        let start = self.at(cell.origin);
        let whole =
            (0..3).all(|a| cell.lo[a] == cell.origin[a] && cell.hi[a] == cell.origin[a] + [2, 2, 4][a]);
        if whole && self.stride[2] == 1 {
            for (row, four) in values.chunks_exact(4).enumerate() {
                self.write(start + (row >> 1) * self.stride[0] + (row & 1) * self.stride[1], four);
            }
            return;
        }
        for lane in 0..16 {
            if cell.has(lane) {
                let offset = place(lane);
                let index: [u32; 3] = std::array::from_fn(|a| cell.origin[a] + offset[a]);
                self.write(self.at(index), &values[lane..=lane]);
            }
        }
    }

    fn far(&mut self, cell: &Cell, far: Far) {
        let value = [if far.inside { -self.band } else { self.band }];
        for i in cell.lo[0]..cell.hi[0] {
            for j in cell.lo[1]..cell.hi[1] {
                for k in cell.lo[2]..cell.hi[2] {
                    self.write(self.at([i, j, k]), &value);
                }
            }
        }
    }
}
