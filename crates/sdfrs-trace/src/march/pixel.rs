//! Which ray of a source.

/// A picture's by column and row, 16 bits each, so that neighbours in a row are numbers in line; any other source's
/// by its number.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Pixel(pub u32);

impl Pixel {
    /// Columns and rows of a picture; more has none of its sides.
    pub const MOST: usize = 1 << 16;

    #[inline(always)]
    pub fn at(x: usize, y: usize) -> Self {
        Self((y << 16 | x) as u32)
    }
    #[inline(always)]
    pub fn x(self) -> u32 {
        self.0 & 0xffff
    }
    #[inline(always)]
    pub fn y(self) -> u32 {
        self.0 >> 16
    }
}
