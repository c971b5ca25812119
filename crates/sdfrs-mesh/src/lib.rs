//! Triangles in, signed distances at the nodes of a grid out.

#[cfg(test)]
extern crate self as sdfrs_mesh;
#[cfg(test)]
#[path = "../tests/signs/meshes.rs"]
mod meshes;

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
mod kernels;
mod lanes;
mod layout;
mod leaves;
pub mod mesh;
mod pick;
pub mod read;
mod select;
mod shared;
mod sides;
pub mod sign;
mod store;

pub use error::MeshError;
pub use mesh::{Mesh, Pulse, Watch};
