//! Model only what a scene requires: inside a ball most operands of a union cannot win, and go.
//!
//! One evaluation at the ball's centre decides, 16 balls at a time. Where two operands of a minimum
//! differ by more than their slopes can make up within the radius, the larger one is dropped; a smooth
//! minimum is its smaller operand, to the bit, once they differ by its radius more. Values inside the
//! ball keep their bits (law: crates/sdfrs-trace/tests/prune.rs), so steps and fallbacks do. Slopes come
//! from [`Graph::known`]; operands without one are kept. Probes run in f32 whatever the trace's precision
//! is: what they leave open is kept.
//!
//! Where only hits count, an operand of a union also goes if all its values in the ball are above the hit threshold:
//! what is left has the field's bits up to the threshold and is nowhere below it, with the same slopes, so sphere
//! tracing inside the ball ends at the same surfaces (same law). Spheres that miss the cylinder of a cell's rays go
//! as well. Source: NUMERICS 2, EVALUATOR.md section 3.

mod cell;
mod part;
mod spheres;

use std::sync::Arc;

use crate::{
    crowd::Crowd,
    eval::{Native, Program, Scratch},
    fuse,
    graph::{Graph, INPUTS},
    op::{Ins, Op, Stock},
    tape::order,
};

pub use cell::{Cell, Rod};
use part::Known;
pub use part::{Memory, Part};
use spheres::Union;

/// Balls probed at a time.
pub const CELLS: usize = 16;
/// Rounding of the values compared, in units of the last place of the largest number in their arithmetic.
const ROUNDING: f32 = 1024.0;
/// Most spheres of a crowd that are asked one by one.
const FEW: usize = 1024;
/// Part of the radius kept as a margin.
const MARGIN: f32 = 1e-3;

/// A scene whose programs can be shortened place by place.
#[derive(Debug)]
pub struct Pruner {
    whole: Part,
    stock: Arc<Stock>,
}

impl Pruner {
    /// None where nothing could ever be dropped or skipped.
    pub fn new(graph: &Graph) -> Option<Self> {
        if !graph.known(graph.root).slope.is_finite() {
            return None;
        }
        let fused = fuse::fuse(graph, false);
        let order = fuse::arrange(&fused, &order(&fused));
        let mut slot_of = vec![u32::MAX; fused.nodes.len() + INPUTS as usize];
        for i in 0..INPUTS {
            slot_of[i as usize] = i;
        }
        let mut whole = Part::blank();
        for (at, &id) in order.iter().enumerate() {
            let node = fused.node(id)?;
            let d = at as u32 + INPUTS;
            slot_of[id as usize] = d;
            let mut a = [0; 4];
            for (slot, operand) in a.iter_mut().zip(&node.a[..node.op.arity()]) {
                *slot = slot_of[*operand as usize];
            }
            let known = graph.known(id);
            let (slope, size) = (up(known.slope), up(known.size));
            let one = Ins { op: node.op, run: 1, d, a, k: node.k, n: node.n };
            whole.push(one, Known { slope, size, everywhere: known.everywhere });
        }
        whole.consts.clone_from(&fused.consts);
        whole.root = slot_of[graph.root as usize];
        let stock = Arc::new(graph.stock());
        whole.close(&stock);
        Some(Self { whole, stock })
    }

    pub fn whole(&self) -> &Part {
        &self.whole
    }
    /// Whether spheres are found by place.
    pub fn has_crowds(&self) -> bool {
        !self.stock.crowds.is_empty()
    }
    /// Operations, a crowd's spheres each counted.
    pub fn size(&self) -> u64 {
        self.whole.ops() + self.stock.crowds.iter().map(|crowd| crowd.size()).sum::<u64>()
    }
    /// The crowd that an instruction's constants name.
    fn crowd(&self, consts: &[f64]) -> &Crowd {
        &self.stock.crowds[consts[0] as usize]
    }
    /// Whether operands can be dropped at all; otherwise only empty cells are found.
    pub fn has_choices(&self) -> bool {
        let choice =
            |op| matches!(op, Op::Min | Op::Max | Op::Smin | Op::Smax | Op::SphereUnion | Op::SphereCrowd);
        self.whole.ins.iter().any(|i| choice(i.op))
    }

    /// A part as a program for points inside its ball, written over an old one.
    pub fn program<T: Native>(&self, part: &Part, memory: &mut Memory, to: &mut Program<T>) {
        to.rewrite(&self.stock, |ins, consts| part.assemble(memory, ins, consts));
    }
}

/// Rounded up to f32.
fn up(v: f64) -> f32 {
    (v as f32) * (1.0 + 2.0 * f32::EPSILON)
}

/// What of a field is left in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Left {
    /// Every value.
    All,
    /// Values up to a limit: others may have grown.
    Near,
    /// All values are above the limit.
    Nothing,
}

/// In the place of a slot: the value is above what has to be kept.
const GONE: u32 = u32::MAX - 1;

