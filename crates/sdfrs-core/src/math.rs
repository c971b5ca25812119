//! Sine, cosine, exponential, logarithm and arc tangent with the same bits on every machine.
//!
//! Only `+ - * /`, comparisons and bit operations are used: no fused multiply-add and no call into
//! the system's library, both of which change bits between processors. Every choice is a select on
//! values already computed, so that a loop over lanes becomes vector code.
//!
//! Sources: the reductions and the f32 polynomials for sin, cos, exp and atan are those of Cephes
//! (Moshier); ln in both precisions, and exp's and atan's f64 constants, follow fdlibm (Sun). The f64
//! cosine's polynomial is our own.
//!
//! Range. sin and cos are good to 2.6 ulp up to `|x|` = 1e4 (f32) and 1e6 (f64). From there up to
//! `TRIG_MAX` (2^20 and 2^40) they are the sine of an argument within one ulp of `x`; beyond it, where
//! neighbouring arguments are whole periods apart or nearly so, they are NaN: an honest "invalid"
//! instead of noise. The other functions cover their whole domain, subnormal numbers included.
//!
//! Law (tests below): at most 2.6 ulp in f32 and 2.5 in f64, special values as in IEEE 754.

mod rotation;

pub use rotation::{Matrix, rotation};

/// The transcendental functions of a floating-point type; NaN in, NaN out.
pub trait Math: Copy {
    /// Sine of an angle in radians.
    fn m_sin(self) -> Self;
    /// Cosine of an angle in radians.
    fn m_cos(self) -> Self;
    /// Sines and cosines of some angles, step by step side by side: each step would wait for the one before.
    fn m_sin_cos<const N: usize>(p: [Self; N]) -> ([Self; N], [Self; N]);
    /// e to the power of `self`; overflows to infinity and underflows to zero.
    fn m_exp(self) -> Self;
    /// Natural logarithm; minus infinity at zero, NaN below it.
    fn m_ln(self) -> Self;
    /// Angle of the point (`x`, `self`) in (-pi, pi], with the signed zeros of C's `atan2`.
    fn m_atan2(self, x: Self) -> Self;
}

/// `c0 + z*(c1 + z*(c2 + ...))`, written out so that no inner loop is left to the optimiser.
macro_rules! poly {
    ($z:expr; $c:expr) => { $c };
    ($z:expr; $c:expr, $($rest:expr),+) => { $c + $z * poly!($z; $($rest),+) };
}

