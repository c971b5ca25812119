//! Signed distance fields on the CPU: shapes, the tapes they compile to, and their evaluation.
//!
//! Data flows one way: `shape -> graph -> tape -> eval -> field`; see ARCHITECTURE.md.

pub mod bake;
pub mod contract;
pub mod crowd;
pub mod error;
pub mod eval;
pub mod field;
pub mod file;
pub mod fresh;
mod fuse;
pub mod graph;
pub mod grid;
mod isa;
pub mod lane;
pub mod math;
pub mod op;
pub mod pages;
pub mod pool;
pub mod prune;
pub mod real;
pub mod shape;
pub mod tape;
mod vectorise;

pub use contract::{Control, Hits, Limits, Prune, Rays, Span, Status};
pub use error::{FormatError, SceneError};
pub use eval::{Program, Scratch};
pub use field::Field;
pub use grid::{Grid, GridValues};
pub use real::{Real, Scalar};
pub use shape::{Args, Shape, Value};
