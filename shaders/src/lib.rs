//! The WGSL of the package: modules by name, linked into one text.
mod link;
pub use link::{Linked, link};
