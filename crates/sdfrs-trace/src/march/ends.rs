//! Where rays end, and others take their lanes: one by one, after all packs have taken a step.

use sdfrs_core::{
    Scalar, Status,
    contract::{FLAG_CROSSING, FLAG_INSIDE, FLAG_PRECISION},
    eval::{Lanes, Native},
};

use super::{
    Threshold, along,
    feed::Feed,
    kernels::code,
    swarm::{EIGHT, Eight, Pack, WIDEST},
};
use crate::tracer::{
    guarded::{Bracket, Rule},
    walk::Tally,
};

/// What a ray has come to.
pub struct End<T> {
    pub t: T,
    pub r: T,
    pub witness: T,
    pub multiplier: T,
    pub steps: u32,
    pub fallbacks: u32,
    pub status: Status,
    pub flags: u8,
}

impl<T: Scalar> End<T> {
    /// A miss lies at infinity.
    pub fn of(status: Status, tally: &Tally<T>) -> Self {
        let end = Self::at(status, tally);
        if status == Status::Miss { Self { t: T::INFINITY, ..end } } else { end }
    }

    /// Where the tally says.
    #[inline(always)]
    pub fn at(status: Status, tally: &Tally<T>) -> Self {
        let Tally { t, r, witness, steps, fallbacks, flags, .. } = *tally;
        let multiplier = tally.multiplier();
        Self { t, r, witness, multiplier, steps, fallbacks, status, flags }
    }
}

/// The lowest bit of each byte.
const LOWEST: u64 = 0x0101_0101_0101_0101;

/// Where ended rays go.
pub trait Sink<T> {
    /// A ray has ended, at a point that only surfaces ask for.
    fn end(&mut self, place: u32, end: &End<T>, point: impl FnOnce() -> [T; 3]);
    /// A threshold that decided a hit.
    fn hit(&mut self, threshold: T);
    fn cross(&mut self, crossing: Crossing<T>);
}

/// A surface that a safe step went through, to be refined when the others are done.
pub struct Crossing<T> {
    pub origin: [T; 3],
    pub direction: [T; 3],
    pub bracket: Bracket<T>,
    pub tally: Tally<T>,
    /// Threshold of the last sample.
    pub e: T,
    pub place: u32,
}

impl<T: Scalar> Crossing<T> {
    /// Where the ray is at a depth.
    pub fn at(&self, t: T) -> [T; 3] {
        along(self.origin, self.direction, t)
    }
}

/// Ends of rays that have taken a sample in.
pub struct Ends<'a, 'b, T: Native, S> {
    pub limit: &'a Threshold<T>,
    pub max_steps: u32,
    /// Samples of the packs.
    pub p: &'a [Vec<T>; 3],
    pub r: &'a [T],
    pub feed: &'a mut Feed<'b, T>,
    pub sink: &'a mut S,
}

impl<T: Native, S: Sink<T>> Ends<'_, '_, T, S> {
    /// Ended rays of some packs go to the sink, and others come; the number of lanes left free.
    pub fn take<R: Rule<T::Lanes>>(
        &mut self,
        packs: &mut [Pack<T::Lanes>],
        (picked, codes): (&[u32], &[Eight]),
    ) -> usize {
        let mut free = 0;
        for (eight, first) in codes.iter().zip((0..).step_by(EIGHT)) {
            for octet in 0..T::Lanes::WIDTH / EIGHT {
                // Many packs' lanes in one word: the end of a loop over its bits is a branch that nobody can guess.
                let mut left = 0;
                for (i, codes) in eight.iter().enumerate() {
                    left |= (u64::from_le_bytes(codes.as_chunks().0[octet]) & LOWEST) << i;
                }
                while left != 0 {
                    let bit = left.trailing_zeros() as usize;
                    left &= left - 1;
                    let (lane, i) = (octet * EIGHT + bit / EIGHT, bit % EIGHT);
                    let pack = &mut packs[picked[first + i] as usize];
                    self.end::<R>(pack, eight[i][lane], lane, (first + i) * T::Lanes::WIDTH + lane);
                    free += usize::from(!self.next::<R>(pack, lane));
                }
            }
        }
        free
    }

