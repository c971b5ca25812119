//! Triangles in, signed distances at the nodes of a grid out.

mod afterwards;
mod assembly;
pub mod bake;
mod bricks;
mod budget;
pub mod check;
mod clusters;
mod dense;
mod descent;
pub mod error;
mod error_bound;
mod exact;
mod examine;
mod frames;
mod grid;
pub mod isa;
mod kernels;
mod lanes;
mod leaves;
pub mod mesh;
mod pick;
mod shared;
mod sides;
pub mod sign;

pub use error::MeshError;
pub use mesh::{Mesh, Watch};
