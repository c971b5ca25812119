//! Equal vertices, equal faces, and what hangs together.
//!
//! The hash is seeded anew in every process: no file can be made to collide. What is found doesn't depend on it.

use super::frame::Frame;
use crate::Mesh;
use foldhash::fast::RandomState;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

const NONE: u32 = u32::MAX;

pub struct Weld {
    /// Used vertices in the unit frame, in the order of their first use by index.
    pub vertices: Vec<[f64; 3]>,
    /// The new index of each old one.
    pub of: Vec<u32>,
    pub welded: u64,
    pub unused: u64,
}

/// One vertex for every place that `faces` use.
pub fn weld(mesh: &Mesh, faces: &[[u32; 3]], frame: &Frame) -> Weld {
    let mut of = vec![NONE; mesh.vertices.len()];
    for &v in faces.iter().flatten() {
        of[v as usize] = 0;
    }
    let used = of.iter().filter(|&&new| new == 0).count();
    let mut seen: HashMap<[u64; 3], u32, RandomState> =
        HashMap::with_capacity_and_hasher(used, RandomState::default());
    let mut vertices = Vec::with_capacity(used);
    for (new, &p) in of.iter_mut().zip(&mesh.vertices) {
        if *new == NONE {
            continue;
        }
        let unit = frame.unit(p);
        *new = *seen.entry(unit.map(f64::to_bits)).or_insert_with(|| {
            vertices.push(unit);
            (vertices.len() - 1) as u32
        });
    }
    let (welded, unused) = ((used - vertices.len()) as u64, (of.len() - used) as u64);
    Weld { vertices, of, welded, unused }
}

/// Keeps the first of faces with the same corners in the same order. Where the same corners are there in both orders,
/// all stay: such faces cancel each other, and which of them is superfluous nobody can say.
pub fn drop_duplicates(faces: &mut Vec<[u32; 3]>) {
    const FIRST: u8 = 0;
    const AGAIN: u8 = 1;
    const BOTH: u8 = 2;
    let mut seen: HashMap<[u32; 3], (u32, u8), RandomState> =
        HashMap::with_capacity_and_hasher(faces.len(), RandomState::default());
    let mut again = Vec::new();
    for (i, face) in faces.iter().enumerate() {
        let (key, even) = sorted(*face);
        match seen.entry(key) {
            Entry::Vacant(place) => {
                place.insert((i as u32, FIRST));
            }
            Entry::Occupied(mut place) => {
                let (first, state) = place.get_mut();
                let same = sorted(faces[*first as usize]).1 == even;
                *state = if same { (*state).max(AGAIN) } else { BOTH };
                again.push(i);
            }
        }
    }
    if again.is_empty() {
        return;
    }
    let mut drop = vec![false; faces.len()];
    for i in again {
        drop[i] = seen.get(&sorted(faces[i]).0).is_some_and(|&(_, state)| state == AGAIN);
    }
    let mut at = 0;
    faces.retain(|_| {
        at += 1;
        !drop[at - 1]
    });
}

/// The corners in rising order, and whether that took an even number of swaps.
fn sorted([mut a, mut b, mut c]: [u32; 3]) -> ([u32; 3], bool) {
    let mut even = true;
    for _ in 0..2 {
        if a > b {
            (a, b, even) = (b, a, !even);
        }
        if b > c {
            (b, c, even) = (c, b, !even);
        }
    }
    ([a, b, c], even)
}

/// How many parts have no vertex in common.
pub fn components(faces: &[[u32; 3]], vertices: usize) -> u64 {
    let mut parent: Vec<u32> = (0..vertices as u32).collect();
    let mut used = vec![false; vertices];
    let mut parts = 0;
    for face in faces {
        for &v in face {
            if !std::mem::replace(&mut used[v as usize], true) {
                parts += 1;
            }
        }
        let first = root(&mut parent, face[0]);
        for &v in &face[1..] {
            let other = root(&mut parent, v);
            if other != first {
                parent[other as usize] = first;
                parts -= 1;
            }
        }
    }
    parts
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
