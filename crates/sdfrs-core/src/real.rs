//! The only arithmetic vocabulary: every op kernel is written once against [`Real`] and runs on
//! scalars, packs of lanes, intervals and dual numbers.
//!
//! Law: no fused multiply-add anywhere (but inside a root that is rounded correctly, `lane/root.rs`, and by 1); min
//! and max are `if a < b {a} else {b}`.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::{
    crowd::{Crowd, Levels, Nearest},
    grid::{Grid, Step},
    math::Math,
};

/// A number an op kernel can work on.
pub trait Real:
    Copy
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    type S: Scalar;
    /// Whether it is values alone, without derivatives or bounds: any way to the same bits will do.
    const ONLY_VALUES: bool = false;
    fn splat(s: Self::S) -> Self;
    #[inline(always)]
    fn c(v: f64) -> Self {
        Self::splat(Self::S::of(v))
    }
    /// `self - o`. Where `FUSED`, as `self * one - o`, which is rounded once and has the same bits, but goes by the pipes
    /// that multiply: for loops that mostly add, on instruction sets that have it.
    #[inline(always)]
    fn less<const FUSED: bool>(self, o: Self, _one: Self) -> Self {
        self - o
    }
    fn min(self, o: Self) -> Self;
    fn max(self, o: Self) -> Self;
    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    fn floor(self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    /// Sines and cosines of three angles at once.
    #[inline(always)]
    fn sin_cos(p: [Self; 3]) -> ([Self; 3], [Self; 3]) {
        let [x, y, z] = p;
        ([x.sin(), y.sin(), z.sin()], [x.cos(), y.cos(), z.cos()])
    }
    fn exp(self) -> Self;
    fn ln(self) -> Self;
    fn atan2(self, x: Self) -> Self;
    /// `x` where `a < b`, else `y`.
    fn select_lt(a: Self, b: Self, x: Self, y: Self) -> Self;
    /// Whether `a < b` may hold anywhere; lets loops end early.
    fn any_lt(a: Self, b: Self) -> bool;
    /// Trilinear sample of a grid.
    fn sample(grid: &Grid, step: Step, p: [Self; 3]) -> Self;
    /// The sample and the slope of the interpolant.
    fn sample_gradient(grid: &Grid, step: Step, p: [Self; 3]) -> (Self, [Self; 3]);
    /// The nearest of a crowd's spheres: x, y, z, r.
    fn nearest(crowd: &Crowd, p: [Self; 3]) -> [Self; 4];
    #[inline(always)]
    fn sq(self) -> Self {
        self * self
    }
    #[inline(always)]
    fn len2(a: Self, b: Self) -> Self {
        (a.sq() + b.sq()).sqrt()
    }
    #[inline(always)]
    fn len3(a: Self, b: Self, c: Self) -> Self {
        (a.sq() + b.sq() + c.sq()).sqrt()
    }
    /// `self` multiplied by itself, `n` factors in all (at least one).
    #[inline(always)]
    fn power(self, n: u32) -> Self {
        let mut r = self;
        for _ in 1..n {
            r = r * self;
        }
        r
    }
    /// `(x + i y)^n` by squaring, `n` at least 1.
    #[inline(always)]
    fn complex_power(mut x: Self, mut y: Self, mut n: u32) -> (Self, Self) {
        while n & 1 == 0 && n > 0 {
            (x, y) = (x * x - y * y, (x + x) * y);
            n >>= 1;
        }
        let (mut a, mut b) = (x, y);
        while n > 1 {
            (x, y) = (x * x - y * y, (x + x) * y);
            n >>= 1;
            if n & 1 == 1 {
                (a, b) = (a * x - b * y, a * y + b * x);
            }
        }
        (a, b)
    }
    /// `self * s`.
    #[inline(always)]
    fn by(self, s: f64) -> Self {
        self * Self::c(s)
    }
    /// Where a point goes when its distance, its polar angle (from z) and its azimuth are raised to the
    /// power of, or multiplied by, `n`: the Mandelbulb's power.
    ///
    /// Angles are multiplied by complex powers: (z + i rho)^n carries r^n and n times the polar angle;
    /// the azimuth is kept of unit length.
    #[inline(always)]
    fn triplex_power(x: Self, y: Self, z: Self, n: u32) -> [Self; 3] {
        let rho = Self::len2(x, y);
        let (ca, sa, _) = Self::azimuth(x, y, rho);
        let (pz, prho) = Self::complex_power(z, rho, n);
        let (pc, ps) = Self::complex_power(ca, sa, n);
        [prho * pc, prho * ps, pz]
    }
    /// Cosine and sine of the azimuth, and `rho` or 1 where it is 0.
    #[inline(always)]
    fn azimuth(x: Self, y: Self, rho: Self) -> (Self, Self, Self) {
        let (zero, one) = (Self::c(0.0), Self::c(1.0));
        let safe = Self::select_lt(zero, rho, rho, one);
        (Self::select_lt(zero, rho, x / safe, one), y / safe, safe)
    }
    /// Whether `x^2 + y^2 + z^2 < r^2 * slack + tiny` may hold anywhere.
    #[inline(always)]
    fn reaches(x: Self, y: Self, z: Self, r: Self, slack: Self, tiny: Self) -> bool {
        Self::any_lt(x.sq() + y.sq() + z.sq(), r.sq() * slack + tiny)
    }
    #[inline(always)]
    fn clamp(self, lo: Self, hi: Self) -> Self {
        self.max(lo).min(hi)
    }
}

