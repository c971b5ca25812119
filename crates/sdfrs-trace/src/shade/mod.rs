//! From hits to colours: normals, then light.

mod clusters;
pub mod direct;
pub mod normal;
mod picture;
mod slopes;
mod srgb;
mod window;

pub use direct::{Light, PointLight, Surface};
pub use picture::Shading;
