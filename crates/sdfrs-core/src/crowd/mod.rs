//! Many spheres, found by place: the nearest to a point, or all that a ball may be nearest to.
//!
//! A union asks every sphere at every point. Here sixteen neighbours make a cluster, with a box around their
//! centres; sixteen clusters the next, and so on: from a good guess on, a point goes down where one may be nearer,
//! sixteen bounds at a time. Of 100,000 spheres it meets a few hundred.
//!
//! Law: the bits of the union, and of its gradient: of equally near spheres the first counts, as it does
//! there (tests.rs).

mod tree;

#[cfg(test)]
mod tests;

use std::sync::{Arc, OnceLock};

use crate::{
    lane::{Mask, Pack, Truth},
    real::{Real, Scalar},
    vectorise::{Kernel, vectorise},
};
pub use tree::Levels;
use tree::{Tree, Visitor};

/// Fewer spheres are asked one by one as fast.
pub const FEWEST: usize = 4096;

/// Spheres and clusters that a point meets, about.
pub const MET: u64 = 256;

/// Spheres a block.
const WIDTH: usize = 16;
/// Their centres and radii, coordinate by coordinate.
type Block<S> = [S; 4 * WIDTH];

/// Spheres in clusters.
#[derive(Debug)]
pub struct Crowd {
    /// x, y, z, r.
    spheres: Vec<[f64; 4]>,
    tree: Tree,
    single: OnceLock<Levels<f32>>,
    double: OnceLock<Levels<f64>>,
}

impl Crowd {
    /// Of rows of x, y, z, r; none where they are few, or no numbers.
    pub fn new(rows: &[f64]) -> Option<Arc<Self>> {
        let (spheres, _) = rows.as_chunks::<4>();
        // Squares of f32 have to stay finite.
        let usual = rows.iter().all(|v| v.abs() < 1e15);
        (usual && spheres.len() >= FEWEST).then(|| Arc::new(Self::of(spheres.to_vec())))
    }

    fn of(spheres: Vec<[f64; 4]>) -> Self {
        let tree = Tree::new(&spheres);
        Self { spheres, tree, single: OnceLock::new(), double: OnceLock::new() }
    }

    pub fn single(&self) -> &Levels<f32> {
        self.single.get_or_init(|| self.tree.levels(&self.spheres))
    }
    pub fn double(&self) -> &Levels<f64> {
        self.double.get_or_init(|| self.tree.levels(&self.spheres))
    }

    /// The nearest sphere to a point, from any guess: nobody is near what is no number.
    #[inline(always)]
    pub fn nearest<S: Scalar>(&self, levels: &Levels<S>, p: [S; 3], guess: Nearest<S>) -> Nearest<S> {
        let mut best = guess.seen_from(p);
        if let Some((cluster, ids)) = self.tree.greedy(levels, p) {
            best.look(cluster, ids, p);
        }
        let mut look = Look { p, best };
        self.tree.walk(levels, p, best.distance, &mut look);
        look.best
    }

    /// Numbers of the spheres at most `reach` away from a point that a sieve keeps, from the first to the last, and
    /// perhaps of some farther ones; false if there are more than `most`.
    pub fn within(
        &self,
        p: [f32; 3],
        reach: f32,
        sieve: &impl Sieve,
        most: usize,
        to: &mut Vec<u32>,
    ) -> bool {
        to.clear();
        let reach = reach + (reach.abs() + tree::SLACK as f32) * tree::SLACK as f32;
        vectorise(Within { crowd: self, p, reach, sieve, most, to });
        to.sort_unstable();
        // The last cluster may have a sphere more than once.
        to.dedup();
        to.len() <= most
    }

    /// Spheres.
    pub fn size(&self) -> u64 {
        self.spheres.len() as u64
    }

    /// A sphere's x, y, z, r.
    pub fn sphere(&self, id: u32) -> &[f64; 4] {
        &self.spheres[id as usize]
    }
}

/// The nearest sphere so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest<S> {
    distance: S,
    /// Its number: of equally near ones the first counts.
    id: u32,
    /// x, y, z, r.
    pub sphere: [S; 4],
}

impl<S: Scalar> Nearest<S> {
    /// None yet: a sphere that is infinitely far from everything.
    #[inline(always)]
    pub fn nobody() -> Self {
        let zero = S::of(0.0);
        Self { distance: S::INFINITY, id: u32::MAX, sphere: [zero, zero, zero, zero - S::INFINITY] }
    }

