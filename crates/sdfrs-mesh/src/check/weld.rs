//! Equal vertices, and what hangs together.
//!
//! The hash is seeded anew in every process: no file can be made to collide. What is found doesn't depend on it.

use super::frame::Frame;
use crate::{Mesh, MeshError, Pulse};
use hashbrown::HashTable;
use hashbrown::hash_table::Entry;
use std::hash::BuildHasher;

const NONE: u32 = u32::MAX;

pub struct Weld {
    /// Used vertices in the unit frame, in the order of their first mention in the mesh.
    pub vertices: Vec<[f64; 3]>,
    /// The new index of each old one.
    pub of: Vec<u32>,
    pub welded: u64,
    pub unused: u64,
}

/// One vertex for every place among the `used` ones.
pub fn weld(mesh: &Mesh, used: &[bool], frame: &Frame, pulse: &mut Pulse) -> Result<Weld, MeshError> {
    let count = used.iter().filter(|&&used| used).count();
    let mut of = vec![NONE; used.len()];
    let mut vertices: Vec<[f64; 3]> = Vec::with_capacity(count);
    let state = foldhash::fast::RandomState::default();
    let bits = |p: &[f64; 3]| p.map(f64::to_bits);
    let mut seen: HashTable<u32> = HashTable::with_capacity(count);
    for ((new, &p), _) in of.iter_mut().zip(&mesh.vertices).zip(used).filter(|(_, used)| **used) {
        pulse.beat()?;
        let unit = frame.unit(p);
        let same = |&i: &u32| vertices[i as usize] == unit;
        let hash = |&i: &u32| state.hash_one(bits(&vertices[i as usize]));
        *new = match seen.entry(state.hash_one(bits(&unit)), same, hash) {
            Entry::Occupied(place) => *place.get(),
            Entry::Vacant(place) => {
                let name = vertices.len() as u32;
                place.insert(name);
                vertices.push(unit);
                name
            }
        };
    }
    let (welded, unused) = ((count - vertices.len()) as u64, (used.len() - count) as u64);
    Ok(Weld { vertices, of, welded, unused })
}

/// How many parts have no vertex in common.
pub fn components(faces: &[[u32; 3]], vertices: usize, pulse: &mut Pulse) -> Result<u64, MeshError> {
    let mut parent: Vec<u32> = (0..vertices as u32).collect();
    let mut used = vec![false; vertices];
    for face in faces {
        pulse.beat()?;
        for &v in face {
            used[v as usize] = true;
        }
        let first = root(&mut parent, face[0]);
        for &v in &face[1..] {
            let other = root(&mut parent, v);
            parent[other as usize] = first;
        }
    }
    Ok((0..vertices).filter(|&v| used[v] && parent[v] == v as u32).count() as u64)
}

/// The part's name, with every second step of the way shortened.
fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        let above = parent[parent[v as usize] as usize];
        parent[v as usize] = above;
        v = above;
    }
    v
}
