//! The first root of a cell's interpolant along a line: the exact surface of a texture.
//!
//! Along a line the trilinear interpolant is a cubic. In the line's own parameter from cell wall to cell
//! wall its coefficients keep their digits (about an origin ten cells away they lose four); its derivative's
//! roots split it into pieces that rise or fall, and the first piece that ends at 0 or below holds the root,
//! which Newton's steps find, kept in their bracket (Marmitt 2004's split; NUMERICS (g)). Law: tests below
//! compare 200,000 cells with f64.

use super::{BRICK, Grid, Store, bricks_along};
use crate::real::Scalar;

/// Newton's steps in a bracket: 5 or so reach the last digit of f64, the others are for bisections among them.
const STEPS: u32 = 60;

/// `c[0] + c[1] s + c[2] s^2 + c[3] s^3`.
#[derive(Debug, Clone, Copy)]
struct Cubic<T>([T; 4]);

impl<T: Scalar> Cubic<T> {
    /// The interpolant of corners `c` along `a + s b`, both in cell units.
    fn new(c: &[T; 8], a: [T; 3], b: [T; 3]) -> Self {
        // Along x: four linear functions of s, then two of degree 2, then one of degree 3.
        let line = |i: usize| {
            let d = c[2 * i + 1] - c[2 * i];
            [c[2 * i] + a[0] * d, b[0] * d]
        };
        let square = |p: [T; 2], q: [T; 2]| {
            let d = [q[0] - p[0], q[1] - p[1]];
            [p[0] + a[1] * d[0], p[1] + a[1] * d[1] + b[1] * d[0], b[1] * d[1]]
        };
        let (p, q) = (square(line(0), line(1)), square(line(2), line(3)));
        let d: [T; 3] = std::array::from_fn(|i| q[i] - p[i]);
        Self([
            p[0] + a[2] * d[0],
            p[1] + a[2] * d[1] + b[2] * d[0],
            p[2] + a[2] * d[2] + b[2] * d[1],
            b[2] * d[2],
        ])
    }

    fn at(&self, s: T) -> T {
        let [c0, c1, c2, c3] = self.0;
        c0 + s * (c1 + s * (c2 + s * c3))
    }

    fn slope(&self, s: T) -> T {
        let [_, c1, c2, c3] = self.0;
        c1 + s * (c2 + c2 + s * (c3 + c3 + c3))
    }

    /// Where the cubic turns, in order; NaN where it does not.
    fn turns(&self) -> [T; 2] {
        let [_, c, b, a] = self.0;
        let a = a + a + a;
        // a s^2 + 2 b s + c = 0, without the difference of near numbers.
        let root = (b * b - a * c).sqrt();
        let q = if b < T::of(0.0) { root - b } else { -(b + root) };
        let (s, t) = (q / a, c / q);
        if s < t { [s, t] } else { [t, s] }
    }

    /// The root in a piece that falls from above 0 to 0 or below.
    fn root(&self, mut lo: T, mut hi: T) -> T {
        let half = T::of(0.5);
        let mut s = (lo + hi) * half;
        for _ in 0..STEPS {
            let v = self.at(s);
            if v > T::of(0.0) {
                lo = s;
            } else {
                hi = s;
            }
            let next = s - v / self.slope(s);
            // A step out of the bracket, or to nowhere, becomes a bisection; one that stays is the end.
            let next = if next >= lo && next <= hi { next } else { (lo + hi) * half };
            if next == s {
                break;
            }
            s = next;
        }
        s
    }
}

/// The least `s` in 0..1 where the interpolant of corners `c` along `a + s b` (cell units) is 0 or below.
pub fn first_root<T: Scalar>(c: &[T; 8], a: [T; 3], b: [T; 3]) -> Option<T> {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    if c.iter().all(|v| *v > zero) {
        return None;
    }
    let cubic = Cubic::new(c, a, b);
    if !(cubic.at(zero) > zero) {
        return Some(zero);
    }
    let mut from = zero;
    let [s, t] = cubic.turns();
    for to in [s, t, one] {
        // Turns outside of the cell, or nowhere, part nothing.
        if !(to > from && to <= one) {
            continue;
        }
        if !(cubic.at(to) > zero) {
            return Some(cubic.root(from, to));
        }
        from = to;
    }
    None
}

/// What a line finds in a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell<T> {
    /// Corners of a cell, x fastest, then y, then z.
    Corners([T; 8]),
    /// A brick without samples: nothing is in any of its cells.
    Empty,
}

