//! Shortened programs for patches of a picture, slab by slab of depth: cut here, run by the interpreter.
//!
//! From the whole depth of 64 x 64 patches down, cells are cut up to sixteen at a time, along the rays while
//! they are longer than wide, else across them; each keeps what [`Pruner`] leaves of its parent. A cell is
//! not cut again once its program is short, or some cuts made it no shorter. Values keep their bits in a
//! cell, so status, steps and fallbacks do. On request cells whose field is proven to stay above the
//! hit threshold have no program: guarded steppers leap over them (shaders/tracer/leap.wgsl). Twin: `sdfrs_trace::march::cells`, which cuts as rays get there;
//! here all is known before the first dispatch, since asking the GPU where its rays are costs more.
//! Law (tests/patches.rs): strict mode gives the bits of the unpruned scene.

use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicUsize, Ordering},
};

use rayon::prelude::*;
use sdfrs_core::{
    Control, Program,
    graph::Graph,
    pool,
    prune::{CELLS, Cell as Ball, Memory, Part, Probe, Pruner},
    tape::Tape,
};
use sdfrs_trace::camera::Frame;

pub use super::slabs::LENGTHS;
use super::{
    beam::{Beam, Rect},
    slabs::{Cell, EMPTY, Leaf, number, table},
    tape::{self, Length, Needs, Row, Writer},
};
use crate::error::GpuError;

/// Pixels along a side of a patch, unless the picture would have more than [`MOST_PATCHES`] of them.
const PATCH: u32 = 16;
const MOST_PATCHES: u64 = 1 << 16;
/// Children along a side, and along the rays.
const ACROSS: u32 = 4;
const ALONG: usize = CELLS;
/// Where programs need too much memory, long ones are shared by more pixels and short ones are left longer, by a
/// factor that grows by this.
const LESS: u64 = 4;
/// A program as short as this is not shortened any more.
const ENOUGH: u64 = 12;
/// Cuts in a row that shorten a program by less than a tenth before it is given up.
const FRUITLESS: u32 = 5;
/// A cell's own program is written where it is shorter by a quarter than the one it would run otherwise.
const OWN: (u64, u64) = (3, 4);
/// Cells are cut along the rays while they are this much longer than wide.
const LONG: f64 = 1.5;
/// Shortest slab in units of the hit threshold.
const SHORTEST: f64 = 64.0;
/// Depth up to which programs are shortened.
const FARTHEST: f32 = 1e9;
/// Rows of all programs, at most: 96 MiB.
const MOST_ROWS: usize = 6 << 20;
/// Words of the table, at most: what every adapter can bind.
const MOST_WORDS: usize = 32 << 20;

/// The picture whose rays are walked.
#[derive(Debug, Clone, Copy)]
pub struct Raster {
    pub frame: Frame,
    pub width: u32,
    pub height: u32,
    pub t_max: f32,
    pub eps: f64,
    pub cone: f64,
    /// Whether cells proven empty have no program.
    pub skip: bool,
}

/// Which program runs where.
#[derive(Debug, Clone, Default)]
pub struct Patches {
    /// Patches along a row and pixels along their side; for each patch, and behind the last, the word where
    /// its slabs begin; the slabs: where they end (bits of an f32), their program's first row.
    pub table: Vec<u32>,
    /// Whether some slabs have no program.
    pub skip: bool,
    /// Operations of the programs, by the number that their first row carries.
    pub lengths: Vec<u64>,
    /// Operations that probes took.
    pub probed: u64,
    /// Bytes of programs and table.
    pub bytes: u64,
}

/// A scene's programs.
pub struct Plan {
    pub text: String,
    pub rows: Vec<Row>,
    /// Instructions of the whole, and most rounds of loops in an evaluation of any of the programs.
    pub length: Length,
    pub patches: Patches,
}

/// What a cell came to.
#[derive(Default)]
struct Branch {
    rows: Vec<Row>,
    /// Where programs begin.
    programs: Vec<usize>,
    leaves: Vec<Leaf>,
    needs: Needs,
    probed: u64,
    /// Most rounds of loops in an evaluation, the whole apart.
    longest: u64,
}

impl Branch {
    fn join(&mut self, other: Self) {
        let behind = self.rows.len();
        self.rows.extend(other.rows);
        self.programs.extend(other.programs.iter().map(|row| row + behind));
        let place = |row| if row == EMPTY { EMPTY } else { row + behind };
        let moved = |leaf: Leaf| Leaf { row: leaf.row.map(place), ..leaf };
        self.leaves.extend(other.leaves.into_iter().map(moved));
        self.needs.join(other.needs);
        self.probed += other.probed;
        self.longest = self.longest.max(other.longest);
    }

    /// Gives a program to all leaves without one.
    fn close(&mut self, writer: &Writer, tape: &Tape<f32>) {
        let row = self.rows.len();
        self.needs.learn(tape);
        self.programs.push(row);
        writer.add(tape, &mut self.rows);
        self.leaves.iter_mut().for_each(|leaf| leaf.row = leaf.row.or(Some(row)));
    }
}

