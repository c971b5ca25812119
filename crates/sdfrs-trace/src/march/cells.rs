//! Shortened programs along a block of rays: slabs of depth for the block, thinner ones for each of its
//! groups, made as rays get there.
//!
//! Sixteen slabs are probed at a time. Under `Prune::Skip` a cell whose field is proven to stay above the
//! hit threshold is stepped over, and what stays above it in a cell is left out there: values that are no
//! hits may then be too large, so rays stop at the cell's end and start anew in the next
//! (`march/worker.rs`). Everything is written over old memory, so a worker's arena stops growing after its
//! first blocks. Law: crates/sdfrs-trace/tests/prune.rs.

use std::ops::Range;

use sdfrs_core::{
    Field,
    contract::Work,
    eval::{Native, Program},
    prune::{CELLS, Clearance, Left, Memory, Part, Probe, Pruner},
};

use super::{Threshold, beam::Beam, sizes::Sizes};

/// Shortest slab in units of the hit threshold.
const SHORTEST: f64 = 64.0;
/// Lengths of programs with a counter of their own.
const LISTED: usize = 256;
/// Rows of slabs kept for a block.
const ROWS: usize = 6;

/// Up to 16 slabs of depth, one behind the other.
struct Row {
    probe: Probe,
    /// Where slab `i` begins; slab `i` ends at `edges[i + 1]`.
    edges: [f64; CELLS + 1],
    len: usize,
    /// Where rays can be taken from slab `i` without meeting anything; its own beginning if nowhere.
    clear_to: [f64; CELLS],
    made: [bool; CELLS],
    /// What is made may say too much above the hit threshold.
    near: [bool; CELLS],
    /// How far from what is made the next hit is.
    clearance: [Clearance; CELLS],
}

impl Row {
    fn new() -> Self {
        Self {
            probe: Probe::default(),
            edges: [f64::INFINITY; CELLS + 1],
            len: 0,
            clear_to: [0.0; CELLS],
            made: [false; CELLS],
            near: [false; CELLS],
            clearance: [Clearance::default(); CELLS],
        }
    }

    /// The slab that holds a depth.
    fn find(&self, t: f64) -> Option<usize> {
        (0..self.len).find(|&i| self.edges[i] <= t && t < self.edges[i + 1])
    }

    /// Whether nothing is in slab `i`.
    fn is_clear(&self, i: usize) -> bool {
        self.clear_to[i] > self.edges[i]
    }

    /// The clear stretch that slab `i` belongs to.
    fn clear(&self, i: usize) -> (f64, f64) {
        let first = (0..i).rev().take_while(|&before| self.is_clear(before)).last().unwrap_or(i);
        (self.edges[first], self.clear_to[i])
    }

    /// Up to where the field has to be kept in slab `i`: larger values are no hits.
    fn exact(&self, i: usize, limit: &Threshold<f64>, skip: bool) -> f32 {
        if skip { self.probe.threshold(i, (limit.eps, limit.cone), self.edges[i + 1]) } else { f32::INFINITY }
    }

    /// Probes the slabs between the edges. Up to the depth `end` the part says how far the next thing is.
    fn look(&mut self, part: &Part, beam: &Beam, limit: &Threshold<f64>, skip: bool, end: f64) {
        let cells: [_; CELLS] = std::array::from_fn(|i| {
            let i = i.min(self.len - 1);
            beam.cell(self.edges[i], self.edges[i + 1])
        });
        self.probe.look(part, &cells);
        self.made = [false; CELLS];
        for i in (0..self.len).rev() {
            let (lo, hi) = (self.edges[i], self.edges[i + 1]);
            self.clear_to[i] = lo;
            let clear = f64::from(self.probe.clear_radius(part, i, (limit.eps, limit.cone), hi));
            if !skip || !(clear > f64::from(cells[i].radius)) {
                continue;
            }
            let beyond = if i + 1 < self.len { self.clear_to[i + 1] } else { hi };
            self.clear_to[i] = beyond.max(hi).max(beam.clear_to(0.5 * (lo + hi), clear).min(end));
        }
    }
}

/// What to do with rays that ask for a sample somewhere.
pub enum Found<'a, T: Native> {
    /// Nothing is there, from the first depth to the second.
    Empty(f64, f64),
    /// Between these depths a program has the field's values.
    Cell(Stretch<'a, T>),
    /// Only the whole field does.
    Whole,
}

/// A cell's depths, and its program.
pub struct Stretch<'a, T: Native> {
    pub from: f64,
    pub to: f64,
    pub program: &'a Program<T>,
    /// How far from its values the next hit is.
    pub clearance: Clearance,
    /// Whether values above the hit threshold may be too large: what no ray meets here is left out.
    pub near: bool,
}