    /// The same sphere, seen from another point.
    #[inline(always)]
    fn seen_from(mut self, p: [S; 3]) -> Self {
        let [x, y, z, r] = self.sphere;
        self.distance = Real::len3(p[0] - x, p[1] - y, p[2] - z) - r;
        if self.distance < S::INFINITY { self } else { Self::nobody() }
    }

    /// Takes a cluster's nearest sphere, if it is nearer.
    #[inline(always)]
    fn look(&mut self, cluster: &Block<S>, ids: &[u32], p: [S; 3]) {
        let d = distances(cluster, p) - Pack::load(&cluster[3 * WIDTH..]);
        // Few clusters have one.
        if Pack::below(Pack::splat(self.distance), d).bits() == (1 << WIDTH) - 1 {
            return;
        }
        let (distance, lane) = d.settled().first_least();
        if distance < self.distance || (distance == self.distance && ids[lane] < self.id) {
            let sphere =
                [cluster[lane], cluster[WIDTH + lane], cluster[2 * WIDTH + lane], cluster[3 * WIDTH + lane]];
            *self = Self { distance, id: ids[lane], sphere };
        }
    }
}

/// Which spheres are wanted.
pub trait Sieve {
    /// Whether a sphere of x, y, z, r is; inlined into loops over packs, so without a branch.
    fn keeps(&self, sphere: [f32; 4]) -> bool;
}

struct Within<'a, S> {
    crowd: &'a Crowd,
    p: [f32; 3],
    reach: f32,
    sieve: &'a S,
    most: usize,
    to: &'a mut Vec<u32>,
}

impl<S: Sieve> Kernel for Within<'_, S> {
    #[inline(always)]
    fn run(self) {
        let mut own = self;
        own.crowd.tree.walk(own.crowd.single(), own.p, own.reach, &mut own);
    }
}

impl<S: Sieve> Visitor<f32> for Within<'_, S> {
    #[inline(always)]
    fn see(&mut self, cluster: &Block<f32>, ids: &[u32]) -> f32 {
        let d = distances(cluster, self.p) - Pack::load(&cluster[3 * WIDTH..]);
        let mut kept = Mask([0; WIDTH]);
        for i in 0..WIDTH {
            let sphere = [cluster[i], cluster[WIDTH + i], cluster[2 * WIDTH + i], cluster[3 * WIDTH + i]];
            kept.0[i] = if self.sieve.keeps(sphere) { u32::MAX } else { 0 };
        }
        let mut bits = (kept & !Pack::below(Pack::splat(self.reach), d)).bits();
        while bits != 0 {
            self.to.push(ids[bits.trailing_zeros() as usize % WIDTH]);
            bits &= bits - 1;
        }
        // More are enough: a cluster has fewer than sixteen to spare.
        if self.to.len() > self.most.saturating_add(WIDTH) { f32::NEG_INFINITY } else { self.reach }
    }
}

/// On the way to the nearest.
struct Look<S> {
    p: [S; 3],
    best: Nearest<S>,
}

impl<S: Scalar> Visitor<S> for Look<S> {
    #[inline(always)]
    fn see(&mut self, cluster: &Block<S>, ids: &[u32]) -> S {
        self.best.look(cluster, ids, self.p);
        self.best.distance
    }
}

/// From a point to a block's centres.
#[inline(always)]
fn distances<S: Scalar>(block: &Block<S>, p: [S; 3]) -> Pack<S, WIDTH> {
    let x = Pack::<S, WIDTH>::splat(p[0]) - Pack::load(&block[..WIDTH]);
    let y = Pack::<S, WIDTH>::splat(p[1]) - Pack::load(&block[WIDTH..]);
    let z = Pack::<S, WIDTH>::splat(p[2]) - Pack::load(&block[2 * WIDTH..]);
    Real::len3(x, y, z)
}

impl<S: Scalar, const W: usize> Pack<S, W> {
    /// The least lane and the first that holds it.
    #[inline(always)]
    fn first_least(self) -> (S, usize) {
        let least = self.least();
        let mut number = Self::splat(S::of(W as f64 - 1.0));
        for i in 0..W {
            number.0[i] = if self.0[i] <= least { S::of(i as f64) } else { number.0[i] };
        }
        (least, number.settled().least().cell() as usize % W)
    }

    /// The same, brought to memory: what is asked of single lanes would otherwise take the loop apart that the
    /// pack comes from.
    #[inline(always)]
    #[allow(unsafe_code)]
    fn settled(mut self) -> Self {
        // SAFETY: no instruction at all.
        unsafe { std::arch::asm!("/* {0} */", in(reg) &mut self, options(nostack, preserves_flags)) };
        self
    }
}
