//! Tracers for signed distance fields, what they count, and the pictures they make.
//!
//! `tracer -> march -> stats, shade -> render`; see ARCHITECTURE.md. Twin: the GPU's rooms of the same names.

pub mod budget;
pub mod camera;
pub mod error;
pub mod march;
pub mod render;
pub mod shade;
pub mod stats;
pub mod tracer;
pub mod voxel;

pub use camera::Camera;
pub use error::TraceError;
pub use march::trace;
pub use tracer::{Form, SearchForm, Tracer};