pub struct Cells<T: Native> {
    skip: bool,
    pub sizes: Sizes,
    limit: Threshold<f64>,
    block: Beam,
    group: Beam,
    rows: Vec<(Row, Vec<Part>)>,
    /// Rows in use, and the one to be written over next.
    used: usize,
    next: usize,
    /// Slabs of the group inside one slab of the block.
    fine: Row,
    within: (usize, usize),
    programs: Vec<Program<T>>,
    /// The cell that was found last.
    last: usize,
    /// The whole with its crowds, where it has some.
    whole: Option<Program<T>>,
    /// A fine part on its way to a program.
    part: Part,
    memory: Memory,
    /// Operations of probes, and points by the length of the program they ran.
    probed: u64,
    points: Vec<u64>,
    longer: Work,
}

impl<T: Native> Cells<T> {
    pub fn new(skip: bool, sizes: Sizes, limit: &Threshold<T>) -> Self {
        Self {
            skip,
            sizes,
            limit: Threshold { eps: limit.eps.f64(), cone: limit.cone.f64() },
            block: Beam::default(),
            group: Beam::default(),
            rows: Vec::new(),
            used: 0,
            next: 0,
            fine: Row::new(),
            within: (usize::MAX, 0),
            programs: (0..CELLS).map(|_| Program::blank()).collect(),
            last: 0,
            whole: None,
            part: Part::blank(),
            memory: Memory::default(),
            probed: 0,
            points: vec![0; LISTED],
            longer: Work::default(),
        }
    }

    /// Before anything else is asked.
    pub fn prepare(&mut self, pruner: &Pruner) {
        if pruner.has_crowds() && self.whole.is_none() {
            let mut whole = Program::blank();
            pruner.program(pruner.whole(), &mut self.memory, &mut whole);
            self.whole = Some(whole);
        }
    }

    /// What has the field's values everywhere.
    pub fn whole<'a>(&'a self, field: &'a dyn Field<T>) -> &'a dyn Field<T> {
        self.whole.as_ref().map_or(field, |whole| whole)
    }

    pub fn begin_block(&mut self, beam: Beam) {
        (self.block, self.used, self.next) = (beam, 0, 0);
    }
    pub fn begin_group(&mut self, beam: Beam) {
        self.group = beam;
        self.fine.len = 0;
    }

