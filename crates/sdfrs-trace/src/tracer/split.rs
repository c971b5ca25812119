//! Binary search with the empty span around each centre cut out: Klenert's split (003), mended.
//!
//! As printed it does not end. Here a sample within the threshold drops everything behind it, and any
//! other cuts its ball (less half the threshold) out of its segment: coverage search without merging.

use sdfrs_core::{Scalar, Status};

use super::walk::{Next, Range, Sample, Tally, Walk};

pub struct Split;

pub struct Gaps<T> {
    /// The open segment in hand.
    x: T,
    y: T,
    /// Open segments behind it, nearest on top.
    rest: Vec<(T, T)>,
    /// Nothing behind matters any more.
    end: T,
    /// The sample that hit, if any.
    hit: Option<Sample<T>>,
}

impl<T: Scalar> Walk<T> for Split {
    type State = Gaps<T>;

    fn start(&self, range: &Range<T>) -> (Gaps<T>, T) {
        let (x, y) = (range.t_min, range.t_max);
        (Gaps { x, y, rest: Vec::new(), end: y, hit: None }, T::of(0.5) * (x + y))
    }

    fn step(&self, st: &mut Gaps<T>, s: &Sample<T>, range: &Range<T>, tally: &mut Tally<T>) -> Next<T> {
        let (zero, half) = (T::of(0.0), T::of(0.5));
        if !s.r.is_finite() {
            return Next::Done(Status::Invalid);
        }
        tally.at(s.t, s.r);
        if s.r <= s.e {
            st.hit = Some(*s);
            st.rest.clear();
            st.end = s.t + s.r.min(zero);
            st.y = st.end;
            if st.end <= st.x {
                return hit_at(st.x.min(s.t), s, range, tally);
            }
        } else {
            let q = s.r - s.e * half;
            st.rest.push((s.t + q, st.y));
            st.y = s.t - q;
        }
        loop {
            if let Some(hit) = st.hit
                && st.y == st.end
                && st.y - st.x <= s.e * half
            {
                return hit_at(st.x.min(st.end), &hit, range, tally);
            }
            if st.y > st.x {
                break;
            }
            match (st.rest.pop(), st.hit) {
                (Some((x, y)), _) => (st.x, st.y) = (x, y),
                (None, Some(hit)) => return hit_at(st.end, &hit, range, tally),
                (None, None) => return Next::Done(Status::Miss),
            }
        }
        if tally.spent() { Next::Done(Status::OutOfSteps) } else { Next::Ask(half * (st.x + st.y)) }
    }
}

/// A hit at `t`, decided by the sample `s`.
pub fn hit_at<T: Scalar>(t: T, s: &Sample<T>, range: &Range<T>, tally: &mut Tally<T>) -> Next<T> {
    tally.at(t, s.r);
    let s = Sample { t, ..*s };
    if t <= range.t_min { tally.hit_at_start(&s, range) } else { tally.hit(&s, range) }
}
