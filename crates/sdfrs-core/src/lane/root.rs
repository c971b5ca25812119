//! Square roots without the divider: eight f64 by AVX-512, the bits of the processor's own root.
//!
//! Computes `sqrt(a)` from the processor's reciprocal root of 14 bits, by a cubic step (Halley's, with Goldschmidt's
//! pair `g` -> `sqrt(a)`, `h` -> `1 / (2 sqrt(a))`) and one of Newton's. A divider takes 16 cycles for eight roots
//! and does nothing else meanwhile; beside it the multipliers have time for every fourth pack ([`EVERY`]).
//!
//! Departs from the house's ban on fused multiply-add: here alone it may be used, because the result is the correctly
//! rounded root, which no instruction set can do otherwise. For that the last step is taken twice, by a factor a
//! little too small and by one a little too large. The root lies between the two sums, and rounding is monotonic:
//! where both round to one number, that is the root rounded. Where they don't (one pack in thousands), and for
//! infinity, NaN, negative and very small numbers, the divider is asked.
//!
//! Law (tests below): bit for bit the processor's root, next to the halves between two roots above all.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

/// Of so many packs one goes without the divider: with one of two the multipliers would be what takes longest.
pub const EVERY: usize = 4;

/// Below, a remainder `a - g^2` could be no normal number.
#[cfg(target_arch = "x86_64")]
const SMALLEST: f64 = 1e-270;
/// `h` is made too small by so much: more than half of what `g` may be wrong, 2^-39.8 of it.
#[cfg(target_arch = "x86_64")]
const UNDER: f64 = 1.0 / (1_u64 << 40) as f64;
/// The larger factor exceeds the smaller one by so much: more than `UNDER` and what the smaller one leaves out,
/// 1.5 r^2 < 2^-27.3.
#[cfg(target_arch = "x86_64")]
const OVER: f64 = 1.0 / (1_u64 << 26) as f64;

/// Roots of eight numbers.
///
/// With y = (1 + e) / sqrt(a), |e| <= 2^-14 by the processor's promise: `r = 1/2 - g h` has |r| < 2^-13.99 and is
/// exact to a rounding, and sqrt(a) = g (1 - 2r)^-1/2 = g (1 + r + 1.5 r^2 + 2.5 r^3 ..), but for `UNDER / 2` and
/// half a rounding. After the cubic step `g` is therefore wrong by 2.5 r^3 + UNDER / 2 < 2^-39.8 of it at most. From
/// there sqrt(a) = g + d / (g + sqrt(a)) exactly, d = a - g^2; and 1 / (g + sqrt(a)) is 1 / (2 sqrt(a)) but for
/// 2^-40.8 of it, which is h (1 + r + 1.5 r^2 ..) (1 + UNDER). So `low = h (1 + r)` lies below it, and
/// `low (1 + OVER)` above it, with room for the roundings of `h`, `low` and `d`, 2^-53 each.
///
/// Where `a` is below `SMALLEST`: g = a, h = 0, low = 0, high = 1. A zero gives itself twice; any other number `g` and
/// `g + d`, which differ. NaN and the infinities make NaN, which differs from itself.
///
/// # Safety
/// The processor must have AVX-512 F.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
#[allow(unsafe_code)]
pub unsafe fn root(a: __m512d) -> __m512d {
    // SAFETY: arithmetic on registers, which the caller promises.
    unsafe {
        let (one, half) = (_mm512_set1_pd(1.0), _mm512_set1_pd(0.5));
        let usual = _mm512_cmp_pd_mask::<_CMP_GE_OQ>(a, _mm512_set1_pd(SMALLEST));
        let y = _mm512_rsqrt14_pd(a);
        let h = _mm512_maskz_mul_pd(usual, y, _mm512_set1_pd(0.5 - 0.5 * UNDER));
        let g = _mm512_mask_mul_pd(a, usual, a, y);
        let r = _mm512_fnmadd_pd(g, h, half);
        let series = _mm512_fmadd_pd(r, _mm512_set1_pd(1.5), one);
        let g = _mm512_fmadd_pd(_mm512_mul_pd(g, r), series, g);
        let low = _mm512_fmadd_pd(h, r, h);
        let high = _mm512_mask_mul_pd(one, usual, low, _mm512_set1_pd(1.0 + OVER));
        let d = _mm512_fnmadd_pd(g, g, a);
        let (root, other) = (_mm512_fmadd_pd(d, low, g), _mm512_fmadd_pd(d, high, g));
        if _mm512_cmp_pd_mask::<_CMP_NEQ_UQ>(root, other) != 0 {
            // Not to be computed before it is known to be needed.
            super::opaque();
            return _mm512_sqrt_pd(a);
        }
        root
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests;
