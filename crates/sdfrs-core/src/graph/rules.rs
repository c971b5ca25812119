//! What lowering has to know of a kind of node.

use std::collections::HashSet;

use super::Form;
use crate::{
    grid::Step,
    shape::{Kind, Shape},
};

/// Slope of a primitive's value in its own frame; infinite for an estimate that is no bound.
pub fn slope(kind: &Kind, form: Form) -> f64 {
    match kind {
        Kind::Mandelbulb { .. } => f64::INFINITY,
        Kind::Texture { grid } => grid.strict_slope(if form == Form::Value { Step::Raw } else { Step::Safe }),
        _ => 1.0,
    }
}

/// Whether the node's surface is made of its children's surfaces alone: then their walks make its walk.
pub fn keeps_surface(kind: &Kind) -> bool {
    match kind {
        Kind::Union { k } | Kind::Intersection { k } | Kind::Difference { k } => *k == 0.0,
        Kind::Texture { .. } | Kind::Negate {} | Kind::WithBounds { .. } | Kind::Translate { .. } => true,
        Kind::Rotate { .. } | Kind::Scale { .. } | Kind::Mirror { .. } | Kind::Repeat { .. } => true,
        Kind::Twist { .. } | Kind::Bend { .. } => true,
        _ => false,
    }
}

/// Operands of nested unions (or intersections) without smoothing, in order, each once.
pub fn flatten(shape: &Shape) -> Vec<&Shape> {
    let same = |s: &Shape| match (shape.kind(), s.kind()) {
        (Kind::Union { .. }, Kind::Union { k }) | (Kind::Intersection { .. }, Kind::Intersection { k }) => {
            *k == 0.0
        }
        _ => false,
    };
    let (mut out, mut seen, mut stack) = (Vec::new(), HashSet::new(), vec![shape]);
    while let Some(s) = stack.pop() {
        if !seen.insert(s.ptr_id()) {
            continue;
        }
        if same(s) {
            stack.extend(s.children().iter().rev());
        } else {
            out.push(s);
        }
    }
    out
}
