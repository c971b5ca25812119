//! Where the rays of a rectangle of pixels can be between two depths: a ball around their mean ray.
//!
//! A camera's directions fill the spherical quadrangle of its corners' directions, and a cap around the mean
//! that holds the corners holds it all; origins without perspective fill a plane rectangle. So four rays
//! bound all of them. Twin: `sdfrs_trace::march::beam`, which has every ray at hand. Law: every point lies
//! in the ball (tests below).

use sdfrs_core::prune::Cell;
use sdfrs_trace::camera::Frame;

/// Pixels `x..x + width` by `y..y + height`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rect {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

/// The mean ray of a rectangle, and how far the others are from it.
#[derive(Debug, Clone, Copy)]
pub struct Beam {
    origin: [f64; 3],
    direction: [f64; 3],
    /// Largest offset of an origin.
    apart: f64,
    /// The same of a direction: along the mean one, and in all.
    bulge: f64,
    spread: f64,
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    let d = std::array::from_fn(|i| a[i] - b[i]);
    dot(d, d).sqrt()
}

impl Beam {
    /// None where the directions do not lie within a quarter turn of their mean.
    pub fn new(frame: &Frame, rect: Rect) -> Option<Self> {
        let (right, bottom) = (rect.x + rect.width - 1, rect.y + rect.height - 1);
        let corners = [(rect.x, rect.y), (right, rect.y), (rect.x, bottom), (right, bottom)]
            .map(|(x, y)| frame.ray(x, y));
        let mean = |v: [[f64; 3]; 4]| -> [f64; 3] {
            std::array::from_fn(|a| 0.25 * (v[0][a] + v[1][a] + v[2][a] + v[3][a]))
        };
        let (origins, directions) = (corners.map(|c| c.0), corners.map(|c| c.1));
        let (origin, direction) = (mean(origins), mean(directions));
        let length = dot(direction, direction).sqrt();
        let unit = direction.map(|v| v / length);
        // Unit vectors: the one farthest from the mean is the one that turns away most.
        let least = directions.iter().map(|d| dot(*d, unit)).fold(f64::INFINITY, f64::min);
        let most = |v: [[f64; 3]; 4], from: [f64; 3]| v.iter().map(|v| apart(*v, from)).fold(0.0, f64::max);
        (length > 0.0 && least > 0.0).then(|| Self {
            origin,
            direction,
            apart: most(origins, origin),
            bulge: (length - least).max(1.0 - length),
            spread: most(directions, direction),
        })
    }

    /// How wide the beam is at a depth.
    pub fn width(&self, t: f64) -> f64 {
        2.0 * (self.apart + t * self.spread)
    }

    /// A ball around all points between two depths from 0 on.
    pub fn cell(&self, lo: f64, hi: f64) -> Cell {
        let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        let centre: [f64; 3] = std::array::from_fn(|a| self.origin[a] + middle * self.direction[a]);
        let radius = (half + hi * self.bulge).hypot(self.apart + hi * self.spread);
        // Rays, points and the centre itself are rounded to f32 on their way.
        let size = radius + hi + self.origin.iter().map(|v| v.abs()).sum::<f64>();
        Cell::ball(centre, radius, size)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use sdfrs_trace::camera::{Camera, Kind};

    #[test]
    fn a_cell_holds_all_points_between_its_depths() {
        for kind in [
            Kind::Pinhole { fov_deg: 40.0 },
            Kind::Pinhole { fov_deg: 150.0 },
            Kind::Orthographic { extent: 3.0 },
        ] {
            let camera = Camera {
                kind,
                origin: [2.0, -1.0, 5.0],
                target: [0.3, 0.2, 0.0],
                up: [0.1, 1.0, 0.0],
                width: 96,
                height: 80,
            };
            let frame = camera.frame().unwrap();
            for (x, y, width, height) in [(0, 0, 96, 80), (32, 16, 16, 16), (80, 64, 16, 16), (5, 7, 1, 1)] {
                let beam = Beam::new(&frame, Rect { x, y, width, height }).unwrap();
                for (lo, hi) in [(0.0, 0.1), (2.0, 2.5), (7.0, 90.0)] {
                    let cell = beam.cell(lo, hi);
                    let mut most: f64 = 0.0;
                    for (px, py) in (x..x + width).flat_map(|px| (y..y + height).map(move |py| (px, py))) {
                        let (o, d) = frame.ray(px, py);
                        for t in [lo, 0.5 * (lo + hi), hi] {
                            let p = std::array::from_fn(|a| o[a] + t * d[a]);
                            most = most.max(apart(p, cell.centre.map(f64::from)));
                        }
                    }
                    let radius = f64::from(cell.radius);
                    assert!(most <= radius, "{kind:?} {x} {y} {lo} {hi}: {most} {radius}");
                    assert!(radius <= 2.2 * most + 1e-3, "{kind:?} loose: {most} {radius}");
                }
            }
        }
    }
}
