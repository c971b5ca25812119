//! Which faces share which edges.
//!
//! Half-edge h = 3 f + k runs from corner k of face f to the next. They are put into buckets by their lower vertex, and
//! each bucket is sorted by the other: linear but for vertices with very many faces.

/// The edges of a mesh.
#[derive(Debug, Clone)]
pub struct Edges {
    /// The edge of each half-edge.
    pub of: Vec<u32>,
    /// How many faces run from the lower vertex to the higher, less those that run back.
    pub surplus: Vec<i32>,
}

impl Edges {
    pub fn new(faces: &[[u32; 3]], vertices: usize) -> Self {
        let (places, mut bucket) = buckets(faces, vertices);
        let mut edges = Self { of: vec![0; bucket.len()], surplus: Vec::with_capacity(bucket.len() / 2) };
        for v in 0..vertices {
            let own = &mut bucket[places[v] as usize..places[v + 1] as usize];
            own.sort_unstable();
            for group in own.chunk_by(|a, b| a >> 32 == b >> 32) {
                let name = edges.surplus.len() as u32;
                let mut surplus = 0;
                for &entry in group {
                    let h = entry as u32 as usize;
                    edges.of[h] = name;
                    surplus += if faces[h / 3][h % 3] == v as u32 { 1 } else { -1 };
                }
                edges.surplus.push(surplus);
            }
        }
        edges
    }
}

/// Where each lower vertex's half-edges begin, and all of them as (other vertex, half-edge).
fn buckets(faces: &[[u32; 3]], vertices: usize) -> (Vec<u32>, Vec<u64>) {
    let ends = |f: &[u32; 3], k: usize| {
        let (a, b) = (f[k], f[(k + 1) % 3]);
        (a.min(b) as usize, a.max(b))
    };
    let mut places = starts(vertices, faces.iter().flat_map(|f| (0..3).map(move |k| ends(f, k).0)));
    let mut bucket = vec![0_u64; 3 * faces.len()];
    for (i, f) in faces.iter().enumerate() {
        for k in 0..3 {
            let (low, high) = ends(f, k);
            bucket[places[low] as usize] = u64::from(high) << 32 | (3 * i + k) as u64;
            places[low] += 1;
        }
    }
    rewind(&mut places);
    (places, bucket)
}

/// Where each of `n` buckets begins, and the end of the last.
pub fn starts(n: usize, members: impl Iterator<Item = usize>) -> Vec<u32> {
    let mut places = vec![0_u32; n + 1];
    for member in members {
        places[member] += 1;
    }
    let mut at = 0;
    for place in &mut places {
        at += std::mem::replace(place, at);
    }
    places
}

/// After each place has been moved to its bucket's end, which is where the next begins.
pub fn rewind(places: &mut [u32]) {
    places.rotate_right(1);
    places[0] = 0;
}
