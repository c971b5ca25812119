//! Signed distance functions: shapes, six sphere tracers, pictures and measurements, on CPU and GPU.
//!
//! The door of the house: what a user of the Rust crates needs, under one name.
//!
//! ```
//! use sdfrs::{Control, Limits, Prune, SceneFile, Tracer, render::{Scene, render}};
//!
//! let file = SceneFile::parse(r#"{
//!     "sdfrs": 1,
//!     "nodes": [{"op": "sphere", "radius": 1.0}],
//!     "root": 0,
//!     "camera": {"kind": "pinhole", "origin": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0],
//!                "fov": 40, "width": 32, "height": 24}
//! }"#)?;
//! let camera = file.camera.ok_or("a camera is needed")?;
//! let scene = Scene { shape: &file.shape, camera: &camera, lights: &[], surface: file.surface() };
//! let tracer = Tracer::from_parts("basic", None, None, None, None, true)?;
//! let limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 1000, prune: Prune::Off };
//! let picture = render::<f32>(&scene, &tracer, &limits, 100.0, &Control::new())?;
//! assert!((picture.hits.t[12 * 32 + 16] - 4.0).abs() < 0.02);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod device;
pub mod polygons;
pub mod scene;
pub mod texture;

pub use scene::SceneFile;
pub use sdfrs_core::{
    Control, Field, FormatError, Grid, GridValues, Hits, Limits, Program, Prune, Rays, Scalar, SceneError,
    Scratch, Shape, Span, Status, Value, contract, pool,
};
pub use sdfrs_mesh as mesh;
pub use sdfrs_trace::{Form, SearchForm, TraceError, Tracer};
pub use sdfrs_trace::{budget, camera, march, render, shade, stats, tracer};
pub use sdfrs_trace::{camera::Camera, shade::PointLight, shade::Surface, stats::Summary};
