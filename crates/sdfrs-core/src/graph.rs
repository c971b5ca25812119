//! From shapes to one hash-consed list of ops in order of definition.
//!
//! Transforms become coordinates (chains of translations, rotations and scales collapse into one
//! affine frame), unions are flattened, unions of spheres become one op. Each value is emitted once.
//! Nothing recurses. Law: a lowered scene gives the bits of the scene evaluated by hand (tests/laws).

mod frame;
mod lower;
mod rules;

use std::collections::HashMap;
use std::sync::Arc;

use crate::{
    crowd::Crowd,
    error::SceneError,
    grid::Grid,
    op::{Op, Stock},
    shape::Shape,
};

/// Most ops of a scene: shared parts at different places are counted at each place.
pub const MAX_OPS: usize = 1 << 21;
/// Nodes 0, 1, 2 are the point's coordinates.
pub const INPUTS: u32 = 3;

/// What a value is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// The field itself.
    Value,
    /// A field with the same surface that is safe to walk: each part divided by its own Lipschitz bound,
    /// textures by their safe step. One steep part doesn't slow the others.
    Walk,
    /// The same for the complement.
    WalkNegated,
}

impl Form {
    fn flipped(self) -> Self {
        match self {
            Form::Value => Form::Value,
            Form::Walk => Form::WalkNegated,
            Form::WalkNegated => Form::Walk,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    pub op: Op,
    pub a: [u32; 4],
    /// Constants `k .. k + n`.
    pub k: u32,
    pub n: u32,
}

/// What pruning knows of a node's value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trait {
    /// Certified slope where no repetition jumps; infinite where none is known.
    pub slope: f64,
    /// Size of the constants in its arithmetic: what rounding is relative to beside the point's coordinates.
    pub size: f64,
    /// Whether the slope holds across the jumps of repetitions as well.
    pub everywhere: bool,
}

impl Trait {
    const INPUT: Self = Self { slope: 1.0, size: 0.0, everywhere: true };
}

/// What makes two ops one: the op, its operands, the bits of its constants.
type Key = (Op, [u32; 4], Box<[u64]>);

/// Ops in order of definition; operand `i >= INPUTS` is `nodes[i - INPUTS]`.
#[derive(Debug, Default)]
pub struct Graph {
    pub nodes: Vec<Node>,
    pub consts: Vec<f64>,
    pub grids: Vec<Arc<Grid>>,
    pub crowds: Vec<Arc<Crowd>>,
    pub root: u32,
    /// What pruning knows of each node.
    traits: Vec<Trait>,
    known: HashMap<Key, u32>,
}

impl Graph {
    /// Lowers a shape.
    pub fn new(shape: &Shape, form: Form) -> Result<Self, SceneError> {
        let mut graph = Self::default();
        graph.root = lower::lower(&mut graph, shape, form)?;
        graph.known = HashMap::new();
        Ok(graph)
    }

    /// The same with large unions of spheres as crowds, found by place, with the same bits; none where there is
    /// no such union.
    pub fn crowded(&self) -> Option<Self> {
        let crowd = |node: &Node| (node.op == Op::SphereUnion).then(|| Crowd::new(self.constants(node)))?;
        let crowds: Vec<_> = self.nodes.iter().map(crowd).collect();
        if crowds.iter().all(Option::is_none) {
            return None;
        }
        let mut graph = Self { root: self.root, grids: self.grids.clone(), ..Self::default() };
        graph.traits.clone_from(&self.traits);
        for (&(mut node), crowd) in self.nodes.iter().zip(crowds) {
            let k = graph.consts.len();
            match crowd {
                Some(crowd) => {
                    node.op = Op::SphereCrowd;
                    graph.consts.push(graph.crowds.len() as f64);
                    graph.crowds.push(crowd);
                }
                None => graph.consts.extend_from_slice(self.constants(&node)),
            }
            (node.k, node.n) = (k as u32, (graph.consts.len() - k) as u32);
            graph.nodes.push(node);
        }
        Some(graph)
    }

    /// What its programs read beside constants.
    pub fn stock(&self) -> Stock {
        Stock { grids: self.grids.clone(), crowds: self.crowds.clone() }
    }

    pub fn node(&self, id: u32) -> Option<&Node> {
        id.checked_sub(INPUTS).and_then(|i| self.nodes.get(i as usize))
    }

    fn constants(&self, node: &Node) -> &[f64] {
        &self.consts[node.k as usize..(node.k + node.n) as usize]
    }

