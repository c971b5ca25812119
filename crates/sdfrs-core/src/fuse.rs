//! What the tape makes of a graph before it runs: pairs of arithmetic become one instruction, and
//! instructions of one kind stand side by side.
//!
//! An instruction costs a jump that the processor guesses badly in a long program (2 to 7 ns), as much
//! as its arithmetic over 16 to 32 points. A pair rounds twice, like its parts: there is no fused
//! multiply-add here. Only a value with a single use disappears into its user. Law: every bit is that
//! of the plain program (crates/sdfrs-core/tests/fuse.rs).

use crate::{
    graph::{Graph, INPUTS, Node},
    op::Op,
};

/// How far ahead an instruction of the same kind is looked for: each one found keeps a slot longer alive.
const WINDOW: usize = 24;
/// Most instructions that follow each other for their kind.
const RUN: usize = 32;

/// The graph with pairs fused; absorbed nodes stay behind without a use, and no node changes its number.
/// Minima and maxima stay single unless `choices` are to be fused as well: pruning decides one by one.
pub fn fuse(graph: &Graph, choices: bool) -> Graph {
    let mut fused = Graph::default();
    fused.nodes.clone_from(&graph.nodes);
    fused.consts.clone_from(&graph.consts);
    fused.grids.clone_from(&graph.grids);
    fused.crowds.clone_from(&graph.crowds);
    fused.root = graph.root;
    let mut uses = uses(graph);
    // From the root downwards, so that the largest pattern wins.
    for i in (0..fused.nodes.len()).rev() {
        if uses[i] == 0 {
            continue;
        }
        let view = View { nodes: &fused.nodes, uses: &uses };
        let node = &fused.nodes[i];
        let choice = matches!(node.op, Op::Min | Op::Max);
        if let Some(found) = view.pattern(node).filter(|_| choices || !choice) {
            for absorbed in found.absorbed.into_iter().flatten() {
                uses[(absorbed - INPUTS) as usize] = 0;
            }
            let mut node = Node { op: found.op, a: found.a, ..fused.nodes[i] };
            if let [Some(first), Some(second)] = found.consts {
                (node.k, node.n) = (fused.consts.len() as u32, 2);
                let pair = [fused.consts[first as usize], fused.consts[second as usize]];
                fused.consts.extend(pair);
            }
            fused.nodes[i] = node;
        }
    }
    fused
}

/// How often each node is an operand of what the root needs.
fn uses(graph: &Graph) -> Vec<u32> {
    let mut uses = vec![0u32; graph.nodes.len()];
    let count = |id: u32, uses: &mut [u32]| {
        if let Some(i) = id.checked_sub(INPUTS) {
            uses[i as usize] += 1;
        }
    };
    count(graph.root, &mut uses);
    for (i, node) in graph.nodes.iter().enumerate().rev() {
        if uses[i] > 0 {
            node.a[..node.op.arity()].iter().for_each(|id| count(*id, &mut uses));
        }
    }
    uses
}

/// A node as it should be, and the nodes that are part of it from now on.
struct Found {
    op: Op,
    a: [u32; 4],
    /// Places of the constants, first the inner node's.
    consts: [Option<u32>; 2],
    absorbed: [Option<u32>; 5],
}

impl Found {
    fn new<const N: usize, const M: usize>(op: Op, a: [u32; N], absorbed: [u32; M]) -> Self {
        let mut found = Found { op, a: [0; 4], consts: [None; 2], absorbed: [None; 5] };
        found.a[..N].copy_from_slice(&a);
        for (to, id) in found.absorbed.iter_mut().zip(absorbed) {
            *to = Some(id);
        }
        found
    }
}

struct View<'a> {
    nodes: &'a [Node],
    uses: &'a [u32],
}

