//! Polygons into triangles: a fan where the polygon is convex, else ear by ear (Meisters, Polygons have ears, 1975).
//!
//! No corner is dropped, not even one on a straight side: neighbours have it too, and the mesh would open there.

use crate::{Mesh, MeshError, Pulse};
use robust::{Coord, orient2d};

/// A polygon with more corners than this has to be convex: ears take time with the square of their number.
const MAX_CORNERS: usize = 4096;

/// Vertices and polygons as they stand in a file.
#[derive(Default)]
pub struct Polygons {
    pub vertices: Vec<[f64; 3]>,
    corners: Vec<u32>,
    /// Where each polygon ends among the corners, and its place in the file: a line or a number.
    ends: Vec<(usize, u64)>,
    /// The first polygon that is none: its number of corners, and its place.
    short: Option<(usize, u64)>,
}

impl Polygons {
    pub fn of(vertices: Vec<[f64; 3]>) -> Self {
        Self { vertices, ..Self::default() }
    }

    pub fn corner(&mut self, vertex: u32) {
        self.corners.push(vertex);
    }

    /// Ends the polygon begun by `corner`; `place` is where it stands.
    pub fn end(&mut self, place: u64) {
        let start = self.ends.last().map_or(0, |last| last.0);
        let corners = self.corners.len() - start;
        if corners < 3 {
            // Kept for `mesh` to refuse; no list grows by such polygons.
            self.short = self.short.or(Some((corners, place)));
            self.corners.truncate(start);
        } else {
            self.ends.push((self.corners.len(), place));
        }
    }

    /// The triangles. `place` names what `end` was given.
    pub fn mesh(self, place: impl Fn(u64) -> String, pulse: &mut Pulse) -> Result<Mesh, MeshError> {
        if let Some((corners, at)) = self.short {
            let message = format!("a face of {corners} corners; at least 3 are needed");
            return Err(MeshError::bad(place(at), message));
        }
        let count = self.vertices.len();
        if count as u64 > crate::check::MAX_VERTICES {
            let message = format!("{count} given, at most {} are allowed", crate::check::MAX_VERTICES);
            return Err(MeshError::bad("vertices", message));
        }
        let mut faces = Vec::with_capacity(self.corners.len().saturating_sub(2 * self.ends.len()));
        let mut start = 0;
        for &(end, at) in &self.ends {
            let polygon = &self.corners[start..end];
            start = end;
            pulse.beat()?;
            if let Some(&v) = polygon.iter().find(|&&v| v as usize >= count) {
                let message = format!("a face has vertex {v} (from 0), but there are only {count}");
                return Err(MeshError::bad(place(at), message));
            }
            if let &[a, b, c] = polygon {
                faces.push([a, b, c]);
            } else {
                cut(&self.vertices, polygon, &mut faces)
                    .map_err(|message| MeshError::bad(place(at), message))?;
            }
        }
        Ok(Mesh { vertices: self.vertices, faces })
    }
}

/// Adds the triangles of a polygon of at least three corners.
fn cut(vertices: &[[f64; 3]], polygon: &[u32], faces: &mut Vec<[u32; 3]>) -> Result<(), String> {
    let flat = flat(vertices, polygon);
    let n = polygon.len();
    let area = |a: usize, b: usize, c: usize| orient2d(flat[a], flat[b], flat[c]);
    let convex = (1..n - 1).all(|k| area(0, k, k + 1) > 0.0)
        && (0..n).all(|k| area(k, (k + 1) % n, (k + 2) % n) > 0.0);
    if convex {
        faces.extend((1..n - 1).map(|k| [polygon[0], polygon[k], polygon[k + 1]]));
        return Ok(());
    }
    if n > MAX_CORNERS {
        return Err(format!("a face of {n} corners that isn't convex; at most {MAX_CORNERS} are allowed"));
    }
    let mut left: Vec<usize> = (0..n).collect();
    let (mut at, mut tried, mut patience) = (0, 0, 2);
    while left.len() > 3 {
        let m = left.len();
        let (a, b, c) = (left[(at + m - 1) % m], left[at % m], left[(at + 1) % m]);
        let turn = area(a, b, c);
        // A round without an ear: the polygon meets itself. From then on a straight corner will do, and then any.
        let ear = match patience {
            2 => turn > 0.0 && !holds_another(&flat, &left, [a, b, c]),
            1 => turn >= 0.0 && !holds_another(&flat, &left, [a, b, c]),
            _ => true,
        };
        if ear {
            faces.push([polygon[a], polygon[b], polygon[c]]);
            left.remove(at % m);
            (at, tried) = (at % m, 0);
            continue;
        }
        (at, tried) = ((at + 1) % m, tried + 1);
        if tried == m {
            (tried, patience) = (0, patience - 1);
        }
    }
    faces.push([polygon[left[0]], polygon[left[1]], polygon[left[2]]]);
    Ok(())
}

/// Whether another corner lies in the triangle or on its rim; one in the same place as a corner of it doesn't count.
fn holds_another(flat: &[Coord<f64>], left: &[usize], [a, b, c]: [usize; 3]) -> bool {
    left.iter().any(|&p| {
        let at = flat[p];
        if [a, b, c].iter().any(|&corner| flat[corner] == at) {
            return false;
        }
        orient2d(flat[a], flat[b], at) >= 0.0
            && orient2d(flat[b], flat[c], at) >= 0.0
            && orient2d(flat[c], flat[a], at) >= 0.0
    })
}

/// The corners along the two axes in which the polygon (Newell's normal) is largest, counter-clockwise.
fn flat(vertices: &[[f64; 3]], polygon: &[u32]) -> Vec<Coord<f64>> {
    let at = |k: usize| vertices[polygon[k % polygon.len()] as usize];
    let origin = at(0);
    let mut normal = [0.0; 3];
    for k in 0..polygon.len() {
        let (p, q) = (at(k), at(k + 1));
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            normal[axis] +=
                ((p[u] - origin[u]) * (q[v] - origin[v])) - ((q[u] - origin[u]) * (p[v] - origin[v]));
        }
    }
    let largest = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap_or(2);
    let (mut u, mut v) = ((largest + 1) % 3, (largest + 2) % 3);
    if normal[largest] < 0.0 {
        (u, v) = (v, u);
    }
    (0..polygon.len()).map(|k| Coord { x: at(k)[u], y: at(k)[v] }).collect()
}
