//! The constants of a scene as rows of four, as uniforms have them.
//!
//! Uniforms, because every invocation reads the same: GPUs keep them in registers of their own, and a
//! driver in software loads them once instead of once a lane (100 boxes compile 20 times as fast).

use std::collections::HashMap;

use sdfrs_core::{
    graph::{Graph, Node},
    op::Op,
};

use super::FAR;
use crate::{error::GpuError, grids};

/// Constants, and how each op is told of its own.
pub struct Packed {
    pub rows: Vec<[f32; 4]>,
    /// What follows an op's operands.
    pub arguments: HashMap<u32, String>,
    /// The row that single constants fill up.
    open: Option<(usize, usize)>,
}

impl Packed {
    pub fn new(graph: &Graph, order: &[u32]) -> Result<Self, GpuError> {
        let mut packed = Self { rows: Vec::new(), arguments: HashMap::new(), open: None };
        let (parts, _) = grids::layout(&graph.grids)?;
        let mut headers: Vec<Option<usize>> = vec![None; graph.grids.len()];
        for &id in order {
            let Some(node) = graph.node(id) else { continue };
            let values = &graph.consts[node.k as usize..(node.k + node.n) as usize];
            let argument = match node.op {
                Op::Texture | Op::TextureSafe | Op::TextureSafeNegated => {
                    let at = values.first().map_or(0, |v| *v as usize);
                    let grid = &graph.grids[at];
                    let rows = || grids::rows(grid, &parts[at]).map(|row| row.map(tame));
                    let row = *headers[at].get_or_insert_with(|| packed.add(&rows()));
                    format!("{row}u, {}u, {}u", grids::kind(grid), grids::rule(grid))
                }
                _ => packed.place(node, values),
            };
            packed.arguments.insert(id, argument);
        }
        Ok(packed)
    }

    fn add(&mut self, rows: &[[f32; 4]]) -> usize {
        self.rows.extend_from_slice(rows);
        self.rows.len() - rows.len()
    }

    /// The arguments that hand an op its constants: one number, or rows of four.
    fn place(&mut self, node: &Node, values: &[f64]) -> String {
        if let [value] = values {
            return self.single(finite(*value));
        }
        let rows: Vec<[f32; 4]> =
            values.chunks(4).map(|c| std::array::from_fn(|i| c.get(i).map_or(0.0, |v| finite(*v)))).collect();
        let first = self.add(&rows);
        match node.op {
            Op::SphereUnion => format!("{first}u, {}u", rows.len()),
            _ => (first..self.rows.len()).map(|row| format!("consts[{row}]")).collect::<Vec<_>>().join(", "),
        }
    }

    fn single(&mut self, value: f32) -> String {
        let (row, lane) = match self.open {
            Some((row, lane)) => (row, lane),
            None => (self.add(&[[0.0; 4]]), 0),
        };
        self.rows[row][lane] = value;
        self.open = (lane < 3).then_some((row, lane + 1));
        format!("consts[{row}].{}", ["x", "y", "z", "w"][lane])
    }
}

/// A constant as f32, never infinite.
fn finite(v: f64) -> f32 {
    tame(v as f32)
}

pub fn tame(v: f32) -> f32 {
    if v.is_infinite() { FAR.copysign(v) } else { v }
}
