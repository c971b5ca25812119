//! The WGSL of the package: modules by name, linked into one text that holds what its entry point needs.
//!
//! Twins of the CPU's rooms bear the same names. A crate of its own, so that the texts travel with the
//! sources. Law (tests/validate.rs): every combination passes naga, and every op of the table is here.

mod link;
mod modules;

pub use link::{LinkError, link};
pub use modules::*;
