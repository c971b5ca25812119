//! Point lights on a matt surface (Lambert 1760), without fall-off, under a little even light.
//!
//! `albedo * (0.15 + 0.85 * sum(intensity * color * max(0, n.l)))`, in the trace's precision and linear colours, then
//! encoded as sRGB. The background is plain: shown as it is given, neither lit nor encoded. Rays on
//! which the field was not a number are magenta, so that nobody takes them for a picture.
//! Twin: the GPU's direct shading.
//! Law: the same bits on every machine and for any number of threads.

use sdfrs_core::{Real, Scalar, SceneError, Status};

use super::{
    normal::moderate,
    srgb::{Srgb, byte},
};

/// Light that reaches every point of a surface, and the share left for the lamps.
const AMBIENT: f64 = 0.15;
pub const DIRECT: f64 = 0.85;
/// From here on a lamp's distance is as good as infinite.
const FAR: f64 = 1e30;
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

    /// What a ray shows that ended with `status` where there is nothing to be lit.
    pub fn unlit(&self, status: u8) -> [u8; 3] {
        if status == Status::Invalid as u8 { INVALID_RGB } else { self.background.map(byte) }
    }
}

/// Lamps and what they shine upon.
#[derive(Debug, Clone, Copy)]
pub struct Light<'a> {
    pub lights: &'a [PointLight],
    pub surface: &'a Surface,
}

impl Light<'_> {
    /// The same in the precision of a trace.
    pub fn lamps<T: Scalar>(&self) -> Lamps<T> {
        let Surface { albedo, .. } = self.surface;
        Lamps { lamps: self.lights.iter().map(Lamp::of).collect(), albedo: albedo.map(T::of) }
    }

    /// The pixel of a ray that ended with `status` at `point`.
    pub fn pixel<T: Scalar>(&self, status: u8, point: [T; 3], normal: [T; 3]) -> [u8; 3] {
        if !shows_surface(status) {
            return self.surface.unlit(status);
        }
        let table = Srgb::get();
        self.lamps().linear(point, normal).map(|linear| table.byte(linear))
    }
}

/// Light ready to be computed with.
pub struct Lamps<T> {
    lamps: Vec<Lamp<T>>,
    albedo: [T; 3],
}

struct Lamp<T> {
    /// Times `scale`.
    position: [T; 3],
    /// 1, or what brings a lamp near enough to be a number: only its direction counts.
    scale: T,
    /// Linear, times the intensity and the share of the lamps.
    color: [T; 3],
}

impl<T: Scalar> Lamp<T> {
    fn of(light: &PointLight) -> Self {
        let farthest = light.position.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let scale = if farthest > FAR { FAR / farthest } else { 1.0 };
        Self {
            position: light.position.map(|v| T::of(v * scale)),
            scale: T::of(scale),
            color: light.color.map(|c| T::of(c * DIRECT * light.intensity)),
        }
    }
}

impl<T: Scalar> Lamps<T> {
    /// Whether red, green and blue are the same everywhere.
    pub fn grey(&self) -> bool {
        let alike = |[r, g, b]: [T; 3]| r == g && g == b;
        alike(self.albedo) && self.lamps.iter().all(|lamp| alike(lamp.color))
    }

    /// Linear red, green and blue of a point with a unit normal.
    #[inline(always)]
    pub fn linear<R: Real<S = T>>(&self, point: [R; 3], normal: [R; 3]) -> [R; 3] {
        let mut sum = [R::c(AMBIENT); 3];
        for Lamp { position: [x, y, z], scale, color } in &self.lamps {
            let (x, y, z, scale) = (R::splat(*x), R::splat(*y), R::splat(*z), R::splat(*scale));
            let [px, py, pz] = point;
            let facing = cosine(normal, [x - px * scale, y - py * scale, z - pz * scale]);
            for (sum, color) in sum.iter_mut().zip(color) {
                *sum = *sum + R::splat(*color) * facing;
            }
        }
        let [r, g, b] = self.albedo;
        [R::splat(r) * sum[0], R::splat(g) * sum[1], R::splat(b) * sum[2]]
    }
}

/// Whether a surface is seen: a ray out of steps shows the one it was closing in on.
pub fn shows_surface(status: u8) -> bool {
    status == Status::Hit as u8 || status == Status::OutOfSteps as u8
}

/// Cosine of the angle between a unit normal and the way to the light; 0 behind, and at the lamp itself.
#[inline(always)]
fn cosine<R: Real>(n: [R; 3], l: [R; 3]) -> R {
    let zero = R::c(0.0);
    let most = l[0].abs().max(l[1].abs()).max(l[2].abs());
    let scale = moderate(most);
    let l = [l[0] * scale, l[1] * scale, l[2] * scale];
    let along = n[0] * l[0] + n[1] * l[1] + n[2] * l[2];
    let near = R::select_lt(most, R::splat(R::S::INFINITY), along / R::len3(l[0], l[1], l[2]), zero);
    R::select_lt(zero, along, near, zero)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HIT: u8 = Status::Hit as u8;
    const UP: [f64; 3] = [0.0, 1.0, 0.0];

    fn srgb(linear: f64) -> u8 {
        Srgb::get().byte(linear)
    }

    #[test]
    fn light_falls_with_the_cosine_and_not_with_distance() {
        let s = Surface { albedo: [1.0; 3], background: [0.0; 3] };
        let lit =
            |p: [f64; 3]| Light { lights: &[PointLight::at(p)], surface: &s }.pixel(HIT, [0.0; 3], UP)[0];
        assert_eq!(lit([0.0, 1.0, 0.0]), 255);
        assert_eq!(lit([0.0, 1e6, 0.0]), 255);
        assert_eq!(lit([3.0f64.sqrt(), 1.0, 0.0]), srgb(0.15 + 0.85 * 0.5));
        for dark in [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3]] {
            assert_eq!(lit(dark), srgb(0.15), "{dark:?}");
        }
    }

    #[test]
    fn lamps_at_any_distance_shine_alike_in_both_precisions() {
        fn of<T: Scalar>(far: f64) -> u8 {
            let s = Surface { albedo: [1.0; 3], background: [0.0; 3] };
            let lamp = PointLight::at([3.0f64.sqrt() * far, far, 0.0]);
            let up = [0.0, 1.0, 0.0].map(T::of);
            Light { lights: &[lamp], surface: &s }.pixel(HIT, [T::of(0.0); 3], up)[0]
        }
        for far in [1.0, 1e6, 1e14, 1e18, 1e30, 1e200, 1e307] {
            assert_eq!([of::<f32>(far), of::<f64>(far)], [srgb(0.15 + 0.85 * 0.5); 2], "{far}");
        }
    }

    #[test]
    fn lamps_add_up_and_keep_their_colors() {
        let s = Surface { albedo: [1.0, 1.0, 0.5], background: [0.0; 3] };
        let lamp = PointLight { position: UP, color: [1.0, 0.0, 1.0], intensity: 0.2 };
        let want = [srgb(0.15 + 0.34), srgb(0.15), srgb(0.5 * (0.15 + 0.34))];
        let light = Light { lights: &[lamp, lamp], surface: &s };
        assert_eq!(light.pixel(HIT, [0.0; 3], UP), want);
    }

    #[test]
    fn status_decides() {
        let s = Surface { albedo: [1.0; 3], background: [0.0, 1.0, 0.5] };
        let light = Light { lights: &[], surface: &s };
        let of = |status: Status| light.pixel::<f32>(status as u8, [0.0; 3], [0.0, 1.0, 0.0]);
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
