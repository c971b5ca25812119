//! One line about many rays.
//!
//! A step is one evaluation of the field. Percentiles are nearest-rank: the value at position
//! `ceil(q n)` of the sorted counts, so they are counts that really occurred. Law: the same numbers as
//! sorting everything (tests below), whatever the number of threads.

use sdfrs_core::{
    Hits, Scalar,
    contract::{FLAG_CROSSING, FLAG_INSIDE, FLAG_PRECISION, Work},
    eval::{Kernel, vectorise},
};

/// Counts of one trace; zeros where there were no rays.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Summary {
    pub rays: u64,
    pub hits: u64,
    pub misses: u64,
    pub out_of_steps: u64,
    pub invalid: u64,
    /// Rays on which a safe step passed the surface: the field is steeper than declared.
    pub crossings: u64,
    /// Hits decided by the floor of 4 ulp instead of `eps`.
    pub precision_limited: u64,
    /// Largest threshold that decided a hit: `eps`, the cone's, or the floor of 4 ulp.
    pub threshold: f64,
    /// Rays that started inside the solid.
    pub inside: u64,
    pub mean_steps: f64,
    pub p50_steps: u32,
    pub p99_steps: u32,
    pub max_steps: u32,
    pub fallbacks: u64,
    /// Field evaluations: the sum of the steps.
    pub evaluations: u64,
    /// Operations times points, of programs and of the probes that shortened them.
    pub node_evaluations: u64,
    /// What pruning was in use.
    pub prune: &'static str,
    /// Operations of the program that an evaluation ran.
    pub mean_ops: f64,
    pub p50_ops: u64,
    pub p99_ops: u64,
    /// Bytes that the pruner kept.
    pub arena_bytes: u64,
    pub seconds: f64,
    /// Steepest slope seen along a ray, in units of the declared bound: above 1.01 it was too small.
    pub witness: f64,
    /// The same in the shape's own units.
    pub lipschitz_observed: f64,
}

impl Summary {
    /// Of a field whose declared bound is `lipschitz`.
    pub fn of<T: Scalar>(hits: &Hits<T>, seconds: f64, lipschitz: f64) -> Self {
        let mut sums = Sums::default();
        vectorise(Add { hits, sums: &mut sums });
        let steps = Counts::of(&hits.steps);
        let [misses, hit, out_of_steps, invalid] = sums.statuses;
        let [inside, crossings, precision_limited] = sums.flags;
        let (evaluations, witness) = (steps.sum(), hits.steepest.f64());
        Self {
            rays: hits.status.len() as u64,
            hits: hit,
            misses,
            out_of_steps,
            invalid,
            crossings,
            precision_limited,
            threshold: hits.threshold.f64(),
            inside,
            mean_steps: if steps.all == 0 { 0.0 } else { evaluations as f64 / steps.all as f64 },
            p50_steps: steps.percentile(50),
            p99_steps: steps.percentile(99),
            max_steps: steps.percentile(100),
            fallbacks: sums.fallbacks,
            evaluations,
            node_evaluations: hits.work.node_evaluations,
            prune: hits.work.prune.name(),
            mean_ops: mean_length(&hits.work),
            p50_ops: length(&hits.work, 50),
            p99_ops: length(&hits.work, 99),
            arena_bytes: hits.work.arena_bytes,
            seconds,
            witness,
            lipschitz_observed: witness * lipschitz,
        }
    }
}

/// Mean length of the programs that evaluations ran.
fn mean_length(work: &Work) -> f64 {
    let n: u64 = work.lengths.values().sum();
    let all: f64 = work.lengths.iter().map(|(ops, n)| *ops as f64 * *n as f64).sum();
    if n == 0 { 0.0 } else { all / n as f64 }
}

/// Nearest-rank percentile of those lengths.
fn length(work: &Work, percent: u64) -> u64 {
    let all: u64 = work.lengths.values().sum();
    let rank = (u128::from(all) * u128::from(percent)).div_ceil(100);
    let mut seen = 0;
    for (ops, n) in &work.lengths {
        seen += u128::from(*n);
        if seen >= rank {
            return *ops;
        }
    }
    0
}

/// Rays still active after `n` steps, for `n` from 0 to the largest count.
pub fn active_rays(steps: &[u32]) -> Vec<u64> {
    let longest = steps.iter().copied().max().unwrap_or(0) as usize;
    let mut active = vec![0u64; longest + 1];
    for &n in steps {
        // A ray of n steps is active after 0, .., n - 1.
        if n > 0 {
            active[n as usize - 1] += 1;
        }
    }
    for i in (0..longest).rev() {
        active[i] += active[i + 1];
    }
    active
}

/// Everything that is a sum over all rays.
#[derive(Default)]
struct Sums {
    /// Rays by status, and by flag.
    statuses: [u64; 4],
    flags: [u64; 3],
    fallbacks: u64,
}

/// One pass over all columns, some rays at a time.
struct Add<'a, T> {
    hits: &'a Hits<T>,
    sums: &'a mut Sums,
}

/// Rays at a time: as many as a byte counts.
const RUN: usize = 255;

