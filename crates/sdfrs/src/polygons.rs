//! Polygons to triangles, by cutting ears off, in the plane that fits the polygon best.
//!
//! Triangles stay as they are, quadrilaterals and larger ones may be concave or slightly bent. Indices are
//! compared with the number of vertices first. Law: the triangles' area vectors add up to the polygon's, and
//! no corner lies inside an ear (tests below).

use sdfrs_mesh::{Mesh, MeshError};

/// A mesh of polygons given as the corners of all of them, one after the other, and each one's count.
pub fn of_polygons(vertices: Vec<[f64; 3]>, corners: &[i64], counts: &[u32]) -> Result<Mesh, MeshError> {
    let most = vertices.len() as i64;
    let total: u64 = counts.iter().map(|&n| u64::from(n)).sum();
    if total != corners.len() as u64 {
        let message = format!("{} corners given for polygons of {total} in all", corners.len());
        return Err(MeshError::bad("faces", message));
    }
    let mut faces: Vec<[u32; 3]> = Vec::new();
    faces.try_reserve(corners.len()).map_err(|_| MeshError::bad("faces", "too many to be held"))?;
    let (mut at, mut loop_): (usize, Vec<u32>) = (0, Vec::new());
    for (face, &n) in counts.iter().enumerate() {
        if n < 3 {
            return Err(MeshError::bad(
                format!("face {face}"),
                format!("{n} corners given; at least 3 are allowed"),
            ));
        }
        loop_.clear();
        for &corner in &corners[at..at + n as usize] {
            if !(0..most).contains(&corner) {
                let allowed = if most == 0 {
                    "there are no vertices".into()
                } else {
                    format!("0 to {} are allowed", most - 1)
                };
                return Err(MeshError::bad(
                    format!("face {face}"),
                    format!("vertex {corner} given; {allowed}"),
                ));
            }
            loop_.push(corner as u32);
        }
        at += n as usize;
        match loop_[..] {
            [a, b, c] => faces.push([a, b, c]),
            _ => cut(&vertices, &mut loop_, &mut faces),
        }
    }
    Ok(Mesh { vertices, faces })
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

/// Cuts a polygon's ears off until a triangle is left.
fn cut(vertices: &[[f64; 3]], left: &mut Vec<u32>, out: &mut Vec<[u32; 3]>) {
    let flat = Flat::of(vertices, left);
    // Which of `flat`'s corners are left, in order.
    let mut order: Vec<usize> = (0..left.len()).collect();
    while order.len() > 3 {
        let n = order.len();
        let ear = (0..n).find(|&i| flat.is_ear(&order, i)).unwrap_or_else(|| flat.roundest(&order));
        let [a, b, c] = [(ear + n - 1) % n, ear, (ear + 1) % n].map(|i| order[i]);
        out.push([left[a], left[b], left[c]]);
        order.remove(ear);
    }
    if let [a, b, c] = order[..] {
        out.push([left[a], left[b], left[c]]);
    }
}

/// A polygon's corners in its own plane.
struct Flat {
    at: Vec<[f64; 2]>,
}

impl Flat {
    fn of(vertices: &[[f64; 3]], corners: &[u32]) -> Self {
        let point = |i: u32| vertices[i as usize];
        let first = point(corners[0]);
        // Twice the area vector; the largest part's axis is the one to look along.
        let mut area = [0f64; 3];
        for pair in corners.windows(2) {
            let (u, v) = (minus(point(pair[0]), first), minus(point(pair[1]), first));
            area = [
                area[0] + u[1] * v[2] - u[2] * v[1],
                area[1] + u[2] * v[0] - u[0] * v[2],
                area[2] + u[0] * v[1] - u[1] * v[0],
            ];
        }
        let axis = (0..3).fold(0, |best, i| if area[i].abs() > area[best].abs() { i } else { best });
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let turn = if area[axis] < 0.0 { -1.0 } else { 1.0 };
        let at = corners.iter().map(|&i| minus(point(i), first)).map(|p| [p[u], p[v] * turn]).collect();
        Self { at }
    }

    /// Twice the area of a triangle, positive where it turns like the polygon.
    fn area(&self, a: usize, b: usize, c: usize) -> f64 {
        let ([ax, ay], [bx, by], [cx, cy]) = (self.at[a], self.at[b], self.at[c]);
        (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    }

    fn corner(&self, order: &[usize], i: usize) -> [usize; 3] {
        let n = order.len();
        [order[(i + n - 1) % n], order[i], order[(i + 1) % n]]
    }

    /// Whether corner `i` is convex and no other corner lies in its triangle.
    fn is_ear(&self, order: &[usize], i: usize) -> bool {
        let [a, b, c] = self.corner(order, i);
        let within = |&p: &usize| {
            let same = [a, b, c].iter().any(|&q| self.at[q] == self.at[p]);
            !same && self.area(a, b, p) >= 0.0 && self.area(b, c, p) >= 0.0 && self.area(c, a, p) >= 0.0
        };
        self.area(a, b, c) > 0.0 && !order.iter().any(within)
    }

    /// Where a polygon crosses itself no corner need be an ear: then the largest goes.
    fn roundest(&self, order: &[usize]) -> usize {
        let area = |i: usize| {
            let [a, b, c] = self.corner(order, i);
            self.area(a, b, c)
        };
        (0..order.len()).fold(0, |best, i| if area(i) > area(best) { i } else { best })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn area(vertices: &[[f64; 3]], f: [u32; 3]) -> f64 {
        let [a, b, c] = f.map(|i| vertices[i as usize]);
        let (u, v) = (minus(b, a), minus(c, a));
        (u[0] * v[1] - u[1] * v[0]) / 2.0
    }

    #[test]
    fn concave_polygons_keep_their_area_and_turn() {
        let arrow = vec![[0.0, 0.0, 1.0], [2.0, 1.0, 1.0], [0.0, 2.0, 1.0], [0.5, 1.0, 1.0]];
        let comb: Vec<[f64; 3]> = (0..9)
            .map(|i| [f64::from(i), if i % 2 == 0 { 0.0 } else { 3.0 }, 0.0])
            .chain([[8.0, 5.0, 0.0], [0.0, 5.0, 0.0]])
            .collect();
        for polygon in [arrow, comb] {
            let n = polygon.len() as u32;
            let forward: Vec<i64> = (0..i64::from(n)).collect();
            let sum = |corners: &[i64]| {
                let mesh = of_polygons(polygon.clone(), corners, &[n]).unwrap();
                assert_eq!(mesh.faces.len() as u32, n - 2);
                mesh.faces
                    .iter()
                    .map(|f| area(&mesh.vertices, *f))
                    .fold([0.0, 0.0], |s: [f64; 2], a| [s[0] + a, s[1] + a.abs()])
            };
            let [a, whole] = sum(&forward);
            assert!(a > 0.0 && (a - whole).abs() < 1e-12, "no triangle turned over: {a} {whole}");
            let backward: Vec<i64> = forward.iter().rev().copied().collect();
            assert!((sum(&backward)[0] + a).abs() < 1e-12);
        }
    }

    #[test]
    fn indices_are_compared_first() {
        let v = vec![[0.0; 3]; 3];
        for (corners, counts, word) in [
            (vec![0, 1, 3], vec![3], "face 0: vertex 3"),
            (vec![0, 1, 2, 0, -1, 2], vec![3, 3], "face 1: vertex -1"),
            (vec![0, 1], vec![2], "at least 3"),
            (vec![0, 1, 2], vec![4], "3 corners"),
        ] {
            let error = of_polygons(v.clone(), &corners, &counts).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
        assert!(of_polygons(vec![], &[0, 0, 0], &[3]).unwrap_err().to_string().contains("no vertices"));
    }
}
