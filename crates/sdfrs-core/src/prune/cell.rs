//! Places in which a scene is pruned: balls, and the cylinders that rays fill inside them.

use super::{MARGIN, up};
use crate::crowd::Sieve;

/// A ball in world units.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cell {
    pub centre: [f32; 3],
    pub radius: f32,
    /// A cylinder around the same points, for what is asked in world units.
    pub rod: Option<Rod>,
}

/// Half a cylinder's length and its radius, around a unit axis.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rod {
    pub axis: [f32; 3],
    pub along: f32,
    pub across: f32,
}

impl Cell {
    /// A ball around points as any precision rounds them; they and the centre come from numbers up to `size`. One
    /// that is no number becomes infinite: in such a ball nothing is dropped.
    pub fn ball(centre: [f64; 3], radius: f64, size: f64) -> Self {
        let radius = radius + Self::noise(size);
        let radius = if radius.is_finite() { radius as f32 } else { f32::INFINITY };
        Self { centre: centre.map(|c| c as f32), radius, rod: None }
    }

    /// What rounding to f32 may add to a distance between numbers up to `size`.
    pub fn noise(size: f64) -> f64 {
        8.0 * f64::from(f32::EPSILON) * size
    }

    /// The largest coordinate of its points, and at least its radius.
    pub(super) fn far(&self) -> f32 {
        self.centre.iter().fold(self.radius, |most, c| most.max(c.abs() + self.radius))
    }

    /// Values above this are no hit in a cell that ends at the depth `far`: the threshold of a guarded hit,
    /// `max(eps, cone * t)` and what rounding adds to it.
    pub(super) fn threshold(&self, (eps, cone): (f64, f64), far: f64) -> f32 {
        let size = f64::from(self.centre.iter().fold(self.radius, |s, c| s.max(c.abs()))) + far;
        up(eps.max(cone * far).max(Self::noise(size)))
    }

    /// Which spheres may come nearer than `below` to the cylinder; all without one.
    pub(super) fn around(&self, below: f32) -> Around {
        let everything = Rod { axis: [0.0; 3], along: f32::INFINITY, across: f32::INFINITY };
        Around { centre: self.centre, rod: self.rod.unwrap_or(everything), below }
    }
}

/// What lies around a cell's cylinder.
#[derive(Clone, Copy)]
pub(super) struct Around {
    centre: [f32; 3],
    rod: Rod,
    below: f32,
}

impl Around {
    /// Whatever is asked.
    pub fn all() -> Self {
        Cell::default().around(f32::INFINITY)
    }
}

impl Sieve for Around {
    #[inline(always)]
    fn keeps(&self, [x, y, z, r]: [f32; 4]) -> bool {
        let Self { centre, rod: Rod { axis, along, across }, below } = *self;
        let (x, y, z, reach) = (x - centre[0], y - centre[1], z - centre[2], r + below);
        let far = x * axis[0] + y * axis[1] + z * axis[2];
        let size = x * x + y * y + z * z;
        let (long, wide) = ((along + reach) * (1.0 + MARGIN), (across + reach) * (1.0 + MARGIN));
        // What is not a number is kept.
        !((reach >= 0.0) & ((far.abs() > long) | (size - far * far > wide * wide + 1e-5 * size)))
    }
}
