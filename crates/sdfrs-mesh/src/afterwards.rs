//! Signs that need no nearest triangle, given to distances once these are there: winding numbers and parity.
//!
//! By whole numbers along the grid's columns where the method has them (closed meshes, parity), else by asking for each
//! node. A part of a sparse grid without bricks has the sign of its middle.

use rayon::prelude::*;

use crate::{
    MeshError, Watch,
    bricks::{Bricks, SIDE},
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
    pub fn new(signs: &'a Signs<'a>, grid: &'a Grid, budget: &Budget, watch: &'a dyn Watch) -> Self {
        let lines: [Vec<f64>; 3] = std::array::from_fn(|k| grid.line(k));
        let columns = signs.columns([&lines[0], &lines[1], &lines[2]], budget.left());
        Self { signs, columns, grid, watch }
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

    /// Signs for one task's bricks.
    pub fn bricks(&self, part: &mut Bricks) -> Result<(), MeshError> {
        let half = f64::from(SIDE / 2);
        let middle = |key: [u32; 3]| self.grid.place(key.map(|b| f64::from(SIDE * b) + half)).to_array();
        let far = part.far.iter().map(|(_, far)| self.grid.unit(far.centre.map(f64::from)));
        let flat = part.flat.iter().map(|(key, _)| self.grid.unit(middle(*key)));
        let points: Vec<[f64; 3]> = far.chain(flat).collect();
        let mut inside = vec![false; points.len()];
        self.signs.inside_many(&points, &mut inside);
        let flags =
            part.far.iter_mut().map(|(_, far)| &mut far.inside).chain(part.flat.iter_mut().map(|(_, i)| i));
        for (flag, inside) in flags.zip(inside) {
            *flag = inside;
        }
        for brick in 0..part.keys.len() {
            let (nodes, places): (Vec<[u32; 3]>, Vec<usize>) =
                part.places(brick).map(|(index, place)| (self.world(index), place)).unzip();
            for (place, _) in places.into_iter().zip(self.inside(&nodes)?).filter(|(_, inside)| *inside) {
                part.nodes[place] = -part.nodes[place];
            }
        }
        Ok(())
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
