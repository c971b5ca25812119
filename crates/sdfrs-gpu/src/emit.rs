//! Scenes as WGSL: one line an op, without nesting, constants by their place in a buffer.
//!
//! `field(p) -> f32` and `field_gradient(p) -> vec4` (gradient, value) call the functions named like the rows
//! of the op table. Functions hold [`PART`] ops at most: naga's parser and drivers' optimisers are
//! worse than linear in a function's length. Moving an object changes constants, so the text stays the
//! same and nothing is compiled. Law (tests/parity.rs): the CPU's bits in strict mode.

mod beam;
mod consts;
mod cost;
pub mod patches;
mod slabs;
mod tape;
mod text;

use std::{
    hash::{DefaultHasher, Hash, Hasher},
    sync::Arc,
};

use sdfrs_core::{
    Control, Grid,
    graph::{Graph, INPUTS, Node},
    prune::Pruner,
};

use sdfrs_trace::voxel::Placed;

use crate::{error::GpuError, grids, pipelines::Binding};
pub use patches::Patches;

/// Most ops of a function.
pub const PART: usize = 1000;
/// Most that compiling may cost, in operations of the shader: 5,000 sums, or 300 boxes. Beyond it the scene
/// is interpreted. On lavapipe 300 boxes take 8 s to compile, and are 0.9 us a point instead of 5 from then
/// on (examples/break_even.rs): it pays from 2 million evaluations on, a picture of 256 x 256.
pub const MAX_COST: usize = 10_000;
/// Most rows of four constants in a uniform: WebGPU promises 64 KiB everywhere.
const UNIFORM_ROWS: usize = 4096;
/// "Never": stands for an infinite constant, since shaders may assume that there is no infinity.
pub const FAR: f32 = 1e30;

/// A scene as a shader needs it.
#[derive(Debug, Clone)]
pub struct Emitted {
    /// Declares `field` and `field_gradient`; depends on the structure of the scene alone.
    pub text: String,
    /// What the shader sees as `consts`, in rows of four.
    pub consts: Vec<f32>,
    /// Hash of the text.
    pub key: u64,
    /// What the shader sees as `grids`, in this order.
    pub grids: Vec<Arc<Grid>>,
    /// Whether results between operations are kept as rounded.
    pub strict: bool,
    /// Number of ops, or of instructions.
    pub ops: usize,
    /// Most rounds of loops in an evaluation.
    pub loops: u64,
    /// Whether the text is the scene itself; else an interpreter, and the scene is among the constants.
    pub compiled: bool,
    /// Which shortened program runs where, for an interpreter.
    pub patches: Option<Patches>,
}

impl Emitted {
    /// Whether the constants fit a uniform.
    pub fn is_uniform(&self) -> bool {
        self.compiled && self.consts.len() <= 4 * UNIFORM_ROWS
    }

    /// What the shader sees in group 1.
    pub fn bindings(&self) -> Vec<Binding> {
        let consts = if self.is_uniform() { Binding::Uniform } else { Binding::Read };
        let patches = self.patches.as_ref().map(|_| Binding::Read);
        [consts, Binding::Read].into_iter().chain(patches).collect()
    }

    /// The texts to link with a pass.
    pub fn parts(&self) -> Vec<&str> {
        let mut parts = sdfrs_shaders::ops(self.strict);
        parts.push(&self.text);
        parts
    }

    /// The one text of a pass over this scene.
    pub fn link(&self, pass: &[&str], entry: &str) -> Result<String, GpuError> {
        let parts: Vec<&str> = pass.iter().copied().chain(self.parts()).collect();
        sdfrs_shaders::link(&parts, &[entry])
            .map_err(|e| GpuError::Shader { name: entry.into(), message: e.to_string() })
    }
}

/// Emits a scene: compiled, or interpreted where compiling would take longer than it saves.
pub fn emit(graph: &Graph, strict: bool) -> Result<Emitted, GpuError> {
    let cost: usize = needed(graph).iter().filter_map(|id| graph.node(*id)).map(|n| cost::cost(n.op)).sum();
    if cost <= MAX_COST { emit_in_parts(graph, strict, PART) } else { emit_interpreted(graph, strict) }
}

