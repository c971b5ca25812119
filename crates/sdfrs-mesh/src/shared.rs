//! One array, written by many tasks in places of their own.

use std::marker::PhantomData;

/// A slice that tasks share for writing.
#[derive(Clone, Copy)]
pub struct Shared<'a> {
    first: *mut f32,
    len: usize,
    life: PhantomData<&'a mut [f32]>,
}

// SAFETY: `write` and `copy` are the only accesses, and their callers answer for the places.
#[allow(unsafe_code)]
unsafe impl Send for Shared<'_> {}
#[allow(unsafe_code)]
unsafe impl Sync for Shared<'_> {}

impl<'a> Shared<'a> {
    pub fn new(values: &'a mut [f32]) -> Self {
        Self { first: values.as_mut_ptr(), len: values.len(), life: PhantomData }
    }

    /// # Safety
    /// No other task writes these places.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub unsafe fn write(&self, at: usize, values: &[f32]) {
        assert!(at <= self.len && values.len() <= self.len - at, "written past the end of the grid");
        // SAFETY: inside the array, which is borrowed for as long as `self` lives; alone there by the contract.
        unsafe { std::ptr::copy_nonoverlapping(values.as_ptr(), self.first.add(at), values.len()) }
    }

    /// # Safety
    /// No other task writes either place.
    #[inline(always)]
    #[allow(unsafe_code)]
    pub unsafe fn copy(&self, from: usize, to: usize) {
        assert!(from < self.len && to < self.len, "outside of the grid");
        // SAFETY: as above.
        unsafe { *self.first.add(to) = *self.first.add(from) }
    }
}
