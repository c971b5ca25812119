//! Bricks of 8^3 cells near the surface, and a bound for each of the others.
//!
//! The descent hands over bricks without aprons, 8^3 nodes each; `assembly` puts them together.

use crate::{
    MeshError,
    budget::Budget,
    descent::{Far, Sink},
    grid::{Cell, Grid, place},
};

/// Cells along a brick's side, and nodes without the apron.
pub const SIDE: u32 = 8;
/// Nodes of a brick without its apron.
pub const CORE: usize = 512;

/// World units a unit of the descent; and the band, world units.
#[derive(Debug, Clone, Copy)]
pub struct Units {
    pub scale: f32,
    pub band: f32,
}

/// One task's bricks.
pub struct Bricks<'a> {
    budget: &'a Budget,
    units: Units,
    /// How far on the next node along each of the descent's axes lies in a brick (x fastest).
    stride: [usize; 3],
    /// Bricks with a node within the band: their places, in bricks along the descent's axes, and their nodes.
    pub keys: Vec<[u32; 3]>,
    pub nodes: Vec<f32>,
    /// Bricks whose own nodes are all cut, and the sign; their aprons may be needed yet.
    pub flat: Vec<([u32; 3], bool)>,
    /// Cells without any brick near the band.
    pub far: Vec<(Cell, Far)>,
    /// The two bricks of the present cell.
    open: [Option<Box<Open>>; 2],
}

struct Open {
    key: [u32; 3],
    nodes: [f32; CORE],
}

impl<'a> Bricks<'a> {
    pub fn new(budget: &'a Budget, grid: &Grid, units: Units) -> Self {
        let stride = grid.axes.map(|k| [1, 8, 64][k]);
        Self {
            budget,
            units,
            stride,
            keys: vec![],
            nodes: vec![],
            flat: vec![],
            far: vec![],
            open: [const { None }; 2],
        }
    }

    /// A brick's nodes: where they are on the grid (descent's axes), and in `nodes`.
    pub fn places(&self, brick: usize) -> impl Iterator<Item = ([u32; 3], usize)> + '_ {
        let key = self.keys[brick];
        (0..SIDE.pow(3)).map(move |n| {
            let at = [n / 64, n / 8 % 8, n % 8];
            let place = brick * CORE + self.offset(at);
            (std::array::from_fn(|a| key[a] * SIDE + at[a]), place)
        })
    }

    fn offset(&self, at: [u32; 3]) -> usize {
        (0..3).map(|a| (at[a] & 7) as usize * self.stride[a]).sum()
    }

    /// Keeps the nodes of a brick that has some within the band.
    fn keep(&mut self, open: &Open) -> Result<(), MeshError> {
        let first = open.nodes[0];
        if first.abs() >= self.units.band && open.nodes.iter().all(|v| *v == first) {
            self.flat.push((open.key, first < 0.0));
            return Ok(());
        }
        let room = self.nodes.capacity() - self.nodes.len();
        if room < CORE {
            // Few bricks a task, and `finish` gives back what is left over.
            let more = self.nodes.len().max(CORE);
            self.budget.take((more * size_of::<f32>()) as u64, "bricks")?;
            self.nodes
                .try_reserve_exact(more)
                .map_err(|_| MeshError::bad("memory", "the system has none for bricks"))?;
        }
        self.nodes.extend_from_slice(&open.nodes);
        self.keys.push(open.key);
        Ok(())
    }
}

impl Sink for Bricks<'_> {
    fn fork(&self) -> Self {
        let Self { budget, units, stride, .. } = *self;
        let open = [const { None }; 2];
        Self { budget, units, stride, keys: vec![], nodes: vec![], flat: vec![], far: vec![], open }
    }

    fn open(&mut self, cell: &Cell) {
        for half in 0..2 {
            let from = cell.origin[2] + SIDE * half;
            let some = cell.lo[2].max(from) < cell.hi[2].min(from + SIDE);
            let key = [cell.origin[0] / SIDE, cell.origin[1] / SIDE, from / SIDE];
            // Nodes that no leaf reaches lie past the grid's end.
            let nodes = [self.units.band; CORE];
            self.open[half as usize] = some.then(|| Box::new(Open { key, nodes }));
        }
    }

    fn close(&mut self) -> Result<(), MeshError> {
        for half in 0..2 {
            if let Some(open) = self.open[half].take() {
                self.keep(&open)?;
            }
        }
        Ok(())
    }

    fn finish(&mut self) {
        self.nodes.shrink_to_fit();
    }

    fn leaf(&mut self, cell: &Cell, values: &[f32; 16]) {
        let Units { scale, band } = self.units;
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
        let value = if far.inside { -self.units.band } else { self.units.band };
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
