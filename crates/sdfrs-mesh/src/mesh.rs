//! Triangles as they came from a file or an array, before anything is believed of them.

/// Vertices in world units; faces by vertex index, counter-clockwise seen from outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    pub vertices: Vec<[f64; 3]>,
    pub faces: Vec<[u32; 3]>,
}

/// The caller's ear: asked often, from any thread.
pub trait Watch: Sync {
    fn cancelled(&self) -> bool {
        false
    }
    /// `done` more of what `bake` announced as its total.
    fn advance(&self, _done: u64) {}
}

/// Nobody listens.
impl Watch for () {}
