//! Scenes as WGSL: one line an op, without nesting, constants by their place in a buffer.
//!
//! `field(p) -> f32` and `field_gradient(p) -> vec4` (gradient, value) call the functions named like the rows
//! of the op table. Functions hold [`PART`] ops at most: naga's parser and drivers' optimisers are
//! worse than linear in a function's length. Moving an object changes constants, so the text stays the
//! same and nothing is compiled. Law (tests/parity.rs): the CPU's bits in strict mode.

mod text;

use std::{
    hash::{DefaultHasher, Hash, Hasher},
    sync::Arc,
};

use sdfrs_core::{
    Grid,
    graph::{Graph, INPUTS},
};

use crate::error::GpuError;

/// Most ops of a function.
pub const PART: usize = 1000;
/// Most ops of a compiled scene; beyond them compiling takes longer than drawing.
pub const MAX_OPS: usize = 5000;
/// "Never": stands for an infinite constant, since shaders may assume that there is no infinity.
pub const FAR: f32 = 1e30;

/// A scene as a shader needs it.
#[derive(Debug, Clone)]
pub struct Emitted {
    /// Declares `field` and `field_gradient`; depends on the structure of the scene alone.
    pub text: String,
    /// What the shader sees as `consts`.
    pub consts: Vec<f32>,
    /// Hash of the text.
    pub key: u64,
    /// What the shader sees as `grids`, in this order.
    pub grids: Vec<Arc<Grid>>,
    /// Whether results between operations are kept as rounded.
    pub strict: bool,
    /// Number of ops.
    pub ops: usize,
}

impl Emitted {
    /// The texts to link with a pass.
    pub fn parts(&self) -> Vec<&str> {
        let mut parts = sdfrs_shaders::ops(self.strict).to_vec();
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

/// Emits a scene.
pub fn emit(graph: &Graph, strict: bool) -> Result<Emitted, GpuError> {
    emit_in_parts(graph, strict, PART)
}

/// Emits a scene as functions of `part` ops at most; the values don't depend on it.
pub fn emit_in_parts(graph: &Graph, strict: bool, part: usize) -> Result<Emitted, GpuError> {
    let order = needed(graph);
    if order.len() > MAX_OPS {
        let what = "operations of a scene compiled into a shader".into();
        return Err(GpuError::Limits { what, asked: order.len() as u64, allowed: MAX_OPS as u64 });
    }
    let text = text::scene(graph, &order, part.max(1));
    let mut hasher = DefaultHasher::new();
    text.hash(&mut hasher);
    Ok(Emitted {
        key: hasher.finish(),
        text,
        consts: graph.consts.iter().map(|v| finite(*v)).collect(),
        grids: graph.grids.clone(),
        strict,
        ops: order.len(),
    })
}

/// A constant as f32, never infinite.
fn finite(v: f64) -> f32 {
    let v = v as f32;
    if v.is_infinite() { FAR.copysign(v) } else { v }
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
