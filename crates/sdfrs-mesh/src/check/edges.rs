//! Which faces share which edges.
//!
//! Half-edge h = 3 f + k runs from corner k of face f to the next. They are put into buckets by their lower vertex, and
//! each bucket is sorted by the other: linear but for vertices with very many faces.

use crate::{MeshError, Pulse};

/// No half-edge.
pub const NONE: u32 = u32::MAX;

/// The edges of a mesh.
#[derive(Debug, Clone)]
pub struct Edges {
    /// The half-edge on the other side of each: one that runs the other way if there is one, and its own partner's.
    pub across: Vec<u32>,
    /// A half-edge of each edge along which more faces run one way than the other, and how many more run its way.
    pub surplus: Vec<(u32, i32)>,
}

impl Edges {
    pub fn new(faces: &[[u32; 3]], vertices: usize, pulse: &mut Pulse) -> Result<Self, MeshError> {
        let (places, mut bucket) = buckets(faces, vertices, pulse)?;
        let mut edges = Self { across: pulse.filled(NONE, bucket.len())?, surplus: Vec::new() };
        for v in 0..vertices {
            pulse.beat()?;
            let own = &mut bucket[places[v] as usize..places[v + 1] as usize];
            own.sort_unstable();
            for group in own.chunk_by(|a, b| a >> 33 == b >> 33) {
                edges.add(group);
            }
        }
        Ok(edges)
    }

    /// One edge, from those that run downwards to those that run upwards.
    fn add(&mut self, group: &[u64]) {
        let name = |entry: u64| (entry as u32, entry >> 32 & 1 == 1);
        if let &[a, b] = group {
            let ((a, a_up), (b, b_up)) = (name(a), name(b));
            (self.across[a as usize], self.across[b as usize]) = (b, a);
            if a_up == b_up {
                self.surplus.push((a, 2));
            }
            return;
        }
        let down = group.iter().filter(|&&entry| !name(entry).1).count();
        let up = group.len() - down;
        for i in 0..up.min(down) {
            let (a, b) = (name(group[i]).0, name(group[down + i]).0);
            (self.across[a as usize], self.across[b as usize]) = (b, a);
        }
        if up != down {
            let first = if up > down { group[down] } else { group[0] };
            self.surplus.push((name(first).0, up.abs_diff(down) as i32));
        }
    }
}

/// Where each lower vertex's half-edges begin, and all of them as other vertex, whether it runs upwards, half-edge.
fn buckets(
    faces: &[[u32; 3]],
    vertices: usize,
    pulse: &mut Pulse,
) -> Result<(Vec<u32>, Vec<u64>), MeshError> {
    let ends = |f: &[u32; 3], k: usize| (f[k], f[(k + 1) % 3]);
    let lower = |f: &[u32; 3]| {
        let [a, b, c] = *f;
        [a.min(b) as usize, b.min(c) as usize, c.min(a) as usize]
    };
    let mut places = starts(vertices, faces.iter().flat_map(lower), pulse)?;
    pulse.ask()?;
    let mut bucket = vec![0_u64; 3 * faces.len()];
    for (i, f) in faces.iter().enumerate() {
        pulse.beat()?;
        for k in 0..3 {
            let (a, b) = ends(f, k);
            let place = &mut places[a.min(b) as usize];
            bucket[*place as usize] = u64::from(a.max(b)) << 33 | u64::from(a < b) << 32 | (3 * i + k) as u64;
            *place += 1;
        }
    }
    rewind(&mut places);
    Ok((places, bucket))
}

/// Where each of `n` buckets begins, and the end of the last.
pub fn starts(
    n: usize,
    members: impl Iterator<Item = usize>,
    pulse: &mut Pulse,
) -> Result<Vec<u32>, MeshError> {
    let mut places = vec![0_u32; n + 1];
    for member in members {
        pulse.beat()?;
        places[member] += 1;
    }
    let mut at = 0;
    for place in &mut places {
        at += std::mem::replace(place, at);
    }
    Ok(places)
}

/// After each place has been moved to its bucket's end, which is where the next begins.
pub fn rewind(places: &mut [u32]) {
    places.rotate_right(1);
    places[0] = 0;
}
