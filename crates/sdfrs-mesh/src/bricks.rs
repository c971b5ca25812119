//! What a task finds for a sparse grid: bricks of 8^3 cells near the surface, and a bound for each of the others.
//!
//! A task has few bricks. When it ends their signs are settled and they go to the `Store`, which all tasks share, so that
//! no node is there twice.

use crate::{
    MeshError,
    afterwards::Judge,
    assembly::{CORE, SIDE},
    descent::{Far, Sink},
    grid::{Cell, place},
    store::{Core, Store},
};

/// One task's bricks.
pub struct Bricks<'a> {
    store: &'a Store<'a>,
    /// Where signs come after the distances.
    judge: Option<&'a Judge<'a>>,
    /// How far on the next node along each of the descent's axes lies in a brick (x fastest).
    stride: [usize; 3],
    /// Bricks with a node within the band.
    cores: Vec<Core>,
    /// Bricks whose own nodes are all cut, and the sign.
    flat: Vec<([u32; 3], bool)>,
    /// Cells without any brick near the band.
    far: Vec<(Cell, Far)>,
    /// The two bricks of the present cell.
    open: [Option<Box<Core>>; 2],
}

impl<'a> Bricks<'a> {
    pub fn new(store: &'a Store<'a>, judge: Option<&'a Judge<'a>>) -> Self {
        let stride = store.grid.axes.map(|k| [1, 8, 64][k]);
        Self { store, judge, stride, cores: vec![], flat: vec![], far: vec![], open: [const { None }; 2] }
    }

    fn offset(&self, at: [u32; 3]) -> usize {
        (0..3).map(|a| (at[a] & 7) as usize * self.stride[a]).sum()
    }

    /// A brick's nodes: where they are on the grid (descent's axes), and among its own. Those past the grid's end are left
    /// out.
    fn places(&self, key: [u32; 3]) -> (Vec<[u32; 3]>, Vec<usize>) {
        let dims = self.store.grid.dims;
        let nodes = (0..SIDE.pow(3)).map(|n| [n / 64, n / 8 % 8, n % 8]);
        nodes
            .map(|at| (std::array::from_fn(|a| key[a] * SIDE + at[a]), self.offset(at)))
            .filter(|(index, _): &([u32; 3], usize)| (0..3).all(|a| index[a] < dims[a]))
            .unzip()
    }

    /// Signs for everything that the task has found; a part without bricks has that of its middle.
    fn judge(&mut self, judge: &Judge) -> Result<(), MeshError> {
        let half = f64::from(SIDE / 2);
        let middle =
            |key: [u32; 3]| self.store.grid.place(key.map(|b| f64::from(SIDE * b) + half)).to_array();
        let far = self.far.iter().map(|(_, far)| far.centre.map(f64::from));
        let flat = self.flat.iter().map(|(key, _)| middle(*key));
        let inside = judge.points(far.chain(flat))?;
        let flags =
            self.far.iter_mut().map(|(_, far)| &mut far.inside).chain(self.flat.iter_mut().map(|(_, i)| i));
        for (flag, inside) in flags.zip(inside) {
            *flag = inside;
        }
        let mut cores = std::mem::take(&mut self.cores);
        for core in &mut cores {
            let (nodes, places) = self.places(core.key);
            for (place, _) in places.into_iter().zip(judge.nodes(&nodes)?).filter(|(_, inside)| *inside) {
                core.nodes[place] = -core.nodes[place];
            }
        }
        self.cores = cores;
        Ok(())
    }
}

impl Sink for Bricks<'_> {
    fn fork(&self) -> Self {
        Self::new(self.store, self.judge)
    }

    fn open(&mut self, cell: &Cell) {
        for half in 0..2 {
            let from = cell.origin[2] + SIDE * half;
            let some = cell.lo[2].max(from) < cell.hi[2].min(from + SIDE);
            let key = [cell.origin[0] / SIDE, cell.origin[1] / SIDE, from / SIDE];
            // Nodes that no leaf reaches lie past the grid's end.
            let nodes = [self.store.units.band; CORE];
            self.open[half as usize] = some.then(|| Box::new(Core { key, nodes }));
        }
    }

    fn close(&mut self) {
        for half in 0..2 {
            let Some(core) = self.open[half].take() else { continue };
            let first = core.nodes[0];
            if first.abs() >= self.store.units.band && core.nodes.iter().all(|v| *v == first) {
                self.flat.push((core.key, first < 0.0));
            } else {
                self.cores.push(*core);
            }
        }
    }

    fn finish(mut self) -> Result<(), MeshError> {
        if let Some(judge) = self.judge {
            self.judge(judge)?;
        }
        for (cell, far) in &self.far {
            self.store.bound(cell, far);
        }
        for (key, inside) in &self.flat {
            self.store.flat(*key, *inside);
        }
        self.store.keep(&self.cores)
    }

    fn leaf(&mut self, cell: &Cell, values: &[f32; 16]) {
        let (scale, band) = (self.store.units.scale, self.store.units.band);
        let start = self.offset(cell.origin);
        let offsets: [usize; 16] = std::array::from_fn(|lane| {
            let at = place(lane);
            start + (0..3).map(|a| at[a] as usize * self.stride[a]).sum::<usize>()
        });
        let Some(open) = &mut self.open[(cell.origin[2] >> 3 & 1) as usize] else { return };
        for lane in 0..16 {
            if cell.has(lane) {
                open.nodes[offsets[lane]] = (values[lane] * scale).min(band).max(-band);
            }
        }
    }

    fn far(&mut self, cell: &Cell, far: Far) {
        if cell.n >= SIDE {
            self.far.push((*cell, far));
            return;
        }
        let (start, stride) = (self.offset(cell.origin), self.stride);
        let band = self.store.units.band;
        let value = if far.inside { -band } else { band };
        let count: [usize; 3] = std::array::from_fn(|a| (cell.hi[a] - cell.lo[a]) as usize);
        let Some(open) = &mut self.open[(cell.origin[2] >> 3 & 1) as usize] else { return };
        for i in 0..count[0] {
            for j in 0..count[1] {
                for k in 0..count[2] {
                    open.nodes[start + i * stride[0] + j * stride[1] + k * stride[2]] = value;
                }
            }
        }
    }
}
