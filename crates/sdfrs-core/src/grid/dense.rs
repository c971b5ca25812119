//! Samples in one array, x fastest: f16, f32 or f64, kept as they were given.
//!
//! Halves are widened by shifting and one multiplication, which is exact and the same everywhere; the
//! interpolation runs in the precision of whoever asks.

use std::sync::Arc;

use half::{
    f16,
    slice::{HalfBitsSliceExt, HalfFloatSliceExt},
    vec::HalfBitsVecExt,
};
use rayon::prelude::*;

use super::place;
use crate::{error::SceneError, lane, pool, real::Scalar};

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

    /// Two neighbours in each of four places: the first ones, and the second ones.
    ///
    /// # Safety
    /// Each place and the next one exist.
    #[inline(always)]
    #[allow(unsafe_code)]
    unsafe fn pairs(row: &[Self], at: [usize; 4]) -> [[Self; 4]; 2] {
        // SAFETY: the caller's promise.
        unsafe { lane::pairs(row, at) }
    }
}

impl Sample for f32 {
    #[inline(always)]
    fn wide<T: Scalar>(self) -> T {
        T::of(f64::from(self))
    }
    #[inline(always)]
    #[allow(unsafe_code)]
    unsafe fn pairs(row: &[Self], at: [usize; 4]) -> [[Self; 4]; 2] {
        // SAFETY: the caller's promise.
        unsafe { lane::pairs_f32(row, at) }
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
    pub(super) fn into_f16(self, stop: Stop) -> Result<(GridValues, f64), SceneError> {
        let (values, worst) = match self {
            GridValues::F16(_) => return Ok((self, 0.0)),
            GridValues::F32(v) => halves(Arc::unwrap_or_clone(v), stop)?,
            GridValues::F64(v) => {
                let (bits, worst) = trade(Arc::unwrap_or_clone(v), UNIT, stop, |_, v, out: &mut [u16]| {
                    v.iter().zip(out).fold(0.0, |m: f64, (v, bits)| {
                        let half = f16::from_f64(*v);
                        *bits = half.to_bits();
                        m.max((*v - half.wide::<f64>()).abs())
                    })
                })?;
                (bits.reinterpret_into(), worst)
            }
        };
        if worst.is_finite() { Ok((GridValues::F16(Arc::new(values)), worst)) } else { Err(too_large()) }
    }
}

/// Numbers a task converts.
const UNIT: usize = 1 << 12;

/// Numbers rounded to halves, and the largest error that made.
pub(super) fn halves(values: Vec<f32>, stop: Stop) -> Result<(Vec<f16>, f64), SceneError> {
    // As bits: the system hands out zeros of whole numbers alone without touching their pages.
    let (bits, worst) = trade(values, UNIT, stop, |_, v, out: &mut [u16]| {
        let out: &mut [f16] = out.reinterpret_cast_mut();
        out.convert_from_f32_slice(v);
        v.iter().zip(out).fold(0.0, |m: f32, (v, half)| m.max((*v - half.wide::<f32>()).abs())).into()
    })?;
    if worst.is_finite() { Ok((bits.reinterpret_into(), worst)) } else { Err(too_large()) }
}

fn too_large() -> SceneError {
    let message = format!("a value does not fit float16, allowed: magnitudes up to {}", f16::MAX);
    SceneError::new("texture", message)
}

/// Whether to give up.
pub type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// Other numbers for numbers, from the end, `unit` of them at a time; memory is given back on the way, so that both are
/// never there whole. `convert` gets a unit's place, and says how large its error was.
pub(super) fn trade<S: Copy + Send + Sync, D: Copy + Default + Send>(
    mut from: Vec<S>,
    unit: usize,
    stop: Stop,
    convert: impl Fn(usize, &[S], &mut [D]) -> f64 + Sync,
) -> Result<(Vec<D>, f64), SceneError> {
    let n = from.len();
    reserve(&mut Vec::<D>::new(), n)?;
    // Zeros cost nothing before their page is touched.
    let mut out = vec![D::default(); n];
    // Few portions: not every system gives memory back without copying what is left.
    let portion = (n / 64).max(1 << 20).next_multiple_of(unit);
    let mut worst = 0f64;
    while !from.is_empty() {
        if stop() {
            return Err(SceneError::new("texture", "cancelled"));
        }
        let first = (from.len() - 1) / portion * portion;
        let end = from.len();
        let one = |(i, (v, out)): (usize, (&[S], &mut [D]))| convert(first / unit + i, v, out);
        worst = worst.max(pool::install(|| {
            let units = from[first..].par_chunks(unit).zip(out[first..end].par_chunks_mut(unit));
            units.enumerate().map(one).reduce(|| 0.0, f64::max)
        }));
        from.truncate(first);
        from.shrink_to_fit();
    }
    Ok((out, worst))
}

/// Room for `n` more values, or an error instead of an abort.
pub(super) fn reserve<T>(out: &mut Vec<T>, n: usize) -> Result<(), SceneError> {
    out.try_reserve_exact(n).map_err(|_| {
        let mib = (n as u64).saturating_mul(size_of::<T>() as u64) >> 20;
        SceneError::new("texture", format!("{mib} MiB are not to be had"))
    })
}