    /// The next ray takes a lane; if there is one.
    #[inline(always)]
    fn next<R: Rule<T::Lanes>>(&mut self, pack: &mut Pack<T::Lanes>, lane: usize) -> bool {
        match self.feed.next() {
            Some((which, place)) => {
                pack.enter::<R>(lane, (self.feed.bundle(), which), place, &self.feed.start)
            }
            None => {
                pack.free(lane);
                return false;
            }
        }
        true
    }

    /// The end of the ray in a lane, whose last sample is the `at`-th.
    #[inline(always)]
    fn end<R: Rule<T::Lanes>>(&mut self, pack: &Pack<T::Lanes>, code: u8, lane: usize, at: usize) {
        let Some(status) = code::status(code) else { return self.seldom::<R>(pack, code, lane, at) };
        let end = pack.result::<R>(lane, status);
        self.sink.end(pack.place[lane], &end, || pack.rays.at(lane, end.t));
    }

    #[cold]
    #[inline(never)]
    fn seldom<R: Rule<T::Lanes>>(&mut self, pack: &Pack<T::Lanes>, code: u8, lane: usize, at: usize) {
        let (t, r) = (pack.rays.t.lane(lane), self.r[at]);
        let e = self.limit.sample(t, self.p.each_ref().map(|p| p[at]), r).e;
        let place = pack.place[lane];
        let end = match code {
            code::TOLD => {
                let limited = if r > self.limit.asked(t) { FLAG_PRECISION } else { 0 };
                let inside = if r < -e { FLAG_INSIDE } else { 0 };
                End { flags: limited | inside, ..pack.result::<R>(lane, Status::Hit) }
            }
            code::CROSSED => {
                let origin = pack.rays.origin.each_ref().map(|v| v.lane(lane));
                let direction = pack.rays.direction.each_ref().map(|v| v.lane(lane));
                let mut tally = pack.tally::<R>(lane);
                (tally.flags, tally.max_steps) = (FLAG_CROSSING, self.max_steps);
                let bracket = Bracket::new(tally.t, tally.r, t, r, e);
                self.sink.cross(Crossing { origin, direction, bracket, tally, e, place });
                return;
            }
            _ => {
                let end = pack.result::<R>(lane, Status::Invalid);
                // Only a first sample is where the ray stands.
                if end.t == t { End { r, ..end } } else { end }
            }
        };
        self.sink.end(place, &end, || pack.rays.at(lane, end.t));
    }
}

/// Rays that have passed everything; the number of lanes left free.
pub fn pass<T: Native, R: Rule<T::Lanes>>(
    packs: &mut [Pack<T::Lanes>],
    (picked, codes): (&[u32], &[Eight]),
    sink: &mut impl Sink<T>,
) -> usize {
    let mut free = 0;
    for (number, codes) in picked.iter().zip(codes.as_flattened()) {
        if *codes != [code::NONE; WIDEST] {
            free += pass_pack::<T, R>(&mut packs[*number as usize], codes, sink);
        }
    }
    free
}

fn pass_pack<T: Native, R: Rule<T::Lanes>>(
    pack: &mut Pack<T::Lanes>,
    codes: &[u8; WIDEST],
    sink: &mut impl Sink<T>,
) -> usize {
    let mut free = 0;
    for lane in (0..T::Lanes::WIDTH).filter(|lane| codes[*lane] == code::MISS) {
        let end = End { r: T::INFINITY, ..pack.result::<R>(lane, Status::Miss) };
        sink.end(pack.place[lane], &end, || pack.rays.at(lane, end.t));
        pack.free(lane);
        free += 1;
    }
    free
}
