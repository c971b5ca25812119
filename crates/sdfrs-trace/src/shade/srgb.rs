//! Linear light as 8 bits of sRGB: IEC 61966-2-1, looked up.
//!
//! A table holds the least linear value of each byte, found once from the formula by bisection; another
//! leads to a byte close below. A lookup costs a twentieth of the logarithm and the exponential. Law: the
//! formula's byte, wherever no threshold lies within rounding (tests below).

use std::sync::OnceLock;

use sdfrs_core::{Real, Scalar, math::Math};

/// Steps of the second table; the curve climbs less than a byte in one.
const STEPS: usize = 4096;

pub struct Srgb {
    /// Least linear value of each byte; the last one stops the search.
    least: [f64; 257],
    /// Byte of `(i - 1/2) / STEPS`, where the `i`-th step begins; as many as bits can name.
    near: [u8; 2 * STEPS],
}

impl Srgb {
    pub fn get() -> &'static Self {
        static TABLE: OnceLock<Srgb> = OnceLock::new();
        TABLE.get_or_init(Self::new)
    }

    fn new() -> Self {
        let mut least = [f64::INFINITY; 257];
        least[0] = f64::NEG_INFINITY;
        // Nothing is at least that, not even infinity.
        least[256] = f64::NAN;
        for (byte, least) in least.iter_mut().enumerate().take(256).skip(1) {
            let (mut lo, mut hi) = (0.0, 1.0);
            while let middle = 0.5 * (lo + hi)
                && lo < middle
                && middle < hi
            {
                if usize::from(formula(middle)) < byte { lo = middle } else { hi = middle }
            }
            *least = hi;
        }
        let mut table = Self { least, near: [0; 2 * STEPS] };
        let mut byte = 0u8;
        for i in 0..2 * STEPS {
            byte = table.from(byte, (i as f64 - 0.5) / STEPS as f64);
            table.near[i] = byte;
        }
        table
    }

    /// The byte of a linear value, `from` it or the byte before.
    #[inline(always)]
    fn from(&self, from: u8, linear: f64) -> u8 {
        from + u8::from(self.least[usize::from(from) + 1] <= linear)
    }

    /// One channel; below 0 is 0, above 1 is 255.
    pub fn byte<T: Scalar>(&self, linear: T) -> u8 {
        self.at(step(linear).cell(), linear)
    }

    /// The same, where the step is known.
    #[inline(always)]
    pub fn at<T: Scalar>(&self, step: u32, linear: T) -> u8 {
        self.from(self.near[step as usize % (2 * STEPS)], linear.f64())
    }
}

/// The nearest step to linear values, whose `cell` is its number. What is not a number becomes 0.
#[inline(always)]
pub fn step<R: Real>(linear: R) -> R {
    let steps = R::c(STEPS as f64);
    (linear.max(R::c(0.0)) * steps).min(steps)
}

/// A value from 0 to 1 as 8 bits; the cast saturates.
pub fn byte(v: f64) -> u8 {
    (v * 255.0 + 0.5) as u8
}

/// One channel as the standard has it.
fn formula(linear: f64) -> u8 {
    byte(if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * (linear.m_ln() / 2.4).m_exp() - 0.055 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_follows_the_standard() {
        let table = Srgb::get();
        for i in 0..=255u8 {
            let v = f64::from(i) / 255.0;
            let linear = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
            assert_eq!(table.byte(linear), i);
        }
        for v in [f64::INFINITY, 1e300, 1.0, 1.0 + 1e-9] {
            assert_eq!(table.byte(v), 255);
        }
        for v in [f64::NAN, f64::NEG_INFINITY, -1.0, -0.0, 0.0, 1e-300] {
            assert_eq!([table.byte(v), table.byte(v as f32)], [0; 2]);
        }
    }

    #[test]
    fn the_table_is_the_formula() {
        let table = Srgb::get();
        let mut seen = [false; 256];
        for i in 0..200_000 {
            let linear = f64::from(i) * 5.1e-6;
            let byte = table.byte(linear);
            seen[usize::from(byte)] = true;
            assert_eq!(byte, formula(linear), "{linear}");
            let single = linear as f32;
            assert_eq!(table.byte(single), formula(single.into()), "{single}");
        }
        assert!(seen.iter().all(|s| *s));
    }
}
