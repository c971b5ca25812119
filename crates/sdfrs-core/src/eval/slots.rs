//! Where a program's values lie while it runs.

use crate::real::Real;

/// A worker's memory for one kind of number; grows to what the largest tape needs and is used again.
pub struct Slots<R> {
    values: Vec<R>,
    /// Where each slot lies: `width` values each, one slot after the other.
    pub(super) at: Vec<*mut R>,
    width: usize,
}

// SAFETY: the pointers lead into `values` between calls, and nobody follows them then.
#[allow(unsafe_code)]
unsafe impl<R: Send> Send for Slots<R> {}
#[allow(unsafe_code)]
unsafe impl<R: Sync> Sync for Slots<R> {}

impl<R: Real> Slots<R> {
    pub const fn new() -> Self {
        Self { values: Vec::new(), at: Vec::new(), width: 0 }
    }

    /// Memory for `slots` slots of `width` values; a list of places that fits already is kept.
    #[inline(always)]
    pub(super) fn reserve(&mut self, slots: usize, width: usize) {
        if self.width != width || self.at.len() < slots {
            self.lay_out(slots, width);
        }
    }

    #[inline(never)]
    fn lay_out(&mut self, slots: usize, width: usize) {
        if self.values.len() < slots * width {
            self.values.resize(slots * width, R::c(0.0));
        }
        let base = self.values.as_mut_ptr();
        self.at.clear();
        self.at.extend((0..slots).map(|s| base.wrapping_add(s * width)));
        self.width = width;
    }

    /// A slot's values where it has a single one.
    pub fn only(&self, slot: usize) -> &R {
        debug_assert_eq!(self.width, 1);
        &self.values[slot]
    }

    /// A slot's place in this memory.
    #[inline(always)]
    pub(super) fn own(&mut self, slot: usize) -> *mut R {
        self.values.as_mut_ptr().wrapping_add(slot * self.width)
    }
}