impl<T: Scalar> Kernel for Add<'_, T> {
    #[inline(always)]
    fn run(self) {
        let Self { hits, sums } = self;
        for run in hits.status.chunks(RUN) {
            for (sum, status) in sums.statuses.iter_mut().zip(0..) {
                *sum += u64::from(run.iter().fold(0u8, |n, s| n + u8::from(*s == status)));
            }
        }
        let loud = if hits.work.quiet { 0 } else { hits.flags.len() };
        for run in hits.flags[..loud].chunks(RUN) {
            // Hardly ever is one raised.
            if run.iter().fold(0, |all, flags| all | flags) != 0 {
                for (sum, bit) in sums.flags.iter_mut().zip([FLAG_INSIDE, FLAG_CROSSING, FLAG_PRECISION]) {
                    *sum += u64::from(run.iter().fold(0u8, |n, flags| n + u8::from(flags & bit != 0)));
                }
            }
        }
        sums.fallbacks = hits.fallbacks[..loud].iter().map(|n| u64::from(*n)).sum();
    }
}

/// How often each count occurs: the first ones by number, what lies beyond sorted.
struct Counts {
    all: u64,
    few: Vec<u64>,
    many: Vec<u32>,
}

impl Counts {
    const LISTED: u32 = 1 << 12;

    fn of(values: &[u32]) -> Self {
        // Four lists in turn: neighbours count alike, and a number just written is slow to be read.
        let mut few = vec![[0; 4]; Self::LISTED as usize];
        let mut many = Vec::new();
        for run in values.chunks(4) {
            for (turn, v) in run.iter().enumerate() {
                match few.get_mut(*v as usize) {
                    Some(few) => few[turn] += 1,
                    None => many.push(*v),
                }
            }
        }
        many.sort_unstable();
        let few = few.iter().map(|turns| turns.iter().sum()).collect();
        Self { all: values.len() as u64, few, many }
    }

    /// Of all values.
    fn sum(&self) -> u64 {
        let few: u64 = self.few.iter().zip(0..).map(|(n, v)| n * v).sum();
        few + self.many.iter().map(|v| u64::from(*v)).sum::<u64>()
    }

    /// Nearest-rank percentile; 0 of nothing.
    fn percentile(&self, percent: u64) -> u32 {
        let rank = (self.all * percent).div_ceil(100).max(1);
        let mut seen = 0;
        for (v, n) in (0..).zip(&self.few) {
            seen += n;
            if seen >= rank {
                return v;
            }
        }
        self.many.get((rank - seen - 1) as usize).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn work() -> Work {
        Work { node_evaluations: 310, lengths: [(5, 10), (13, 20)].into(), ..Work::default() }
    }

    fn hits(steps: Vec<u32>) -> Hits<f64> {
        let n = steps.len();
        Hits {
            t: vec![1.0; n],
            status: (0..n).map(|i| (i % 4) as u8).collect(),
            fallbacks: vec![2; n],
            multiplier: vec![1.0; n],
            distance: vec![0.0; n],
            witness: vec![0.0; n],
            flags: (0..n).map(|i| (i % 8) as u8).collect(),
            threshold: 0.0,
            steepest: 0.07,
            work: work(),
            steps,
        }
    }

    #[test]
    fn counts_by_hand() {
        let s = Summary::of(&hits(vec![5, 1, 9, 1, 3, 2, 2, 8]), 0.5, 2.0);
        assert_eq!((s.rays, s.hits, s.misses, s.out_of_steps, s.invalid), (8, 2, 2, 2, 2));
        assert_eq!((s.inside, s.crossings, s.precision_limited), (4, 4, 4));
        assert_eq!((s.mean_steps, s.p50_steps, s.p99_steps, s.max_steps), (31.0 / 8.0, 2, 9, 9));
        assert_eq!((s.fallbacks, s.evaluations, s.node_evaluations), (16, 31, 310));
        assert_eq!((s.witness, s.lipschitz_observed), (0.07, 0.14));
        assert_eq!((s.prune, s.mean_ops, s.p50_ops, s.p99_ops), ("off", 310.0 / 30.0, 13, 13));
    }

    #[test]
    fn percentiles_equal_those_of_the_sorted_counts() {
        for n in [1u32, 2, 3, 99, 100, 101, 1000] {
            let steps: Vec<u32> = (0..n).map(|i| i.wrapping_mul(2_654_435_761) >> 20).collect();
            let mut sorted = steps.clone();
            sorted.sort_unstable();
            let s = Summary::of(&hits(steps), 0.0, 1.0);
            let at = |q: u32| sorted[((n * q).div_ceil(100) - 1) as usize];
            assert_eq!((s.p50_steps, s.p99_steps, s.max_steps), (at(50), at(99), at(100)));
        }
    }

    #[test]
    fn no_rays_give_zeros() {
        let s = Summary::of(&Hits { work: Work::default(), steepest: 0.0, ..hits(vec![]) }, 0.0, 1.0);
        assert_eq!(s, Summary { prune: "off", ..Summary::default() });
        assert_eq!(active_rays(&[]), [0]);
    }

    #[test]
    fn the_curve_falls_to_zero_and_sums_to_the_evaluations() {
        let steps = [5, 1, 9, 1, 3, 0, 2, 8];
        let curve = active_rays(&steps);
        assert_eq!(curve, [7, 5, 4, 3, 3, 2, 2, 2, 1, 0]);
        assert_eq!(curve.iter().sum::<u64>(), steps.iter().map(|&n| u64::from(n)).sum::<u64>());
    }
}
