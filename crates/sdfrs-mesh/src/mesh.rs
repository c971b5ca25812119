//! Triangles as they came from a file or an array, before anything is believed of them; who waits for the work.

use crate::MeshError;

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

/// Asks a watch now and then, for loops of many short turns: every few milliseconds.
pub struct Pulse<'w> {
    watch: &'w dyn Watch,
    turns: u32,
}

impl<'w> Pulse<'w> {
    pub fn new(watch: &'w dyn Watch) -> Self {
        Self { watch, turns: 0 }
    }

    /// One for a task of its own.
    pub fn another(&self) -> Self {
        Self::new(self.watch)
    }

    /// One turn.
    #[inline(always)]
    pub fn beat(&mut self) -> Result<(), MeshError> {
        self.turns = self.turns.wrapping_add(1);
        if self.turns.is_multiple_of(8192) { self.ask() } else { Ok(()) }
    }

    /// `n` times the same: the system takes its time with the pages of very many.
    pub fn filled<T: Copy>(&self, value: T, n: usize) -> Result<Vec<T>, MeshError> {
        let mut all = Vec::with_capacity(n);
        while all.len() < n {
            self.ask()?;
            all.resize(n.min(all.len() + (1 << 19)), value);
        }
        Ok(all)
    }

    /// A step after which it is time in any case.
    #[inline(never)]
    pub fn ask(&self) -> Result<(), MeshError> {
        if self.watch.cancelled() { Err(MeshError::Cancelled) } else { Ok(()) }
    }
}
