//! From the graph to a program: an order that keeps few values alive, and slots to keep them in.

use std::sync::Arc;

use crate::{
    crowd, fuse,
    graph::{Graph, INPUTS},
    op::{Ins, Op, Stock, Tables},
    real::Scalar,
};

/// A checked program: every slot is below `slots`, every constant range inside `consts`.
///
/// The fields are private on purpose: the evaluator's `unsafe` reads rely on them.
#[derive(Debug, Clone)]
pub struct Tape<T> {
    ins: Vec<Ins>,
    consts: Vec<T>,
    stock: Arc<Stock>,
    slots: u32,
    root: u32,
}

impl<T: Scalar> Tape<T> {
    /// The program that runs fastest: pairs fused, instructions of one kind side by side.
    pub fn new(graph: &Graph) -> Self {
        let fused = fuse::fuse(graph, true);
        let order = fuse::arrange(&fused, &order(&fused));
        Self::in_order(&fused, &order)
    }

    /// The graph's ops one by one.
    pub fn plain(graph: &Graph) -> Self {
        Self::in_order(graph, &order(graph))
    }

    fn in_order(graph: &Graph, order: &[u32]) -> Self {
        let mut uses = vec![0u32; graph.nodes.len() + INPUTS as usize];
        for &id in order {
            for operand in operands(graph, id) {
                uses[*operand as usize] += 1;
            }
        }
        uses[graph.root as usize] += 1;
        let mut slot_of = vec![u32::MAX; uses.len()];
        let mut free: Vec<u32> = Vec::new();
        let mut slots = INPUTS;
        for i in 0..INPUTS {
            slot_of[i as usize] = i;
        }
        let mut ins = Vec::with_capacity(order.len());
        for &id in order {
            let node = graph.nodes[(id - INPUTS) as usize];
            let mut a = [0; 4];
            for (slot, &operand) in a.iter_mut().zip(operands(graph, id)) {
                *slot = slot_of[operand as usize];
            }
            // The first operand's slot last: it is the next one taken, so that chains of joins stay in one slot.
            for &operand in operands(graph, id).iter().rev() {
                uses[operand as usize] -= 1;
                // The coordinates' slots are never given away: every chunk fills them afresh.
                if uses[operand as usize] == 0 && operand >= INPUTS {
                    free.push(slot_of[operand as usize]);
                }
            }
            let d = free.pop().unwrap_or_else(|| {
                slots += 1;
                slots - 1
            });
            slot_of[id as usize] = d;
            ins.push(Ins { op: node.op, run: 1, d, a, k: node.k, n: node.n });
        }
        let consts = graph.consts.iter().map(|v| T::of(*v)).collect();
        Self::of(ins, consts, Arc::new(graph.stock()), slots, slot_of[graph.root as usize])
    }

    /// A program of instructions in order, checked.
    fn of(ins: Vec<Ins>, consts: Vec<T>, stock: Arc<Stock>, slots: u32, root: u32) -> Self {
        let mut tape = Self { ins, consts, stock, slots, root };
        tape.finish();
        tape
    }

    /// Counts what goes together, and checks.
    fn finish(&mut self) {
        for i in (0..self.ins.len()).rev() {
            let same =
                self.ins.get(i + 1).filter(|next| together(&self.ins[i], next)).map_or(0, |next| next.run);
            self.ins[i].run = same.checked_add(1).unwrap_or(1);
        }
        self.check();
    }

    /// Rewrites the program in place, so that no memory has to be asked for: `fill` gets the instructions
    /// and constants, both empty, and gives the number of slots and the root's.
    pub fn rewrite(
        &mut self,
        stock: &Arc<Stock>,
        fill: impl FnOnce(&mut Vec<Ins>, &mut Vec<T>) -> (u32, u32),
    ) {
        self.ins.clear();
        self.consts.clear();
        if !Arc::ptr_eq(&self.stock, stock) {
            self.stock = stock.clone();
        }
        (self.slots, self.root) = fill(&mut self.ins, &mut self.consts);
        self.finish();
    }

    /// A program that isn't one yet: the point's x.
    pub fn blank() -> Self {
        Self::of(Vec::new(), Vec::new(), Arc::default(), INPUTS, 0)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.ins.capacity() * size_of::<Ins>() + self.consts.capacity() * size_of::<T>()
    }

    /// Operations run for a point: every sphere of a union counts, and of a crowd those that a point meets.
    pub fn ops(&self) -> u64 {
        let of = |i: &Ins| match i.op {
            Op::SphereUnion => u64::from(i.n / 4),
            Op::SphereCrowd => crowd::MET,
            _ => 1,
        };
        self.ins.iter().map(of).sum()
    }

    /// The promise behind the evaluator's `unsafe`.
    fn check(&self) {
        for (at, i) in self.ins.iter().enumerate() {
            let slots = i.a[..i.op.arity()].iter().chain([&i.d]).all(|s| *s < self.slots);
            let consts = (i.k as usize + i.n as usize) <= self.consts.len()
                && i.op.constants().is_none_or(|n| n == i.n as usize);
            // Inputs may lie in the caller's slices: nothing is ever written there.
            // A run of n is followed by one of n - 1, so that none leaves the program.
            let run = match i.run {
                0 => false,
                1 => true,
                n => self.ins.get(at + 1).is_some_and(|next| next.run == n - 1 && together(i, next)),
            };
            assert!(slots && consts && run && i.d >= INPUTS, "{i:?} leaves the program's memory");
        }
        assert!(self.root < self.slots);
    }

    pub fn instructions(&self) -> &[Ins] {
        &self.ins
    }
    pub fn slots(&self) -> usize {
        self.slots as usize
    }
    pub fn root(&self) -> usize {
        self.root as usize
    }
    pub fn tables(&self) -> Tables<'_, T> {
        Tables { consts: &self.consts, stock: &self.stock }
    }
}

/// Whether an instruction can share the jump of the one before: both have one op, or both join, the second
/// to the first's result and in its place, so that nobody else can ask for that.
fn together(before: &Ins, ins: &Ins) -> bool {
    if before.op.joins() || ins.op.joins() {
        let follows = ins.a[0] == before.d && ins.d == before.d && ins.a[1] != before.d;
        before.op.joins() && ins.op.joins() && follows
    } else {
        before.op == ins.op
    }
}

pub(crate) fn operands(graph: &Graph, id: u32) -> &[u32] {
    graph.node(id).map_or(&[], |n| &n.a[..n.op.arity()])
}

/// Nodes the root needs, each after its operands and as late as the first use allows.
pub(crate) fn order(graph: &Graph) -> Vec<u32> {
    let mut done = vec![false; graph.nodes.len() + INPUTS as usize];
    let mut out = Vec::with_capacity(graph.nodes.len());
    let mut stack = vec![(graph.root, 0usize)];
    while let Some((id, next)) = stack.pop() {
        if id < INPUTS || done[id as usize] {
            continue;
        }
        match operands(graph, id).get(next) {
            Some(&operand) => {
                stack.push((id, next + 1));
                stack.push((operand, 0));
            }
            None => {
                done[id as usize] = true;
                out.push(id);
            }
        }
    }
    out
}
