//! Where a group of rays can be between two depths: a ball around their mean ray.
//!
//! A ray's point at depth t is `o + t d`. With the group's mean origin and direction, its offset from
//! the mean ray has a part along the direction (the bulge of a fan of unit rays) and a part across; both
//! grow linearly with t. Law: every point lies in the ball (tests below).

use std::array;

use sdfrs_core::{
    Real,
    eval::{Kernel, Lanes, Native, vectorise},
    prune::{Cell, Rod},
};

use super::{feed::Bundle, swarm::Swarm};

/// Rounding of offsets, in parts of them: more than f32's of three products and their sum.
const SLACK: f64 = 1e-6;
/// What rounding adds to a direction's offset: its numbers are rounded one by one.
const ROUNDED: f64 = 8.0 * f32::EPSILON as f64;

/// What a step along rays is shortened by, so that rounding cannot lengthen it.
pub const SHORTER: f64 = 1.0 - 1e-6;

/// How far rays are from their mean one.
#[derive(Debug, Clone, Copy, Default)]
pub struct Offsets<R> {
    /// Largest offset of an origin along the mean direction, and in all.
    pub along: R,
    pub apart: R,
    /// The same of a direction.
    pub bulge: R,
    pub spread: R,
}

impl<R: Real> Offsets<R> {
    /// The largest along the mean direction and in all, up to a depth.
    #[inline(always)]
    pub fn to(&self, depth: R) -> [R; 2] {
        [self.along + depth * self.bulge, self.apart + depth * self.spread]
    }

    /// How far from the mean ray's point at a depth a ball around it still holds all rays; negative where it does not even
    /// there. And how far they are apart.
    #[inline(always)]
    pub fn inside(&self, t: R, ball: R) -> [R; 2] {
        let [along, across] = self.to(t.abs() + ball);
        [(ball * ball - across * across).max(R::c(0.0)).sqrt() - along, across]
    }
}

