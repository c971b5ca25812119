//! Cameras: which ray belongs to which pixel.
//!
//! Right-handed; pixel (0, 0) is the top left one and rays pass through pixel centres. Everything is
//! computed in f64 with the crate's own sine and cosine, so that the rays have the same bits on every
//! machine, and is rounded once, to the precision of the trace.
//!
//! Twin: the GPU's camera set-up. Law: directions have unit length; the centre of the image looks at
//! the target; the top of the image is on the side of `up` (tests below).

use glam::{DVec2, DVec3};
use sdfrs_core::{Real, Scalar, SceneError, math::Math};

use crate::budget;

/// How pixels spread: over an angle or over a length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Vertical field of view in degrees, between 0 and 180.
    Pinhole { fov_deg: f64 },
    /// Height of the image in world units.
    Orthographic { extent: f64 },
}

/// Origins and unit directions.
pub type Batch<T> = (Vec<[T; 3]>, Vec<[T; 3]>);

/// A camera at `origin` looking at `target`, with `up` towards the top of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    pub kind: Kind,
    pub origin: [f64; 3],
    pub target: [f64; 3],
    pub up: [f64; 3],
    /// Pixels.
    pub width: u32,
    pub height: u32,
}

impl Camera {
    /// Refuses what has no picture: numbers that are not finite, no direction, absurd sizes.
    pub fn check(&self) -> Result<(), SceneError> {
        self.frame().map(|_| ())
    }

    /// The same camera for another image size.
    pub fn resized(mut self, width: u32, height: u32) -> Self {
        (self.width, self.height) = (width, height);
        self
    }

    /// Number of pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// The checked camera, ready to give rays.
    pub fn frame(&self) -> Result<Frame, SceneError> {
        budget::check_pixels(u64::from(self.width), u64::from(self.height))?;
        for (name, v) in [("origin", self.origin), ("target", self.target), ("up", self.up)] {
            if v.iter().any(|c| !c.is_finite()) {
                return Err(refuse(name, format!("got {v:?}, allowed: finite numbers")));
            }
        }
        let (origin, target) = (DVec3::from(self.origin), DVec3::from(self.target));
        let Some(forward) = unit(target - origin) else {
            let message = format!(
                "got {target}, allowed: a point apart from the origin {origin}, at a finite distance"
            );
            return Err(refuse("target", message));
        };
        let right = unit(self.up.into())
            .map(|up| forward.cross(up))
            .filter(|side| side.length_squared() > 1e-18)
            .and_then(unit);
        let Some(right) = right else {
            let message =
                format!("got {:?}, allowed: a vector that is not parallel to the view {forward}", self.up);
            return Err(refuse("up", message));
        };
        let half = self.half_height()?;
        Ok(Frame {
            origin,
            forward,
            right,
            up: right.cross(forward),
            half,
            grain: half / f64::from(self.height),
            perspective: matches!(self.kind, Kind::Pinhole { .. }),
            size: DVec2::new(self.width.into(), self.height.into()),
            width: u64::from(self.width),
        })
    }

    /// Half the height of the image: at unit distance, or in world units without perspective.
    fn half_height(&self) -> Result<f64, SceneError> {
        match self.kind {
            Kind::Pinhole { fov_deg } => {
                let angle = fov_deg.to_radians() / 2.0;
                let half = angle.m_sin() / angle.m_cos();
                if !(fov_deg > 0.0 && fov_deg < 180.0 && half > 0.0 && half.is_finite()) {
                    return Err(refuse(
                        "fov",
                        format!("got {fov_deg} degrees, allowed: above 0 and below 180"),
                    ));
                }
                Ok(half)
            }
            Kind::Orthographic { extent } => {
                if !(extent > 0.0 && extent.is_finite()) {
                    return Err(refuse("extent", format!("got {extent}, allowed: a finite length above 0")));
                }
                Ok(extent / 2.0)
            }
        }
    }

    /// Origin and unit direction of one pixel's ray.
    pub fn ray(&self, px: u32, py: u32) -> Result<([f64; 3], [f64; 3]), SceneError> {
        if px >= self.width || py >= self.height {
            let message = format!("got ({px}, {py}), allowed: inside {} x {}", self.width, self.height);
            return Err(refuse("pixel", message));
        }
        Ok(self.frame()?.ray(px, py))
    }