macro_rules! math {
    ($T:ident, $U:ident, $k:ident) => {
        impl Math for $T {
            #[inline(always)]
            fn m_sin(self) -> Self {
                Self::m_sin_cos([self]).0[0]
            }

            #[inline(always)]
            fn m_cos(self) -> Self {
                Self::m_sin_cos([self]).1[0]
            }

            #[inline(always)]
            fn m_sin_cos<const N: usize>(p: [Self; N]) -> ([Self; N], [Self; N]) {
                let mut x = p;
                for i in 0..N {
                    x[i] = p[i].abs();
                }
                let (q, s, c) = $k::quarters(x);
                let (mut sin, mut cos) = (p, p);
                for i in 0..N {
                    let (v, w) = if q[i] & 1 == 0 { (s[i], c[i]) } else { (c[i], s[i]) };
                    // Bit 1 of the quadrant is the sign; the argument's own sign joins it (sin is odd).
                    let sign = ((q[i] << ($k::BITS - 2)) ^ p[i].to_bits()) & $k::SIGN;
                    sin[i] = $T::from_bits(v.to_bits() ^ sign);
                    let sign = (q[i].wrapping_add(1) << ($k::BITS - 2)) & $k::SIGN;
                    cos[i] = $T::from_bits(w.to_bits() ^ sign);
                }
                (sin, cos)
            }

            #[inline(always)]
            fn m_exp(self) -> Self {
                // Beyond the clamp the answer is infinity or zero anyway; a NaN passes both tests.
                let x = if self > $k::EXP_MAX { $k::EXP_MAX } else { self };
                let x = if x < $k::EXP_MIN { $k::EXP_MIN } else { x };
                let n = x * $k::LOG2_E + $k::MAGIC;
                let k = n - $k::MAGIC;
                let r = (x - k * $k::LN2_HI) - k * $k::LN2_LO;
                let y = $k::exp_small(r);
                // 2^k in two halves: k reaches past the largest exponent and into the subnormals,
                // and y * 2^(k/2) is always normal, so that only the last product rounds.
                let k = n.to_bits().wrapping_sub($k::MAGIC.to_bits()).wrapping_add(4 * $k::BIAS);
                let a = k >> 1;
                let b = k.wrapping_sub(a);
                let pow2 = |e: $U| $T::from_bits(e.wrapping_sub($k::BIAS) << $k::MANTISSA);
                y * pow2(a) * pow2(b)
            }

            #[inline(always)]
            fn m_ln(self) -> Self {
                let tiny = self < $T::MIN_POSITIVE;
                let x = if tiny { self * $k::TWO_POW } else { self };
                // x = m * 2^e with m in [sqrt(1/2), sqrt(2)), the exponent offset to stay positive.
                let t = x.to_bits().wrapping_sub($k::SQRT_HALF).wrapping_add($k::OFFSET << $k::MANTISSA);
                let e = t >> $k::MANTISSA;
                let m = x.to_bits().wrapping_sub(e.wrapping_sub($k::OFFSET) << $k::MANTISSA);
                let k = $T::from_bits($k::INT.to_bits() | e) - ($k::INT + $k::OFFSET as $T);
                let k = if tiny { k - $k::TWO_EXP } else { k };
                let f = $T::from_bits(m) - 1.0;
                let s = f / (2.0 + f);
                let half = 0.5 * f * f;
                let rest = s * (half + $k::ln_small(s * s));
                let y = k * $k::LN2_HI - ((half - (rest + k * $k::LN2_LO)) - f);
                let y = if self < $T::INFINITY { y } else { self };
                let y = if self > 0.0 { y } else { $T::NAN };
                if self == 0.0 { $T::NEG_INFINITY } else { y }
            }

            #[inline(always)]
            fn m_atan2(self, x: Self) -> Self {
                let (a, b) = (self.abs(), x.abs());
                let swap = a > b;
                let (small, large) = if swap { (b, a) } else { (a, b) };
                // The scale keeps the sum finite and the threshold out of the subnormals.
                let scale = if large > 1.0 { 0.5 } else { 16_777_216.0 };
                let (u, v) = (small * scale, large * scale);
                // atan(s/l) = pi/4 + atan((s-l)/(s+l)) keeps the polynomial's argument below 7/16.
                // Equal operands may be infinite.
                let steep = (u >= $k::STEEP * v) & (v > 0.0);
                let difference = if small == large { 0.0 } else { u - v };
                let (over, under) = if steep { (difference, u + v) } else { (small, large) };
                let under = if large == 0.0 { 1.0 } else { under };
                let w = over / under;
                let w = w - w * $k::atan_small(w * w);
                // The octants add a whole number of eighths of a turn and mirror w: counted first, so
                // that only one addition rounds.
                let (n, w) = if steep { (1.0, w) } else { (0.0, w) };
                let (n, w) = if swap { (2.0 - n, -w) } else { (n, w) };
                let left = x.to_bits() & $k::SIGN != 0;
                let (n, w) = if left { (4.0 - n, -w) } else { (n, w) };
                let low = if n == 3.0 { $k::PI_3_4_LO } else { n * $k::PI_4_LO };
                let r = n * $k::PI_4_HI + (w + low);
                let r = $T::from_bits(r.to_bits() | (self.to_bits() & $k::SIGN));
                if self.is_nan() | x.is_nan() { $T::NAN } else { r }
            }
        }

        impl $k {
            /// Quadrants, and sines and cosines of what remains of each `x` >= 0 after whole quarters of a turn.
            ///
            /// Every step is taken for all of them before the next one, which would wait for it otherwise.
            #[inline(always)]
            fn quarters<const N: usize>(x: [$T; N]) -> ([$U; N], [$T; N], [$T; N]) {
                let (mut q, mut k, mut r, mut z) = ([0; N], x, x, x);
                // Adding and taking away 1.5 * 2^MANTISSA rounds to nearest and leaves the integer in
                // the low bits. The products k * PI_2[i] are exact while k is below 2^13 (f32), 2^20.
                for i in 0..N {
                    let n = x[i] * Self::TWO_OVER_PI + Self::MAGIC;
                    (q[i], k[i]) = (n.to_bits(), n - Self::MAGIC);
                }
                for part in Self::PI_2 {
                    for i in 0..N {
                        r[i] -= k[i] * part;
                    }
                }
                for i in 0..N {
                    // Chosen here and not before: nothing else waits for the comparison.
                    r[i] = if x[i] <= Self::TRIG_MAX { r[i] } else { $T::NAN };
                    z[i] = r[i] * r[i];
                }
                let last = Self::TERMS - 1;
                let (mut s, mut c) = ([Self::SIN[last]; N], [Self::COS[last]; N]);
                for term in 1..Self::TERMS {
                    for i in 0..N {
                        s[i] = Self::SIN[last - term] + z[i] * s[i];
                        c[i] = Self::COS[last - term] + z[i] * c[i];
                    }
                }
                for i in 0..N {
                    s[i] = r[i] + r[i] * z[i] * s[i];
                    c[i] = Self::cosine(z[i], c[i]);
                }
                (q, s, c)
            }
        }
    };
}

