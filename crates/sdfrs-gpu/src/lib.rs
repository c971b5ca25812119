//! Signed distance fields on the GPU: devices, scenes as WGSL, and their evaluation.
//!
//! Data flows one way: `graph -> emit -> pipelines -> compiled -> march -> shade -> render`; twins of the CPU's rooms, with the shaders
//! themselves in the crate `sdfrs-shaders`.

mod adapters;
pub mod buffers;
pub mod camera;
pub mod compiled;
pub mod contract;
pub mod device;
pub mod dispatch;
pub mod emit;
pub mod error;
pub mod field;
pub mod grids;
pub mod march;
pub mod pace;
pub mod pipelines;
pub mod render;
pub mod scene;
pub mod shade;
pub mod share;
pub mod tracer;

pub use adapters::{AdapterInfo, Kind, adapters};
pub use device::{Choice, Device};
pub use emit::{Emitted, emit};
pub use error::GpuError;
pub use field::GpuField;
pub use pipelines::{Binding, Pipeline, Pipelines};
pub use scene::Scene;
