//! Is this a mesh, and what is wrong with it?
//!
//! Whatever cannot be baked is refused with the element's name. The rest is brought into the unit frame: the middle of
//! the box of all faces at the origin, divided by a power of two, so that the division is exact and a mesh 1e8 away or
//! 1e-20 small bakes like any other. Vertices in exactly the same place become one (a soup of separate triangles, as in
//! STL files, has edges then). Faces without area are dropped, and so are all but the first of equal faces; both are
//! counted.
//!
//! Law: offsets and scales by powers of two change no finding and no bit of the result (`tests/check.rs`).

mod edges;
mod frame;
mod survey;
mod weld;

use crate::{Mesh, MeshError, Pulse, Watch};
use glam::DVec3;
use rayon::prelude::*;

pub(crate) use edges::{Edges, NONE};
use frame::{Flat, Frame, flatness};

/// The most faces: half-edges are numbered by u32.
pub const MAX_FACES: u64 = (u32::MAX / 3) as u64;
/// The most vertices: an edge's two and its direction have to fit 64 bits with its number.
pub const MAX_VERTICES: u64 = (u32::MAX / 2) as u64;

/// Faces that a task looks at.
const CHUNK: usize = 4096;

/// A mesh to be believed, in the unit frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Checked {
    /// All different, all used, none beyond 1 (2 at the very end of f64) along any axis.
    pub vertices: Vec<[f64; 3]>,
    pub faces: Vec<[u32; 3]>,
    /// world = centre + scale * unit
    pub centre: [f64; 3],
    /// A power of two.
    pub scale: f64,
}

impl Checked {
    pub fn corners(&self, face: usize) -> [[f64; 3]; 3] {
        // Spelled out: as a `map` over the array it isn't inlined.
        let [a, b, c] = self.faces[face];
        [self.vertices[a as usize], self.vertices[b as usize], self.vertices[c as usize]]
    }

    pub(crate) fn points(&self, face: usize) -> [DVec3; 3] {
        let [a, b, c] = self.corners(face);
        [DVec3::from_array(a), DVec3::from_array(b), DVec3::from_array(c)]
    }
}

/// What was found. Edges, components and volume are those of the faces that were kept, needles included among the edges.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// As given.
    pub vertices: u64,
    pub faces: u64,
    /// Vertices in exactly the same place as an earlier one.
    pub welded_vertices: u64,
    /// Vertices that no face has.
    pub unused_vertices: u64,
    /// Dropped for their lack of area.
    pub degenerate_faces: u64,
    /// Those of them whose corners are three different points on a line.
    pub needle_faces: u64,
    /// Dropped because an earlier face has the same corners in the same order.
    pub duplicate_faces: u64,
    /// Edges of one face.
    pub boundary_edges: u64,
    /// Edges of more than two.
    pub nonmanifold_edges: u64,
    /// Vertices where several fans of faces meet (not looked for where edges are out of order).
    pub nonmanifold_vertices: u64,
    /// Edges along which neighbours disagree about what is outside.
    pub misoriented_edges: u64,
    /// Parts without a common vertex.
    pub components: u64,
    /// No edge has an odd number of faces.
    pub watertight: bool,
    /// No edge has more than two faces, no vertex more than one fan.
    pub manifold: bool,
    /// Along no edge do neighbours disagree.
    pub oriented: bool,
    /// Cubic world units; about the middle of the box where the mesh is open. Negative: the faces point inwards.
    pub signed_volume: f64,
    /// Of the faces kept, in world units.
    pub bounds: ([f64; 3], [f64; 3]),
}

impl Findings {
    /// The winding number is a whole number everywhere.
    pub fn closed(&self) -> bool {
        self.watertight && self.oriented
    }
}

/// Checks `mesh`, and brings it into the unit frame.
pub fn check(mesh: &Mesh) -> Result<(Checked, Findings), MeshError> {
    check_until(mesh, &())
}

/// The same, given up when the watch says so.
pub fn check_until(mesh: &Mesh, watch: &dyn Watch) -> Result<(Checked, Findings), MeshError> {
    let mut pulse = Pulse::new(watch);
    let pulse = &mut pulse;
    believe(mesh, pulse)?;
    let mut faces = Vec::with_capacity(mesh.faces.len());
    for part in mesh.faces.chunks(CHUNK) {
        pulse.ask()?;
        faces.extend_from_slice(part);
    }
    let used = frame::used(mesh, &faces, pulse)?;
    pulse.ask()?;
    let mut bounds = frame::bounds(mesh, &used);
    pulse.ask()?;
    let mut pass = Pass::new(mesh, &faces, &used, bounds, pulse)?;
    if pass.degenerate() > 0 {
        // A face without area mustn't stretch the frame either.
        faces.retain(|f| flatness(&f.map(|v| mesh.vertices[v as usize])) == Flat::No);
        let used = frame::used(mesh, &faces, pulse)?;
        let kept = frame::bounds(mesh, &used);
        if !faces.is_empty() && kept != bounds {
            bounds = kept;
            pass = Pass::new(mesh, &faces, &used, bounds, pulse)?;
        }
    }
    if pass.kept.is_empty() {
        return Err(MeshError::bad(
            "faces",
            format!("none of the {} has an area (corners in one place or on one line)", mesh.faces.len()),
        ));
    }
    pass.finish(mesh, bounds, pulse)
}

