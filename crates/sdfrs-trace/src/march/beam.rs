//! Where a group of rays can be between two depths: a ball around their mean ray.
//!
//! A ray's point at depth t is `o + t d`. With the group's mean origin and direction, its offset from
//! the mean ray has a part along the direction (the bulge of a fan of unit rays) and a part across; both
//! grow linearly with t. Law: every point lies in the ball (tests below).

use sdfrs_core::{eval::Native, prune::Cell};

use super::swarm::Swarm;

/// The mean ray of a group, and how far the others are from it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Beam {
    origin: [f64; 3],
    direction: [f64; 3],
    /// Largest offset of an origin along the mean direction, and in all.
    along: f64,
    apart: f64,
    /// The same of a direction.
    bulge: f64,
    spread: f64,
    /// Largest end of the rays.
    pub t_max: f64,
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Beam {
    /// The beam of the rays that are under way in some swarms; none where there are none.
    pub fn around<'a, T: Native>(swarms: impl Iterator<Item = &'a Swarm<T>> + Clone) -> Option<Self> {
        let mut lo = [[f64::INFINITY; 3]; 2];
        let mut hi = [[f64::NEG_INFINITY; 3]; 2];
        for swarm in swarms.clone() {
            for (which, columns) in [&swarm.origin, &swarm.direction].into_iter().enumerate() {
                for a in 0..3 {
                    let (least, most) = extent(&columns[a]);
                    lo[which][a] = lo[which][a].min(least.f64());
                    hi[which][a] = hi[which][a].max(most.f64());
                }
            }
        }
        let middle = |w: usize| -> [f64; 3] { std::array::from_fn(|a| 0.5 * (lo[w][a] + hi[w][a])) };
        let (origin, direction) = (middle(0), middle(1));
        let mut beam = Self { origin, direction, t_max: f64::NEG_INFINITY, ..Self::default() };
        let length = dot(beam.direction, beam.direction).sqrt();
        if !(length > 0.0 && beam.origin.iter().all(|v| v.is_finite())) {
            return None;
        }
        let unit = beam.direction.map(|v| v / length);
        for swarm in swarms {
            let (along, apart) = farthest(&swarm.origin, beam.origin, unit);
            let (bulge, spread) = farthest(&swarm.direction, beam.direction, unit);
            beam.along = beam.along.max(along);
            beam.apart = beam.apart.max(apart);
            beam.bulge = beam.bulge.max(bulge);
            beam.spread = beam.spread.max(spread);
            beam.t_max = beam.t_max.max(extent(&swarm.t_max).1.f64());
        }
        Some(beam)
    }

    /// How wide the beam is at a depth.
    pub fn width(&self, t: f64) -> f64 {
        2.0 * (self.apart + t.abs() * self.spread)
    }

    /// A ball around all points between two depths.
    pub fn cell(&self, lo: f64, hi: f64) -> Cell {
        let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        let far = lo.abs().max(hi.abs());
        let centre: [f64; 3] = std::array::from_fn(|a| self.origin[a] + middle * self.direction[a]);
        let along = self.along + half + far * self.bulge;
        let radius = along.hypot(self.apart + far * self.spread);
        let centre32 = centre.map(|c| c as f32);
        // The centre as it is rounded, and points as any precision rounds them.
        let size = centre.iter().fold(radius, |s, c| s + c.abs());
        Cell { centre: centre32, radius: (radius + 8.0 * f64::from(f32::EPSILON) * size) as f32 }
    }

    /// How far along the beam a ball of that radius around its axis at `t` clears all rays: the depth.
    pub fn clear_to(&self, t: f64, radius: f64) -> f64 {
        let across = self.apart + (t.abs() + radius) * self.spread;
        let along = self.along + (t.abs() + radius) * self.bulge;
        let half = (radius * radius - across * across).max(0.0).sqrt() - along;
        t + half.max(0.0) * (1.0 - 1e-6)
    }
}

