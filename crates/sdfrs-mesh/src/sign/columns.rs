//! Whole winding numbers at all nodes of a grid: along each column, +1 where a face is entered, -1 where one is left.
//!
//! Exact for closed meshes, with whatever overlaps and wherever nodes lie on edges, and cheaper than any test by node:
//! a few nanoseconds a column and face. For the parity rule, crossings are counted without their direction.

use super::cross::{Face, above, facing, meets};
use crate::check::Checked;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Where each column of a grid's nodes is inside.
pub struct Columns {
    nx: usize,
    /// Whether the space around the mesh is inside.
    around: bool,
    /// Where each column's list begins; x fastest.
    starts: Vec<u32>,
    /// The nodes from which on it is otherwise.
    turns: Vec<u32>,
}

/// What makes a node inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// The winding number is at least this.
    AtLeast(i32),
    Odd,
}

impl Rule {
    fn inside(self, winding: i32, crossings: u32) -> bool {
        match self {
            Self::AtLeast(least) => winding >= least,
            Self::Odd => crossings % 2 == 1,
        }
    }
}

impl Columns {
    /// `axes` are the nodes' coordinates in the unit frame, rising. Nothing where it would take more than `budget` bytes.
    pub fn new(mesh: &Checked, axes: [&[f64]; 3], rule: Rule, budget: u64) -> Option<Self> {
        let mut lists = Lists::new(mesh, axes, budget)?;
        let (around, mut kept) = (rule.inside(0, 0), 0);
        for column in 0..lists.starts.len() - 1 {
            let own = lists.starts[column] as usize..lists.starts[column + 1] as usize;
            lists.starts[column] = kept as u32;
            let (mut winding, mut count, mut was) = (0, 0, around);
            for i in own.clone() {
                let crossing = lists.crossings[i];
                winding += step(crossing);
                count += 1;
                // What happens between the same two nodes happens at once.
                let last = i + 1 == own.end || lists.crossings[i + 1] >> 1 != crossing >> 1;
                let is = if last { rule.inside(winding, count) } else { was };
                if is != was {
                    lists.crossings[kept] = crossing >> 1;
                    kept += 1;
                    was = is;
                }
            }
        }
        if let Some(end) = lists.starts.last_mut() {
            *end = kept as u32;
        }
        lists.crossings.truncate(kept);
        Some(Self { nx: axes[0].len(), around, starts: lists.starts, turns: lists.crossings })
    }

    /// Whether node (i, j, k) is inside.
    #[inline]
    pub fn inside(&self, i: usize, j: usize, k: usize) -> bool {
        let turned = self.turns(i, j).partition_point(|&turn| turn as usize <= k) % 2 == 1;
        turned != self.around
    }

    /// The nodes of column (i, j) from which on it is inside, outside, inside ..., or the other way round where the space
    /// around the mesh is inside. Some may lie beyond the last.
    pub fn turns(&self, i: usize, j: usize) -> &[u32] {
        let column = i + self.nx * j;
        &self.turns[self.starts[column] as usize..self.starts[column + 1] as usize]
    }
}

/// The least and the largest winding number at the nodes of a grid.
pub fn extremes(mesh: &Checked, axes: [&[f64]; 3], budget: u64) -> Option<(i32, i32)> {
    let lists = Lists::new(mesh, axes, budget)?;
    let (mut least, mut most) = (0, 0);
    for ends in lists.starts.windows(2) {
        let own = &lists.crossings[ends[0] as usize..ends[1] as usize];
        let mut winding = 0;
        for node in own.chunk_by(|a, b| a >> 1 == b >> 1) {
            winding += node.iter().map(|&crossing| step(crossing)).sum::<i32>();
            (least, most) = (least.min(winding), most.max(winding));
        }
    }
    Some((least, most))
}

/// A crossing is the first node above it, doubled, and 1 where the mesh is entered.
fn step(crossing: u32) -> i32 {
    if crossing & 1 == 1 { 1 } else { -1 }
}

/// The crossings of each column, sorted.
struct Lists {
    starts: Vec<u32>,
    crossings: Vec<u32>,
}

/// At the most, while they are sorted.
const BYTES_PER_CROSSING: u64 = 24;
const CHUNK: usize = 1024;

