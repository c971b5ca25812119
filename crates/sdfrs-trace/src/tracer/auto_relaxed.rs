//! Auto-relaxed sphere tracing: the step to the touching ball of a plane whose slope is an exponential
//! average of the slopes seen. 000 Algorithm 4.
//!
//! Faults of the letter form: slopes near 1 make steps without bound, head-on surfaces are passed by
//! equality in `z <= r + |R|`, and sheets between touching balls are skipped (14 %).

use sdfrs_core::{Real, Scalar, Status};

use super::{
    guarded::Rule,
    walk::{Next, Range, Sample, Tally, Walk, onwards},
};

#[derive(Debug, Clone, Copy)]
pub struct AutoRelaxed<R> {
    pub beta: R,
}

impl<R: Real + Sync> Rule<R> for AutoRelaxed<R> {
    #[inline(always)]
    fn slope(self, m: R, seen: R) -> R {
        m + self.beta * (seen - m)
    }
    #[inline(always)]
    fn next(self, r: R, m: R) -> R {
        let one = R::c(1.0);
        r * one.max(R::c(2.0) / (one - m))
    }
}

/// Algorithm 4 as printed.
pub struct Letter<T> {
    pub beta: T,
}

pub struct State<T> {
    begun: bool,
    t: T,
    r: T,
    z: T,
    m: T,
}

impl<T: Scalar> Walk<T> for Letter<T> {
    type State = State<T>;

    fn start(&self, range: &Range<T>) -> (State<T>, T) {
        let zero = T::of(0.0);
        (State { begun: false, t: range.t_min, r: zero, z: zero, m: T::of(-1.0) }, range.t_min)
    }

    fn step(&self, st: &mut State<T>, s: &Sample<T>, range: &Range<T>, tally: &mut Tally<T>) -> Next<T> {
        if s.r.is_nan() {
            return Next::Done(Status::Invalid);
        }
        let (one, begun) = (T::of(1.0), st.begun);
        st.begun = true;
        let mut accepted = true;
        if !begun {
            (st.r, st.z) = (s.r, s.r);
        } else {
            let dz = s.t - st.t;
            tally.observe(st.r, s, dz);
            accepted = st.z <= st.r + s.r.abs();
            if accepted {
                tally.accept(st.z / st.r);
                let seen = (s.r - st.r) / dz;
                st.m = (one - self.beta) * st.m + self.beta * seen;
                (st.t, st.r) = (s.t, s.r);
            } else {
                tally.fallbacks += 1;
                st.m = T::of(-1.0);
            }
            st.z = T::of(2.0) * st.r / (one - st.m);
        }
        if accepted {
            tally.at(s.t, s.r);
            if s.r <= s.e {
                return if begun { tally.hit(s, range) } else { tally.hit_at_start(s, range) };
            }
        }
        onwards(st.t, st.r, st.t + st.z, range, tally)
    }
}