/// The slot that holds an instruction's value without it: that of the only operand that matters.
fn alias(one: &Ins, same: u32, slot_of: &[u32]) -> Option<u32> {
    if same != u32::MAX {
        return Some(slot_of[same as usize]);
    }
    let [a, b] = [0, 1].map(|i| slot_of[one.a[i] as usize]);
    match one.op {
        Op::Min | Op::Smin if a == GONE => Some(b),
        Op::Min | Op::Smin if b == GONE => Some(a),
        Op::Max | Op::Smax if a == GONE || b == GONE => Some(GONE),
        _ => None,
    }
}

/// From a value to a ball without a hit: what lies above `above`, over the field's slope.
#[derive(Debug, Clone, Copy, Default)]
pub struct Clearance {
    pub above: f32,
    pub slope: f32,
}

impl Clearance {
    fn radius(self, value: f32) -> f32 {
        (value - self.above) / self.slope
    }
}

/// A part evaluated at the centres of up to 16 balls.
#[derive(Default)]
pub struct Probe {
    scratch: Scratch<f32>,
    cells: [Cell; CELLS],
    /// The cells' largest coordinates.
    far: [f32; CELLS],
    centres: [[f32; CELLS]; 3],
    roots: [f32; CELLS],
}

impl Probe {
    /// Evaluates a part at the centres of cells; those missing are as the last one.
    pub fn look(&mut self, part: &Part, cells: &[Cell]) {
        for i in 0..CELLS {
            let Some(cell) = cells.get(i).or(cells.last()) else { return };
            (self.cells[i], self.far[i]) = (*cell, cell.far());
            for a in 0..3 {
                self.centres[a][i] = cell.centre[a];
            }
        }
        let p = [&self.centres[0][..], &self.centres[1], &self.centres[2]];
        part.tape.run(&mut self.scratch, p, &mut self.roots);
    }

    /// How far around a cell's centre the field certainly stays above the threshold of a hit, up to the depth
    /// `far`; negative where that isn't known.
    pub fn clear_radius(&self, part: &Part, cell: usize, limit: (f64, f64), far: f64) -> f32 {
        let clear = self.clearance(part, cell, limit, far).radius(self.roots[cell]);
        if clear > self.cells[cell].radius { clear } else { -1.0 }
    }

    /// What tells from a part's value in a cell how far the next hit is.
    pub fn clearance(&self, part: &Part, cell: usize, limit: (f64, f64), far: f64) -> Clearance {
        let known = part.known_of(part.root);
        let above = self.threshold(cell, limit, far) + known.noise(self.far[cell]);
        Clearance { above, slope: known.slope * (1.0 + MARGIN) }
    }

    /// Values above this are no hit in a cell that ends at the depth `far`, of an accuracy and a cone.
    pub fn threshold(&self, cell: usize, limit: (f64, f64), far: f64) -> f32 {
        self.cells[cell].threshold(limit, far)
    }

    fn slot(&self, part: &Part, slot: u32, cell: usize) -> f32 {
        if slot == part.root {
            return self.roots[cell];
        }
        match slot {
            0..INPUTS => self.centres[slot as usize][cell],
            _ => self.scratch.slot(slot as usize).0[cell],
        }
    }

    /// How far a value inside a cell can be from the one at its centre.
    fn deviation(&self, part: &Part, slot: u32, cell: usize, broken: bool) -> f32 {
        let known = part.known_of(slot);
        if broken && !known.everywhere {
            return f32::INFINITY;
        }
        known.slope * self.cells[cell].radius * (1.0 + MARGIN) + known.noise(self.far[cell])
    }

    /// What is left of a part in a cell, written over an old one. Values up to `exact` are kept; larger ones, unless
    /// that is infinite, may grow.
    pub fn narrow(
        &self,
        pruner: &Pruner,
        part: &Part,
        (cell, exact): (usize, f32),
        memory: &mut Memory,
        to: &mut Part,
    ) -> Left {
        let left = self.narrow_last(pruner, part, (cell, exact), memory, to);
        if left != Left::Nothing {
            to.close(&pruner.stock);
        }
        left
    }

