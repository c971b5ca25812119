//! Triangles in an order in which neighbours in space are neighbours in memory, cut into clusters of 16.
//!
//! Halves by the median of the middles along the longest axis of their box; every half but the last is a multiple of a
//! cluster. The order is a function of the mesh alone, whatever the number of threads.

use glam::DVec3;
use rayon::prelude::*;

use crate::{MeshError, Pulse, Watch, select::select};

/// Triangles a cluster.
pub const CLUSTER: usize = 16;
/// Parts larger than this are ordered by tasks of their own.
const TASK: usize = 8192;

/// A triangle's middle, and its number.
#[derive(Clone, Copy)]
struct Middle {
    at: [f32; 3],
    face: u32,
}

/// Face numbers in the new order.
pub fn order(
    corners: impl Fn(usize) -> [DVec3; 3] + Sync,
    count: usize,
    watch: &dyn Watch,
) -> Result<Vec<u32>, MeshError> {
    let pulse = Pulse::new(watch);
    let mut middles: Vec<Middle> = (0..count)
        .into_par_iter()
        .map(|f| {
            if f.is_multiple_of(1 << 12) {
                pulse.ask()?;
            }
            let [a, b, c] = corners(f);
            Ok(Middle { at: ((a + b + c) / 3.0).as_vec3().to_array(), face: f as u32 })
        })
        .collect::<Result<_, MeshError>>()?;
    split(&mut middles, watch)?;
    Ok(middles.into_iter().map(|m| m.face).collect())
}

fn split(part: &mut [Middle], watch: &dyn Watch) -> Result<(), MeshError> {
    if part.len() <= CLUSTER {
        return Ok(());
    }
    let (mut lo, mut hi) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for m in part.iter() {
        for k in 0..3 {
            lo[k] = lo[k].min(m.at[k]);
            hi[k] = hi[k].max(m.at[k]);
        }
    }
    let axis = (1..3).fold(0, |best, k| if hi[k] - lo[k] > hi[best] - lo[best] { k } else { best });
    let half = (part.len() / 2).next_multiple_of(CLUSTER);
    let before = |a: &Middle, b: &Middle| a.at[axis].total_cmp(&b.at[axis]).then(a.face.cmp(&b.face));
    select(part, half, before, watch)?;
    let (left, right) = part.split_at_mut(half);
    if left.len() < TASK {
        split(left, watch)?;
        return split(right, watch);
    }
    if watch.cancelled() {
        return Err(MeshError::Cancelled);
    }
    let (a, b) = rayon::join(|| split(left, watch), || split(right, watch));
    a.and(b)
}
