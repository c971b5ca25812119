//! Scene files as values: a strict JSON tree, and shapes as a flat list of nodes in it.
//!
//! A file may come from a stranger: sizes are checked before anything is allocated, nothing recurses
//! over the scene, and every refusal names the place. Law: what was written reads back bit for bit.

mod json;
mod nodes;
mod texture;

pub use json::{Fields, Json, MAX_BYTES};
pub use nodes::{MAX_NODES, nodes_to_json, shape_from_nodes};
