//! Samples in one array, x fastest: f16, f32 or f64, kept as they were given.
//!
//! Halves are widened by shifting and one multiplication, which is exact and the same everywhere; the
//! interpolation runs in the precision of whoever asks.

use std::sync::Arc;

use half::f16;

use super::place;
use crate::{error::SceneError, real::Scalar};

/// Node values as they were given; nothing is rounded on the way in.
#[derive(Debug, Clone, PartialEq)]
pub enum GridValues {
    F16(Arc<Vec<f16>>),
    F32(Arc<Vec<f32>>),
    F64(Arc<Vec<f64>>),
}

/// A number that samples are stored as.
pub trait Sample: Copy + Send + Sync {
    fn wide<T: Scalar>(self) -> T;
}

impl Sample for f32 {
    #[inline(always)]
    fn wide<T: Scalar>(self) -> T {
        T::of(f64::from(self))
    }
}

impl Sample for f64 {
    #[inline(always)]
    fn wide<T: Scalar>(self) -> T {
        T::of(self)
    }
}

impl Sample for f16 {
    #[inline(always)]
    fn wide<T: Scalar>(self) -> T {
        let bits = u32::from(self.to_bits());
        // Exponent and fraction shifted into place are too small by 2^112, denormals included.
        let magnitude = f32::from_bits((bits & 0x7fff) << 13) * f32::from_bits(0x7780_0000);
        T::of(f64::from(f32::from_bits(magnitude.to_bits() | (bits & 0x8000) << 16)))
    }
}

/// Runs `$body` with `$v` as the slice of values, whatever their type.
macro_rules! with_values {
    ($values:expr, $v:ident => $body:expr) => {
        match $values {
            GridValues::F16($v) => $body,
            GridValues::F32($v) => $body,
            GridValues::F64($v) => $body,
        }
    };
}

impl GridValues {
    pub fn len(&self) -> usize {
        with_values!(self, v => v.len())
    }
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    pub fn nbytes(&self) -> u64 {
        with_values!(self, v => size_of_val(v.as_slice()) as u64)
    }
    /// The name of the type in files and in Python.
    pub fn dtype(&self) -> &'static str {
        match self {
            GridValues::F16(_) => "f16",
            GridValues::F32(_) => "f32",
            GridValues::F64(_) => "f64",
        }
    }
    #[inline(always)]
    pub fn at<T: Scalar>(&self, i: usize) -> T {
        with_values!(self, v => v[i].wide())
    }

    /// As many values as nodes, all finite.
    pub(super) fn check(&self, dims: [usize; 3]) -> Result<(), SceneError> {
        let bad = |message: String| Err(SceneError::new("texture", message));
        let count = dims.iter().try_fold(1usize, |a, &n| a.checked_mul(n));
        if count != Some(self.len()) {
            return bad(format!("got {} values for {dims:?} nodes, allowed: their product", self.len()));
        }
        let wrong = match self {
            GridValues::F16(v) => v.iter().position(|v| !v.is_finite()),
            GridValues::F32(v) => v.iter().position(|v| !v.is_finite()),
            GridValues::F64(v) => v.iter().position(|v| !v.is_finite()),
        };
        match wrong {
            Some(i) => bad(format!("value {} is not finite, allowed: finite numbers", place(i, dims))),
            None => Ok(()),
        }
    }

    /// Whether a value on the grid's faces is below 0.
    pub(super) fn cut(&self, [nx, ny, nz]: [usize; 3]) -> bool {
        let below = |x: usize, y: usize, z: usize| self.at::<f64>(x + nx * (y + ny * z)) < 0.0;
        let mut rows = (0..nz).flat_map(|z| (0..ny).map(move |y| (y, z)));
        rows.any(|(y, z)| {
            let whole = y == 0 || y == ny - 1 || z == 0 || z == nz - 1;
            if whole { (0..nx).any(|x| below(x, y, z)) } else { below(0, y, z) || below(nx - 1, y, z) }
        })
    }

    /// Rounded to halves, and the largest error that made; an error where a value is too large.
    pub fn to_f16(&self) -> Result<(GridValues, f64), SceneError> {
        let mut worst = 0f64;
        let mut out = Vec::new();
        reserve(&mut out, self.len())?;
        for i in 0..self.len() {
            let (value, error) = round(self.at::<f64>(i))?;
            worst = worst.max(error);
            out.push(value);
        }
        Ok((GridValues::F16(Arc::new(out)), worst))
    }
}

/// A half and its error.
pub(super) fn round(value: f64) -> Result<(f16, f64), SceneError> {
    let half = f16::from_f64(value);
    if !half.is_finite() {
        let message = format!("{value} does not fit float16, allowed: magnitudes up to {}", f16::MAX);
        return Err(SceneError::new("texture", message));
    }
    Ok((half, (half.to_f64() - value).abs()))
}

/// Room for `n` more values, or an error instead of an abort.
pub(super) fn reserve<T>(out: &mut Vec<T>, n: usize) -> Result<(), SceneError> {
    out.try_reserve_exact(n).map_err(|_| {
        let mib = (n as u64).saturating_mul(size_of::<T>() as u64) >> 20;
        SceneError::new("texture", format!("{mib} MiB are not to be had"))
    })
}
