//! The loop of 002's listings 2 and 3: a step whose balls come apart is tried again at once, with the
//! signed radius in the test. Budgets count evaluations, so a retry is a step of its own.

use sdfrs_core::{Scalar, Status};

use super::walk::{Next, Range, Sample, Tally, Walk, onwards};

/// The step length of a 2018 listing.
pub trait Retry<T>: Sync {
    /// From the radius, the radius before and the last step.
    fn length(&self, r: T, before: T, d: T) -> T;
}

/// The listing around a step length.
pub struct Listing<R>(pub R);

pub struct State<T> {
    begun: bool,
    retrying: bool,
    t: T,
    r: T,
    before: T,
    d: T,
}

impl<T: Scalar, R: Retry<T>> Walk<T> for Listing<R> {
    type State = State<T>;

    fn start(&self, range: &Range<T>) -> (State<T>, T) {
        let zero = T::of(0.0);
        (State { begun: false, retrying: false, t: range.t_min, r: zero, before: zero, d: zero }, range.t_min)
    }

    fn step(&self, st: &mut State<T>, s: &Sample<T>, range: &Range<T>, tally: &mut Tally<T>) -> Next<T> {
        if s.r.is_nan() {
            return Next::Done(Status::Invalid);
        }
        if st.begun {
            tally.observe(st.r, s, s.t - st.t);
        }
        if !st.retrying && st.d > st.r + s.r {
            tally.fallbacks += 1;
            st.d = st.r;
            st.retrying = true;
            return if tally.spent() { Next::Done(Status::OutOfSteps) } else { Next::Ask(st.t + st.d) };
        }
        if st.begun {
            tally.accept(if st.retrying { T::of(1.0) } else { st.d / st.r });
        }
        (st.t, st.before, st.r, st.retrying) = (s.t, st.r, s.r, false);
        tally.at(s.t, s.r);
        if s.r <= s.e {
            return if st.begun { tally.hit(s, range) } else { tally.hit_at_start(s, range) };
        }
        st.begun = true;
        st.d = self.0.length(st.r, st.before, st.d);
        onwards(st.t, st.r, st.t + st.d, range, tally)
    }
}