impl Grid {
    /// The cell at a place below the number of cells.
    pub fn cell<T: Scalar>(&self, at: [usize; 3]) -> Cell<T> {
        if let Store::Sparse(bricks) = self.store() {
            let count = bricks_along(self.dims());
            let [x, y, z] = at.map(|v| v / BRICK);
            if bricks.slot(x + count[0] * (y + count[1] * z)).is_none() {
                return Cell::Empty;
            }
        }
        Cell::Corners(self.corners_of(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same by cutting the cell into pieces, in f64.
    fn reference(c: &[f64; 8], a: [f64; 3], b: [f64; 3]) -> Option<f64> {
        let cubic = Cubic::new(c, a, b);
        let [s, t] = cubic.turns();
        let mut ends: Vec<f64> = [0.0, s, t, 1.0].into_iter().filter(|s| (0.0..=1.0).contains(s)).collect();
        ends.sort_by(f64::total_cmp);
        let first = ends.iter().position(|s| cubic.at(*s) <= 0.0)?;
        let (mut lo, mut hi) = (if first == 0 { 0.0 } else { ends[first - 1] }, ends[first]);
        for _ in 0..60 {
            let mid = (lo + hi) / 2.0;
            if cubic.at(mid) > 0.0 { lo = mid } else { hi = mid }
        }
        Some(hi)
    }

    struct Random(u64);
    impl Random {
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    /// R9: no root missed, none off by 1e-2 h. Half of the cells hold a sphere's distances, half anything.
    #[test]
    fn roots_in_f32_are_those_of_f64() {
        let mut random = Random(9);
        let (mut roots, mut missed, mut wrong, mut worst) = (0, 0, 0, 0f64);
        for i in 0..200_000 {
            let centre: [f64; 3] = std::array::from_fn(|_| 6.0 * random.unit() - 3.0);
            let radius = 0.3 + 4.0 * random.unit();
            let mut corner = |k: usize| {
                let p = [k & 1, k >> 1 & 1, k >> 2].map(|v| v as f64);
                let d = (0..3).map(|a| (p[a] - centre[a]).powi(2)).sum::<f64>().sqrt() - radius;
                if i % 2 == 0 { d as f32 } else { (2.0 * random.unit() - 1.0) as f32 }
            };
            let c: [f32; 8] = std::array::from_fn(&mut corner);
            // From one wall to another.
            let mut point = || {
                let mut p: [f32; 3] = std::array::from_fn(|_| random.unit() as f32);
                p[(random.unit() * 3.0) as usize % 3] = if random.unit() < 0.5 { 0.0 } else { 1.0 };
                p
            };
            let (a, e) = (point(), point());
            let b: [f32; 3] = std::array::from_fn(|k| e[k] - a[k]);
            let [wide_a, wide_b] = [a, b].map(|v| v.map(f64::from));
            let exact = reference(&c.map(f64::from), wide_a, wide_b);
            let found = first_root(&c, a, b);
            let length = b.iter().map(|v| f64::from(v * v)).sum::<f64>().sqrt();
            match (exact, found) {
                (Some(s), Some(f)) => {
                    roots += 1;
                    // Two roots close together: the later one is no miss where the cubic is 0 to all digits.
                    let cubic = Cubic::new(&c.map(f64::from), wide_a, wide_b);
                    let grazes = cubic.at(f.into()).abs() < 1e-6;
                    // At 0 the line starts inside.
                    worst = if f > 0.0 { worst.max(cubic.at(f.into()).abs()) } else { worst };
                    let off = (f64::from(f) - s).abs() * length;
                    wrong += usize::from(off > 1e-2 && !grazes);
                }
                (Some(s), None) => {
                    let cubic = Cubic::new(&c.map(f64::from), wide_a, wide_b);
                    let lowest = (0..=1000).map(|k| cubic.at(k as f64 / 1000.0)).fold(cubic.at(s), f64::min);
                    missed += usize::from(lowest < -1e-6);
                }
                _ => {}
            }
        }
        assert!(roots > 50_000, "{roots}");
        assert_eq!((missed, wrong), (0, 0));
        assert!(worst < 5e-6, "{worst}");
    }

    #[test]
    fn flat_and_degenerate_cells() {
        let ramp: [f64; 8] = std::array::from_fn(|k| 0.25 - (k & 1) as f64);
        assert_eq!(
            first_root(&ramp, [0.0, 0.5, 0.5], [1.0, 0.0, 0.0]).map(|s| (s * 1e9).round()),
            Some(0.25e9)
        );
        assert_eq!(first_root(&ramp, [0.0, 0.0, 0.5], [0.0, 1.0, 0.0]), None);
        assert_eq!(first_root(&[0.0; 8], [0.5; 3], [0.5, 0.0, 0.0]), Some(0.0));
        assert_eq!(first_root(&[1.0; 8], [0.5; 3], [0.5, 0.0, 0.0]), None);
        assert_eq!(first_root(&[-1.0; 8], [0.5; 3], [0.0; 3]), Some(0.0));
    }
}
