//! Polygons as arrays have them: signed indices, compared with the number of vertices before they are believed.
//!
//! Law: the triangles' areas add up to the polygon's, concave ones too, and none is turned over (tests below).

use sdfrs_mesh::{Mesh, MeshError, Pulse, Watch, read::polygon::Polygons};

/// A mesh of polygons given as the corners of all of them, one after the other, and each one's count.
/// Given up when the watch says so.
pub fn of_polygons(
    vertices: Vec<[f64; 3]>,
    corners: &[i64],
    counts: &[u32],
    watch: &dyn Watch,
) -> Result<Mesh, MeshError> {
    let mut pulse = Pulse::new(watch);
    let most = vertices.len() as i64;
    let total: u64 = counts.iter().map(|&n| u64::from(n)).sum();
    if total != corners.len() as u64 {
        let message = format!("{} corners given for polygons of {total} in all", corners.len());
        return Err(MeshError::bad("faces", message));
    }
    let mut polygons = Polygons::of(vertices);
    let mut rest = corners.iter();
    for (face, &n) in counts.iter().enumerate() {
        pulse.beat()?;
        for &corner in rest.by_ref().take(n as usize) {
            let vertex = u32::try_from(corner).ok().filter(|_| corner < most).ok_or_else(|| {
                let allowed = if most == 0 {
                    "there are none".into()
                } else {
                    format!("0 to {} are allowed", most - 1)
                };
                MeshError::bad(format!("face {face}"), format!("vertex {corner} given; {allowed}"))
            })?;
            polygons.corner(vertex);
        }
        polygons.end(face as u64);
    }
    polygons.mesh(|face| format!("face {face}"), &mut pulse)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| a[i] - b[i])
    }

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
                let mesh = of_polygons(polygon.clone(), corners, &[n], &()).unwrap();
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
            let error = of_polygons(v.clone(), &corners, &counts, &()).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
        assert!(
            of_polygons(vec![], &[0, 0, 0], &[3], &()).unwrap_err().to_string().contains("there are none")
        );
    }
}