/// The mean ray of a group, and how far the others are from it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Beam {
    origin: [f64; 3],
    direction: [f64; 3],
    /// The direction's unit vector.
    axis: [f32; 3],
    off: Offsets<f64>,
    /// Largest end of the rays.
    pub t_max: f64,
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Beam {
    /// The beam of all rays in some swarms; none where they have no direction in common.
    pub fn around<T: Native>(swarms: &[Swarm<T>]) -> Option<Self> {
        Self::of::<T, _>(|| swarms.iter().flat_map(Swarm::packs).map(|pack| &pack.rays))
    }

    /// The beam of all rays that lie between those of a bundle, as those of a planar source do between the corners of
    /// a rectangle.
    pub fn between<T: Native>(corners: &Bundle<T::Lanes>) -> Option<Self> {
        let beam = Self::of::<T, _>(|| std::iter::once(corners))?;
        // What lies within a cap does, and so does all between; a cap is smaller than half a sphere.
        let length = dot(beam.direction, beam.direction).sqrt();
        let wide = beam.off.spread >= 1.0;
        let bulge = beam.off.bulge.max((1.0 - length).abs()) + ROUNDED;
        let off = Offsets { bulge, spread: beam.off.spread + ROUNDED, ..beam.off };
        (!wide).then_some(Self { off, ..beam })
    }

    fn of<'a, T: Native, I: Iterator<Item = &'a Bundle<T::Lanes>>>(rays: impl Fn() -> I) -> Option<Self> {
        let mut extent = Extent::<T>::none();
        vectorise(Grow { rays: rays(), to: &mut extent });
        let middle = extent.middle();
        let [origin, direction] = middle.map(|v| v.map(T::f64));
        let length = dot(direction, direction).sqrt();
        if !(length > 0.0 && origin.iter().all(|v| v.is_finite())) {
            return None;
        }
        let unit = direction.map(|v| v / length);
        let mut far = [[T::Lanes::c(0.0); 2]; 2];
        vectorise(Reach { rays: rays(), middle, unit: unit.map(T::of), to: &mut far });
        // What rounding may have taken from offsets whose parts along the beam cancel.
        let most = |v: T::Lanes| (0..T::Lanes::WIDTH).map(|l| v.lane(l).f64()).fold(0.0, f64::max);
        let [[along, apart], [bulge, spread]] = far.map(|[along, apart]| {
            let apart = most(apart).sqrt() * (1.0 + SLACK);
            [most(along) + SLACK * apart, apart]
        });
        let t_max =
            (0..T::Lanes::WIDTH).map(|l| extent.t_max.lane(l).f64()).fold(f64::NEG_INFINITY, f64::max);
        let off = Offsets { along, apart, bulge, spread };
        Some(Self { origin, direction, axis: unit.map(|v| v as f32), off, t_max })
    }

    /// How wide the beam is at a depth.
    pub fn width(&self, t: f64) -> f64 {
        let [_, across] = self.off.to(t.abs());
        2.0 * across
    }

    /// A ball around all points between two depths.
    pub fn cell(&self, lo: f64, hi: f64) -> Cell {
        let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        let far = lo.abs().max(hi.abs());
        let centre: [f64; 3] = array::from_fn(|a| self.origin[a] + middle * self.direction[a]);
        let [along, across] = self.off.to(far);
        let along = along + half;
        let radius = (along * along + across * across).sqrt();
        // The centre as it is rounded, and points as any precision rounds them.
        let size = centre.iter().fold(radius, |s, c| s + c.abs());
        let noise = Cell::noise(size);
        let rod = Rod { axis: self.axis, along: (along + noise) as f32, across: (across + noise) as f32 };
        Cell { rod: Some(rod), ..Cell::ball(centre, radius, size) }
    }

    /// How far along the beam a ball of that radius around its axis at `t` clears all rays: the depth.
    pub fn clear_to(&self, t: f64, radius: f64) -> f64 {
        let [half, _] = self.off.inside(t, radius);
        t + half.max(0.0) * SHORTER
    }
}

/// Least and largest coordinates of origins and directions, and the largest end.
struct Extent<T: Native> {
    lo: [[T::Lanes; 3]; 2],
    hi: [[T::Lanes; 3]; 2],
    t_max: T::Lanes,
}

impl<T: Native> Extent<T> {
    fn none() -> Self {
        let (lo, hi) = (T::Lanes::splat(T::INFINITY), T::Lanes::splat(-T::INFINITY));
        Self { lo: [[lo; 3]; 2], hi: [[hi; 3]; 2], t_max: hi }
    }

    fn middle(&self) -> [[T; 3]; 2] {
        array::from_fn(|which| {
            array::from_fn(|a| {
                let (lo, hi) = (self.lo[which][a], self.hi[which][a]);
                let ends = (0..T::Lanes::WIDTH).fold((T::INFINITY, -T::INFINITY), |(least, most), l| {
                    (least.min(lo.lane(l)), most.max(hi.lane(l)))
                });
                // Halves first: the sum of two finite numbers may not be one.
                T::of(0.5) * ends.0 + T::of(0.5) * ends.1
            })
        })
    }
}

/// Takes all rays into an extent. Free lanes of a pack hold copies of one of its rays.
struct Grow<'a, T: Native, I> {
    rays: I,
    to: &'a mut Extent<T>,
}

impl<'b, T: Native, I: Iterator<Item = &'b Bundle<T::Lanes>>> Kernel for Grow<'_, T, I> {
    #[inline(always)]
    fn run(self) {
        let Extent { lo, hi, t_max } = self.to;
        for rays in self.rays {
            for a in 0..3 {
                lo[0][a] = lo[0][a].min(rays.origin[a]);
                hi[0][a] = hi[0][a].max(rays.origin[a]);
                lo[1][a] = lo[1][a].min(rays.direction[a]);
                hi[1][a] = hi[1][a].max(rays.direction[a]);
            }
            *t_max = t_max.max(rays.t_max);
        }
    }
}