/// What cutting needs, kept from one cell to the next.
struct Tools {
    probe: Probe,
    memory: Memory,
    program: Program<f32>,
}

struct Grower<'a> {
    pruner: &'a Pruner,
    raster: &'a Raster,
    writer: &'a Writer,
    patch: u32,
    /// Operations of an own program, times this, are no more than the cell has pixels; and 12 of these are short.
    less: u64,
    /// Rows of programs so far.
    written: AtomicUsize,
    tools: Mutex<Vec<Tools>>,
    control: &'a Control,
}

/// A cell's place among its ancestors.
#[derive(Clone, Copy)]
struct Line {
    /// Operations of the program that runs here without an own one.
    otherwise: u64,
    /// Cuts in a row that came to nothing.
    fruitless: u32,
}

/// Programs for all patches of a picture; None where they take more memory than is sure to be there, however
/// long they are left.
pub fn plan(
    graph: &Graph,
    pruner: &Pruner,
    raster: &Raster,
    control: &Control,
) -> Result<Option<Plan>, GpuError> {
    // A sample may lie at the end itself.
    let raster = &Raster { t_max: raster.t_max.min(FARTHEST).next_up(), ..*raster };
    let whole = Tape::<f32>::new(graph);
    let (writer, patch) = (Writer::new(&graph.grids)?, side(raster.width, raster.height));
    // The first without bounds.
    let (mut less, mut probed) = (0, 0);
    while ENOUGH * less < whole.ops().max(u64::from(patch * patch)) {
        let grower = Grower {
            pruner,
            raster,
            writer: &writer,
            patch,
            less,
            written: AtomicUsize::new(0),
            tools: Mutex::default(),
            control,
        };
        let mut all = grower.all(&whole);
        if control.is_cancelled() {
            return Err(GpuError::Cancelled);
        }
        probed += all.probed;
        let table = table(&all.leaves, (raster.width, raster.height), patch);
        if !grower.is_full() && table.len() <= MOST_WORDS {
            tape::check(&all.rows)?;
            let lengths = number(&mut all.rows, &all.programs);
            let bytes = (size_of_val(&all.rows[..]) + size_of_val(&table[..])) as u64;
            let patches = Patches { table, skip: raster.skip, lengths, probed, bytes };
            // The whole stands there too, but need not run anywhere; listings may sample behind the end.
            let runs = !raster.skip || all.leaves.iter().any(|leaf| leaf.row.is_none());
            let length =
                (whole.instructions().len(), all.longest.max(if runs { tape::loops(&whole) } else { 0 }));
            return Ok(Some(Plan { text: all.needs.text()?, rows: all.rows, length, patches }));
        }
        less = (less * LESS).max(1);
    }
    Ok(None)
}

/// Pixels along a patch's side.
fn side(width: u32, height: u32) -> u32 {
    let mut side = PATCH;
    while u64::from(width.div_ceil(side)) * u64::from(height.div_ceil(side)) > MOST_PATCHES {
        side *= 2;
    }
    side
}

/// A rectangle in squares of a side, those at its ends smaller.
fn cut(rect: Rect, side: u32) -> Vec<Rect> {
    let part =
        |from: u32, size: u32| (0..size).step_by(side as usize).map(move |a| (from + a, side.min(size - a)));
    part(rect.y, rect.height)
        .flat_map(|(y, height)| part(rect.x, rect.width).map(move |(x, width)| Rect { x, y, width, height }))
        .collect()
}

