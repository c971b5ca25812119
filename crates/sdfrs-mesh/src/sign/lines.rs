//! Parity: inside is where most of three rays, one along each axis, cross the faces an odd number of times.
//!
//! The crossings are exact (`cross`), so that a closed mesh is never misjudged; one vote of three may be lost to a hole.
//! Faces are found by a grid of buckets across each axis.

use super::cross::{Face, above, facing, meets};
use crate::check::Checked;
use crate::{MeshError, Pulse, Watch};

#[derive(Default)]
pub struct Lines([Buckets; 3]);

/// The faces over each square of a plane.
#[derive(Default)]
struct Buckets {
    side: usize,
    starts: Vec<u32>,
    faces: Vec<u32>,
}

/// The axis becomes z, and the others follow in order: no face changes its orientation.
fn turned(p: [f64; 3], axis: usize) -> [f64; 3] {
    [p[(axis + 1) % 3], p[(axis + 2) % 3], p[axis]]
}

impl Lines {
    pub fn new(mesh: &Checked, watch: &dyn Watch) -> Result<Self, MeshError> {
        let mut pulse = Pulse::new(watch);
        let [x, y, z] = [0, 1, 2].map(|axis| Buckets::new(mesh, axis, &mut pulse));
        Ok(Self([x?, y?, z?]))
    }

    pub fn inside(&self, mesh: &Checked, p: [f64; 3]) -> bool {
        let votes = (0..3).filter(|&axis| {
            let p = turned(p, axis);
            let crossed = self.0[axis].over(p).iter().filter(|&&face| {
                let face: Face = mesh.corners(face as usize).map(|v| turned(v, axis));
                let way = facing(&face);
                way != 0 && meets(&face, way, [p[0], p[1]]) && !above(&face, way, p)
            });
            crossed.count() % 2 == 1
        });
        votes.count() >= 2
    }
}

impl Buckets {
    /// As many squares as faces, about, unless faces are so large that the lists would be too long.
    fn new(mesh: &Checked, axis: usize, pulse: &mut Pulse) -> Result<Self, MeshError> {
        let faces = mesh.faces.len();
        let mut side = (faces as f64).sqrt().ceil().clamp(1.0, 2048.0) as usize;
        loop {
            let total = (0..faces).try_fold(0, |total, f| {
                pulse.beat()?;
                Ok(total + squares(mesh, f, axis, side).map(|r| r.len()).iter().product::<usize>())
            })?;
            if side == 1 || total <= 16 * faces + 1024 {
                return Self::of(mesh, axis, side, pulse);
            }
            side = side.div_ceil(2);
        }
    }

    fn of(mesh: &Checked, axis: usize, side: usize, pulse: &mut Pulse) -> Result<Self, MeshError> {
        let all = || {
            (0..mesh.faces.len()).flat_map(move |f| {
                let [xs, ys] = squares(mesh, f, axis, side);
                ys.flat_map(move |y| xs.clone().map(move |x| (x + side * y, f as u32)))
            })
        };
        let mut starts = vec![0_u32; side * side + 1];
        for (square, _) in all() {
            pulse.beat()?;
            starts[square] += 1;
        }
        let mut at = 0;
        for start in &mut starts {
            at += std::mem::replace(start, at);
        }
        let mut faces = vec![0_u32; at as usize];
        for (square, face) in all() {
            pulse.beat()?;
            faces[starts[square] as usize] = face;
            starts[square] += 1;
        }
        starts.rotate_right(1);
        starts[0] = 0;
        Ok(Self { side, starts, faces })
    }

    /// The faces over the square of a point.
    fn over(&self, p: [f64; 3]) -> &[u32] {
        let square = place(p[0], self.side) + self.side * place(p[1], self.side);
        &self.faces[self.starts[square] as usize..self.starts[square + 1] as usize]
    }
}

/// The square of a coordinate; those beyond the mesh belong to the outermost ones.
fn place(x: f64, side: usize) -> usize {
    // Casting clamps what is below 0.
    (((x + 1.0) * (0.5 * side as f64)) as usize).min(side - 1)
}

fn squares(mesh: &Checked, face: usize, axis: usize, side: usize) -> [std::ops::Range<usize>; 2] {
    let corners = mesh.corners(face).map(|v| turned(v, axis));
    [0, 1].map(|i| {
        let places = corners.map(|v| place(v[i], side));
        let [a, b, c] = places;
        a.min(b).min(c)..a.max(b).max(c) + 1
    })
}
