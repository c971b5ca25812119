//! Triangles in, signed distances at the nodes of a grid out.

#[cfg(test)]
extern crate self as sdfrs_mesh;
#[cfg(test)]
#[path = "../tests/signs/meshes.rs"]
mod meshes;

pub mod check;
pub mod error;
pub mod mesh;
pub mod read;
pub mod sign;

pub use error::MeshError;
pub use mesh::{Mesh, Watch};
