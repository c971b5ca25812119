//! Moments of clusters of faces, as the winding number sees them from afar (Barill and others, 2018, there up to the
//! second as here): integrals over the faces, passed on from clusters to clusters of them.

use crate::check::Checked;
use glam::DVec3;

/// A cluster's moments: integrals of n_i, n_i d_j and n_i d_j d_k over its faces, d from its centre.
#[derive(Clone)]
pub struct Moments {
    pub centre: DVec3,
    pub radius: f64,
    /// Of the faces, without direction.
    weight: f64,
    pub area: DVec3,
    first: [DVec3; 3],
    second: [[DVec3; 3]; 3],
}

impl Moments {
    fn none(centre: DVec3) -> Self {
        Self {
            centre,
            radius: 0.0,
            weight: 0.0,
            area: DVec3::ZERO,
            first: [DVec3::ZERO; 3],
            second: [[DVec3::ZERO; 3]; 3],
        }
    }

    pub fn of(mesh: &Checked, faces: &[u32]) -> Self {
        let all: Vec<[DVec3; 3]> = faces.iter().map(|&f| mesh.points(f as usize)).collect();
        let area = |[a, b, c]: &[DVec3; 3]| 0.5 * (*b - *a).cross(*c - *a);
        let (mut middle, mut weight) = (DVec3::ZERO, 0.0);
        for t in &all {
            let size = area(t).length();
            middle += (t[0] + t[1] + t[2]) * (size / 3.0);
            weight += size;
        }
        let mut sum = Self::none(if weight > 0.0 { middle / weight } else { all[0][0] });
        sum.weight = weight;
        for t in &all {
            let (area, d) = (area(t), t.map(|v| v - sum.centre));
            let total = d[0] + d[1] + d[2];
            sum.radius = d.iter().map(|d| d.length()).fold(sum.radius, f64::max);
            sum.area += area;
            for j in 0..3 {
                sum.first[j] += area * (total[j] / 3.0);
                for k in 0..3 {
                    let products = d.iter().map(|d| d[j] * d[k]).sum::<f64>() + total[j] * total[k];
                    sum.second[j][k] += area * (products / 12.0);
                }
            }
        }
        sum
    }

    pub fn sum(parts: &[Self]) -> Self {
        let weight: f64 = parts.iter().map(|p| p.weight).sum();
        let middle = parts.iter().map(|p| p.centre * p.weight).sum::<DVec3>() / weight;
        let mut sum = Self::none(if middle.is_finite() { middle } else { parts[0].centre });
        sum.weight = weight;
        for part in parts {
            let o = part.centre - sum.centre;
            sum.radius = sum.radius.max(o.length() + part.radius);
            sum.area += part.area;
            for j in 0..3 {
                sum.first[j] += part.first[j] + part.area * o[j];
                for k in 0..3 {
                    sum.second[j][k] += part.second[j][k]
                        + part.first[j] * o[k]
                        + part.first[k] * o[j]
                        + part.area * (o[j] * o[k]);
                }
            }
        }
        sum
    }

    /// The first moments as `Far` keeps them. Only the symmetric part without trace meets the derivatives of a harmonic
    /// function.
    pub fn first(&self) -> [f64; 5] {
        let m = &self.first;
        let s = |i: usize, j: usize| 0.5 * (m[j][i] + m[i][j]);
        let trace = (s(0, 0) + s(1, 1) + s(2, 2)) / 3.0;
        [s(0, 0) - trace, s(1, 1) - trace, 2.0 * s(0, 1), 2.0 * s(0, 2), 2.0 * s(1, 2)].map(|x| -3.0 * x)
    }

    /// The second moments likewise.
    pub fn second(&self) -> [f64; 7] {
        let m = &self.second;
        let s = |i: usize, j: usize, k: usize| (m[j][k][i] + m[i][k][j] + m[i][j][k]) / 3.0;
        let trace: [f64; 3] = std::array::from_fn(|k| (s(0, 0, k) + s(1, 1, k) + s(2, 2, k)) / 5.0);
        let [x, y, z] = trace;
        [
            s(0, 0, 0) - 3.0 * x,
            s(1, 1, 1) - 3.0 * y,
            3.0 * (s(0, 0, 1) - y),
            3.0 * (s(0, 1, 1) - x),
            s(0, 0, 2) - z,
            s(1, 1, 2) - z,
            6.0 * s(0, 1, 2),
        ]
        .map(|x| 7.5 * x)
    }
}
