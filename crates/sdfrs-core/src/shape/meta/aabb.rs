//! Axis-aligned boxes, infinite where a solid is.

use crate::shape::value::Axis;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    pub lo: [f64; 3],
    pub hi: [f64; 3],
}

impl Aabb {
    pub const ALL: Self = Self { lo: [f64::NEG_INFINITY; 3], hi: [f64::INFINITY; 3] };

    pub fn centred(half: [f64; 3]) -> Self {
        Self { lo: half.map(|v| -v), hi: half }
    }
    pub fn of_points(points: &[[f64; 3]]) -> Self {
        let fold = |start: f64, f: fn(f64, f64) -> f64| {
            std::array::from_fn(|i| points.iter().map(|p| p[i]).fold(start, f))
        };
        Self { lo: fold(f64::INFINITY, f64::min), hi: fold(f64::NEG_INFINITY, f64::max) }
    }
    /// Half space below a plane: bounded along the axis its normal follows, if it follows one.
    pub fn below_plane(normal: &[f64; 3], point: &[f64; 3]) -> Self {
        let mut all = Self::ALL;
        for i in 0..3 {
            if normal[(i + 1) % 3] == 0.0 && normal[(i + 2) % 3] == 0.0 {
                if normal[i] > 0.0 {
                    all.hi[i] = point[i];
                } else {
                    all.lo[i] = point[i];
                }
            }
        }
        all
    }
    pub fn grown(&self, by: f64) -> Self {
        if !by.is_finite() {
            return Self::ALL;
        }
        Self { lo: self.lo.map(|v| v - by), hi: self.hi.map(|v| v + by) }
    }
    pub fn shifted(&self, by: &[f64; 3]) -> Self {
        Self {
            lo: std::array::from_fn(|i| self.lo[i] + by[i]),
            hi: std::array::from_fn(|i| self.hi[i] + by[i]),
        }
    }
    pub fn scaled(&self, by: &[f64; 3]) -> Self {
        Self {
            lo: std::array::from_fn(|i| self.lo[i] * by[i]),
            hi: std::array::from_fn(|i| self.hi[i] * by[i]),
        }
    }
    pub fn hull(&self, o: &Self) -> Self {
        Self {
            lo: std::array::from_fn(|i| self.lo[i].min(o.lo[i])),
            hi: std::array::from_fn(|i| self.hi[i].max(o.hi[i])),
        }
    }
    /// Common part; the first box where there is none.
    pub fn overlap(&self, o: &Self) -> Self {
        let both = Self {
            lo: std::array::from_fn(|i| self.lo[i].max(o.lo[i])),
            hi: std::array::from_fn(|i| self.hi[i].min(o.hi[i])),
        };
        if (0..3).all(|i| both.lo[i] <= both.hi[i]) { both } else { *self }
    }
    /// Box around the rotated box; `m` maps old to new coordinates.
    pub fn rotated(&self, m: &[[f64; 3]; 3]) -> Self {
        let end = |i: usize, low: bool| {
            (0..3)
                .filter(|&j| m[i][j] != 0.0)
                .map(|j| m[i][j] * if (m[i][j] > 0.0) == low { self.lo[j] } else { self.hi[j] })
                .sum()
        };
        Self { lo: std::array::from_fn(|i| end(i, true)), hi: std::array::from_fn(|i| end(i, false)) }
    }
    /// Largest distance of a point of the box from the third axis.
    pub fn radius(&self, a: Axis, b: Axis) -> f64 {
        let most = |i: Axis| self.lo[i as usize].abs().max(self.hi[i as usize].abs());
        most(a).hypot(most(b))
    }
    /// Box that stays the same under rotations in the plane of two axes.
    pub fn round(&self, a: Axis, b: Axis) -> Self {
        let (r, mut out) = (self.radius(a, b), *self);
        for i in [a as usize, b as usize] {
            (out.lo[i], out.hi[i]) = (-r, r);
        }
        out
    }
}