struct Single;
struct Double;
math!(f32, u32, Single);
math!(f64, u64, Double);

// Digits beyond the type's own are the sources'; they document which constant is meant.
#[allow(clippy::excessive_precision, clippy::approx_constant)]
impl Single {
    const BITS: u32 = 32;
    const MANTISSA: u32 = 23;
    const SIGN: u32 = 1 << 31;
    const BIAS: u32 = 127;
    const MAGIC: f32 = 12_582_912.0;
    const TRIG_MAX: f32 = 1_048_576.0;
    const TWO_OVER_PI: f32 = 0.636_619_77;
    const EXP_MAX: f32 = 89.0;
    const EXP_MIN: f32 = -104.0;
    const LOG2_E: f32 = 1.442_695;
    const LN2_HI: f32 = 0.693_359_375;
    const LN2_LO: f32 = -2.121_944_4e-4;
    const SQRT_HALF: u32 = 0x3f35_04f3;
    const OFFSET: u32 = 128;
    const INT: f32 = 8_388_608.0;
    const TWO_POW: f32 = 33_554_432.0;
    const TWO_EXP: f32 = 25.0;
    const STEEP: f32 = 0.414_213_56;
    const PI_4_HI: f32 = 0.785_398_2;
    const PI_4_LO: f32 = -2.185_569_4e-8;
    const PI_3_4_LO: f32 = -5.962440319251527e-09;

    /// pi/2 in parts of 11, 11, 11 and 24 bits.
    const PI_2: [f32; 4] =
        [1.570_312_5, 4.837_512_969_970_703e-4, 7.549_533_620_476_723e-8, 2.563_344_151_594_519e-12];
    const TERMS: usize = 3;
    const SIN: [f32; 3] = [-1.6666654611e-1, 8.3321608736e-3, -1.9515295891e-4];
    const COS: [f32; 3] = [4.166664568298827e-2, -1.388731625493765e-3, 2.443315711809948e-5];
    #[inline(always)]
    fn cosine(z: f32, c: f32) -> f32 {
        (1.0 - 0.5 * z) + z * z * c
    }
    #[inline(always)]
    fn exp_small(r: f32) -> f32 {
        let p = poly!(r; 5.0000001201e-1, 1.6666665459e-1, 4.1665795894e-2, 8.3334519073e-3,
            1.3981999507e-3, 1.9875691500e-4);
        1.0 + (r + r * r * p)
    }
    #[inline(always)]
    fn ln_small(z: f32) -> f32 {
        z * poly!(z; 0.66666662693, 0.40000972152, 0.28498786688, 0.24279078841)
    }
    #[inline(always)]
    fn atan_small(z: f32) -> f32 {
        z * poly!(z; 3.33329491539e-1, -1.99777106478e-1, 1.38776856032e-1, -8.05374449538e-2)
    }
}

