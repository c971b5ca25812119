//! Normals: the field's exact gradient at the hit, by dual numbers, at unit length.
//!
//! Where the gradient is zero or not a number the normal faces the ray, so that shading has a
//! direction everywhere. Law: on a sphere it is the direction from the centre (tests in `render`).

use sdfrs_core::{Program, Scalar, Scratch, eval::Native};

/// Memory of one tile's gradients, reused from tile to tile.
pub struct Gradients<T: Native> {
    scratch: Scratch<T>,
    points: [Vec<T>; 3],
    values: [Vec<T>; 4],
}

impl<T: Native> Gradients<T> {
    pub fn new() -> Self {
        Self { scratch: Scratch::new(), points: Default::default(), values: Default::default() }
    }

    /// Normals at `points`; `directions` are those of the rays that found them.
    pub fn normals(
        &mut self,
        field: &Program<T>,
        points: &[[T; 3]],
        directions: &[[T; 3]],
        out: &mut Vec<[T; 3]>,
    ) {
        for (axis, column) in self.points.iter_mut().enumerate() {
            column.clear();
            column.extend(points.iter().map(|p| p[axis]));
        }
        for column in &mut self.values {
            column.clear();
            column.resize(points.len(), T::default());
        }
        let [x, y, z] = &self.points;
        let [v, gx, gy, gz] = &mut self.values;
        field.gradient(&mut self.scratch, [x, y, z], [v, gx, gy, gz]);
        let [_, gx, gy, gz] = &self.values;
        out.clear();
        out.extend(directions.iter().enumerate().map(|(i, &d)| unit([gx[i], gy[i], gz[i]], d)));
    }
}

impl<T: Native> Default for Gradients<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// The gradient at unit length, or the way back along the ray where it has no direction.
fn unit<T: Scalar>(g: [T; 3], direction: [T; 3]) -> [T; 3] {
    let largest = g[0].abs().max(g[1].abs()).max(g[2].abs());
    let usable = g.iter().all(|v| v.is_finite()) && largest > T::default();
    if !usable {
        return direction.map(|d| -d);
    }
    // Scaled first: squares of a tiny gradient would vanish.
    let g = g.map(|v| v / largest);
    let length = T::len3(g[0], g[1], g[2]);
    g.map(|v| v / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gradient_without_direction_faces_the_ray() {
        let d = [0.0, 0.6, 0.8];
        for g in [[0.0; 3], [f64::NAN, 1.0, 0.0], [f64::INFINITY, 0.0, 0.0]] {
            assert_eq!(unit(g, d), [-0.0, -0.6, -0.8]);
        }
        assert_eq!(unit([1e-30f32, 0.0, 0.0], [0.0, 0.0, 1.0]), [1.0, 0.0, 0.0]);
        assert_eq!(unit([0.0, -3e38f32, 0.0], [0.0, 0.0, 1.0]), [0.0, -1.0, 0.0]);
    }
}
