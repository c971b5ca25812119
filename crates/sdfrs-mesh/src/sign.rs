//! Inside or outside.

/// How a node's sign is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SignRule {
    /// Pseudonormals for closed, oriented, manifold meshes, else winding numbers.
    #[default]
    Auto,
    Winding,
    Pseudonormal,
    Parity,
    /// Distances without a sign.
    Unsigned,
}
