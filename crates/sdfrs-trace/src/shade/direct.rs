//! Point lights on a matt surface (Lambert 1760), without fall-off, under a little even light.
//!
//! `albedo * (0.15 + 0.85 * sum(intensity * color * max(0, n.l)))`, in f64 and linear colours, then
//! encoded as sRGB. The background is plain: shown as it is given, neither lit nor encoded. Rays on
//! which the field was not a number are magenta, so that nobody takes them for a picture.
//! Twin: the GPU's direct shading.
//! Law: the same bits on every machine and for any number of threads.

use sdfrs_core::{Scalar, SceneError, Status, math::Math};

/// Light that reaches every point of a surface, and the share left for the lamps.
const AMBIENT: f64 = 0.15;
pub const DIRECT: f64 = 0.85;
/// Pixels on which the field was not a number.
const INVALID_RGB: [u8; 3] = [255, 0, 255];

/// A lamp that shines alike in all directions and at all distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLight {
    pub position: [f64; 3],
    /// Linear red, green and blue.
    pub color: [f64; 3],
    pub intensity: f64,
}

impl PointLight {
    /// A white lamp of intensity 1.
    pub fn at(position: [f64; 3]) -> Self {
        Self { position, color: [1.0; 3], intensity: 1.0 }
    }

    pub fn check(&self) -> Result<(), SceneError> {
        if self.position.iter().any(|v| !v.is_finite()) {
            let message = format!("got {:?}, allowed: finite numbers", self.position);
            return Err(SceneError::new("light position", message));
        }
        if self.color.iter().any(|v| !(*v >= 0.0 && v.is_finite())) {
            let message = format!("got {:?}, allowed: three finite numbers of at least 0", self.color);
            return Err(SceneError::new("light color", message));
        }
        if !(self.intensity >= 0.0 && self.intensity.is_finite()) {
            let message = format!("got {}, allowed: a finite number of at least 0", self.intensity);
            return Err(SceneError::new("light intensity", message));
        }
        Ok(())
    }
}

/// Colours of what is hit (linear) and of what is behind it (as shown), each from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    pub albedo: [f64; 3],
    pub background: [f64; 3],
}

impl Default for Surface {
    fn default() -> Self {
        Self { albedo: [0.8; 3], background: [0.93, 0.95, 0.98] }
    }
}

impl Surface {
    pub fn check(&self) -> Result<(), SceneError> {
        for (what, color) in [("albedo", &self.albedo), ("background", &self.background)] {
            if !color.iter().all(|v| (0.0..=1.0).contains(v)) {
                return Err(SceneError::new(
                    what,
                    format!("got {color:?}, allowed: red, green and blue from 0 to 1"),
                ));
            }
        }
        Ok(())
    }

    /// The pixel of a ray that ended with `status` at `point`.
    pub fn pixel<T: Scalar>(
        &self,
        lights: &[PointLight],
        status: u8,
        point: [T; 3],
        normal: [T; 3],
    ) -> [u8; 3] {
        if status == Status::Invalid as u8 {
            return INVALID_RGB;
        }
        if status == Status::Miss as u8 {
            return self.background.map(byte);
        }
        let (p, n) = (point.map(Scalar::f64), normal.map(Scalar::f64));
        let mut light = [AMBIENT; 3];
        for lamp in lights {
            let facing =
                DIRECT * lamp.intensity * cosine(n, std::array::from_fn(|i| lamp.position[i] - p[i]));
            for (sum, color) in light.iter_mut().zip(lamp.color) {
                *sum += color * facing;
            }
        }
        std::array::from_fn(|i| srgb(self.albedo[i] * light[i]))
    }
}

/// Cosine of the angle between a unit normal and the way to the light; 0 behind, and at the lamp itself.
fn cosine(n: [f64; 3], l: [f64; 3]) -> f64 {
    let length = (l[0] * l[0] + l[1] * l[1] + l[2] * l[2]).sqrt();
    let along = n[0] * l[0] + n[1] * l[1] + n[2] * l[2];
    if along > 0.0 && length.is_finite() { along / length } else { 0.0 }
}

/// A value from 0 to 1 as 8 bits; the cast saturates.
fn byte(v: f64) -> u8 {
    (v * 255.0 + 0.5) as u8
}

/// One channel of IEC 61966-2-1, rounded to 8 bits.
fn srgb(linear: f64) -> u8 {
    byte(if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * (linear.m_ln() / 2.4).m_exp() - 0.055 })
}

#[cfg(test)]
mod tests {
    use super::*;

    const HIT: u8 = Status::Hit as u8;
    const UP: [f64; 3] = [0.0, 1.0, 0.0];

    #[test]
    fn srgb_follows_the_standard() {
        for i in 0..=255u8 {
            let v = f64::from(i) / 255.0;
            let linear = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
            assert_eq!(srgb(linear), i);
        }
        assert_eq!((srgb(1e300), srgb(0.0), srgb(-1.0)), (255, 0, 0));
    }

    #[test]
    fn light_falls_with_the_cosine_and_not_with_distance() {
        let s = Surface { albedo: [1.0; 3], background: [0.0; 3] };
        let lit = |p: [f64; 3]| s.pixel(&[PointLight::at(p)], HIT, [0.0; 3], UP)[0];
        assert_eq!(lit([0.0, 1.0, 0.0]), 255);
        assert_eq!(lit([0.0, 1e6, 0.0]), 255);
        assert_eq!(lit([3.0f64.sqrt(), 1.0, 0.0]), srgb(0.15 + 0.85 * 0.5));
        for dark in [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3]] {
            assert_eq!(lit(dark), srgb(0.15), "{dark:?}");
        }
    }

    #[test]
    fn lamps_add_up_and_keep_their_colors() {
        let s = Surface { albedo: [1.0, 1.0, 0.5], background: [0.0; 3] };
        let lamp = PointLight { position: UP, color: [1.0, 0.0, 1.0], intensity: 0.2 };
        let want = [srgb(0.15 + 0.34), srgb(0.15), srgb(0.5 * (0.15 + 0.34))];
        assert_eq!(s.pixel(&[lamp, lamp], HIT, [0.0; 3], UP), want);
    }

    #[test]
    fn status_decides() {
        let s = Surface { albedo: [1.0; 3], background: [0.0, 1.0, 0.5] };
        let of = |status: Status| s.pixel::<f32>(&[], status as u8, [0.0; 3], [0.0, 1.0, 0.0]);
        assert_eq!(of(Status::Miss), [0, 255, 128]);
        assert_eq!(of(Status::Invalid), [255, 0, 255]);
        assert_eq!(of(Status::OutOfSteps), of(Status::Hit));
    }

    #[test]
    fn refuses_what_is_no_light() {
        let good = PointLight::at(UP);
        assert!(good.check().is_ok() && Surface::default().check().is_ok());
        let bad = [
            PointLight { position: [f64::NAN, 0.0, 0.0], ..good },
            PointLight { color: [-0.1, 0.0, 0.0], ..good },
            PointLight { color: [f64::INFINITY, 0.0, 0.0], ..good },
            PointLight { intensity: -1.0, ..good },
            PointLight { intensity: f64::NAN, ..good },
        ];
        assert!(bad.iter().all(|light| light.check().is_err()));
        assert!(Surface { albedo: [f64::NAN; 3], ..Surface::default() }.check().is_err());
        assert!(Surface { background: [0.0, 0.0, -1.0], ..Surface::default() }.check().is_err());
        assert!(Surface { background: [1.1, 0.0, 0.0], ..Surface::default() }.check().is_err());
    }
}