impl Lists {
    fn new(mesh: &Checked, axes: [&[f64]; 3], budget: u64) -> Option<Self> {
        let [xs, ys, zs] = axes.map(|axis| axis.len() as u64);
        let columns = xs.checked_mul(ys).filter(|&n| n < u64::from(u32::MAX) && zs < 1 << 31)?;
        let limit = (budget.checked_sub(4 * columns)? / BYTES_PER_CROSSING).min(u64::from(u32::MAX));
        let found = gather(mesh, axes, limit)?;
        let all = || found.iter().flatten();
        let mut starts = vec![0_u32; columns as usize + 1];
        for &(column, _) in all() {
            starts[column as usize] += 1;
        }
        let mut at = 0;
        for start in &mut starts {
            at += std::mem::replace(start, at);
        }
        let mut crossings = vec![0_u32; at as usize];
        for &(column, crossing) in all() {
            let place = &mut starts[column as usize];
            crossings[*place as usize] = crossing;
            *place += 1;
        }
        // Each place is now its list's end, which is where the next begins.
        starts.rotate_right(1);
        starts[0] = 0;
        for ends in starts.windows(2) {
            crossings[ends[0] as usize..ends[1] as usize].sort_unstable();
        }
        Some(Self { starts, crossings })
    }
}

/// All crossings as (column, crossing), if there are at most `limit`.
fn gather(mesh: &Checked, axes: [&[f64]; 3], limit: u64) -> Option<Vec<Vec<(u32, u32)>>> {
    let count = AtomicU64::new(0);
    let chunks = (0..mesh.faces.len()).into_par_iter().step_by(CHUNK);
    chunks
        .map(|first| {
            let mut own = Vec::new();
            for face in first..(first + CHUNK).min(mesh.faces.len()) {
                let before = own.len();
                cross(&mesh.corners(face), axes, &mut own, limit);
                let more = (own.len() - before) as u64;
                if count.fetch_add(more, Ordering::Relaxed) + more > limit {
                    return None;
                }
            }
            Some(own)
        })
        .collect()
}

/// Adds each column that a face meets, with the first node above it and whether it is entered there.
fn cross(face: &Face, [xs, ys, zs]: [&[f64]; 3], out: &mut Vec<(u32, u32)>, limit: u64) {
    let facing = facing(face);
    if facing == 0 {
        return;
    }
    let (js, levels) = (within(ys, face, 1), within(zs, face, 2));
    for j in js {
        for i in row(face, ys[j], xs) {
            if !meets(face, facing, [xs[i], ys[j]]) {
                continue;
            }
            let between = &zs[levels.clone()];
            let first = levels.start + between.partition_point(|&z| !above(face, facing, [xs[i], ys[j], z]));
            out.push(((i + xs.len() * j) as u32, (first as u32) << 1 | u32::from(facing < 0)));
        }
        if out.len() as u64 > limit {
            return;
        }
    }
}

/// The nodes along an axis that lie within a face's extent.
fn within(nodes: &[f64], face: &Face, axis: usize) -> std::ops::Range<usize> {
    let lo = face[0][axis].min(face[1][axis]).min(face[2][axis]);
    let hi = face[0][axis].max(face[1][axis]).max(face[2][axis]);
    let start = nodes.partition_point(|&x| x < lo);
    start..start + nodes[start..].partition_point(|&x| x <= hi)
}

/// The nodes of a row that may lie within a face: of a long one, only those between its edges there, rounding included.
fn row(face: &Face, y: f64, xs: &[f64]) -> std::ops::Range<usize> {
    let all = within(xs, face, 0);
    if all.len() < 8 {
        return all;
    }
    let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
    for k in 0..3 {
        let (a, b) = (face[k], face[(k + 1) % 3]);
        if !(a[1].min(b[1]) <= y && y <= a[1].max(b[1])) {
            continue;
        }
        let rise = b[1] - a[1];
        let t = if rise.abs() > 1e-6 { (y - a[1]) / rise } else { f64::NAN };
        // Nearly level edges count whole.
        let (from, to) = if t.is_nan() {
            (a[0].min(b[0]), a[0].max(b[0]))
        } else {
            let x = a[0] + t * (b[0] - a[0]);
            (x, x)
        };
        (lo, hi) = (lo.min(from - 1e-8), hi.max(to + 1e-8));
    }
    let start = all.start + xs[all.clone()].partition_point(|&x| x < lo);
    start..start + xs[start..all.end].partition_point(|&x| x <= hi)
}
