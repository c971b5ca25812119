//! A truth value a lane: all bits of a word, or none.
//!
//! Words instead of `bool`s: LLVM keeps what comes from a comparison and goes into a choice in mask
//! registers, and the bits of a pack of bytes it would not.

use std::ops::{BitAnd, BitOr, Not};

/// What packs are compared to, and chosen by.
pub trait Truth: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    const ALL: Self;
    /// A bit a lane.
    fn bits(self) -> u32;
    /// Adds 1 to the counts of the lanes in which it holds.
    fn count(self, counts: &mut [u32]);
    /// The lanes whose count has come to `most`.
    fn at_least(counts: &[u32], most: u32) -> Self;
}

#[derive(Debug, Clone, Copy)]
pub struct Mask<const W: usize>(pub [u32; W]);

impl<const W: usize> BitAnd for Mask<W> {
    type Output = Self;
    #[inline(always)]
    fn bitand(mut self, o: Self) -> Self {
        lanes!(i in self: self.0[i] & o.0[i])
    }
}
impl<const W: usize> BitOr for Mask<W> {
    type Output = Self;
    #[inline(always)]
    fn bitor(mut self, o: Self) -> Self {
        lanes!(i in self: self.0[i] | o.0[i])
    }
}
impl<const W: usize> Not for Mask<W> {
    type Output = Self;
    #[inline(always)]
    fn not(mut self) -> Self {
        lanes!(i in self: !self.0[i])
    }
}

impl<const W: usize> Truth for Mask<W> {
    const ALL: Self = Mask([u32::MAX; W]);
    #[inline(always)]
    fn bits(self) -> u32 {
        let mut bits = 0;
        for i in 0..W {
            bits |= self.0[i] & 1 << i;
        }
        bits
    }
    #[inline(always)]
    fn count(self, counts: &mut [u32]) {
        // All bits are minus one.
        if let Some(counts) = counts.first_chunk_mut::<W>() {
            for i in 0..W {
                counts[i] = counts[i].wrapping_sub(self.0[i]);
            }
        }
    }
    #[inline(always)]
    fn at_least(counts: &[u32], most: u32) -> Self {
        let mut r = Mask([0; W]);
        if let Some(counts) = counts.first_chunk::<W>() {
            for i in 0..W {
                r.0[i] = if counts[i] >= most { u32::MAX } else { 0 };
            }
        }
        r
    }
}
