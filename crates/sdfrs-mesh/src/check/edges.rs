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
    pub boundary: u64,
    pub nonmanifold: u64,
    pub misoriented: u64,
    /// Edges with an odd number of faces.
    pub odd: u64,
}

impl Edges {
    pub fn new(faces: &[[u32; 3]], vertices: usize) -> Self {
        Self::with_extra(faces, &[], vertices)
    }

    /// The faces of `extra` are numbered after those of `faces`.
    pub fn with_extra(faces: &[[u32; 3]], extra: &[[u32; 3]], vertices: usize) -> Self {
        let (places, mut bucket) = buckets(faces, extra, vertices);
        let mut edges = Self {
            of: vec![0; bucket.len()],
            surplus: Vec::with_capacity(bucket.len() / 2),
            boundary: 0,
            nonmanifold: 0,
            misoriented: 0,
            odd: 0,
        };
        for v in 0..vertices {
            let own = &mut bucket[places[v] as usize..places[v + 1] as usize];
            own.sort_unstable();
            for group in own.chunk_by(|a, b| a >> 32 == b >> 32) {
                edges.add(group, |h| corner(faces, extra, h) == v as u32);
            }
        }
        edges
    }

    /// One edge: its half-edges, and whether one of them runs upwards.
    fn add(&mut self, group: &[u64], up: impl Fn(u32) -> bool) {
        let name = self.surplus.len() as u32;
        let mut surplus = 0_i32;
        for &entry in group {
            let h = entry as u32;
            self.of[h as usize] = name;
            surplus += if up(h) { 1 } else { -1 };
        }
        self.surplus.push(surplus);
        let odd = group.len() % 2 == 1;
        self.boundary += u64::from(group.len() == 1);
        self.nonmanifold += u64::from(group.len() > 2);
        self.odd += u64::from(odd);
        self.misoriented += u64::from(surplus.unsigned_abs() > u32::from(odd));
    }

    /// Vertices of more than one fan. The corners around a vertex are a cycle where every edge has one face on each side;
    /// where some edge has not, nothing is looked for.
    pub fn nonmanifold_vertices(&self, faces: &[[u32; 3]], extra: &[[u32; 3]], vertices: usize) -> u64 {
        if self.odd + self.nonmanifold + self.misoriented > 0 {
            return 0;
        }
        let mut pair = vec![[u32::MAX; 2]; self.surplus.len()];
        for (h, &edge) in self.of.iter().enumerate() {
            let place = &mut pair[edge as usize];
            place[usize::from(place[0] != u32::MAX)] = h as u32;
        }
        let mut seen = vec![false; self.of.len()];
        let mut fans = vec![0_u8; vertices];
        for start in 0..self.of.len() {
            if std::mem::replace(&mut seen[start], true) {
                continue;
            }
            let fan = &mut fans[corner(faces, extra, start as u32) as usize];
            *fan = fan.saturating_add(1);
            let mut h = start as u32;
            loop {
                // The half-edge into this corner, and its other side, which leaves from it.
                let into = h - h % 3 + (h + 2) % 3;
                let [a, b] = pair[self.of[into as usize] as usize];
                h = if a == into { b } else { a };
                if std::mem::replace(&mut seen[h as usize], true) {
                    break;
                }
            }
        }
        fans.iter().filter(|&&fans| fans > 1).count() as u64
    }
}

/// The vertex from which half-edge `h` runs.
fn corner(faces: &[[u32; 3]], extra: &[[u32; 3]], h: u32) -> u32 {
    let (f, k) = ((h / 3) as usize, (h % 3) as usize);
    if f < faces.len() { faces[f][k] } else { extra[f - faces.len()][k] }
}

/// Where each lower vertex's half-edges begin, and all of them as (other vertex, half-edge).
fn buckets(faces: &[[u32; 3]], extra: &[[u32; 3]], vertices: usize) -> (Vec<u32>, Vec<u64>) {
    let mut places = vec![0_u32; vertices + 1];
    let ends = |f: &[u32; 3], k: usize| {
        let (a, b) = (f[k], f[(k + 1) % 3]);
        (a.min(b) as usize, a.max(b))
    };
    for f in faces.iter().chain(extra) {
        for k in 0..3 {
            places[ends(f, k).0] += 1;
        }
    }
    let mut at = 0;
    for place in &mut places {
        at += std::mem::replace(place, at);
    }
    let mut bucket = vec![0_u64; 3 * (faces.len() + extra.len())];
    let mut next = places.clone();
    for (i, f) in faces.iter().chain(extra).enumerate() {
        for k in 0..3 {
            let (low, high) = ends(f, k);
            bucket[next[low] as usize] = u64::from(high) << 32 | (3 * i + k) as u64;
            next[low] += 1;
        }
    }
    (places, bucket)
}
