//! The guarded sphere tracing step that basic, relaxed, enhanced and auto-relaxed share, for a pack of
//! rays at once and without a branch.
//!
//! TRACERS.md, "Where the listings break, and the guards". It departs from the listings in that balls
//! must overlap by 2 ulp instead of touching, the far radius is signed, slopes are clamped, nothing is
//! sampled behind `t_max`, and a surface crossed by a safe step is refined instead of walked through.
//! Truth values are 1 and 0 of the pack's own type: they stay in the lanes.
//! Law: of 10^6 rays through 1-Lipschitz fields none misses its first surface and none is late.

use sdfrs_core::{Real, Scalar};

/// What distinguishes the steppers.
pub trait Rule<R>: Copy + Sync {
    /// The slope to go on with, from the one in use and the one just seen (both clamped).
    fn slope(self, m: R, seen: R) -> R;
    /// Length of the next step; at the start and after a fallback `m` is -1.
    fn next(self, r: R, m: R) -> R;
}

/// Rays between two samples.
#[derive(Debug, Clone, Copy)]
pub struct Lanes<R> {
    /// Where they stand, and the field there. A ray that stands where it asks (`t` is the sample's own,
    /// `r` and `z` are 0) takes the sample as its first.
    pub t: R,
    pub r: R,
    /// Step tried.
    pub z: R,
    /// Slope in use.
    pub m: R,
    /// Sum of the accepted steps' lengths over their radii.
    pub ratios: R,
    /// Steepest slope seen.
    pub witness: R,
}

/// What the field said.
#[derive(Debug, Clone, Copy)]
pub struct Samples<R> {
    pub t: R,
    pub r: R,
    /// Hit threshold here, never below 4 ulp of `scale`.
    pub e: R,
    /// max(|p|, |t|): what rounding is relative to.
    pub scale: R,
}

/// What became of the step, 1 or 0.
#[derive(Debug, Clone, Copy)]
pub struct Verdict<R> {
    /// Counted into the multiplier.
    pub accepted: R,
    pub fallback: R,
    /// One of `code`, 0 for a ray that goes on.
    pub code: R,
}

/// Ends of a walk as numbers that fit into lanes.
pub mod code {
    pub const HIT: f64 = 1.0;
    pub const MISS: f64 = 2.0;
    pub const INVALID: f64 = 3.0;
    /// A safe step went through the surface: the field is steeper than declared.
    pub const CROSSED: f64 = 4.0;
}

/// `a < b` as 1 or 0.
#[inline(always)]
fn lt<R: Real>(a: R, b: R) -> R {
    R::select_lt(a, b, R::c(1.0), R::c(0.0))
}
/// `x` where the truth value holds, else `y`.
#[inline(always)]
pub fn pick<R: Real>(truth: R, x: R, y: R) -> R {
    R::select_lt(R::c(0.5), truth, x, y)
}
#[inline(always)]
fn not<R: Real>(truth: R) -> R {
    R::c(1.0) - truth
}

/// One step of all lanes. Lanes where `on` is 0 keep their state.
#[inline(always)]
pub fn step<R: Real>(
    rule: impl Rule<R>,
    lanes: &mut Lanes<R>,
    s: &Samples<R>,
    t_max: R,
    on: R,
) -> Verdict<R> {
    let (zero, one, eps) = (R::c(0.0), R::c(1.0), R::splat(R::S::EPS));
    let Lanes { t, r, z, m, ratios, witness } = *lanes;
    let dz = s.t - t;
    let moved = lt(zero, dz);
    let basic = not(lt(r, z));
    let finite = lt(s.r.abs(), R::splat(R::S::INFINITY));
    let apart = lt(r + s.r, dz + R::c(2.0) * (eps * s.t.abs()));
    let accept = on * finite * basic.max(not(apart));
    let invalid = on * not(finite) * basic;

    let slope = (s.r - r).abs() / dz;
    let seen = on * finite * lt(R::c(512.0) * eps * s.scale, dz) * lt(witness, slope);
    lanes.witness = pick(seen, slope, witness);
    let counted = accept * moved;
    lanes.ratios = pick(counted, ratios + pick(basic, one, dz / r), ratios);

    let crossed = accept * moved * lt(s.r, -s.e);
    let take = accept - crossed;
    let slope = rule.slope(m, ((s.r - r) / dz).clamp(R::c(-1.0), R::c(0.9)));
    let slope = pick(moved, slope, R::c(-1.0));
    let fallback = on - accept.max(invalid);
    lanes.t = pick(take, s.t, t);
    lanes.r = pick(take, s.r, r);
    lanes.m = pick(take, slope, pick(fallback, R::c(-1.0), m));
    lanes.z = pick(take, rule.next(s.r, slope), pick(fallback, r, z));

    let hit = take * not(lt(s.e, s.r));
    let far = on * not(lt(lanes.t + lanes.r, t_max)).max(take * not(lt(s.t, t_max)));
    let mut end = pick(far, R::c(code::MISS), zero);
    end = pick(hit, R::c(code::HIT), end);
    end = pick(crossed, R::c(code::CROSSED), end);
    end = pick(invalid, R::c(code::INVALID), end);
    Verdict { accepted: counted, fallback, code: end }
}

/// Evaluations spent on a crossing at most.
const REFINEMENTS: u32 = 5;

/// A surface between `a` (outside) and `b` (inside).
#[derive(Debug, Clone, Copy)]
pub struct Bracket<T> {
    a: T,
    b: T,
    /// Half the threshold at `b`: aiming at it instead of 0 finds a point outside.
    aim: T,
    /// Field at the ends less the aim.
    fa: T,
    fb: T,
    /// Field at `a`.
    r: T,
    /// Whether `a` was the end replaced last, once one was.
    moved_a: Option<bool>,
    tries: u32,
}

impl<T: Scalar> Bracket<T> {
    /// Between the sample at `a` of radius `r` and the one at `b` of radius `rb`, threshold `e` there.
    pub fn new(a: T, r: T, b: T, rb: T, e: T) -> Self {
        let aim = e * T::of(0.5);
        Self { a, b, aim, fa: r - aim, fb: rb - aim, r, moved_a: None, tries: 0 }
    }

    /// The outer end and the field there: what is reported if nothing better is found.
    pub fn outer(&self) -> (T, T) {
        (self.a, self.r)
    }

    /// Where to look next, unless enough was tried.
    pub fn guess(&self) -> Option<T> {
        let guess = (self.a * self.fb - self.b * self.fa) / (self.fb - self.fa);
        (self.tries < REFINEMENTS && guess > self.a && guess < self.b).then_some(guess)
    }

    /// Takes the sample asked for in; false once the surface is found or lost. Illinois: regula falsi
    /// that halves the weight of an end kept twice in a row.
    pub fn narrow(&mut self, t: T, r: T, e: T) -> bool {
        let (zero, half) = (T::of(0.0), T::of(0.5));
        self.tries += 1;
        if r >= zero && r <= e {
            (self.a, self.r) = (t, r);
            return false;
        }
        let f = r - self.aim;
        if f > zero {
            (self.a, self.fa, self.r) = (t, f, r);
            if self.moved_a.replace(true) == Some(true) {
                self.fb = self.fb * half;
            }
        } else if f <= zero {
            (self.b, self.fb) = (t, f);
            if self.moved_a.replace(false) == Some(false) {
                self.fa = self.fa * half;
            }
        } else {
            return false;
        }
        true
    }
}
