//! Signs that need no nearest triangle, given to distances once these are there: winding numbers and parity.
//!
//! By whole numbers along the grid's columns where the method has them (closed meshes, parity), else by asking for each
//! node.

use rayon::prelude::*;

use crate::{
    MeshError, Watch,
    budget::Budget,
    grid::Grid,
    sign::{Columns, Signs},
};

/// Nodes asked about at once: many enough for the winding numbers' lanes, few enough to stop soon.
const BATCH: usize = 2048;

/// Who knows the signs of a grid's nodes.
pub struct Judge<'a> {
    signs: &'a Signs<'a>,
    columns: Option<Columns>,
    grid: &'a Grid,
    watch: &'a dyn Watch,
}

impl<'a> Judge<'a> {
    pub fn new(
        signs: &'a Signs<'a>,
        grid: &'a Grid,
        budget: &Budget,
        watch: &'a dyn Watch,
    ) -> Result<Self, MeshError> {
        let lines: [Vec<f64>; 3] = std::array::from_fn(|k| grid.line(k));
        let columns = signs.columns_until([&lines[0], &lines[1], &lines[2]], budget.left(), watch)?;
        if columns.is_none() {
            signs.prepare(watch)?;
        }
        Ok(Self { signs, columns, grid, watch })
    }

    /// Signs for a dense grid, x fastest.
    pub fn dense(&self, values: &mut [f32], dims: [u32; 3]) -> Result<(), MeshError> {
        let [nx, ny, _] = dims.map(|n| n as usize);
        values.par_chunks_mut(BATCH).enumerate().try_for_each(|(chunk, values)| {
            let first = chunk * BATCH;
            let nodes: Vec<[u32; 3]> = (first..first + values.len())
                .map(|at| [at % nx, at / nx % ny, at / nx / ny].map(|i| i as u32))
                .collect();
            let inside = self.inside(&nodes)?;
            for (value, _) in values.iter_mut().zip(inside).filter(|(_, inside)| *inside) {
                *value = -*value;
            }
            Ok(())
        })
    }

    /// Points in the descent's frame.
    pub fn points(&self, points: impl Iterator<Item = [f64; 3]>) -> Result<Vec<bool>, MeshError> {
        let points: Vec<[f64; 3]> = points.map(|p| self.grid.unit(p)).collect();
        let mut inside = vec![false; points.len()];
        for (points, inside) in points.chunks(BATCH).zip(inside.chunks_mut(BATCH)) {
            if self.watch.cancelled() {
                return Err(MeshError::Cancelled);
            }
            self.signs.inside_many(points, inside);
        }
        Ok(inside)
    }

    /// Nodes by their indices along the descent's axes.
    pub fn nodes(&self, nodes: &[[u32; 3]]) -> Result<Vec<bool>, MeshError> {
        self.inside(&nodes.iter().map(|n| self.world(*n)).collect::<Vec<_>>())
    }

    /// Nodes by their indices along x, y and z.
    fn inside(&self, nodes: &[[u32; 3]]) -> Result<Vec<bool>, MeshError> {
        if self.watch.cancelled() {
            return Err(MeshError::Cancelled);
        }
        if let Some(columns) = &self.columns {
            let node = |n: &[u32; 3]| columns.inside(n[0] as usize, n[1] as usize, n[2] as usize);
            return Ok(nodes.iter().map(node).collect());
        }
        let axes = self.grid.axes;
        let points: Vec<[f64; 3]> = nodes.iter().map(|n| self.grid.node(axes.map(|k| n[k]))).collect();
        let mut inside = vec![false; points.len()];
        self.signs.inside_many(&points, &mut inside);
        Ok(inside)
    }

    fn world(&self, index: [u32; 3]) -> [u32; 3] {
        let mut world = [0; 3];
        for a in 0..3 {
            world[self.grid.axes[a]] = index[a];
        }
        world
    }
}
