//! What is out of order: equal faces, open, crowded and contradictory edges, vertices of several fans.
//!
//! One walk over the vertices, each with the list of its corners. A face is known by its lowest vertex, an edge by the
//! lower of its two.

use super::edges::{rewind, starts};
use crate::{MeshError, Pulse};

/// The counts, by the names of `Findings`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Survey {
    pub duplicates: u64,
    pub boundary: u64,
    pub nonmanifold: u64,
    pub nonmanifold_vertices: u64,
    pub misoriented: u64,
    /// Edges with an odd number of faces.
    pub odd: u64,
}

/// A face at one of its vertices.
#[derive(Debug, Clone, Copy)]
struct Corner {
    next: u32,
    prev: u32,
    face: u32,
}

/// Lists longer than this are sorted rather than searched.
const LONG: usize = 32;

/// Surveys `faces`, and `needles`, which have edges but no area; and says which of both are duplicates.
pub fn survey(
    faces: &[[u32; 3]],
    needles: &[[u32; 3]],
    vertices: usize,
    pulse: &mut Pulse,
) -> Result<(Survey, Vec<bool>), MeshError> {
    let (places, mut corners) = corners(faces, needles, vertices, pulse)?;
    let mut found = Survey::default();
    let mut dropped = vec![false; faces.len() + needles.len()];
    let (mut edges, mut link) = (Vec::new(), Vec::new());
    for v in 0..vertices {
        pulse.beat()?;
        let own = &mut corners[places[v] as usize..places[v + 1] as usize];
        if whole(own) {
            continue;
        }
        if own.len() > LONG {
            own.sort_unstable_by_key(|c| (c.next.min(c.prev), c.next.max(c.prev), c.face));
        }
        found.duplicates += duplicates(own, v as u32, faces.len(), &mut dropped);
        let own = own.iter().filter(|c| !dropped[c.face as usize]);
        edges.clear();
        link.clear();
        for corner in own {
            link.push((corner.next, corner.prev));
            for (other, way) in [(corner.next, 1), (corner.prev, -1)] {
                if other > v as u32 {
                    edges.push((other, way));
                }
            }
        }
        found.edges(&mut edges);
        found.nonmanifold_vertices += u64::from(fans(&mut link) > 1);
    }
    Ok((found, dropped))
}

/// Where each vertex's corners begin, and all of them.
fn corners(
    faces: &[[u32; 3]],
    needles: &[[u32; 3]],
    vertices: usize,
    pulse: &mut Pulse,
) -> Result<(Vec<u32>, Vec<Corner>), MeshError> {
    let all = || faces.iter().chain(needles);
    let mut places = starts(vertices, all().flatten().map(|&v| v as usize), pulse)?;
    pulse.ask()?;
    let mut corners =
        pulse.filled(Corner { next: 0, prev: 0, face: 0 }, 3 * (faces.len() + needles.len()))?;
    for (face, f) in all().enumerate() {
        pulse.beat()?;
        for k in 0..3 {
            let place = &mut places[f[k] as usize];
            corners[*place as usize] =
                Corner { next: f[(k + 1) % 3], prev: f[(k + 2) % 3], face: face as u32 };
            *place += 1;
        }
    }
    rewind(&mut places);
    Ok((places, corners))
}

/// Whether the faces around a vertex are one closed fan, so that there is nothing to report. Sorts them on the way.
fn whole(own: &mut [Corner]) -> bool {
    let Some(last) = own.len().checked_sub(1).filter(|&last| last < LONG) else { return own.is_empty() };
    for i in 0..last {
        let to = own[i].prev;
        let mut next = (i + 1..=last).filter(|&j| own[j].next == to);
        let (Some(j), None) = (next.next(), next.next()) else { return false };
        if to == own[0].next {
            return false;
        }
        own.swap(i + 1, j);
    }
    own[last].prev == own[0].next
}

/// Marks all but the first of the faces that are equal and have `v` as their lowest vertex. Where the same corners are
/// there in both orders, all stay: such faces cancel each other, and which of them is superfluous nobody can say.
/// Long lists come sorted, so that equal ones are neighbours.
fn duplicates(own: &[Corner], v: u32, faces: usize, dropped: &mut [bool]) -> u64 {
    let lowest = |c: &Corner| c.next > v && c.prev > v && (c.face as usize) < faces;
    let same = |a: &Corner, b: &Corner| (a.next, a.prev) == (b.next, b.prev);
    let turned = |a: &Corner, b: &Corner| (a.next, a.prev) == (b.prev, b.next);
    let sorted = own.len() > LONG;
    let mut count = 0;
    for (i, corner) in own.iter().enumerate().filter(|(_, c)| lowest(c)) {
        let equal = |other: &&Corner| same(corner, other) || turned(corner, other);
        let (mut before, mut both) = (false, false);
        let mut meet = |other: &Corner, earlier: bool| {
            if lowest(other) {
                before |= earlier && same(corner, other);
                both |= turned(corner, other);
            }
        };
        if sorted {
            own[..i].iter().rev().take_while(equal).for_each(|other| meet(other, true));
            own[i + 1..].iter().take_while(equal).for_each(|other| meet(other, false));
        } else {
            own[..i].iter().for_each(|other| meet(other, true));
            own[i + 1..].iter().for_each(|other| meet(other, false));
        }
        if before && !both {
            dropped[corner.face as usize] = true;
            count += 1;
        }
    }
    count
}

impl Survey {
    /// The edges of one vertex to higher ones: the other end, and 1 for a face that runs there, -1 for one that runs back.
    fn edges(&mut self, edges: &mut [(u32, i32)]) {
        edges.sort_unstable();
        for group in edges.chunk_by(|a, b| a.0 == b.0) {
            let odd = group.len() % 2 == 1;
            let surplus: i64 = group.iter().map(|&(_, way)| i64::from(way)).sum();
            self.boundary += u64::from(group.len() == 1);
            self.nonmanifold += u64::from(group.len() > 2);
            self.odd += u64::from(odd);
            self.misoriented += u64::from(surplus.unsigned_abs() > u64::from(odd));
        }
    }
}

/// Into how many fans a vertex's corners fall; 1 also where some edge is crowded or contradictory and nothing can be said.
/// The faces' far edges lead from vertex to vertex around it: each closed round or open row of them is a fan.
fn fans(link: &mut [(u32, u32)]) -> usize {
    link.sort_unstable();
    if link.windows(2).any(|pair| pair[0].0 == pair[1].0) {
        return 1;
    }
    let after = |v: u32| link.binary_search_by_key(&v, |&(from, _)| from).ok();
    let mut into = vec![false; link.len()];
    for &(_, to) in link.iter() {
        if let Some(next) = after(to)
            && std::mem::replace(&mut into[next], true)
        {
            return 1;
        }
    }
    let rows = into.iter().filter(|&&into| !into).count();
    // What isn't in a row is in a round.
    let mut seen = vec![false; link.len()];
    let mut walk = |start: usize| {
        let mut at = Some(start);
        let mut length = 0;
        while let Some(here) = at.filter(|&here| !seen[here]) {
            seen[here] = true;
            length += 1;
            at = after(link[here].1);
        }
        length
    };
    for start in (0..into.len()).filter(|&start| !into[start]) {
        walk(start);
    }
    rows + (0..into.len()).filter(|&start| walk(start) > 0).count()
}
