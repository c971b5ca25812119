//! What a step machine is: it asks for a sample, is told the field there, asks for the next or ends.

use sdfrs_core::{
    Scalar, Status,
    contract::{FLAG_INSIDE, FLAG_PRECISION},
};

/// Where a ray may be walked.
#[derive(Debug, Clone, Copy)]
pub struct Range<T> {
    pub t_min: T,
    pub t_max: T,
    /// The threshold asked for, at `t = 0`.
    pub eps: T,
}

/// What the field said.
#[derive(Debug, Clone, Copy)]
pub struct Sample<T> {
    pub t: T,
    pub r: T,
    /// Hit threshold here; with guards never below 4 ulp of max(|p|, t).
    pub e: T,
    /// The threshold without that floor.
    pub asked: T,
    /// max(|p|, |t|): what rounding is relative to.
    pub scale: T,
}

/// What a ray's walk has come to.
#[derive(Debug, Clone, Copy)]
pub struct Tally<T> {
    pub steps: u32,
    pub max_steps: u32,
    pub fallbacks: u32,
    /// Accepted steps and the sum of their lengths over their radii.
    pub accepted: u32,
    pub ratios: T,
    /// Last accepted sample.
    pub t: T,
    pub r: T,
    pub witness: T,
    pub flags: u8,
}

impl<T: Scalar> Tally<T> {
    pub fn new(max_steps: u32) -> Self {
        let zero = T::of(0.0);
        Self {
            steps: 0,
            max_steps,
            fallbacks: 0,
            accepted: 0,
            ratios: zero,
            t: zero,
            r: zero,
            witness: zero,
            flags: 0,
        }
    }
    #[inline]
    pub fn spent(&self) -> bool {
        self.steps >= self.max_steps
    }
    /// A sample that the walk stands on now.
    #[inline]
    pub fn at(&mut self, t: T, r: T) {
        (self.t, self.r) = (t, r);
    }
    /// An accepted step of `ratio` times its radius.
    #[inline]
    pub fn accept(&mut self, ratio: T) {
        self.accepted += 1;
        self.ratios = self.ratios + ratio;
    }
    pub fn multiplier(&self) -> T {
        if self.accepted == 0 { T::of(1.0) } else { self.ratios / T::of(f64::from(self.accepted)) }
    }
    /// The slope between two samples; where rounding could fake one it doesn't count.
    #[inline]
    pub fn observe(&mut self, r: T, at: &Sample<T>, dz: T) {
        let slope = (at.r - r).abs() / dz;
        if dz > T::of(512.0) * T::EPS * at.scale && slope > self.witness {
            self.witness = slope;
        }
    }
    /// A hit at the sample, if it lies in range.
    pub fn hit<N>(&mut self, s: &Sample<T>, range: &Range<T>) -> Next<N> {
        if s.r > s.asked {
            self.flags |= FLAG_PRECISION;
        }
        Next::Done(if s.t > range.t_max { Status::Miss } else { Status::Hit })
    }
    /// A hit at the first sample; inside where it is deeper than the threshold.
    pub fn hit_at_start<N>(&mut self, s: &Sample<T>, range: &Range<T>) -> Next<N> {
        if s.r < -s.e {
            self.flags |= FLAG_INSIDE;
        }
        self.hit(s, range)
    }
}

/// On from a sample at `t` of radius `r` to one at `next`, unless the range or the budget ends first.
#[inline]
pub fn onwards<T: Scalar>(t: T, r: T, next: T, range: &Range<T>, tally: &Tally<T>) -> Next<T> {
    if t + r >= range.t_max {
        Next::Done(Status::Miss)
    } else if tally.spent() {
        Next::Done(Status::OutOfSteps)
    } else {
        Next::Ask(next)
    }
}

/// The next sample's parameter, or the end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Next<T> {
    Ask(T),
    Done(Status),
}

/// A step machine. `step` is called with the sample asked for last; the budget is spent when
/// `tally.spent()`, and exits are tested in the order invalid, hit, miss, out of steps.
pub trait Walk<T: Scalar>: Sync {
    type State: Send;
    fn start(&self, range: &Range<T>) -> (Self::State, T);
    fn step(&self, state: &mut Self::State, s: &Sample<T>, range: &Range<T>, tally: &mut Tally<T>)
    -> Next<T>;
}
