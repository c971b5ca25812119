//! Binary search of the ray: halves whose centre's ball covers them are dropped, front halves first. 003.
//!
//! `stack` keeps the back halves, `stackless` walks addresses (level : segment). Guarded, a half
//! overlaps when `d - e/2 <= half length` (a strict test drops sheets at dyadic points) and the depth
//! follows from eps. Faults of the letter forms: sheets dropped (0.49 % of lattice rays); a fixed depth
//! of 18 levels reports surfaces that pass by at large ranges.

use sdfrs_core::{Scalar, Status};

use super::walk::{Next, Range, Sample, Tally, Walk};

/// Longest stack of a letter form; a listing that outgrows it ends out of steps.
const LONGEST_STACK: usize = 1 << 16;

/// Whether the ball at a segment's centre leaves part of it open.
fn overlaps<T: Scalar>(s: &Sample<T>, half: T, guards: bool) -> bool {
    if guards { s.r - s.e * T::of(0.5) <= half } else { s.r < half }
}

fn is_invalid<T: Scalar>(r: T, guards: bool) -> bool {
    if guards { !r.is_finite() } else { r.is_nan() }
}

/// A hit in a segment too short to halve: at its centre, which is outside or within the threshold, or
/// at its front end, which lies outside, where the centre is inside. The listings take the front end.
fn found<T: Scalar>(s: &Sample<T>, half: T, guards: bool, range: &Range<T>, tally: &mut Tally<T>) -> Next<T> {
    let t = if guards && s.r >= T::of(0.0) { s.t } else { s.t - half };
    tally.at(t, s.r);
    if t <= range.t_min {
        tally.hit_at_start(&Sample { t, ..*s }, range)
    } else {
        tally.hit(&Sample { t, ..*s }, range)
    }
}

fn ask<T: Scalar>(t: T, tally: &Tally<T>) -> Next<T> {
    if tally.spent() { Next::Done(Status::OutOfSteps) } else { Next::Ask(t) }
}

/// The last listing of 003 (with `seg >>= 1` for its misprint).
pub struct Stackless {
    pub max_level: u32,
    pub guards: bool,
}

#[derive(Default)]
pub struct Address {
    level: u32,
    segment: u64,
}

impl Address {
    /// Centre and half length.
    fn span<T: Scalar>(&self, range: &Range<T>) -> (T, T) {
        let length = (range.t_max - range.t_min) * T::of(0.5f64.powi(self.level as i32));
        let centre = range.t_min + length * (T::of(self.segment as f64) + T::of(0.5));
        (centre, T::of(0.5) * length)
    }
    /// Leaves the subtree; false at the end of the ray.
    fn skip(&mut self) -> bool {
        while self.segment & 1 == 1 {
            self.segment >>= 1;
            self.level -= 1;
        }
        self.segment += 1;
        self.level != 0
    }
}

impl Stackless {
    fn deepest<T: Scalar>(&self, range: &Range<T>) -> u32 {
        if !self.guards {
            return self.max_level;
        }
        let levels = ((range.t_max - range.t_min).f64() / range.eps.f64()).log2().ceil();
        (levels.max(0.0) as u32).min(super::MAX_LEVEL)
    }
}

impl<T: Scalar> Walk<T> for Stackless {
    type State = Address;

    fn start(&self, range: &Range<T>) -> (Address, T) {
        (Address::default(), Address::default().span(range).0)
    }

    fn step(&self, st: &mut Address, s: &Sample<T>, range: &Range<T>, tally: &mut Tally<T>) -> Next<T> {
        if is_invalid(s.r, self.guards) {
            return Next::Done(Status::Invalid);
        }
        let (_, half) = st.span(range);
        tally.at(s.t, s.r);
        if overlaps(s, half, self.guards) {
            if half < s.e || st.level > self.deepest(range) {
                return found(s, half, self.guards, range, tally);
            }
            st.level += 1;
            st.segment <<= 1;
        } else if !st.skip() {
            return Next::Done(Status::Miss);
        }
        ask(st.span(range).0, tally)
    }
}

/// The first listing of 003, and Klenert's change to it as printed (`split`).
///
/// As printed the split does not end where a centre is inside: its halves grow.
pub struct Stack {
    pub guards: bool,
    pub split: bool,
}

pub struct Segments<T> {
    x: T,
    y: T,
    rest: Vec<(T, T)>,
}

impl<T: Scalar> Walk<T> for Stack {
    type State = Segments<T>;

    fn start(&self, range: &Range<T>) -> (Segments<T>, T) {
        let (x, y) = (range.t_min, range.t_max);
        (Segments { x, y, rest: Vec::new() }, T::of(0.5) * (y + x))
    }

    fn step(&self, st: &mut Segments<T>, s: &Sample<T>, range: &Range<T>, tally: &mut Tally<T>) -> Next<T> {
        if is_invalid(s.r, self.guards) {
            return Next::Done(Status::Invalid);
        }
        let half = T::of(0.5) * (st.y - st.x);
        tally.at(s.t, s.r);
        if overlaps(s, half, self.guards) {
            if half < s.e {
                return found(s, half, self.guards, range, tally);
            }
            if st.rest.len() == LONGEST_STACK {
                return Next::Done(Status::OutOfSteps);
            }
            // In the listing's order: tcen + d - th and tcen - d + th.
            let (back, front) = if self.split { (s.t + s.r - s.e, s.t - s.r + s.e) } else { (s.t, s.t) };
            st.rest.push((back, st.y));
            st.y = front;
        } else {
            match st.rest.pop() {
                Some((x, y)) => (st.x, st.y) = (x, y),
                None => return Next::Done(Status::Miss),
            }
        }
        ask(T::of(0.5) * (st.y + st.x), tally)
    }
}