impl View<'_> {
    /// The node behind an operand, if this is its only use.
    fn own(&self, id: u32) -> Option<&Node> {
        let i = id.checked_sub(INPUTS)? as usize;
        (self.uses[i] == 1).then(|| &self.nodes[i])
    }
    fn own_of(&self, op: Op, id: u32) -> Option<&Node> {
        self.own(id).filter(|n| n.op == op)
    }
    /// Factors of a product that only this user needs; a square is one too.
    fn product(&self, id: u32) -> Option<[u32; 2]> {
        let node = self.own(id)?;
        match node.op {
            Op::Mul => Some([node.a[0], node.a[1]]),
            Op::Square => Some([node.a[0]; 2]),
            _ => None,
        }
    }
    fn square(&self, id: u32) -> Option<u32> {
        self.product(id).filter(|[a, b]| a == b).map(|[a, _]| a)
    }

    fn pattern(&self, node: &Node) -> Option<Found> {
        let [a, b, ..] = node.a;
        match node.op {
            Op::Sqrt => self.length(a),
            Op::Add => match (self.product(a), self.product(b)) {
                (Some([p, q]), Some([r, s])) => Some(Found::new(Op::MulMulAdd, [p, q, r, s], [a, b])),
                (Some([p, q]), None) => Some(Found::new(Op::MulAdd, [p, q, b], [a])),
                (None, Some([p, q])) => Some(Found::new(Op::MulAdd, [p, q, a], [b])),
                _ => None,
            },
            Op::Sub => match (self.product(a), self.product(b)) {
                (Some([p, q]), Some([r, s])) => Some(Found::new(Op::MulMulSub, [p, q, r, s], [a, b])),
                (Some([p, q]), None) => Some(Found::new(Op::MulSub, [p, q, b], [a])),
                (None, Some([p, q])) => Some(Found::new(Op::SubMul, [a, p, q], [b])),
                _ => None,
            },
            Op::Mul => self.own_of(Op::Mul, a).map(|n| Found::new(Op::Mul3, [n.a[0], n.a[1], b], [a])),
            Op::AddC => self.own_of(Op::MulC, a).map(|n| {
                let consts = [Some(n.k), Some(node.k)];
                Found { consts, ..Found::new(Op::MulAddC, [n.a[0]], [a]) }
            }),
            Op::Max => self.own_of(Op::Neg, b).map(|n| Found::new(Op::Cut, [a, n.a[0]], [b])),
            _ => None,
        }
    }

    /// The root of a sum of two or three squares.
    fn length(&self, sum: u32) -> Option<Found> {
        let add = self.own_of(Op::Add, sum)?;
        let [left, right, ..] = add.a;
        let last = self.square(right)?;
        if let Some(first) = self.square(left) {
            return Some(Found::new(Op::Length2, [first, last], [sum, left, right]));
        }
        let inner = self.own_of(Op::Add, left)?;
        let (x, y) = (self.square(inner.a[0])?, self.square(inner.a[1])?);
        Some(Found::new(Op::Length3, [x, y, last], [sum, left, right, inner.a[0], inner.a[1]]))
    }
}

/// Puts nodes of one kind next to each other where their operands allow, and chains of joins behind
/// what they join: each of them costs one jump.
pub fn arrange(graph: &Graph, order: &[u32]) -> Vec<u32> {
    let mut plan =
        Plan { graph, order, done: vec![false; graph.nodes.len()], out: Vec::with_capacity(order.len()) };
    let mut head = 0;
    while head < order.len() {
        let first = plan.ahead(head).find(|id| !plan.node(*id).op.joins() && plan.ready(*id));
        match first {
            _ if plan.is_done(order[head]) => head += 1,
            Some(first) => plan.run(head, first),
            None => plan.chain(head),
        }
    }
    plan.out
}

struct Plan<'a> {
    graph: &'a Graph,
    order: &'a [u32],
    done: Vec<bool>,
    out: Vec<u32>,
}

impl Plan<'_> {
    fn node(&self, id: u32) -> &Node {
        &self.graph.nodes[(id - INPUTS) as usize]
    }
    fn is_done(&self, id: u32) -> bool {
        id < INPUTS || self.done[(id - INPUTS) as usize]
    }
    fn ready(&self, id: u32) -> bool {
        let node = self.node(id);
        node.a[..node.op.arity()].iter().all(|a| self.is_done(*a))
    }
    fn emit(&mut self, id: u32) {
        self.done[(id - INPUTS) as usize] = true;
        self.out.push(id);
    }
    /// The next nodes that are still to be placed.
    fn ahead(&self, head: usize) -> impl Iterator<Item = u32> {
        let end = self.order.len().min(head + 4 * WINDOW);
        self.order[head..end].iter().copied().filter(|id| !self.is_done(*id)).take(WINDOW)
    }

    /// `first` and what follows of its kind.
    fn run(&mut self, head: usize, first: u32) {
        let op = self.node(first).op;
        self.emit(first);
        for _ in 1..RUN {
            let next = self.ahead(head).find(|id| self.node(*id).op == op && self.ready(*id));
            let Some(next) = next else { break };
            self.emit(next);
        }
    }

    /// The join at `head`, and each that takes the value before it.
    fn chain(&mut self, head: usize) {
        let mut last = self.order[head];
        self.emit(last);
        for _ in 1..RUN {
            let next = self.ahead(head).find(|id| {
                let node = self.node(*id);
                node.op.joins() && node.a[0] == last && self.ready(*id)
            });
            let Some(next) = next else { break };
            self.emit(next);
            last = next;
        }
    }
}