    /// The value of an op, emitted unless it exists.
    fn emit(&mut self, op: Op, operands: &[u32], consts: &[f64]) -> Result<u32, SceneError> {
        if let Some((op, operands, consts)) = self.with_constant(op, operands) {
            return self.emit(op, &[operands], &[consts]);
        }
        let mut a = [0; 4];
        a[..operands.len()].copy_from_slice(operands);
        let key = (op, a, consts.iter().map(|v| v.to_bits()).collect());
        if let Some(id) = self.known.get(&key) {
            return Ok(*id);
        }
        if self.nodes.len() >= MAX_OPS || self.consts.len() + consts.len() > u32::MAX as usize {
            return Err(SceneError::new(
                "scene",
                format!("the scene expands to more than {MAX_OPS} operations"),
            ));
        }
        let (k, n) = (self.consts.len() as u32, consts.len() as u32);
        self.consts.extend_from_slice(consts);
        let known = self.follows(op, operands, consts);
        self.traits.push(known);
        self.nodes.push(Node { op, a, k, n });
        let id = self.nodes.len() as u32 - 1 + INPUTS;
        self.known.insert(key, id);
        Ok(id)
    }

    /// What pruning knows of a node.
    pub fn known(&self, id: u32) -> Trait {
        id.checked_sub(INPUTS).and_then(|i| self.traits.get(i as usize)).copied().unwrap_or(Trait::INPUT)
    }

    /// Notes that a node's value is no steeper than `slope`; `everywhere` even across the jumps of
    /// repetitions below it.
    fn bound(&mut self, id: u32, slope: f64, everywhere: bool) {
        if let Some(known) = id.checked_sub(INPUTS).and_then(|i| self.traits.get_mut(i as usize)) {
            known.slope = known.slope.min(slope);
            known.everywhere |= everywhere && slope.is_finite();
        }
    }

    /// What follows from the operands; primitives are bounded by their frame instead.
    fn follows(&self, op: Op, operands: &[u32], k: &[f64]) -> Trait {
        let at = |i: usize| self.known(operands[i]);
        let slope = match op {
            Op::Const => 0.0,
            Op::Min | Op::Max | Op::Smin | Op::Smax => at(0).slope.max(at(1).slope),
            Op::Neg | Op::Abs | Op::AddC | Op::SubC | Op::Shell | Op::Elongate | Op::Repeat => at(0).slope,
            Op::MulC => at(0).slope * k[0].abs(),
            Op::DivC => at(0).slope / k[0].abs(),
            Op::Add | Op::Sub => at(0).slope + at(1).slope,
            Op::Length2 => at(0).slope.hypot(at(1).slope),
            Op::Length3 => at(0).slope.hypot(at(1).slope).hypot(at(2).slope),
            Op::Dot if operands == [0, 1, 2] => k[0].hypot(k[1]).hypot(k[2]),
            Op::Dot => (0..3).map(|i| at(i).slope * k[i].abs()).sum(),
            _ => f64::INFINITY,
        };
        let own: f64 = match op {
            Op::SphereUnion => 4.0 * k.iter().fold(0.0, |most: f64, v| most.max(v.abs())),
            Op::Dot => k[3].abs(),
            // Factors, not lengths.
            Op::MulC | Op::DivC => 0.0,
            Op::Capsule => k.iter().map(|v| v.abs()).sum::<f64>() - k[6].abs(),
            Op::Cone => k.iter().take(6).map(|v| v.abs()).sum(),
            Op::Gyroid => k[2].abs() + 1.0 / k[0].abs(),
            Op::Texture | Op::TextureSafe | Op::TextureSafeNegated => self.extent(k[0] as usize),
            _ => k.iter().map(|v| v.abs()).sum(),
        };
        let size = own + operands.iter().map(|id| self.known(*id).size).fold(0.0, f64::max);
        let size = match op {
            Op::MulC => size * k[0].abs(),
            Op::DivC => size / k[0].abs(),
            _ => size,
        };
        Trait { slope, size, everywhere: false }
    }

    /// Size of the numbers in a grid's arithmetic.
    fn extent(&self, grid: usize) -> f64 {
        let Some((lo, hi)) = self.grids.get(grid).map(|g| g.bounds()) else { return f64::INFINITY };
        lo.iter().chain(&hi).map(|v| v.abs()).sum()
    }

    /// An op with a constant second operand, as its shorter form with the same bits.
    fn with_constant(&self, op: Op, operands: &[u32]) -> Option<(Op, u32, f64)> {
        let constant = |i: usize| {
            self.node(operands[i]).filter(|n| n.op == Op::Const).map(|n| self.consts[n.k as usize])
        };
        match op {
            Op::Add => match (constant(0), constant(1)) {
                (_, Some(c)) => Some((Op::AddC, operands[0], c)),
                (Some(c), _) => Some((Op::AddC, operands[1], c)),
                _ => None,
            },
            Op::Mul => match (constant(0), constant(1)) {
                (_, Some(c)) => Some((Op::MulC, operands[0], c)),
                (Some(c), _) => Some((Op::MulC, operands[1], c)),
                _ => None,
            },
            Op::Sub => constant(1).map(|c| (Op::SubC, operands[0], c)),
            Op::Div => constant(1).map(|c| (Op::DivC, operands[0], c)),
            _ => None,
        }
    }

    fn grid(&mut self, grid: &Arc<Grid>) -> f64 {
        let at = self.grids.iter().position(|g| Arc::ptr_eq(g, grid)).unwrap_or_else(|| {
            self.grids.push(grid.clone());
            self.grids.len() - 1
        });
        at as f64
    }
}
