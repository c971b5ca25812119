//! Compares reported hits with the known first roots.

use sdfrs_core::contract::{Hits, Limits, Status};
use sdfrs_core::eval::Native;

use crate::families::{Problem, T_MAX};
use crate::field::Pack;

/// How many rays went wrong, and in which way.
#[derive(Debug, Default, Clone)]
pub struct Verdict {
    pub rays: usize,
    /// A miss, or a hit on a later surface.
    pub missed: usize,
    /// The hit lies in the first solid, more than 4 thresholds past the root.
    pub late: usize,
    /// The field at the hit is below what is allowed: -4 ulp of max(|p|, t), where the field is 1-Lipschitz.
    pub deep: usize,
    /// The field at the hit exceeds what the tracer may call a hit.
    pub far: usize,
    /// Budget spent.
    pub unresolved: usize,
    pub invalid: usize,
    pub evaluations: u64,
    pub p99: u32,
    pub fallbacks: u64,
    pub witness: f64,
    /// Index of the first ray that broke a law (not: ran out of steps).
    pub first: Option<usize>,
}

impl Verdict {
    pub fn clean(&self) -> bool {
        self.missed + self.late + self.deep + self.far + self.invalid == 0
    }

    pub fn mean(&self) -> f64 {
        self.evaluations as f64 / self.rays as f64
    }

    /// `missed/late/unresolved` in percent, mean evaluations / p99.
    pub fn row(&self) -> String {
        let percent = |n: usize| 100.0 * n as f64 / self.rays as f64;
        format!(
            "{:.2}/{:.2}/{:.2} deep {} far {} mean {:.1} p99 {} fallbacks {:.2} witness {:.4}",
            percent(self.missed),
            percent(self.late),
            percent(self.unresolved),
            self.deep,
            self.far,
            self.mean(),
            self.p99,
            self.fallbacks as f64 / self.rays as f64,
            self.witness,
        )
    }
}

/// `reach`: how many thresholds above the surface a hit may lie (1 for steppers, 1.5 for searches).
pub fn judge<T: Native>(
    problems: &[Problem],
    pack: &Pack,
    hits: &Hits<T>,
    limits: &Limits,
    reach: f64,
) -> Verdict {
    let mut verdict = Verdict { rays: problems.len(), ..Verdict::default() };
    for (i, problem) in problems.iter().enumerate() {
        let before = (verdict.missed, verdict.late, verdict.deep, verdict.far, verdict.invalid);
        match hits.status[i] {
            s if s == Status::Hit as u8 => {
                judge_hit(problem, pack, hits.t[i], limits, reach, i, &mut verdict)
            }
            s if s == Status::Miss as u8 => verdict.missed += usize::from(problem.root.is_some()),
            s if s == Status::OutOfSteps as u8 => verdict.unresolved += 1,
            _ => verdict.invalid += 1,
        }
        if before != (verdict.missed, verdict.late, verdict.deep, verdict.far, verdict.invalid) {
            verdict.first.get_or_insert(i);
        }
        verdict.evaluations += u64::from(hits.steps[i]);
        verdict.fallbacks += u64::from(hits.fallbacks[i]);
        verdict.witness = verdict.witness.max(hits.witness[i].f64());
    }
    let mut steps = hits.steps.clone();
    steps.sort_unstable();
    verdict.p99 = steps.get(steps.len() * 99 / 100).copied().unwrap_or(0);
    verdict
}

fn judge_hit<T: Native>(
    problem: &Problem,
    pack: &Pack,
    t: T,
    limits: &Limits,
    reach: f64,
    index: usize,
    verdict: &mut Verdict,
) {
    let at = t.f64();
    let floor = 4.0 * T::EPS.f64() * pack.reach(index, at);
    let threshold = limits.eps.max(limits.cone * at).max(floor);
    if let Some(root) = problem.root {
        let slack = 4.0 * threshold;
        if at > problem.exit + slack {
            verdict.missed += 1;
        } else if at > root + slack {
            verdict.late += 1;
        }
    }
    // On a field steeper than it says, a plain step may end inside by less than the threshold.
    let depth = if pack.steepness > 1.0 { threshold } else { floor };
    let value = pack.value(index, t).f64();
    verdict.deep += usize::from(value.is_nan() || value < -depth || !(0.0..=T_MAX).contains(&at));
    verdict.far += usize::from(value.is_nan() || value > reach * threshold);
}
