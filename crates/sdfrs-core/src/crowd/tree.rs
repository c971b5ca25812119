//! The tree of clusters, and the way down.

use super::{Block, WIDTH};
use crate::{
    lane::{Pack, Truth},
    real::{Real, Scalar},
};

/// Levels that a way down can remember: enough for 2^32 spheres.
const DEEPEST: usize = 9;
/// What a box may lose when it is rounded, and a distance to it.
pub const SLACK: f64 = 1e-5;

/// Boxes around the centres of sixteen clusters: least and largest x, y, z, and the largest radius, each for all.
type Boxes<S> = [S; 7 * WIDTH];

/// A box around a cluster's centres, and its largest radius.
type Cluster = [f64; 7];

/// What walks are for. A trait, because a closure would be compiled for the platform's baseline.
pub trait Visitor<S> {
    /// A cluster's spheres and their numbers; tells how near the others have to be from now on.
    fn see(&mut self, cluster: &Block<S>, ids: &[u32]) -> S;
}

#[derive(Debug)]
pub struct Tree {
    /// The spheres of the lowest clusters.
    ids: Vec<u32>,
    /// Level by level.
    clusters: Vec<Vec<Cluster>>,
}

/// The tree as a precision sees it.
#[derive(Debug)]
pub struct Levels<S> {
    spheres: Vec<Block<S>>,
    /// Level by level; the last one has one block.
    clusters: Vec<Vec<Boxes<S>>>,
}

impl Tree {
    pub fn new(spheres: &[[f64; 4]]) -> Self {
        let mut order: Vec<u32> = (0..spheres.len() as u32).collect();
        arrange(&mut order, spheres);
        let mut ids = Vec::with_capacity(order.len().next_multiple_of(WIDTH));
        for cluster in order.chunks_mut(WIDTH) {
            // Of equally near ones the first counts.
            cluster.sort_unstable();
            ids.extend((0..WIDTH).map(|i| cluster[i.min(cluster.len() - 1)]));
        }
        let alone = |id: &u32| {
            let [x, y, z, r] = spheres[*id as usize];
            [x, y, z, x, y, z, r]
        };
        let lowest = ids.chunks(WIDTH).map(|ids| around(ids.iter().map(alone)));
        let mut clusters = vec![lowest.collect::<Vec<_>>()];
        while let Some(below) = clusters.last().filter(|below| below.len() > WIDTH) {
            let above = below.chunks(WIDTH).map(|clusters| around(clusters.iter().copied())).collect();
            clusters.push(above);
        }
        Self { ids, clusters }
    }

    /// In blocks; what is missing in a last one is out of reach.
    pub fn levels<S: Scalar>(&self, spheres: &[[f64; 4]]) -> Levels<S> {
        let sphere = |ids: &[u32], i: usize| S::of(spheres[ids[i % WIDTH] as usize][i / WIDTH]);
        let block = |ids: &[u32]| std::array::from_fn(|i| sphere(ids, i));
        // With room for what rounding takes, here and on the way from the spheres' own numbers.
        let rounded = |cluster: &Cluster, a: usize| {
            let room = SLACK * cluster.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            S::of(if a < 3 { cluster[a] - room } else { cluster[a] + room })
        };
        let missing = |a: usize| S::of(if a == 6 { f64::NEG_INFINITY } else { 0.0 });
        let boxes = |all: &[Cluster]| {
            std::array::from_fn(|i| {
                all.get(i % WIDTH).map_or(missing(i / WIDTH), |cluster| rounded(cluster, i / WIDTH))
            })
        };
        Levels {
            spheres: self.ids.chunks_exact(WIDTH).map(block).collect(),
            clusters: self.clusters.iter().map(|level| level.chunks(WIDTH).map(boxes).collect()).collect(),
        }
    }

