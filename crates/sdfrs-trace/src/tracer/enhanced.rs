//! Enhanced sphere tracing: the step to the ball that would touch this one if the surface were flat.
//! 002 and 001 Algorithm 3, 000 Algorithm 3.
//!
//! Faults of the letter form: where the field rises along the ray the denominator vanishes and the
//! walk leaps over surfaces (or to infinity), and sheets between touching balls are skipped (14 %).
//! 002's listing begins with steps of (1 - omega) radii, because its first slope is taken from zeros.

use sdfrs_core::{Real, Scalar, Status};

use super::{
    guarded::Rule,
    retry::Retry,
    walk::{Next, Range, Sample, Tally, Walk, onwards},
};

#[derive(Debug, Clone, Copy)]
pub struct Enhanced<R> {
    pub omega: R,
}

impl<R: Real + Sync> Rule<R> for Enhanced<R> {
    #[inline(always)]
    fn slope(self, _m: R, seen: R) -> R {
        seen
    }
    #[inline(always)]
    fn next(self, r: R, m: R) -> R {
        let one = R::c(1.0);
        r * (one + self.omega * (one + m) / (one - m))
    }
}

/// 000 Algorithm 3 as printed.
pub struct Letter<T> {
    pub omega: T,
}

pub struct State<T> {
    begun: bool,
    t: T,
    r: T,
    z: T,
}

impl<T: Scalar> Walk<T> for Letter<T> {
    type State = State<T>;

    fn start(&self, range: &Range<T>) -> (State<T>, T) {
        let zero = T::of(0.0);
        (State { begun: false, t: range.t_min, r: zero, z: zero }, range.t_min)
    }

    fn step(&self, st: &mut State<T>, s: &Sample<T>, range: &Range<T>, tally: &mut Tally<T>) -> Next<T> {
        if s.r.is_nan() {
            return Next::Done(Status::Invalid);
        }
        if !st.begun {
            (st.r, st.z) = (s.r, s.r);
            tally.at(s.t, s.r);
        } else {
            let (dz, (r, big)) = (s.t - st.t, (st.r, s.r));
            tally.observe(r, s, dz);
            if st.z <= r + big.abs() {
                tally.accept(st.z / r);
                st.z = big + self.omega * big * (dz + big - r) / (dz - (big - r));
                (st.t, st.r) = (s.t, big);
                tally.at(s.t, big);
            } else {
                tally.fallbacks += 1;
                st.z = r;
                return onwards(st.t, st.r, st.t + st.z, range, tally);
            }
        }
        if s.r <= s.e {
            return if st.begun { tally.hit(s, range) } else { tally.hit_at_start(s, range) };
        }
        st.begun = true;
        onwards(st.t, st.r, st.t + st.z, range, tally)
    }
}

/// 002 Algorithm 3; a ratio of 0/0 (the first one) counts as 0.
impl<T: Scalar> Retry<T> for Enhanced<T> {
    fn length(&self, r: T, before: T, d: T) -> T {
        let (top, bottom) = (d - before + r, d + before - r);
        let zero = T::of(0.0);
        let ratio = if top == zero && bottom == zero { zero } else { top / bottom };
        r + self.omega * r * ratio
    }
}
