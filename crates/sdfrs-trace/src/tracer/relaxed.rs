//! Relaxed sphere tracing: steps of omega radii, taken back where the balls come apart. Keinert 2014;
//! 000 Algorithm 2, 002 Algorithm 2 (which writes omega - 1).
//!
//! Faults of the letter form: on head-on rays the test `z <= r + |R|` holds by equality behind the
//! surface, so a plane at 10 is hit at 15; sheets between two touching balls are skipped (33 %).

use sdfrs_core::{Real, Scalar, Status};

use super::{
    guarded::Rule,
    retry::Retry,
    walk::{Next, Range, Sample, Tally, Walk, onwards},
};

#[derive(Debug, Clone, Copy)]
pub struct Relaxed<R> {
    pub omega: R,
}

impl<R: Real + Sync> Rule<R> for Relaxed<R> {
    const SLOPES: bool = false;
    #[inline(always)]
    fn slope(self, m: R, _seen: R) -> R {
        m
    }
    #[inline(always)]
    fn next(self, r: R, _m: R) -> R {
        self.omega * r
    }
}

/// 000 Algorithm 2 as printed: it begins with a step of length 0 from a radius of 0.
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
        if st.begun {
            tally.observe(st.r, s, s.t - st.t);
        }
        if st.z <= st.r + s.r.abs() {
            if st.begun {
                tally.accept(st.z / st.r);
            }
            st.z = self.omega * s.r;
            (st.t, st.r) = (s.t, s.r);
            tally.at(s.t, s.r);
            if s.r <= s.e {
                return if st.begun { tally.hit(s, range) } else { tally.hit_at_start(s, range) };
            }
        } else {
            tally.fallbacks += 1;
            st.z = st.r;
        }
        st.begun = true;
        onwards(st.t, st.r, st.t + st.z, range, tally)
    }
}

/// 002 Algorithm 2: `d = r + (omega - 1) r`.
impl<T: Scalar> Retry<T> for Relaxed<T> {
    fn length(&self, r: T, _before: T, _d: T) -> T {
        r + (self.omega - T::of(1.0)) * r
    }
}
