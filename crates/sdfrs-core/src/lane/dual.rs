//! Forward-mode dual numbers: a value and its gradient. The value has the bits of plain evaluation.
//!
//! Where a kernel has a kink the derivative is that of the branch taken; at a zero length it is 0.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::{
    grid::{Grid, Step},
    real::Real,
};

#[derive(Debug, Clone, Copy)]
pub struct Dual<R>(pub R, pub [R; 3]);

impl<R: Real> Dual<R> {
    /// The `axis`-th coordinate of the point itself.
    #[inline(always)]
    pub fn variable(v: R, axis: usize) -> Self {
        let mut d = [R::c(0.0); 3];
        d[axis] = R::c(1.0);
        Dual(v, d)
    }
    #[inline(always)]
    fn splat_lanes(v: R) -> Self {
        Dual(v, [R::c(0.0); 3])
    }
    #[inline(always)]
    fn chain(self, value: R, slope: R) -> Self {
        Dual(value, [self.1[0] * slope, self.1[1] * slope, self.1[2] * slope])
    }
}

/// The three derivatives, written out: closures and array maps leave copies through memory.
macro_rules! each {
    ($i:ident => $d:expr) => {
        [
            {
                const $i: usize = 0;
                $d
            },
            {
                const $i: usize = 1;
                $d
            },
            {
                const $i: usize = 2;
                $d
            },
        ]
    };
}

/// 1 / len, 0 where the length is 0: a length's gradient is (sum v_i dv_i) / len.
#[inline(always)]
fn inverse<R: Real>(len: R) -> R {
    let zero = R::c(0.0);
    R::select_lt(zero, len, R::c(1.0) / len, zero)
}

impl<R: Real> Add for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Dual(self.0 + o.0, [self.1[0] + o.1[0], self.1[1] + o.1[1], self.1[2] + o.1[2]])
    }
}

impl<R: Real> Sub for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Dual(self.0 - o.0, [self.1[0] - o.1[0], self.1[1] - o.1[1], self.1[2] - o.1[2]])
    }
}

// The rules of products and quotients mix operators.
#[allow(clippy::suspicious_arithmetic_impl)]
impl<R: Real> Mul for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Dual(self.0 * o.0, each!(I => self.1[I] * o.0 + o.1[I] * self.0))
    }
}

#[allow(clippy::suspicious_arithmetic_impl)]
impl<R: Real> Div for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let q = self.0 / o.0;
        let inv = R::c(1.0) / o.0;
        Dual(q, each!(I => (self.1[I] - q * o.1[I]) * inv))
    }
}

impl<R: Real> Neg for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Dual(-self.0, each!(I => -self.1[I]))
    }
}

impl<R: Real> Real for Dual<R> {
    type S = R::S;
    #[inline(always)]
    fn splat(s: R::S) -> Self {
        Dual(R::splat(s), [R::c(0.0); 3])
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Self::select_lt(self, o, self, o)
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Self::select_lt(o, self, self, o)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        let zero = R::c(0.0);
        let sign = R::select_lt(self.0, zero, R::c(-1.0), R::c(1.0));
        self.chain(self.0.abs(), sign)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let (s, zero) = (self.0.sqrt(), R::c(0.0));
        self.chain(s, R::select_lt(zero, s, R::c(0.5) / s, zero))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Dual(self.0.floor(), [R::c(0.0); 3])
    }
    #[inline(always)]
    fn sin(self) -> Self {
        self.chain(self.0.sin(), self.0.cos())
    }
    #[inline(always)]
    fn cos(self) -> Self {
        self.chain(self.0.cos(), -self.0.sin())
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let e = self.0.exp();
        self.chain(e, e)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        self.chain(self.0.ln(), R::c(1.0) / self.0)
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let (zero, n) = (R::c(0.0), self.0.sq() + x.0.sq());
        let inv = R::select_lt(zero, n, R::c(1.0) / n, zero);
        Dual(self.0.atan2(x.0), each!(I => (self.1[I] * x.0 - x.1[I] * self.0) * inv))
    }
    #[inline(always)]
    fn select_lt(a: Self, b: Self, x: Self, y: Self) -> Self {
        Dual(R::select_lt(a.0, b.0, x.0, y.0), each!(I => R::select_lt(a.0, b.0, x.1[I], y.1[I])))
    }
    #[inline(always)]
    fn any_lt(a: Self, b: Self) -> bool {
        R::any_lt(a.0, b.0)
    }
    #[inline(always)]
    fn sample(grid: &Grid, step: Step, p: [Self; 3]) -> Self {
        let (v, g) = R::sample_gradient(grid, step, [p[0].0, p[1].0, p[2].0]);
        Dual(v, each!(I => g[0] * p[0].1[I] + g[1] * p[1].1[I] + g[2] * p[2].1[I]))
    }
    #[inline(always)]
    fn sample_gradient(grid: &Grid, step: Step, p: [Self; 3]) -> (Self, [Self; 3]) {
        // Nobody asks for second derivatives: the slope counts as constant.
        let (_, g) = R::sample_gradient(grid, step, [p[0].0, p[1].0, p[2].0]);
        (Self::sample(grid, step, p), each!(I => Dual::splat_lanes(g[I])))
    }
    #[inline(always)]
    fn power(self, n: u32) -> Self {
        if n < 2 {
            return self;
        }
        let before = self.0.power(n - 1);
        self.chain(before * self.0, before * R::c(f64::from(n)))
    }
    #[inline(always)]
    fn complex_power(x: Self, y: Self, n: u32) -> (Self, Self) {
        if n < 2 {
            return (x, y);
        }
        // d(w^n) = n w^(n-1) dw; w^n itself by the plain route, for its bits.
        let (a, b) = R::complex_power(x.0, y.0, n);
        let (u, v) = R::complex_power(x.0, y.0, n - 1);
        let n = R::c(f64::from(n));
        let (u, v) = (u * n, v * n);
        (Dual(a, each!(I => u * x.1[I] - v * y.1[I])), Dual(b, each!(I => u * y.1[I] + v * x.1[I])))
    }
    #[inline(always)]
    fn reaches(x: Self, y: Self, z: Self, r: Self, slack: Self, tiny: Self) -> bool {
        R::reaches(x.0, y.0, z.0, r.0, slack.0, tiny.0)
    }
    #[inline(always)]
    fn len2(a: Self, b: Self) -> Self {
        let len = R::len2(a.0, b.0);
        let inv = inverse(len);
        let (u, v) = (a.0 * inv, b.0 * inv);
        Dual(len, each!(I => u * a.1[I] + v * b.1[I]))
    }
    #[inline(always)]
    fn len3(a: Self, b: Self, c: Self) -> Self {
        let len = R::len3(a.0, b.0, c.0);
        let inv = inverse(len);
        let (u, v, w) = (a.0 * inv, b.0 * inv, c.0 * inv);
        Dual(len, each!(I => u * a.1[I] + v * b.1[I] + w * c.1[I]))
    }
}