    /// The same for a part that is made a program, and not probed again.
    pub fn narrow_last(
        &self,
        pruner: &Pruner,
        part: &Part,
        (cell, exact): (usize, f32),
        memory: &mut Memory,
        to: &mut Part,
    ) -> Left {
        self.find_jumps(part, cell, memory);
        let mut grown = self.find_live(part, cell, exact, memory);
        to.clear();
        let Memory { live, same, slot_of, broken, near, sifted, exact, .. } = memory;
        slot_of.clear();
        slot_of.extend(0..INPUTS);
        for (i, one) in part.ins.iter().enumerate() {
            let slot = i + INPUTS as usize;
            if !live[slot] {
                slot_of.push(u32::MAX);
                continue;
            }
            if let Some(other) = alias(one, same[slot], slot_of) {
                slot_of.push(other);
                continue;
            }
            let d = to.ins.len() as u32 + INPUTS;
            let mut new = Ins { d, k: to.consts.len() as u32, ..*one };
            for a in &mut new.a[..one.op.arity()] {
                *a = slot_of[*a as usize];
            }
            let spheres = if broken[slot] {
                None
            } else {
                let union = Union { part, one, cell, below: exact[slot] };
                self.spheres(pruner, union, (near, sifted), &mut to.consts)
            };
            if let Some(left) = spheres {
                grown |= left.cut;
                if !left.any {
                    slot_of.push(GONE);
                    continue;
                }
                new.n = to.consts.len() as u32 - new.k;
                new.op = if new.n == 4 { Op::Sphere } else { Op::SphereUnion };
            } else {
                to.consts.extend_from_slice(&part.consts[one.k as usize..(one.k + one.n) as usize]);
            }
            slot_of.push(d);
            to.push(new, part.known[i]);
        }
        to.root = slot_of[part.root as usize];
        match to.root {
            GONE => Left::Nothing,
            _ if grown => Left::Near,
            _ => Left::All,
        }
    }

    /// Values that may jump inside the cell: those of coordinates that a repetition folds there.
    fn find_jumps(&self, part: &Part, cell: usize, memory: &mut Memory) {
        let broken = &mut memory.broken;
        broken.clear();
        broken.resize(part.ins.len() + INPUTS as usize, false);
        if !part.folds {
            return;
        }
        for (i, one) in part.ins.iter().enumerate() {
            let mut jumps = one.a[..one.op.arity()].iter().any(|a| broken[*a as usize]);
            if one.op == Op::Repeat {
                let [period, off] = [0, 3].map(|k| part.consts[one.k as usize + k] as f32);
                let x = self.slot(part, one.a[0], cell);
                let reach = self.deviation(part, one.a[0], cell, jumps);
                let q = (x - period * (x / period + 0.5).floor()).abs();
                // A fold lies at every half period, and for the neighbours' copies at the cells' centres too.
                jumps |= !(q + reach < 0.5 * period && (off == 0.0 || q > reach));
            }
            broken[i + INPUTS as usize] = jumps && !part.known[i].everywhere;
        }
    }

    /// Marks what the root needs, the choices that are decided, and up to where values have to be kept; whether
    /// larger ones may have grown.
    fn find_live(&self, part: &Part, cell: usize, root: f32, memory: &mut Memory) -> bool {
        let Memory { live, same, broken, exact, .. } = memory;
        let n = part.ins.len() + INPUTS as usize;
        live.clear();
        live.resize(n, false);
        same.clear();
        same.resize(n, u32::MAX);
        exact.clear();
        exact.resize(n, f32::NEG_INFINITY);
        live[part.root as usize] = true;
        exact[part.root as usize] = root;
        let mut cut = false;
        for i in (0..part.ins.len()).rev() {
            let (one, slot) = (&part.ins[i], i + INPUTS as usize);
            if !live[slot] {
                continue;
            }
            let keep = part.exact_below(one, exact[slot]);
            let (operand, grown) = self.decide(part, one, (cell, keep), broken);
            cut |= grown;
            let mut needs = |a: u32| {
                live[a as usize] = true;
                exact[a as usize] = exact[a as usize].max(keep);
            };
            match operand {
                Some(operand) => {
                    same[slot] = operand;
                    needs(operand);
                }
                None => one.a[..one.op.arity()].iter().for_each(|a| needs(*a)),
            }
        }
        cut
    }

    /// The operand that stands for a choice in the cell, if one does; and whether values above `keep` may have grown.
    fn decide(
        &self,
        part: &Part,
        one: &Ins,
        (cell, keep): (usize, f32),
        broken: &[bool],
    ) -> (Option<u32>, bool) {
        let (blends, larger) = match one.op {
            Op::Min => (false, false),
            Op::Max => (false, true),
            Op::Smin => (true, false),
            Op::Smax => (true, true),
            _ => return (None, false),
        };
        let k = if blends { part.consts[one.k as usize] as f32 } else { 0.0 };
        let [a, b, ..] = one.a;
        let [at_a, at_b] = [a, b].map(|slot| self.slot(part, slot, cell));
        let [around_a, around_b] = [a, b].map(|slot| self.deviation(part, slot, cell, broken[slot as usize]));
        // The one that it always equals.
        let gap = at_a - at_b;
        if gap.abs() > k + around_a + around_b {
            return (Some(if (gap < 0.0) != larger { a } else { b }), false);
        }
        if larger {
            return (None, false);
        }
        // The one of a union that alone comes low enough.
        match (at_a - around_a > keep, at_b - around_b > keep) {
            (false, false) => (None, false),
            (true, false) => (Some(b), true),
            (false, true) => (Some(a), true),
            (true, true) => (Some(if at_a < at_b { a } else { b }), true),
        }
    }
}
