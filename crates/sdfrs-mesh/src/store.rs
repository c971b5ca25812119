//! Where all tasks leave the bricks of a sparse grid: one growing array of their own 8^3 nodes, and a table.
//!
//! Nothing is there twice: what a bake takes beside its result is the mesh and the table. `assembly` does the rest.

use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicU32, Ordering::Relaxed},
};

use glam::DVec3;
use sdfrs_core::grid::Word;

use crate::{
    MeshError,
    assembly::{Assembly, CORE, SIDE, VOLUME, index, reserve, word},
    budget::Budget,
    descent::Far,
    grid::{Cell, Grid},
};

/// Bricks near the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Sparse {
    /// Along x, y and z.
    pub bricks: [u32; 3],
    /// One per brick, x fastest: which of the kept ones; or a value of d's sign that |d| is nowhere in the brick less than.
    pub words: Vec<Word>,
    /// Kept bricks, 9 x 9 x 9 nodes each (8 cells and the next bricks' first nodes), x fastest.
    pub nodes: Vec<f32>,
}

/// World units a unit of the descent; and the band, world units.
#[derive(Debug, Clone, Copy)]
pub struct Units {
    pub scale: f32,
    pub band: f32,
}

/// A brick's own nodes, x fastest; its place in bricks along the descent's axes.
pub struct Core {
    pub key: [u32; 3],
    pub nodes: [f32; CORE],
}

/// What all tasks share.
pub struct Store<'a> {
    pub grid: &'a Grid,
    pub units: Units,
    budget: &'a Budget,
    /// Along the world's axes.
    bricks: [usize; 3],
    /// Words of all bricks, and of one more along each axis: the nodes past the last cells, which are aprons only.
    words: Vec<AtomicU32>,
    /// Kept bricks as they came, without aprons.
    nodes: Mutex<Vec<f32>>,
}

impl<'a> Store<'a> {
    pub fn new(
        grid: &'a Grid,
        units: Units,
        bricks: [u32; 3],
        budget: &'a Budget,
    ) -> Result<Self, MeshError> {
        let all = bricks.iter().map(|&n| u64::from(n) + 1).product::<u64>();
        budget.take(all.saturating_mul(size_of::<Word>() as u64), "the table of bricks")?;
        let mut words = Vec::new();
        words
            .try_reserve_exact(all as usize)
            .map_err(|_| MeshError::bad("memory", format!("the system has none for {all} bricks")))?;
        words.extend((0..all).map(|_| AtomicU32::new(Word::far(units.band).bits())));
        let bricks = bricks.map(|n| n as usize);
        // About what a surface crosses; pages that stay empty cost nothing, and what begins large grows in place.
        let (mut nodes, guess) = (Vec::new(), (2.0 * (all as f64).powf(2.0 / 3.0)) as usize);
        if ((guess * CORE * size_of::<f32>()) as u64) < budget.left() / 4 {
            reserve(&mut nodes, guess * CORE, 0)?;
        }
        Ok(Self { grid, units, budget, bricks, words, nodes: Mutex::new(nodes) })
    }

    /// The place in the table of a brick given along the descent's axes.
    fn at(&self, key: [u32; 3]) -> usize {
        let mut world = [0; 3];
        for a in 0..3 {
            world[self.grid.axes[a]] = key[a] as usize;
        }
        index(self.bricks, world)
    }

    fn put(&self, at: usize, word: Word) {
        self.words[at].store(word.bits(), Relaxed);
    }

    /// Takes a task's bricks.
    pub fn keep(&self, cores: &[Core]) -> Result<(), MeshError> {
        if cores.is_empty() {
            return Ok(());
        }
        self.budget.take((cores.len() * VOLUME * size_of::<f32>()) as u64, "bricks")?;
        let mut nodes = self.nodes.lock().unwrap_or_else(PoisonError::into_inner);
        reserve(&mut nodes, cores.len() * CORE, self.budget.left())?;
        for core in cores {
            self.put(self.at(core.key), word(nodes.len() / CORE)?);
            nodes.extend_from_slice(&core.nodes);
        }
        Ok(())
    }

    /// All nodes cut: every point of the brick has a node within half a cell's diagonal.
    pub fn flat(&self, key: [u32; 3], inside: bool) {
        let least = self.within(self.units.band).max(0.0);
        self.put(self.at(key), Word::far(if inside { -least } else { least }));
    }

    /// What bounds |d| between nodes of at least `least`.
    fn within(&self, least: f32) -> f32 {
        let diagonal = self.grid.half_diagonal() * f64::from(self.units.scale);
        ((f64::from(least) - diagonal) * (1.0 - 1e-6)) as f32
    }

    /// Bounds for the bricks of a cell without any near the band.
    pub fn bound(&self, cell: &Cell, far: &Far) {
        let Units { scale, band } = self.units;
        let c = DVec3::from_array(far.centre.map(f64::from));
        let radius = self.grid.half_diagonal() * f64::from(SIDE) * (1.0 + 1e-6) + 1e-6;
        let from: [u32; 3] = cell.lo.map(|i| i / SIDE);
        let to: [u32; 3] = cell.hi.map(|i| i.div_ceil(SIDE));
        for i in from[0]..to[0] {
            for j in from[1]..to[1] {
                for k in from[2]..to[2] {
                    let middle =
                        self.grid.place([i, j, k].map(|b| f64::from(b * SIDE) + 0.5 * f64::from(SIDE)));
                    let least = (f64::from(far.distance) - (middle - c).length() - radius) * f64::from(scale);
                    let value = (least as f32 * (1.0 - 1e-6)).max(band);
                    self.put(self.at([i, j, k]), Word::far(if far.inside { -value } else { value }));
                }
            }
        }
    }

    /// When all tasks are done.
    pub fn finish(self) -> Result<Sparse, MeshError> {
        let Self { grid, units, budget, bricks, words, nodes } = self;
        // In place: the two have the same layout.
        let words: Vec<Word> = words.into_iter().map(|w| Word::of_bits(w.into_inner())).collect();
        let nodes = nodes.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mut all = Assembly { bricks, band: units.band, words, nodes };
        let diagonal = (grid.half_diagonal() * f64::from(units.scale) * (1.0 + 1e-6)) as f32;
        all.finish(diagonal, budget)?;
        Ok(Sparse { bricks: bricks.map(|n| n as u32), words: all.words, nodes: all.nodes })
    }
}
