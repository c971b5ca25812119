//! Coverage search: spans of the ray known to be empty, the nearest gap sampled first. 004, corrected.
//!
//! As printed it reports no hit at all (its end marker has sign 0), does not end at shallow roots, and
//! merges touching balls over sheets; TRACERS.md has the form used here. At most 32 spans are kept:
//! beyond them the walk takes basic steps from the cursor.

use sdfrs_core::{Scalar, Status};

use super::{
    split::hit_at,
    walk::{Next, Range, Sample, Tally, Walk},
};

/// Spans kept at most.
const SPANS: usize = 32;

pub struct CoverageSearch;

pub struct Spans<T> {
    /// Everything before it is empty.
    cur: T,
    end: T,
    hit: Option<Sample<T>>,
    /// Known empty, nearest on top.
    spans: Vec<(T, T)>,
    /// The sample in flight is a basic step from the cursor.
    at_cursor: bool,
}

impl<T: Scalar> Walk<T> for CoverageSearch {
    type State = Spans<T>;

    fn start(&self, range: &Range<T>) -> (Spans<T>, T) {
        let (cur, end) = (range.t_min, range.t_max);
        (Spans { cur, end, hit: None, spans: Vec::new(), at_cursor: false }, (cur + end) * T::of(0.5))
    }

    fn step(&self, st: &mut Spans<T>, s: &Sample<T>, range: &Range<T>, tally: &mut Tally<T>) -> Next<T> {
        if !s.r.is_finite() {
            return Next::Done(Status::Invalid);
        }
        tally.at(s.t, s.r);
        match st.learn(s).or_else(|| st.close(s.e * T::of(0.5))) {
            Some(End::Hit(t)) => hit_at(t, &st.hit.unwrap_or(*s), range, tally),
            Some(End::Miss) => Next::Done(Status::Miss),
            None if tally.spent() => Next::Done(Status::OutOfSteps),
            None => Next::Ask(st.next()),
        }
    }
}

enum End<T> {
    Hit(T),
    Miss,
}

impl<T: Scalar> Spans<T> {
    fn top(&self) -> T {
        self.spans.last().map_or(self.end, |s| s.0)
    }

    fn next(&mut self) -> T {
        self.at_cursor = self.spans.len() == SPANS;
        if self.at_cursor { self.cur } else { (self.cur + self.top()) * T::of(0.5) }
    }

    /// What a sample says.
    fn learn(&mut self, s: &Sample<T>) -> Option<End<T>> {
        if s.r <= s.e {
            self.hit = Some(*s);
            self.spans.clear();
            self.end = s.t + s.r.min(T::of(0.0));
            return (self.end <= self.cur).then(|| End::Hit(self.cur.min(s.t)));
        }
        let q = s.r - s.e * T::of(0.5);
        if self.at_cursor {
            self.cur = s.t + q;
            return None;
        }
        let (low, high) = (s.t - q, s.t + q);
        let reaches = high >= self.top();
        match self.spans.last_mut() {
            Some(top) if reaches => {
                top.0 = low;
                top.1 = top.1.max(high);
            }
            None if reaches && self.hit.is_some() => {
                if low <= self.cur {
                    return Some(End::Hit(self.end));
                }
                self.spans.push((low, self.end));
            }
            _ => self.spans.push((low, high)),
        }
        None
    }

    /// Moves the cursor over what is known to be empty.
    fn close(&mut self, half_e: T) -> Option<End<T>> {
        loop {
            let top = self.top();
            let done = self.hit.is_some() && self.spans.is_empty() && top - self.cur <= half_e;
            if !(top <= self.cur || done) {
                return None;
            }
            match self.spans.pop() {
                Some((_, high)) => {
                    self.cur = self.cur.max(high);
                    if self.cur >= self.end && self.hit.is_none() {
                        return Some(End::Miss);
                    }
                }
                None if self.hit.is_some() => return Some(End::Hit(self.cur.min(self.end))),
                None => return Some(End::Miss),
            }
        }
    }
}