/// Largest offset from the middle along a unit vector, and its largest square in all.
struct Reach<'a, T: Native, I> {
    rays: I,
    middle: [[T; 3]; 2],
    unit: [T; 3],
    to: &'a mut [[T::Lanes; 2]; 2],
}

impl<'b, T: Native, I: Iterator<Item = &'b Bundle<T::Lanes>>> Kernel for Reach<'_, T, I> {
    #[inline(always)]
    fn run(self) {
        let unit =
            [T::Lanes::splat(self.unit[0]), T::Lanes::splat(self.unit[1]), T::Lanes::splat(self.unit[2])];
        for rays in self.rays {
            for (which, v) in [&rays.origin, &rays.direction].into_iter().enumerate() {
                let middle = self.middle[which];
                let x = v[0] - T::Lanes::splat(middle[0]);
                let y = v[1] - T::Lanes::splat(middle[1]);
                let z = v[2] - T::Lanes::splat(middle[2]);
                let [along, apart] = &mut self.to[which];
                *along = along.max((x * unit[0] + y * unit[1] + z * unit[2]).abs());
                *apart = apart.max(x * x + y * y + z * z);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::{
        Tracer,
        camera::{Camera, Kind},
        march::{
            Pixel, Ray, Source,
            feed::{Feed, Wanted},
            order::Order,
            start::Start,
        },
        render::CameraRays,
        tracer::basic::Basic,
    };
    use sdfrs_core::Control;

    struct Fan(Vec<Ray<f32>>);
    impl Source<f32> for Fan {
        fn count(&self) -> usize {
            self.0.len()
        }
        fn ray(&self, i: usize) -> Ray<f32> {
            self.0[i]
        }
    }

    /// Rays around (1, 2, 3), fanned out by `spread`, from origins `apart`.
    fn fan(spread: f32, apart: f32) -> (Fan, Swarm<f32>) {
        let mut state = 9u64;
        let mut unit = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
        };
        let mut fan = Fan(Vec::new());
        for _ in 0..300 {
            let v: [f32; 3] = array::from_fn(|a| [0.3, -0.5, 0.8][a] + spread * unit());
            let length = v.iter().map(|x| x * x).sum::<f32>().sqrt();
            let origin = array::from_fn(|a| [1.0, 2.0, 3.0][a] + apart * unit());
            fan.0.push(Ray { origin, direction: v.map(|x| x / length), t_min: 0.0, t_max: 50.0 });
        }
        let wanted: Vec<Wanted> = (0..300).map(|i| Wanted { pixel: Pixel(i), place: i }).collect();
        let mut swarm = Swarm::default();
        swarm.fill::<Basic>(&mut Feed::new(&fan, &wanted, Start::unknown()), usize::MAX);
        (fan, swarm)
    }

    #[test]
    fn a_cell_holds_all_points_between_its_depths() {
        for (spread, apart) in [(0.0, 0.0), (0.01, 0.0), (0.3, 0.1), (0.0, 1.0)] {
            let (fan, swarm) = fan(spread, apart);
            let beam = Beam::around(std::slice::from_ref(&swarm)).unwrap();
            assert_eq!(beam.t_max, 50.0);
            for (lo, hi) in [(0.0, 0.5), (2.0, 2.25), (7.0, 40.0)] {
                let cell = beam.cell(lo, hi);
                let mut most: f64 = 0.0;
                for i in 0..300 {
                    for t in [lo, 0.5 * (lo + hi), hi].map(|t| t as f32) {
                        let from = |a: usize| fan.0[i].origin[a] + t * fan.0[i].direction[a];
                        let d: f64 = (0..3).map(|a| f64::from(from(a) - cell.centre[a]).powi(2)).sum();
                        most = most.max(d.sqrt());
                    }
                }
                assert!(most <= f64::from(cell.radius), "{spread} {apart} {lo} {hi}: {most} {}", cell.radius);
                assert!(f64::from(cell.radius) <= 2.2 * most + 1e-3, "loose: {most} {}", cell.radius);
            }
        }
    }

    #[test]
    fn what_a_ball_clears_lies_in_the_ball() {
        let (fan, swarm) = fan(0.05, 0.02);
        let beam = Beam::around(std::slice::from_ref(&swarm)).unwrap();
        for (t, radius) in [(1.0, 0.5), (3.0, 0.4), (3.0, 3.0), (10.0, 1.0)] {
            let to = beam.clear_to(t, radius);
            assert!(to >= t && to < t + radius);
            let cell = beam.cell(t, to);
            let axis: [f64; 3] = array::from_fn(|a| beam.origin[a] + t * beam.direction[a]);
            let off: f64 = (0..3).map(|a| (f64::from(cell.centre[a]) - axis[a]).powi(2)).sum();
            for i in 0..300 {
                let at = |a: usize| f64::from(fan.0[i].origin[a]) + to * f64::from(fan.0[i].direction[a]);
                let d: f64 = (0..3).map(|a| (at(a) - axis[a]).powi(2)).sum();
                assert!(to == t || d.sqrt() <= radius * (1.0 + 1e-6), "{t} {radius}: {d} {off}");
            }
        }
    }

    /// What lies between the corners of a picture lies in their beam.
    #[test]
    fn corners_hold_all_between_them() {
        for kind in [
            Kind::Pinhole { fov_deg: 4.0 },
            Kind::Pinhole { fov_deg: 120.0 },
            Kind::Orthographic { extent: 2.0 },
        ] {
            let (origin, target, up) = ([1.0, 2.0, 3.0], [0.1, 0.2, -0.3], [0.0, 1.0, 0.0]);
            let camera = Camera { kind, origin, target, up, width: 39, height: 30 };
            let rays = CameraRays::<f32>::new(&camera, &Tracer::Basic { guards: true }, 9.0).unwrap();
            let mut corners = Bundle::blank();
            let pixels = Order::in_blocks(&rays, [64, 16], &Control::new()).block(0).unwrap().corners();
            rays.bundle(&pixels, &mut corners);
            let beam = Beam::between::<f32>(&corners).unwrap();
            for ray in (0..rays.count()).map(|i| rays.ray(i)) {
                let off: [f64; 3] = array::from_fn(|a| f64::from(ray.direction[a]) - beam.direction[a]);
                let along = dot(off, beam.direction).abs() / dot(beam.direction, beam.direction).sqrt();
                assert!(
                    along <= beam.off.bulge && dot(off, off).sqrt() <= beam.off.spread,
                    "{kind:?}: {off:?}"
                );
            }
            for (lo, hi) in [(0.0, 0.1), (2.0, 2.25), (5.0, 9.0)] {
                let cell = beam.cell(lo, hi);
                let mut most: f64 = 0.0;
                for ray in (0..rays.count()).map(|i| rays.ray(i)) {
                    for t in [lo, 0.5 * (lo + hi), hi].map(|t| t as f32) {
                        let from = |a: usize| ray.origin[a] + t * ray.direction[a];
                        let d: f64 = (0..3).map(|a| f64::from(from(a) - cell.centre[a]).powi(2)).sum();
                        most = most.max(d.sqrt());
                    }
                }
                assert!(most <= f64::from(cell.radius), "{kind:?} {lo} {hi}: {most} {}", cell.radius);
                assert!(f64::from(cell.radius) <= 2.0 * most + 1e-3, "loose: {most} {}", cell.radius);
            }
        }
        // More than half a sphere has no cap.
        let (_, swarm) = fan(3.0, 0.0);
        assert!(Beam::between::<f32>(&swarm.packs()[0].rays).is_none());
    }
}