/// Emits a scene as functions of `part` ops at most; the values don't depend on it.
pub fn emit_in_parts(graph: &Graph, strict: bool, part: usize) -> Result<Emitted, GpuError> {
    let order = needed(graph);
    let packed = consts::Packed::new(graph, &order)?;
    let mut text = declaration(packed.rows.len());
    text::scene(&mut text, graph, &order, &packed.arguments, part.max(1));
    let rounds = |id: &u32| graph.node(*id).map_or(0, |n| cost::loops(n.op, constants(graph, n)));
    let loops = order.iter().map(rounds).sum();
    Ok(finish(&graph.grids, text, packed.rows, strict, (order.len(), loops), true))
}

/// Emits a scene as a program for an interpreter, which scenes of the same ops share.
pub fn emit_interpreted(graph: &Graph, strict: bool) -> Result<Emitted, GpuError> {
    let (text, rows, length) = tape::interpreted(graph)?;
    Ok(finish(&graph.grids, text, rows, strict, length, false))
}

/// Emits a scene as programs for an interpreter, shortened patch by patch of a picture; None where they take
/// more memory than an adapter is sure to have.
pub fn emit_patches(
    graph: &Graph,
    pruner: &Pruner,
    raster: &patches::Raster,
    strict: bool,
    control: &Control,
) -> Result<Option<Emitted>, GpuError> {
    let Some(plan) = patches::plan(graph, pruner, raster, control)? else { return Ok(None) };
    let emitted = finish(&graph.grids, plan.text, plan.rows, strict, plan.length, false);
    Ok(Some(Emitted { patches: Some(plan.patches), ..emitted }))
}

/// What the walk from voxel to voxel sees of a texture that stands alone: the grid's constants, and the way
/// from the scene to its cells.
pub fn emit_voxels(placed: &Placed, strict: bool) -> Result<Emitted, GpuError> {
    let grid = placed.grid();
    let all = std::slice::from_ref(grid);
    let (parts, _) = grids::layout(all)?;
    let to_cells = placed.to_cells().map(|row| row.map(|v| v as f32));
    let rows: Vec<_> = grids::rows(grid, &parts[0]).into_iter().chain(to_cells).collect();
    let (kind, rule) = (grids::kind(grid), grids::rule(grid));
    let text = declaration(rows.len()) + &format!("const KIND: u32 = {kind}u;\nconst RULE: u32 = {rule}u;\n");
    Ok(finish(all, text, rows, strict, (1, 0), true))
}

fn finish(
    grids: &[Arc<Grid>],
    text: String,
    rows: Vec<[f32; 4]>,
    strict: bool,
    (ops, loops): (usize, u64),
    compiled: bool,
) -> Emitted {
    let mut hasher = DefaultHasher::new();
    text.hash(&mut hasher);
    let mut consts = rows.into_flattened();
    consts.resize(consts.len().max(4), 0.0);
    let (key, grids) = (hasher.finish(), grids.to_vec());
    Emitted { text, consts, key, grids, strict, ops, loops, compiled, patches: None }
}

fn constants<'a>(graph: &'a Graph, node: &Node) -> &'a [f64] {
    &graph.consts[node.k as usize..(node.k + node.n) as usize]
}

/// Uniforms are declared as long as they are.
fn declaration(rows: usize) -> String {
    let at = "@group(1) @binding(0)";
    if rows <= UNIFORM_ROWS {
        format!("{at} var<uniform> consts: array<vec4<f32>, {}>;\n", rows.max(1))
    } else {
        format!("{at} var<storage, read> consts: array<vec4<f32>>;\n")
    }
}

/// The ops that the root needs, in order of definition.
fn needed(graph: &Graph) -> Vec<u32> {
    let mut wanted = vec![false; graph.nodes.len() + INPUTS as usize];
    wanted[graph.root as usize] = true;
    for id in (INPUTS..wanted.len() as u32).rev() {
        if wanted[id as usize]
            && let Some(node) = graph.node(id)
        {
            for &operand in &node.a[..node.op.arity()] {
                wanted[operand as usize] = true;
            }
        }
    }
    (INPUTS..wanted.len() as u32).filter(|&id| wanted[id as usize]).collect()
}
