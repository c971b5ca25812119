//! From hits to colours: normals, then light.

pub mod direct;
pub mod normal;
mod picture;
mod srgb;

pub use direct::{Light, PointLight, Surface};
pub use picture::Shading;