/// Least and largest number.
fn extent<T: Native>(v: &[T]) -> (T, T) {
    let mut lanes = [(T::INFINITY, -T::INFINITY); 16];
    for chunk in v.chunks(16) {
        for (lane, x) in lanes.iter_mut().zip(chunk) {
            *lane = (lane.0.min(*x), lane.1.max(*x));
        }
    }
    lanes.into_iter().fold((T::INFINITY, -T::INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Largest offset from a centre along a unit vector, and in all.
fn farthest<T: Native>(v: &[Vec<T>; 3], centre: [f64; 3], unit: [f64; 3]) -> (f64, f64) {
    let (mut along, mut apart) = ([0f64; 8], [0f64; 8]);
    for ((x, y), z) in v[0].chunks(8).zip(v[1].chunks(8)).zip(v[2].chunks(8)) {
        for l in 0..x.len() {
            let d = [x[l].f64() - centre[0], y[l].f64() - centre[1], z[l].f64() - centre[2]];
            along[l] = along[l].max(dot(d, unit).abs());
            apart[l] = apart[l].max(dot(d, d));
        }
    }
    let most = |v: [f64; 8]| v.into_iter().fold(0.0, f64::max);
    (most(along), most(apart).sqrt())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::march::Ray;

    /// Rays around (1, 2, 3), fanned out by `spread`, from origins `apart`.
    fn swarm(spread: f32, apart: f32) -> Swarm<f32> {
        let mut state = 9u64;
        let mut unit = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
        };
        let mut swarm = Swarm::default();
        for id in 0..300 {
            let v: [f32; 3] = std::array::from_fn(|a| [0.3, -0.5, 0.8][a] + spread * unit());
            let length = v.iter().map(|x| x * x).sum::<f32>().sqrt();
            let origin = std::array::from_fn(|a| [1.0, 2.0, 3.0][a] + apart * unit());
            swarm.push(&Ray { origin, direction: v.map(|x| x / length), t_min: 0.0, t_max: 50.0 }, id);
        }
        swarm.start();
        swarm
    }

    #[test]
    fn a_cell_holds_all_points_between_its_depths() {
        for (spread, apart) in [(0.0, 0.0), (0.01, 0.0), (0.3, 0.1), (0.0, 1.0)] {
            let swarm = swarm(spread, apart);
            let beam = Beam::around(std::iter::once(&swarm)).unwrap();
            assert_eq!(beam.t_max, 50.0);
            for (lo, hi) in [(0.0, 0.5), (2.0, 2.25), (7.0, 40.0)] {
                let cell = beam.cell(lo, hi);
                let mut most: f64 = 0.0;
                for i in 0..300 {
                    for t in [lo, 0.5 * (lo + hi), hi].map(|t| t as f32) {
                        let from = |a: usize| swarm.origin[a][i] + t * swarm.direction[a][i];
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
        let swarm = swarm(0.05, 0.02);
        let beam = Beam::around(std::iter::once(&swarm)).unwrap();
        for (t, radius) in [(1.0, 0.5), (3.0, 0.4), (3.0, 3.0), (10.0, 1.0)] {
            let to = beam.clear_to(t, radius);
            assert!(to >= t && to < t + radius);
            let cell = beam.cell(t, to);
            let axis: [f64; 3] = std::array::from_fn(|a| beam.origin[a] + t * beam.direction[a]);
            let off: f64 = (0..3).map(|a| (f64::from(cell.centre[a]) - axis[a]).powi(2)).sum();
            for i in 0..300 {
                let at = |a: usize| f64::from(swarm.origin[a][i]) + to * f64::from(swarm.direction[a][i]);
                let d: f64 = (0..3).map(|a| (at(a) - axis[a]).powi(2)).sum();
                assert!(to == t || d.sqrt() <= radius * (1.0 + 1e-6), "{t} {radius}: {d} {off}");
            }
        }
    }
}