    /// A cluster whose spheres are about as near as any: what a look through the others can begin with.
    #[inline(always)]
    pub fn greedy<'a, S: Scalar>(
        &'a self,
        levels: &'a Levels<S>,
        p: [S; 3],
    ) -> Option<(&'a Block<S>, &'a [u32])> {
        let mut at = 0;
        for level in levels.clusters.iter().rev() {
            let (least, lane) = bounds(&level[at], p).first_least();
            if !(least < S::INFINITY) {
                return None;
            }
            at = at * WIDTH + lane;
        }
        Some((&levels.spheres[at], self.ids(at)))
    }

    /// Shows all lowest clusters that may be as near as `most`.
    #[inline(always)]
    pub fn walk<S: Scalar>(&self, levels: &Levels<S>, p: [S; 3], mut most: S, visitor: &mut impl Visitor<S>) {
        let top = levels.clusters.len() - 1;
        let (mut level, mut block) = (top, 0);
        // Where the way down has come to, how near the clusters there may be, and which are to be seen yet.
        let mut at = [0; DEEPEST];
        let mut near = [Pack::<S, WIDTH>::splat(S::INFINITY); DEEPEST];
        let mut left = [0u32; DEEPEST];
        loop {
            at[level] = block;
            near[level] = bounds(&levels.clusters[level][block], p);
            left[level] = (!Pack::below(Pack::splat(most), near[level])).bits();
            loop {
                if left[level] == 0 {
                    level += 1;
                    if level > top {
                        return;
                    }
                    continue;
                }
                let lane = left[level].trailing_zeros() as usize % WIDTH;
                left[level] &= left[level] - 1;
                let nearest = near[level].0[lane];
                if !(nearest <= most && nearest < S::INFINITY) {
                    continue;
                }
                block = at[level] * WIDTH + lane;
                if level > 0 {
                    level -= 1;
                    break;
                }
                most = visitor.see(&levels.spheres[block], self.ids(block));
            }
        }
    }

    /// The spheres of a lowest cluster.
    #[inline(always)]
    fn ids(&self, cluster: usize) -> &[u32] {
        &self.ids[cluster * WIDTH..][..WIDTH]
    }
}

/// How near the spheres of sixteen clusters may be.
#[inline(always)]
fn bounds<S: Scalar>(boxes: &Boxes<S>, p: [S; 3]) -> Pack<S, WIDTH> {
    let row = |a: usize| Pack::<S, WIDTH>::load(&boxes[a * WIDTH..]);
    let zero = Pack::c(0.0);
    let [px, py, pz] = [Pack::splat(p[0]), Pack::splat(p[1]), Pack::splat(p[2])];
    let x = (row(0) - px).max(px - row(3)).max(zero);
    let y = (row(1) - py).max(py - row(4)).max(zero);
    let z = (row(2) - pz).max(pz - row(5)).max(zero);
    let apart = Real::len3(x, y, z);
    (apart - apart * Pack::c(SLACK) - row(6)).settled()
}

/// A cluster of clusters.
fn around(clusters: impl Iterator<Item = Cluster>) -> Cluster {
    let none = std::array::from_fn(|a| if a < 3 { f64::INFINITY } else { f64::NEG_INFINITY });
    clusters.fold(none, |all: Cluster, one| {
        std::array::from_fn(|a| if a < 3 { all[a].min(one[a]) } else { all[a].max(one[a]) })
    })
}

/// Brings spheres into an order in which every aligned run of 16, of 256, .. lies together: boxes are halved
/// across their longest edge, at a multiple of the run.
fn arrange(ids: &mut [u32], spheres: &[[f64; 4]]) {
    // What is to be cut into runs of so many.
    let mut largest = WIDTH;
    while largest < ids.len() {
        largest *= WIDTH;
    }
    let mut left = vec![(0..ids.len(), largest)];
    while let Some((range, mut run)) = left.pop() {
        if range.len() <= WIDTH {
            continue;
        }
        while run >= range.len() {
            run /= WIDTH;
        }
        let part = &mut ids[range.clone()];
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for id in part.iter() {
            let s = &spheres[*id as usize];
            for a in 0..3 {
                (lo[a], hi[a]) = (lo[a].min(s[a]), hi[a].max(s[a]));
            }
        }
        let axis = (0..3).max_by(|&a, &b| (hi[a] - lo[a]).total_cmp(&(hi[b] - lo[b]))).unwrap_or(0);
        let half = part.len().div_ceil(run) / 2 * run;
        let key = |id: &u32| (spheres[*id as usize][axis], *id);
        part.select_nth_unstable_by(half, |a, b| {
            let (a, b) = (key(a), key(b));
            a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
        });
        let middle = range.start + half;
        left.push((range.start..middle, run));
        left.push((middle..range.end, run));
    }
}