    /// Origins and directions of all rays, row-major from the top left pixel.
    pub fn rays<T: Scalar>(&self) -> Result<Batch<T>, SceneError> {
        let frame = self.frame()?;
        budget::check_bytes("camera rays", self.pixels() * 6 * size_of::<T>() as u64)?;
        Ok((0..self.pixels()).map(|i| frame.pixel(i)).map(|(o, d)| (o.map(T::of), d.map(T::of))).unzip())
    }
}

/// A camera's axes and scale, computed once.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    pub origin: DVec3,
    pub forward: DVec3,
    pub right: DVec3,
    pub up: DVec3,
    /// Half the height of the image: at unit distance, or in world units without perspective.
    pub half: f64,
    pub perspective: bool,
    /// Half a pixel: `half` over the height in pixels.
    grain: f64,
    size: DVec2,
    width: u64,
}

impl Frame {
    /// Origin and unit direction of the ray through the centre of a pixel.
    pub fn ray(&self, px: u32, py: u32) -> ([f64; 3], [f64; 3]) {
        let DVec2 { x: w, y: h } = self.size;
        let x = (2.0 * (f64::from(px) + 0.5) - w) * self.grain;
        let y = (h - 2.0 * (f64::from(py) + 0.5)) * self.grain;
        let offset = x * self.right + y * self.up;
        if self.perspective {
            let v = self.forward + offset;
            // One division instead of three: rays are made by the million.
            (self.origin.into(), (v * (1.0 / v.length())).into())
        } else {
            ((self.origin + offset).into(), self.forward.into())
        }
    }

    /// Where all rays start, if they do at one point.
    pub fn eye(&self) -> Option<[f64; 3]> {
        self.perspective.then(|| self.origin.into())
    }

    /// The same for a pack of pixels, with the same bits: origins and directions.
    #[inline(always)]
    pub fn lanes<L: Real<S = f64>>(&self, px: L, py: L) -> ([L; 3], [L; 3]) {
        let (w, h) = (L::splat(self.size.x), L::splat(self.size.y));
        let grain = L::splat(self.grain);
        let (two, middle) = (L::c(2.0), L::c(0.5));
        let x = (two * (px + middle) - w) * grain;
        let y = (h - two * (py + middle)) * grain;
        let (origin, forward) = (wide::<L>(self.origin), wide::<L>(self.forward));
        let (right, up) = (wide::<L>(self.right), wide::<L>(self.up));
        let offset = [x * right[0] + y * up[0], x * right[1] + y * up[1], x * right[2] + y * up[2]];
        if self.perspective {
            let v = [forward[0] + offset[0], forward[1] + offset[1], forward[2] + offset[2]];
            let inverse = L::c(1.0) / L::len3(v[0], v[1], v[2]);
            (origin, [v[0] * inverse, v[1] * inverse, v[2] * inverse])
        } else {
            ([origin[0] + offset[0], origin[1] + offset[1], origin[2] + offset[2]], forward)
        }
    }

    /// World units that so many pixels span at a depth.
    pub fn span(&self, pixels: usize, depth: f64) -> f64 {
        2.0 * self.grain * pixels as f64 * if self.perspective { depth } else { 1.0 }
    }

    /// Pixels of a row.
    pub fn width(&self) -> usize {
        self.width as usize
    }

    /// The ray of the `i`-th pixel, row by row.
    pub fn pixel(&self, i: u64) -> ([f64; 3], [f64; 3]) {
        // Both fit: a checked camera has at most 65536 columns and rows.
        self.ray((i % self.width) as u32, (i / self.width) as u32)
    }
}

/// A vector in every lane.
#[inline(always)]
fn wide<L: Real<S = f64>>(v: DVec3) -> [L; 3] {
    [L::splat(v.x), L::splat(v.y), L::splat(v.z)]
}

fn refuse(what: &str, message: String) -> SceneError {
    SceneError::new(format!("camera {what}"), message)
}

/// The vector at unit length, or none where it has no direction. Scaled first: squares of large or
/// small components would overflow or vanish.
fn unit(v: DVec3) -> Option<DVec3> {
    let largest = v.abs().max_element();
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    let v = v / largest;
    Some(v / v.length())
}

#[cfg(test)]
mod tests;