/// Sizes, coordinates, indices.
fn believe(mesh: &Mesh, pulse: &mut Pulse) -> Result<(), MeshError> {
    let (vertices, faces) = (mesh.vertices.len() as u64, mesh.faces.len() as u64);
    if vertices == 0 || faces == 0 {
        let message = format!("{vertices} vertices and {faces} faces given; at least 3 and 1 are needed");
        return Err(MeshError::bad("mesh", message));
    }
    for (what, got, most) in [("vertices", vertices, MAX_VERTICES), ("faces", faces, MAX_FACES)] {
        if got > most {
            return Err(MeshError::bad(what, format!("{got} given, at most {most} are allowed")));
        }
    }
    for (i, v) in mesh.vertices.iter().enumerate() {
        pulse.beat()?;
        if let Some(axis) = (0..3).find(|&axis| !v[axis].is_finite()) {
            let message =
                format!("{} is {}, but coordinates have to be finite", ["x", "y", "z"][axis], v[axis]);
            return Err(MeshError::bad(format!("vertex {i}"), message));
        }
    }
    for (i, f) in mesh.faces.iter().enumerate() {
        pulse.beat()?;
        if let Some(&v) = f.iter().find(|&&v| u64::from(v) >= vertices) {
            let message = format!("has vertex {v}, but the mesh has only 0 to {}", vertices - 1);
            return Err(MeshError::bad(format!("face {i}"), message));
        }
    }
    Ok(())
}

/// The mesh in one frame: welded, its flat faces set apart.
struct Pass {
    frame: Frame,
    vertices: Vec<[f64; 3]>,
    welded: u64,
    unused: u64,
    kept: Vec<[u32; 3]>,
    /// Flat, but with three different corners: their edges count.
    needles: Vec<[u32; 3]>,
    collapsed: u64,
}

impl Pass {
    fn new(
        mesh: &Mesh,
        faces: &[[u32; 3]],
        used: &[bool],
        bounds: ([f64; 3], [f64; 3]),
        pulse: &mut Pulse,
    ) -> Result<Self, MeshError> {
        let frame = Frame::around(bounds);
        let weld = weld::weld(mesh, used, &frame, pulse)?;
        let mut pass = Self {
            frame,
            vertices: weld.vertices,
            welded: weld.welded,
            unused: weld.unused,
            kept: Vec::with_capacity(faces.len()),
            needles: Vec::new(),
            collapsed: (mesh.faces.len() - faces.len()) as u64,
        };
        let flat = pass.flat(faces, &weld.of, pulse)?;
        for (face, flat) in faces.iter().zip(flat) {
            pulse.beat()?;
            let f = face.map(|v| weld.of[v as usize]);
            match flat {
                Flat::No => pass.kept.push(f),
                Flat::Needle => pass.needles.push(f),
                Flat::Collapsed => pass.collapsed += 1,
            }
        }
        Ok(pass)
    }

    /// What each face is; `of` names its welded vertices.
    fn flat(&self, faces: &[[u32; 3]], of: &[u32], pulse: &Pulse) -> Result<Vec<Flat>, MeshError> {
        let mut flat = vec![Flat::No; faces.len()];
        faces.par_chunks(CHUNK).zip(flat.par_chunks_mut(CHUNK)).try_for_each(|(faces, flat)| {
            pulse.ask()?;
            for (&[a, b, c], flat) in faces.iter().zip(flat) {
                let corner = |v: u32| self.vertices[of[v as usize] as usize];
                *flat = flatness(&[corner(a), corner(b), corner(c)]);
            }
            Ok(())
        })?;
        Ok(flat)
    }

    fn degenerate(&self) -> u64 {
        self.collapsed + self.needles.len() as u64
    }

    fn finish(
        mut self,
        mesh: &Mesh,
        bounds: ([f64; 3], [f64; 3]),
        pulse: &mut Pulse,
    ) -> Result<(Checked, Findings), MeshError> {
        let needles = std::mem::take(&mut self.needles);
        let degenerate = self.collapsed + needles.len() as u64;
        let (count, mut one, mut other) = (self.vertices.len(), pulse.another(), pulse.another());
        // Duplicates connect what is connected already.
        let (edges, components) = rayon::join(
            || survey::survey(&self.kept, &needles, count, &mut one),
            || weld::components(&self.kept, count, &mut other),
        );
        let ((edges, dropped), components) = (edges?, components?);
        if edges.duplicates > 0 {
            let mut dropped = dropped.into_iter();
            self.kept.retain(|_| dropped.next() != Some(true));
        }
        let volume = volume(&self.vertices, &self.kept);
        pulse.ask()?;
        let findings = Findings {
            vertices: mesh.vertices.len() as u64,
            faces: mesh.faces.len() as u64,
            welded_vertices: self.welded,
            unused_vertices: self.unused,
            degenerate_faces: degenerate,
            needle_faces: needles.len() as u64,
            duplicate_faces: edges.duplicates,
            boundary_edges: edges.boundary,
            nonmanifold_edges: edges.nonmanifold,
            nonmanifold_vertices: edges.nonmanifold_vertices,
            misoriented_edges: edges.misoriented,
            components,
            watertight: edges.odd == 0,
            manifold: edges.nonmanifold == 0 && edges.nonmanifold_vertices == 0,
            oriented: edges.misoriented == 0,
            // The last factor first: scale^3 alone may leave f64 where the volume doesn't.
            signed_volume: volume * self.frame.scale * self.frame.scale * self.frame.scale,
            bounds,
        };
        let Frame { centre, scale } = self.frame;
        Ok((Checked { vertices: self.vertices, faces: self.kept, centre, scale }, findings))
    }
}

/// By tetrahedra from the origin, which is the middle of the box. Summed by parts of one size: the same bits for any number
/// of threads.
fn volume(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> f64 {
    let six = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| DVec3::from(vertices[v as usize]));
        a.dot(b.cross(c))
    };
    let parts: Vec<f64> = faces.par_chunks(CHUNK).map(|part| part.iter().map(six).sum()).collect();
    parts.iter().sum::<f64>() / 6.0
}
