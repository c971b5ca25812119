//! What a user builds: an immutable graph of primitives, combinators, transforms and formulas.
//!
//! Every node knows its Lipschitz bound, its bounding box and what a tracer may divide by, all by
//! rule from its children ([`meta`]). One registry ([`kind`]) serves Python, scene files and Rust.
//! Graphs may be 10^5 deep: nothing here recurses, dropping included.

mod check;
mod kind;
pub mod meta;
mod value;

use std::sync::Arc;

pub use check::{MAX_ITERATIONS, MAX_POWER};
pub use kind::Kind;
pub use meta::{Aabb, Meta};
pub use value::{Args, Value};

use crate::{error::SceneError, grid::Grid};

/// A node of the scene graph; cloning shares it.
#[derive(Debug, Clone)]
pub struct Shape(Arc<Node>);

#[derive(Debug)]
struct Node {
    kind: Kind,
    children: Vec<Shape>,
    meta: Meta,
}

impl Drop for Node {
    /// Unlinks the children one after the other instead of one inside the other.
    fn drop(&mut self) {
        let mut rest = std::mem::take(&mut self.children);
        while let Some(shape) = rest.pop() {
            if let Some(mut node) = Arc::into_inner(shape.0) {
                rest.append(&mut node.children);
            }
        }
    }
}

impl Shape {
    /// Builds a node by name; the message of an error names the op, the argument and what is allowed.
    pub fn build(op: &str, args: Args, children: Vec<Shape>) -> Result<Shape, SceneError> {
        Self::new(Kind::from_args(op, args)?, children)
    }

    /// A grid as a shape.
    pub fn texture(grid: Grid) -> Result<Shape, SceneError> {
        Self::new(Kind::Texture { grid: Arc::new(grid) }, Vec::new())
    }

    fn new(kind: Kind, children: Vec<Shape>) -> Result<Shape, SceneError> {
        check::check(&kind, &children)?;
        let meta = meta::meta(&kind, &children)?;
        Ok(Shape(Arc::new(Node { kind, children, meta })))
    }

    pub fn kind(&self) -> &Kind {
        &self.0.kind
    }
    pub fn op(&self) -> &'static str {
        self.0.kind.op()
    }
    pub fn args(&self) -> Vec<(&'static str, Value)> {
        self.0.kind.args()
    }
    pub fn children(&self) -> &[Shape] {
        &self.0.children
    }
    pub fn meta(&self) -> &Meta {
        &self.0.meta
    }
    pub fn grid(&self) -> Option<&Arc<Grid>> {
        match self.kind() {
            Kind::Texture { grid } => Some(grid),
            _ => None,
        }
    }
    /// A part of a formula rather than a solid.
    pub fn is_expr(&self) -> bool {
        self.0.kind.is_expr()
    }
    /// Whether the value changes from point to point.
    pub fn depends_on_point(&self) -> bool {
        self.0.meta.moves
    }
    /// Certified bound of |f(a) - f(b)| / |a - b|; infinite where none is known.
    pub fn lipschitz(&self) -> f64 {
        self.0.meta.lip
    }
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        (self.0.meta.bounds.lo, self.0.meta.bounds.hi)
    }
    /// Equal for two handles of one node.
    pub fn ptr_id(&self) -> usize {
        Arc::as_ptr(&self.0) as usize
    }
}