/// f32 or f64.
pub trait Scalar: Real<S = Self> + Math + PartialOrd + Default + Debug + Send + Sync + 'static {
    /// Spacing of numbers just above 1: `ulp(x) = EPS * |x|`.
    const EPS: Self;
    const INFINITY: Self;
    /// Largest finite number.
    const MAX: Self;
    /// A few times the rounding error of a number next to zero.
    const TINY: Self;
    fn of(v: f64) -> Self;
    fn f64(self) -> f64;
    /// `self * o - less`, rounded once.
    fn times_less(self, o: Self, less: Self) -> Self;
    fn is_finite(self) -> bool;
    fn is_nan(self) -> bool;
    /// A crowd's tree in this precision.
    fn levels(crowd: &Crowd) -> &Levels<Self>;
    /// The number of a cell: a whole number from 0 to 2^20, read from its digits next to a larger power of two (a
    /// conversion would ask whether it fits, lane by lane).
    fn cell(self) -> u32;
}

macro_rules! scalar {
    ($t:ty, $levels:ident) => {
        impl Scalar for $t {
            const EPS: Self = <$t>::EPSILON;
            const INFINITY: Self = <$t>::INFINITY;
            const MAX: Self = <$t>::MAX;
            const TINY: Self = <$t>::MIN_POSITIVE;
            #[inline(always)]
            fn of(v: f64) -> Self {
                v as $t
            }
            #[inline(always)]
            fn f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn times_less(self, o: Self, less: Self) -> Self {
                <$t>::mul_add(self, o, -less)
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                <$t>::is_finite(self)
            }
            #[inline(always)]
            fn is_nan(self) -> bool {
                <$t>::is_nan(self)
            }
            #[inline(always)]
            fn levels(crowd: &Crowd) -> &Levels<Self> {
                crowd.$levels()
            }
            #[inline(always)]
            fn cell(self) -> u32 {
                const UNITS: $t = (1u64 << (<$t>::MANTISSA_DIGITS - 1)) as $t;
                (self + UNITS).to_bits() as u32 & 0x3f_ffff
            }
        }

        impl Real for $t {
            const ONLY_VALUES: bool = true;
            type S = $t;
            #[inline(always)]
            fn splat(s: Self) -> Self {
                s
            }
            #[inline(always)]
            fn min(self, o: Self) -> Self {
                if self < o { self } else { o }
            }
            #[inline(always)]
            fn max(self, o: Self) -> Self {
                if self > o { self } else { o }
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$t>::abs(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }
            #[inline(always)]
            fn floor(self) -> Self {
                <$t>::floor(self)
            }
            #[inline(always)]
            fn sin(self) -> Self {
                self.m_sin()
            }
            #[inline(always)]
            fn cos(self) -> Self {
                self.m_cos()
            }
            #[inline(always)]
            fn exp(self) -> Self {
                self.m_exp()
            }
            #[inline(always)]
            fn ln(self) -> Self {
                self.m_ln()
            }
            #[inline(always)]
            fn atan2(self, x: Self) -> Self {
                self.m_atan2(x)
            }
            #[inline(always)]
            fn select_lt(a: Self, b: Self, x: Self, y: Self) -> Self {
                if a < b { x } else { y }
            }
            #[inline(always)]
            fn any_lt(a: Self, b: Self) -> bool {
                a < b
            }
            #[inline(always)]
            fn sample(grid: &Grid, step: Step, p: [Self; 3]) -> Self {
                grid.sample(p, step)
            }
            #[inline(always)]
            fn sample_gradient(grid: &Grid, step: Step, p: [Self; 3]) -> (Self, [Self; 3]) {
                grid.sample_gradient(p, step)
            }
            #[inline(always)]
            fn nearest(crowd: &Crowd, p: [Self; 3]) -> [Self; 4] {
                crowd.nearest(crowd.$levels(), p, Nearest::nobody()).sphere
            }
        }
    };
}

scalar!(f32, single);
scalar!(f64, double);
