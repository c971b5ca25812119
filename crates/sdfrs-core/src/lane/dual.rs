//! Forward-mode dual numbers: a value and its gradient. The value has the bits of plain evaluation.
//!
//! Where a kernel has a kink the derivative is that of the branch taken; at a zero length it is 0.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::{
    crowd::Crowd,
    grid::{Grid, Step},
    real::Real,
};

#[derive(Debug, Clone, Copy)]
#[repr(C)]
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

/// `w^n` with the bits of `complex_power`, and `n w^(n-1)` from the same squares, for w = x + i y.
#[inline(always)]
fn power_and_slope<R: Real>(mut x: R, mut y: R, n: u32) -> ((R, R), (R, R)) {
    let (one, zero) = (R::c(1.0), R::c(0.0));
    let (mut power, mut slope) = ((one, zero), (one, zero));
    let (mut bits, mut below) = (n, n.saturating_sub(1));
    let (mut first, mut first_below) = (true, true);
    loop {
        let times = |(a, b): (R, R)| (a * x - b * y, a * y + b * x);
        if bits & 1 == 1 {
            power = if first { (x, y) } else { times(power) };
            first = false;
        }
        if below & 1 == 1 {
            slope = if first_below { (x, y) } else { times(slope) };
            first_below = false;
        }
        (bits, below) = (bits >> 1, below >> 1);
        if bits == 0 {
            return (power, (slope.0.by(f64::from(n)), slope.1.by(f64::from(n))));
        }
        (x, y) = (x * x - y * y, (x + x) * y);
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
    fn nearest(crowd: &Crowd, p: [Self; 3]) -> [Self; 4] {
        let [x, y, z, r] = R::nearest(crowd, [p[0].0, p[1].0, p[2].0]);
        [Self::splat_lanes(x), Self::splat_lanes(y), Self::splat_lanes(z), Self::splat_lanes(r)]
    }
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
    fn sin_cos(p: [Self; 3]) -> ([Self; 3], [Self; 3]) {
        let (s, c) = R::sin_cos([p[0].0, p[1].0, p[2].0]);
        (each!(I => p[I].chain(s[I], c[I])), each!(I => p[I].chain(c[I], -s[I])))
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
    fn by(self, s: f64) -> Self {
        let s = R::c(s);
        self.chain(self.0 * s, s)
    }
    /// By the angles' own derivatives: a third less to do than by those of every intermediate value.
    #[inline(always)]
    fn triplex_power(x: Self, y: Self, z: Self, n: u32) -> [Self; 3] {
        let rho = R::len2(x.0, y.0);
        let (ca, sa, safe) = R::azimuth(x.0, y.0, rho);
        let ((pz, prho), (u, v)) = power_and_slope(z.0, rho, n);
        let (pc, ps) = R::complex_power(ca, sa, n);
        let turning = (prho / safe).by(f64::from(n));
        let slopes = each!(I => {
            let along = ca * x.1[I] + sa * y.1[I];
            let turn = (ca * y.1[I] - sa * x.1[I]) * turning;
            let out = u * along + v * z.1[I];
            [pc * out - ps * turn, ps * out + pc * turn, u * z.1[I] - v * along]
        });
        let value = [prho * pc, prho * ps, pz];
        each!(A => Dual(value[A], each!(I => slopes[I][A])))
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