    /// The cell that holds a depth; it ends behind it.
    pub fn find(&mut self, pruner: &Pruner, t: f64) -> Found<'_, T> {
        if !t.is_finite() {
            return Found::Whole;
        }
        let cell = match self.fine.find(t) {
            Some(cell) => cell,
            None => {
                let (row, slab) = match self.slab(t) {
                    Some(found) => found,
                    None => match self.add_row(pruner, t) {
                        Some(row) => (row, 0),
                        None => return Found::Whole,
                    },
                };
                if self.rows[row].0.is_clear(slab) {
                    let (from, to) = self.rows[row].0.clear(slab);
                    return Found::Empty(from, to);
                }
                if !self.refine(pruner, row, slab) {
                    return Found::Empty(self.rows[row].0.edges[slab], self.rows[row].0.edges[slab + 1]);
                }
                let Some(cell) = self.fine.find(t) else { return Found::Whole };
                cell
            }
        };
        if self.fine.is_clear(cell) {
            let (from, to) = self.fine.clear(cell);
            return Found::Empty(from, to);
        }
        if !self.fine.made[cell] && !self.make(pruner, cell) {
            return Found::Empty(self.fine.edges[cell], self.fine.edges[cell + 1]);
        }
        self.last = cell;
        let (from, to) = (self.fine.edges[cell], self.fine.edges[cell + 1]);
        let (program, clearance) = (&self.programs[cell], self.fine.clearance[cell]);
        Found::Cell(Stretch { from, to, program, clearance, near: self.fine.near[cell] })
    }

    /// The depths and the program of the cell that was found last, if it is left for a depth: another's may take their
    /// place.
    pub fn left(&self, t: f64) -> Option<(Range<f64>, &Program<T>)> {
        let depths = self.fine.edges[self.last]..self.fine.edges[self.last + 1];
        (!depths.contains(&t)).then(|| (depths, &self.programs[self.last]))
    }

    /// Makes a fine cell's program; false if nothing is there.
    fn make(&mut self, pruner: &Pruner, cell: usize) -> bool {
        let (row, slab) = self.within;
        let (coarse, parts) = &self.rows[row];
        let what = (cell, self.fine.exact(cell, &self.limit, self.skip));
        let left = self.fine.probe.narrow_last(pruner, &parts[slab], what, &mut self.memory, &mut self.part);
        if left == Left::Nothing {
            self.fine.clear_to[cell] = self.fine.edges[cell + 1];
            return false;
        }
        self.fine.made[cell] = true;
        self.fine.near[cell] = left == Left::Near || coarse.near[slab];
        let (limit, far) = ((self.limit.eps, self.limit.cone), self.fine.edges[cell + 1]);
        self.fine.clearance[cell] = self.fine.probe.clearance(&parts[slab], cell, limit, far);
        pruner.program(&self.part, &mut self.memory, &mut self.programs[cell]);
        true
    }

    fn slab(&self, t: f64) -> Option<(usize, usize)> {
        (0..self.used).find_map(|row| self.rows[row].0.find(t).map(|slab| (row, slab)))
    }

    /// Slabs of the block from a depth on.
    fn add_row(&mut self, pruner: &Pruner, t: f64) -> Option<usize> {
        let at = self.next;
        self.next = (at + 1) % ROWS;
        self.used = self.used.max(at + 1);
        if self.rows.len() <= at {
            self.rows.push((Row::new(), (0..CELLS).map(|_| Part::blank()).collect()));
        }
        if self.within.0 == at {
            self.fine.len = 0;
        }
        let row = &mut self.rows[at].0;
        row.edges[0] = down(t);
        row.len = 0;
        while row.len < CELLS && !(row.edges[row.len] > self.block.t_max) {
            let lo = row.edges[row.len];
            let least = SHORTEST * self.limit.eps.max(1e-6 * lo.abs());
            let length = self.sizes.coarse * self.block.width(lo);
            row.edges[row.len + 1] = down(lo + length.max(least));
            row.len += 1;
            // A fan of rays that is still a point tells nothing of slabs farther on.
            if length < least {
                break;
            }
        }
        if row.len == 0 || !(row.edges[0] <= t && t < row.edges[1]) || !row.edges[row.len].is_finite() {
            row.len = 0;
            return None;
        }
        row.look(pruner.whole(), &self.block, &self.limit, self.skip, f64::INFINITY);
        self.probed += CELLS as u64 * pruner.whole().ops();
        Some(at)
    }

    /// Slabs of the group inside a slab of the block; false if nothing is there.
    fn refine(&mut self, pruner: &Pruner, row: usize, slab: usize) -> bool {
        let (coarse, parts) = &mut self.rows[row];
        let (lo, hi) = (coarse.edges[slab], coarse.edges[slab + 1]);
        if !coarse.made[slab] {
            coarse.made[slab] = true;
            let what = (slab, coarse.exact(slab, &self.limit, self.skip));
            let left = coarse.probe.narrow(pruner, pruner.whole(), what, &mut self.memory, &mut parts[slab]);
            if left == Left::Nothing {
                coarse.clear_to[slab] = hi;
                return false;
            }
            coarse.near[slab] = left == Left::Near;
        }
        let count = ((hi - lo) / (self.sizes.fine * self.group.width(hi))).ceil().clamp(1.0, CELLS as f64);
        self.fine.len = count as usize;
        for i in 0..=self.fine.len {
            self.fine.edges[i] = down(lo + (hi - lo) * i as f64 / count);
        }
        self.fine.edges[self.fine.len] = hi;
        self.within = (row, slab);
        let end = if coarse.near[slab] { hi } else { f64::INFINITY };
        self.fine.look(&parts[slab], &self.group, &self.limit, self.skip, end);
        self.probed += CELLS as u64 * parts[slab].ops();
        true
    }

    /// Points that ran a program of that length.
    pub fn count(&mut self, ops: u64, points: u64) {
        match self.points.get_mut(ops as usize) {
            Some(n) => *n += points,
            None => self.longer.add(ops, points),
        }
    }

    /// Points of a program that were no rays' samples.
    pub fn probe(&mut self, ops: u64, points: u64) {
        self.probed += ops * points;
    }

    /// Hands over what was counted since the last time.
    pub fn tell(&mut self, work: &mut Work) {
        work.node_evaluations += std::mem::take(&mut self.probed);
        for (ops, n) in self.points.iter_mut().enumerate().filter(|(_, n)| **n > 0) {
            work.add(ops as u64, std::mem::take(n));
        }
        work.join(&std::mem::take(&mut self.longer));
    }

    /// Bytes of the arena.
    pub fn bytes(&self) -> u64 {
        let parts = self.rows.iter().flat_map(|(_, parts)| parts).chain([&self.part]).map(Part::bytes);
        let programs = self.programs.iter().map(|p| p.tape().bytes());
        (parts.sum::<usize>() + programs.sum::<usize>()) as u64
    }
}

/// The next number below that both precisions have.
fn down(t: f64) -> f64 {
    let single = t as f32;
    f64::from(if f64::from(single) > t { single.next_down() } else { single })
}
