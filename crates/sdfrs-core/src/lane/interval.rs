//! Intervals in f64, rounded outwards by one ulp an operation: every value of an op over operands
//! inside lies inside the result (law: property test in tests/laws).

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::{
    crowd::Crowd,
    grid::{Grid, Step},
    real::Real,
};

/// All numbers from `lo` to `hi`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Iv {
    pub lo: f64,
    pub hi: f64,
}

impl Iv {
    pub const ALL: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    pub fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }
    /// Widened by an ulp at both ends; anything undefined becomes everything.
    fn out(lo: f64, hi: f64) -> Self {
        if lo.is_nan() || hi.is_nan() { Self::ALL } else { Self { lo: lo.next_down(), hi: hi.next_up() } }
    }
    /// Own polynomials err by up to 2.6 ulp: four are kept free.
    fn out4(lo: f64, hi: f64) -> Self {
        let a = Self::out(lo, hi);
        let a = Self::out(a.lo, a.hi);
        let a = Self::out(a.lo, a.hi);
        Self::out(a.lo, a.hi)
    }
    fn hull(v: [f64; 4]) -> Self {
        if v.iter().any(|v| v.is_nan()) {
            return Self::ALL;
        }
        Self::out(
            v.into_iter().fold(f64::INFINITY, f64::min),
            v.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }
    /// Largest magnitude.
    pub fn mag(self) -> f64 {
        f64::max(self.lo.abs(), self.hi.abs())
    }
    pub fn contains(self, v: f64) -> bool {
        self.lo <= v && v <= self.hi
    }
    /// A sine shifted by `phase` quarter turns.
    fn wave(self, phase: f64) -> Self {
        use std::f64::consts::{FRAC_PI_2, TAU};
        if !(self.hi - self.lo < TAU) || self.mag() > 1e6 {
            return Self::new(-1.0, 1.0);
        }
        let (a, b) = (self.lo + phase * FRAC_PI_2, self.hi + phase * FRAC_PI_2);
        // A peak at pi/2 + k tau, a trough at -pi/2 + k tau; the margin covers rounding of the shift.
        let has = |at: f64| ((b - at + 1e-9) / TAU).floor() > ((a - at - 1e-9) / TAU).floor();
        let (x, y) = (a.sin(), b.sin());
        let wide = Self::out(f64::min(x, y) - 1e-9, f64::max(x, y) + 1e-9);
        Self {
            lo: if has(-FRAC_PI_2) { -1.0 } else { wide.lo.max(-1.0) },
            hi: if has(FRAC_PI_2) { 1.0 } else { wide.hi.min(1.0) },
        }
    }
}

impl Add for Iv {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self::out(self.lo + o.lo, self.hi + o.hi)
    }
}

impl Sub for Iv {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self::out(self.lo - o.hi, self.hi - o.lo)
    }
}

impl Mul for Iv {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        // 0 * inf counts as 0: an end at infinity stands for arbitrarily large finite values.
        let m = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        Self::hull([m(self.lo, o.lo), m(self.lo, o.hi), m(self.hi, o.lo), m(self.hi, o.hi)])
    }
}

impl Div for Iv {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        if o.contains(0.0) {
            return Self::ALL;
        }
        let d = |a: f64, b: f64| if b.is_infinite() { 0.0 } else { a / b };
        Self::hull([d(self.lo, o.lo), d(self.lo, o.hi), d(self.hi, o.lo), d(self.hi, o.hi)])
    }
}

impl Neg for Iv {
    type Output = Self;
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

impl Real for Iv {
    type S = f64;
    /// Some sphere: intervals ask unions, not crowds.
    fn nearest(_crowd: &Crowd, _p: [Self; 3]) -> [Self; 4] {
        [Self::ALL; 4]
    }
    fn splat(s: f64) -> Self {
        Self { lo: s, hi: s }
    }
    fn min(self, o: Self) -> Self {
        Self { lo: f64::min(self.lo, o.lo), hi: f64::min(self.hi, o.hi) }
    }
    fn max(self, o: Self) -> Self {
        Self { lo: f64::max(self.lo, o.lo), hi: f64::max(self.hi, o.hi) }
    }
    fn abs(self) -> Self {
        if self.lo >= 0.0 {
            self
        } else if self.hi <= 0.0 {
            -self
        } else {
            Self { lo: 0.0, hi: self.mag() }
        }
    }
    fn sqrt(self) -> Self {
        let r = Self::out(f64::max(self.lo, 0.0).sqrt(), f64::max(self.hi, 0.0).sqrt());
        Self { lo: r.lo.max(0.0), hi: r.hi }
    }
    fn floor(self) -> Self {
        Self { lo: self.lo.floor(), hi: self.hi.floor() }
    }
    fn sin(self) -> Self {
        self.wave(0.0)
    }
    fn cos(self) -> Self {
        self.wave(1.0)
    }
    fn exp(self) -> Self {
        let r = Self::out4(self.lo.exp(), self.hi.exp());
        Self { lo: r.lo.max(0.0), hi: r.hi }
    }
    fn ln(self) -> Self {
        if self.hi < 0.0 { Self::ALL } else { Self::out4(f64::max(self.lo, 0.0).ln(), self.hi.ln()) }
    }
    fn atan2(self, x: Self) -> Self {
        use std::f64::consts::PI;
        // Across the cut on the negative x axis, or around the origin, all angles are possible.
        if x.lo <= 0.0 && self.contains(0.0) {
            return Self::out4(-PI, PI);
        }
        let v = [self.lo.atan2(x.lo), self.lo.atan2(x.hi), self.hi.atan2(x.lo), self.hi.atan2(x.hi)];
        let h = Self::hull(v);
        Self::out4(h.lo, h.hi)
    }
    fn select_lt(a: Self, b: Self, x: Self, y: Self) -> Self {
        if a.hi < b.lo {
            x
        } else if a.lo >= b.hi {
            y
        } else {
            Self { lo: f64::min(x.lo, y.lo), hi: f64::max(x.hi, y.hi) }
        }
    }
    fn any_lt(a: Self, b: Self) -> bool {
        !(a.lo >= b.hi)
    }
    fn sample(grid: &Grid, step: Step, p: [Self; 3]) -> Self {
        let (lo, hi) = grid.range(p.map(|a| [a.lo, a.hi]), step);
        Self::out4(lo, hi)
    }
    fn sample_gradient(grid: &Grid, step: Step, p: [Self; 3]) -> (Self, [Self; 3]) {
        (Self::sample(grid, step, p), [Self::ALL; 3])
    }
    fn sq(self) -> Self {
        let a = self.abs();
        let r = Self::out(a.lo * a.lo, a.hi * a.hi);
        Self { lo: r.lo.max(0.0), hi: r.hi }
    }
}
