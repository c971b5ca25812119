//! Memory is asked for before it is taken.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::MeshError;

pub struct Budget {
    allowed: u64,
    taken: AtomicU64,
}

impl Budget {
    pub fn new(allowed: u64) -> Self {
        Self { allowed, taken: AtomicU64::new(0) }
    }

    /// `bytes` more for `what`, or an error that names asked and allowed.
    pub fn take(&self, bytes: u64, what: &str) -> Result<(), MeshError> {
        let before = self.taken.fetch_add(bytes, Ordering::Relaxed);
        if before.saturating_add(bytes) <= self.allowed {
            return Ok(());
        }
        let message = format!(
            "{what} takes {bytes} bytes on top of {before} already taken; {} bytes are allowed in all",
            self.allowed
        );
        Err(MeshError::bad("memory", message))
    }

    pub fn left(&self) -> u64 {
        self.allowed.saturating_sub(self.taken.load(Ordering::Relaxed))
    }

    pub fn give(&self, bytes: u64) {
        self.taken.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// `count` items more for `vec`, filled with `value`; the memory stays counted.
    pub fn grow<T: Clone>(&self, vec: &mut Vec<T>, to: usize, value: T, what: &str) -> Result<(), MeshError> {
        if vec.len() >= to {
            return Ok(());
        }
        let to = to.max(vec.len() + vec.len() / 2);
        self.take(((to - vec.len()) * size_of::<T>()) as u64, what)?;
        vec.try_reserve_exact(to - vec.len())
            .map_err(|_| MeshError::bad("memory", format!("the system has none for {what}")))?;
        vec.resize(to, value);
        Ok(())
    }
}
