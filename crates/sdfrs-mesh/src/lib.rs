//! Triangles in, signed distances at the nodes of a grid out.

pub mod check;
pub mod error;
pub mod mesh;
pub mod sign;

pub use error::MeshError;
pub use mesh::{Mesh, Watch};
