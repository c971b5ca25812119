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
    fn chain(self, value: R, slope: R) -> Self {
        Dual(value, self.1.map(|d| d * slope))
    }
    /// Gradient of a length: (sum v_i dv_i) / len, 0 where the length is 0.
    #[inline(always)]
    fn over_length<const N: usize>(v: [Self; N], len: R) -> Self {
        let zero = R::c(0.0);
        let inv = R::select_lt(zero, len, R::c(1.0) / len, zero);
        let mut d = [zero; 3];
        for a in v {
            for (d, da) in d.iter_mut().zip(a.1) {
                *d = *d + a.0 * da;
            }
        }
        Dual(len, d.map(|d| d * inv))
    }
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
        let d = |i: usize| self.1[i] * o.0 + o.1[i] * self.0;
        Dual(self.0 * o.0, [d(0), d(1), d(2)])
    }
}

#[allow(clippy::suspicious_arithmetic_impl)]
impl<R: Real> Div for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let q = self.0 / o.0;
        let d = |i: usize| (self.1[i] - q * o.1[i]) / o.0;
        Dual(q, [d(0), d(1), d(2)])
    }
}

impl<R: Real> Neg for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Dual(-self.0, self.1.map(|d| -d))
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
        let d = |i: usize| (self.1[i] * x.0 - x.1[i] * self.0) * inv;
        Dual(self.0.atan2(x.0), [d(0), d(1), d(2)])
    }
    #[inline(always)]
    fn select_lt(a: Self, b: Self, x: Self, y: Self) -> Self {
        let pick = |x: R, y: R| R::select_lt(a.0, b.0, x, y);
        Dual(pick(x.0, y.0), [pick(x.1[0], y.1[0]), pick(x.1[1], y.1[1]), pick(x.1[2], y.1[2])])
    }
    #[inline(always)]
    fn any_lt(a: Self, b: Self) -> bool {
        R::any_lt(a.0, b.0)
    }
    #[inline(always)]
    fn sample(grid: &Grid, step: Step, p: [Self; 3]) -> Self {
        let (v, g) = R::sample_gradient(grid, step, p.map(|a| a.0));
        let d = |i: usize| g[0] * p[0].1[i] + g[1] * p[1].1[i] + g[2] * p[2].1[i];
        Dual(v, [d(0), d(1), d(2)])
    }
    #[inline(always)]
    fn sample_gradient(grid: &Grid, step: Step, p: [Self; 3]) -> (Self, [Self; 3]) {
        // Nobody asks for second derivatives: the slope counts as constant.
        let (_, g) = R::sample_gradient(grid, step, p.map(|a| a.0));
        (Self::sample(grid, step, p), g.map(|g| Dual(g, [R::c(0.0); 3])))
    }
    #[inline(always)]
    fn len2(a: Self, b: Self) -> Self {
        Self::over_length([a, b], R::len2(a.0, b.0))
    }
    #[inline(always)]
    fn len3(a: Self, b: Self, c: Self) -> Self {
        Self::over_length([a, b, c], R::len3(a.0, b.0, c.0))
    }
}