#[allow(clippy::excessive_precision, clippy::approx_constant)]
impl Double {
    const BITS: u32 = 64;
    const MANTISSA: u32 = 52;
    const SIGN: u64 = 1 << 63;
    const BIAS: u64 = 1023;
    const MAGIC: f64 = 6_755_399_441_055_744.0;
    const TRIG_MAX: f64 = 1_099_511_627_776.0;
    const TWO_OVER_PI: f64 = 0.636_619_772_367_581_4;
    const EXP_MAX: f64 = 710.0;
    const EXP_MIN: f64 = -746.0;
    const LOG2_E: f64 = 1.442_695_040_888_963_4;
    const LN2_HI: f64 = 6.931_471_803_691_238_164_90e-1;
    const LN2_LO: f64 = 1.908_214_929_270_587_700_02e-10;
    const SQRT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
    const OFFSET: u64 = 1024;
    const INT: f64 = 4_503_599_627_370_496.0;
    const TWO_POW: f64 = 18_014_398_509_481_984.0;
    const TWO_EXP: f64 = 54.0;
    const STEEP: f64 = 0.4375;
    const PI_4_HI: f64 = 0.785_398_163_397_448_3;
    const PI_4_LO: f64 = 3.061_616_997_868_383e-17;
    const PI_3_4_LO: f64 = 9.184850993605148e-17;

    /// pi/2 in parts of 33, 33 and 53 bits.
    const PI_2: [f64; 3] =
        [1.570_796_326_734_125_614_17, 6.077_100_506_303_965_976_60e-11, 2.022_266_248_795_950_631_54e-21];
    const TERMS: usize = 6;
    const SIN: [f64; 6] = [
        -1.66666666666666307295e-1,
        8.33333333332211858878e-3,
        -1.98412698295895385996e-4,
        2.75573136213857245213e-6,
        -2.50507477628578072866e-8,
        1.58962301576546568060e-10,
    ];
    /// The least relative error (Remez' exchange, the coefficients rounded one after the other) that six terms behind
    /// the 1 can have: 0.56 * 2^-53. fdlibm takes seven, for 2^-58.
    const COS: [f64; 6] = [
        -4.999999999999941e-1,
        4.1666666666487454e-2,
        -1.3888888870567436e-3,
        2.480157864246837e-5,
        -2.755524149253816e-7,
        2.0630589985661877e-9,
    ];
    #[inline(always)]
    fn cosine(z: f64, c: f64) -> f64 {
        1.0 + z * c
    }
    /// Taylor's series: its first left-out term, r^14/14!, is below 5e-18 for `|r|` <= ln(2)/2.
    #[inline(always)]
    fn exp_small(r: f64) -> f64 {
        let p = poly!(r; 1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0, 1.0 / 5040.0,
            1.0 / 40320.0, 1.0 / 362880.0, 1.0 / 3628800.0, 1.0 / 39916800.0, 1.0 / 479001600.0,
            1.0 / 6227020800.0);
        1.0 + (r + r * r * p)
    }
    #[inline(always)]
    fn ln_small(z: f64) -> f64 {
        z * poly!(z; 6.666666666666735130e-1, 3.999999999940941908e-1, 2.857142874366239149e-1,
            2.222219843214978396e-1, 1.818357216161805012e-1, 1.531383769920937332e-1,
            1.479819860511658591e-1)
    }
    #[inline(always)]
    fn atan_small(z: f64) -> f64 {
        z * poly!(z; 3.33333333333329318027e-1, -1.99999999998764832476e-1, 1.42857142725034663711e-1,
            -1.11111104054623557880e-1, 9.09088713343650656196e-2, -7.69187620504482999495e-2,
            6.66107313738753120669e-2, -5.83357013379057348645e-2, 4.97687799461593236017e-2,
            -3.65315727442169155270e-2, 1.62858201153657823623e-2)
    }
}

#[cfg(test)]
mod tests;
