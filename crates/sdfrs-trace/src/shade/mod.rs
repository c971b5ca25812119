//! From hits to colours: normals, then light.

pub mod direct;
pub mod normal;

pub use direct::{PointLight, Surface};
