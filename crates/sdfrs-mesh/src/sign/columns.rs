//! Whole winding numbers at all nodes of a grid: along each column, +1 where a face is entered, -1 where one is left.
//!
//! Exact for closed meshes, with whatever overlaps and wherever nodes lie on edges, and cheaper than any test by node:
//! a few nanoseconds a column and face. For the parity rule, crossings are counted without their direction.

use super::cross::{Face, above, facing, meets};
use crate::check::Checked;
use crate::{MeshError, Pulse, Watch};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;
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
    pub fn new(
        mesh: &Checked,
        axes: [&[f64]; 3],
        rule: Rule,
        budget: u64,
        watch: &dyn Watch,
    ) -> Result<Option<Self>, MeshError> {
        let Some(mut lists) = Lists::new(mesh, axes, budget, watch)? else { return Ok(None) };
        let mut pulse = Pulse::new(watch);
        let (around, mut kept) = (rule.inside(0, 0), 0);
        for column in 0..lists.starts.len() - 1 {
            pulse.beat()?;
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
        Ok(Some(Self { nx: axes[0].len(), around, starts: lists.starts, turns: lists.crossings }))
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
pub fn extremes(
    mesh: &Checked,
    axes: [&[f64]; 3],
    budget: u64,
    watch: &dyn Watch,
) -> Result<Option<(i32, i32)>, MeshError> {
    let Some(lists) = Lists::new(mesh, axes, budget, watch)? else { return Ok(None) };
    let (mut least, mut most) = (0, 0);
    for ends in lists.starts.windows(2) {
        let own = &lists.crossings[ends[0] as usize..ends[1] as usize];
        let mut winding = 0;
        for node in own.chunk_by(|a, b| a >> 1 == b >> 1) {
            winding += node.iter().map(|&crossing| step(crossing)).sum::<i32>();
            (least, most) = (least.min(winding), most.max(winding));
        }
    }
    Ok(Some((least, most)))
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
    fn new(
        mesh: &Checked,
        axes: [&[f64]; 3],
        budget: u64,
        watch: &dyn Watch,
    ) -> Result<Option<Self>, MeshError> {
        let [xs, ys, zs] = axes.map(|axis| axis.len() as u64);
        let columns = xs.checked_mul(ys).filter(|&n| n < u64::from(u32::MAX) && zs < 1 << 31);
        let left = columns.and_then(|n| Some((n, budget.checked_sub(n.checked_mul(4)?)?)));
        let Some((columns, left)) = left else { return Ok(None) };
        let found = gather(mesh, axes, (left / BYTES_PER_CROSSING).min(u64::from(u32::MAX)), watch);
        let mut pulse = Pulse::new(watch);
        pulse.ask()?;
        let Some(found) = found else { return Ok(None) };
        let all = || found.iter().flatten();
        let mut starts = vec![0_u32; columns as usize + 1];
        for &(column, _) in all() {
            pulse.beat()?;
            starts[column as usize] += 1;
        }
        let mut at = 0;
        for start in &mut starts {
            at += std::mem::replace(start, at);
        }
        let mut crossings = vec![0_u32; at as usize];
        for &(column, crossing) in all() {
            pulse.beat()?;
            let place = &mut starts[column as usize];
            crossings[*place as usize] = crossing;
            *place += 1;
        }
        // Each place is now its list's end, which is where the next begins.
        starts.rotate_right(1);
        starts[0] = 0;
        for ends in starts.windows(2) {
            pulse.beat()?;
            crossings[ends[0] as usize..ends[1] as usize].sort_unstable();
        }
        Ok(Some(Self { starts, crossings }))
    }
}

/// All crossings as (column, crossing), if there are at most `limit` and nobody wants it to stop.
fn gather(mesh: &Checked, axes: [&[f64]; 3], limit: u64, watch: &dyn Watch) -> Option<Vec<Vec<(u32, u32)>>> {
    let count = AtomicU64::new(0);
    let axes = [Nodes::new(axes[0]), Nodes::new(axes[1]), Nodes::new(axes[2])];
    let chunks = (0..mesh.faces.len()).into_par_iter().step_by(CHUNK);
    chunks
        .map(|first| {
            if watch.cancelled() {
                return None;
            }
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

/// The nodes along an axis, rising; found by a guess that is right where they are even.
#[derive(Clone, Copy)]
struct Nodes<'a> {
    at: &'a [f64],
    per_unit: f64,
}

impl<'a> Nodes<'a> {
    fn new(at: &'a [f64]) -> Self {
        let length = at.last().zip(at.first()).map_or(0.0, |(last, first)| last - first);
        let per_unit = if length > 0.0 { (at.len() - 1) as f64 / length } else { 0.0 };
        Self { at, per_unit }
    }

    /// The first node that isn't below `x`.
    fn from(&self, x: f64) -> usize {
        let n = self.at.len();
        let Some(first) = self.at.first() else { return 0 };
        // Casting clamps what is below 0.
        let guess = (((x - first) * self.per_unit) as usize).min(n - 1);
        for i in guess.saturating_sub(1)..(guess + 3).min(n + 1) {
            if (i == 0 || self.at[i - 1] < x) && (i == n || self.at[i] >= x) {
                return i;
            }
        }
        self.at.partition_point(|&node| node < x)
    }

    /// The nodes within a face's extent.
    fn within(&self, face: &Face, axis: usize) -> Range<usize> {
        let lo = face[0][axis].min(face[1][axis]).min(face[2][axis]);
        let hi = face[0][axis].max(face[1][axis]).max(face[2][axis]);
        let start = self.from(lo);
        let end = start + self.at[start..].iter().take(4).take_while(|&&x| x <= hi).count();
        if end < start + 4 {
            return start..end;
        }
        start..self.from(hi.next_up())
    }
}

/// Adds each column that a face meets, with the first node above it and whether it is entered there.
fn cross(face: &Face, [xs, ys, zs]: [Nodes; 3], out: &mut Vec<(u32, u32)>, limit: u64) {
    // Most faces are smaller than the space between two columns.
    let (is, js) = (xs.within(face, 0), ys.within(face, 1));
    if is.is_empty() || js.is_empty() {
        return;
    }
    let facing = facing(face);
    if facing == 0 {
        return;
    }
    let levels = zs.within(face, 2);
    for j in js {
        let y = ys.at[j];
        for i in row(face, y, xs, is.clone()) {
            let x = xs.at[i];
            if meets(face, facing, [x, y]) {
                let first = first_above(face, facing, [x, y], zs, levels.clone());
                out.push(((i + xs.at.len() * j) as u32, (first as u32) << 1 | u32::from(facing < 0)));
            }
        }
        if out.len() as u64 > limit {
            return;
        }
    }
}

/// The first of the nodes at `levels`, which are those within the face's extent, that is above it; or the end.
fn first_above(face: &Face, facing: i32, [x, y]: [f64; 2], zs: Nodes, levels: Range<usize>) -> usize {
    if levels.is_empty() {
        return levels.start;
    }
    let is_above = |k: usize| above(face, facing, [x, y, zs.at[k]]);
    // By the plane, which rounding may miss by a node.
    let [a, b, c] = [DVec3::from(face[0]), DVec3::from(face[1]), DVec3::from(face[2])];
    let normal = (b - a).cross(c - a);
    let z = a.z - ((x - a.x) * normal.x + (y - a.y) * normal.y) / normal.z;
    let guess = zs.from(z).clamp(levels.start, levels.end);
    if (guess == levels.end || is_above(guess)) && (guess == levels.start || !is_above(guess - 1)) {
        return guess;
    }
    let (start, end) = (levels.start, levels.end);
    start + zs.at[start..end].partition_point(|&z| !above(face, facing, [x, y, z]))
}

/// Those of a row's nodes that may lie within a face: of a long one, only those between its edges there, rounding
/// included.
fn row(face: &Face, y: f64, xs: Nodes, all: Range<usize>) -> Range<usize> {
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
        // Nearly level edges count whole.
        let (from, to) = if rise.abs() > 1e-6 {
            let x = a[0] + (y - a[1]) / rise * (b[0] - a[0]);
            (x, x)
        } else {
            (a[0].min(b[0]), a[0].max(b[0]))
        };
        (lo, hi) = (lo.min(from - 1e-8), hi.max(to + 1e-8));
    }
    xs.from(lo).max(all.start)..xs.from(hi).min(all.end)
}