impl Grower<'_> {
    /// The whole raster.
    fn all(&self, whole: &Tape<f32>) -> Branch {
        let mut all = Branch::default();
        all.close(self.writer, whole);
        let Raster { width, height, t_max, .. } = *self.raster;
        let line = Line { otherwise: whole.ops(), fruitless: 0 };
        let grow =
            |rect: &Rect| self.grow(Cell { rect: *rect, lo: 0.0, hi: t_max }, self.pruner.whole(), line);
        let roots = cut(Rect { x: 0, y: 0, width, height }, self.patch * ACROSS.pow(3));
        let grown: Vec<Branch> = pool::install(|| roots.par_iter().map(grow).collect());
        grown.into_iter().for_each(|branch| all.join(branch));
        all
    }

    /// Whether there are more programs than memory.
    fn is_full(&self) -> bool {
        self.written.load(Ordering::Relaxed) > MOST_ROWS
    }

    fn grow(&self, cell: Cell, part: &Part, line: Line) -> Branch {
        let (children, empty) = self.children(cell, part, line.fruitless);
        let mut branch = Branch::default();
        branch.leaves.extend(empty.into_iter().map(|cell| Leaf { cell, row: Some(EMPTY) }));
        let side = u64::from(cell.rect.width.max(cell.rect.height));
        let own = part.ops() * OWN.1 <= line.otherwise * OWN.0 && part.ops() * self.less <= side * side;
        let otherwise = if own { part.ops() } else { line.otherwise };
        let grow = |(child, shorter): (Cell, Part)| {
            let fruitless = if shorter.ops() * 10 > part.ops() * 9 { line.fruitless + 1 } else { 0 };
            self.grow(child, &shorter, Line { otherwise, fruitless })
        };
        if !(children.is_empty() && branch.leaves.is_empty()) {
            branch.probed = CELLS as u64 * part.ops();
            let grown: Vec<Branch> = children.into_par_iter().map(grow).collect();
            grown.into_iter().for_each(|child| branch.join(child));
        }
        if branch.leaves.is_empty() {
            branch.leaves.push(Leaf { cell, row: None });
        }
        if own && branch.leaves.iter().any(|leaf| leaf.row.is_none()) {
            let mut tools = self.take();
            self.pruner.program(part, &mut tools.memory, &mut tools.program);
            let before = branch.rows.len();
            branch.close(self.writer, tools.program.tape());
            branch.longest = branch.longest.max(tape::loops(tools.program.tape()));
            self.written.fetch_add(branch.rows.len() - before, Ordering::Relaxed);
            self.give(tools);
        }
        branch
    }

    /// A cell's children with their programs, and the empty ones; none where it is not worth cutting.
    fn children(&self, cell: Cell, part: &Part, fruitless: u32) -> (Vec<(Cell, Part)>, Vec<Cell>) {
        let done = part.ops() <= ENOUGH * self.less.max(1) || fruitless >= FRUITLESS;
        if done || self.is_full() || self.control.is_cancelled() {
            return Default::default();
        }
        let cells = self.cut(cell);
        let beams: Option<Vec<Beam>> =
            cells.iter().map(|cell| Beam::new(&self.raster.frame, cell.rect)).collect();
        let Some(beams) = beams else { return Default::default() };
        let balls: Vec<_> =
            beams.iter().zip(&cells).map(|(beam, c)| beam.cell(c.lo.into(), c.hi.into())).collect();
        let mut tools = self.take();
        tools.probe.look(part, &balls);
        let (mut children, mut empty) = (Vec::new(), Vec::new());
        for (i, (cell, ball)) in cells.into_iter().zip(&balls).enumerate() {
            if self.is_empty(&tools.probe, part, (i, ball), cell.hi.into()) {
                empty.push(cell);
                continue;
            }
            let mut shorter = Part::blank();
            tools.probe.narrow(self.pruner, part, (i, f32::INFINITY), &mut tools.memory, &mut shorter);
            children.push((cell, shorter));
        }
        self.give(tools);
        (children, empty)
    }

    /// Whether a probed cell's field stays above the threshold of a guarded hit.
    fn is_empty(&self, probe: &Probe, part: &Part, (i, ball): (usize, &Ball), hi: f64) -> bool {
        let Raster { eps, cone, skip, .. } = *self.raster;
        skip && probe.clear_radius(part, i, (eps, cone), hi) > ball.radius
    }

    /// A cell's pieces, sixteen at most; none where it is as small as cells get.
    fn cut(&self, cell: Cell) -> Vec<Cell> {
        let Some(beam) = Beam::new(&self.raster.frame, cell.rect) else { return Vec::new() };
        let (lo, hi) = (f64::from(cell.lo), f64::from(cell.hi));
        let (length, width) = (hi - lo, beam.width(hi));
        let least = SHORTEST * self.raster.eps.max(1e-6 * hi);
        if length > LONG * width.max(least) {
            let count = (length / width.max(least)).ceil().min(ALONG as f64) as usize;
            let edge = |i: usize| match i {
                0 => cell.lo,
                // The first cut of all: twice as far each time, as the beam is twice as wide.
                _ if lo == 0.0 && hi == f64::from(self.raster.t_max) => {
                    (hi * f64::powi(0.5, (ALONG - i) as i32)) as f32
                }
                _ if i == count => cell.hi,
                _ => (lo + length * i as f64 / count as f64) as f32,
            };
            let count = if lo == 0.0 && hi == f64::from(self.raster.t_max) { ALONG } else { count };
            return (0..count).map(|i| Cell { lo: edge(i), hi: edge(i + 1), ..cell }).collect();
        }
        let most = cell.rect.width.max(cell.rect.height);
        if most <= self.patch {
            return Vec::new();
        }
        // Squares are patches times 64, 16, 4, 1.
        let mut side = self.patch;
        while side * ACROSS < most {
            side *= ACROSS;
        }
        cut(cell.rect, side).into_iter().map(|rect| Cell { rect, ..cell }).collect()
    }

    fn take(&self) -> Tools {
        let free = self.tools.lock().unwrap_or_else(PoisonError::into_inner).pop();
        free.unwrap_or_else(|| Tools {
            probe: Probe::default(),
            memory: Memory::default(),
            program: Program::blank(),
        })
    }

    fn give(&self, tools: Tools) {
        self.tools.lock().unwrap_or_else(PoisonError::into_inner).push(tools);
    }
}
