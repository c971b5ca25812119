//! Rays that step together, a pack of lanes at a time.
//!
//! All that is known of a pack's rays lies side by side, so that a step reads one place and not twenty. A
//! finished ray leaves its lane to the next in the queue; when none waits, and half of the lanes is
//! free, the last rays move into the gaps. Law: a ray's result depends on nothing but the ray (tests/laws,
//! any tile, any thread count).

use sdfrs_core::{
    Real, Scalar, Status,
    eval::{Lanes, Native, vectorise},
};

use super::{
    Source, Threshold,
    ends::{End, Ends, Sink, pass},
    feed::{Bundle, Feed, Wanted, make},
    kernels::{Enter, Jump, Note, Points, Step},
    start::Start,
};
use crate::tracer::{
    guarded::{Rule, State},
    walk::Tally,
};

/// Widest pack of any scalar.
pub const WIDEST: usize = 16;

/// Packs whose lanes share words: eight lanes of eight packs.
pub const EIGHT: usize = 8;
/// How the rays of eight packs have ended with the last sample ([`super::kernels::code`]).
pub type Eight = [[u8; WIDEST]; EIGHT];

/// A pack of rays. A lane that asks for a sample at infinity is free.
#[derive(Clone)]
pub struct Pack<L> {
    /// The rays; their `t` is where the field is wanted next.
    pub rays: Bundle<L>,
    pub state: State<L>,
    pub steps: [u32; WIDEST],
    pub fallbacks: [u32; WIDEST],
    pub accepted: [u32; WIDEST],
    /// Where the result goes.
    pub place: [u32; WIDEST],
    /// How rays have ended with the last sample ([`super::kernels::code`]).
    pub end: L,
}

impl<L: Lanes> Pack<L> {
    /// Nobody.
    fn blank() -> Self {
        let (rays, none) = (Bundle::blank(), [0; WIDEST]);
        let (state, end) = (State::start(rays.t), rays.t);
        Self { rays, state, steps: none, fallbacks: none, accepted: none, place: none, end }
    }

    /// The next rays of a queue, at their starts, over whatever was here; their number.
    pub fn begin<R: Rule<L>>(
        &mut self,
        rays: &dyn Source<L::S>,
        next: &[Wanted],
        start: &Start<L::S>,
    ) -> usize
    where
        L::S: Native<Lanes = L>,
    {
        let n = make(rays, next, &mut self.rays, &mut self.place);
        let Start { r, length, next, steps } = *start;
        (self.state.t, self.state.r, self.state.witness) = (self.rays.t, L::splat(r), L::c(0.0));
        // Other rules never look at these.
        if R::LONGER {
            self.state = State { r: L::splat(r), z: L::splat(length), ..State::start(self.rays.t) };
            (self.fallbacks, self.accepted) = ([0; WIDEST], [0; WIDEST]);
        }
        self.steps = [steps; WIDEST];
        if steps > 0 {
            self.rays.t = L::splat(next);
        }
        (n..L::WIDTH).for_each(|lane| self.free(lane));
        n
    }

    fn is_free(&self, lane: usize) -> bool {
        self.rays.t.lane(lane) == L::S::INFINITY
    }

    pub fn free(&mut self, lane: usize) {
        self.rays.t.set(lane, L::S::INFINITY);
    }

    /// A new ray in a lane.
    #[inline]
    pub fn enter<R: Rule<L>>(
        &mut self,
        lane: usize,
        (from, which): (&Bundle<L>, usize),
        place: u32,
        start: &Start<L::S>,
    ) {
        let (zero, state) = (L::S::of(0.0), &mut self.state);
        if start.steps > 0 {
            // The rays of an eye differ in nothing else.
            self.rays.turn(lane, from, which);
            self.rays.t.set(lane, start.next);
            state.t.set(lane, zero);
        } else {
            self.rays.take(lane, from, which);
            state.t.set(lane, from.t.lane(which));
        }
        state.r.set(lane, start.r);
        state.witness.set(lane, zero);
        // Other rules never look at these.
        if R::LONGER {
            state.z.set(lane, start.length);
            state.m.set(lane, L::S::of(-1.0));
            state.ratios.set(lane, zero);
            (self.fallbacks[lane], self.accepted[lane]) = (0, 0);
        }
        (self.steps[lane], self.place[lane]) = (start.steps, place);
    }

    /// Another pack's ray goes on in a lane of this one, which may come from the same eye.
    #[inline]
    fn adopt<R: Rule<L>>(&mut self, lane: usize, (from, which): (&Self, usize), eye: bool) {
        if eye {
            // They differ in nothing else.
            self.rays.turn(lane, &from.rays, which);
            self.rays.t.set(lane, from.rays.t.lane(which));
        } else {
            self.rays.take(lane, &from.rays, which);
        }
        let (state, old) = (&mut self.state, &from.state);
        state.t.set(lane, old.t.lane(which));
        state.r.set(lane, old.r.lane(which));
        state.witness.set(lane, old.witness.lane(which));
        // Other rules never look at these.
        if R::LONGER {
            state.z.set(lane, old.z.lane(which));
            state.m.set(lane, old.m.lane(which));
            state.ratios.set(lane, old.ratios.lane(which));
            self.fallbacks[lane] = from.fallbacks[which];
            self.accepted[lane] = from.accepted[which];
        }
        self.steps[lane] = from.steps[which];
        self.place[lane] = from.place[which];
    }

    /// What the ray in a lane has come to.
    pub fn tally<R: Rule<L>>(&self, lane: usize) -> Tally<L::S> {
        let one = L::S::of(1.0);
        Tally {
            steps: self.steps[lane],
            max_steps: 0,
            fallbacks: if R::LONGER { self.fallbacks[lane] } else { 0 },
            accepted: if R::LONGER { self.accepted[lane] } else { 1 },
            ratios: if R::LONGER { self.state.ratios.lane(lane) } else { one },
            t: self.state.t.lane(lane),
            r: self.state.r.lane(lane),
            witness: self.state.witness.lane(lane),
            flags: 0,
        }
    }

    /// The same as a result; a miss is at infinity already.
    #[inline(always)]
    pub fn result<R: Rule<L>>(&self, lane: usize, status: Status) -> End<L::S> {
        End::at(status, &self.tally::<R>(lane))
    }
}

/// Which samples are taken: those before a depth. And where their field ends, which tells nothing of what lies
/// beyond: rays stop there.
#[derive(Debug, Clone, Copy)]
pub struct Span<T> {
    pub until: T,
    pub edge: T,
}

impl<T: Scalar> Span<T> {
    pub const ALL: Self = Self { until: T::INFINITY, edge: T::INFINITY };
}

/// Rays under way.
pub struct Swarm<T: Native> {
    /// The first `used` of them.
    packs: Vec<Pack<T::Lanes>>,
    used: usize,
    /// Of the packs that were picked last.
    codes: Vec<Eight>,
    /// The nearest sample asked for in each pack, where somebody wants to know.
    near: Vec<T>,
    alive: usize,
    /// Whether all come from one.
    eye: bool,
}

impl<T: Native> Default for Swarm<T> {
    fn default() -> Self {
        Self { packs: Vec::new(), used: 0, codes: Vec::new(), near: Vec::new(), alive: 0, eye: false }
    }
}

impl<T: Native> Swarm<T> {
    pub const WIDTH: usize = T::Lanes::WIDTH;

    /// Rays from the queue, in so many packs at most.
    pub fn fill<R: Rule<T::Lanes>>(&mut self, feed: &mut Feed<T>, packs: usize) {
        self.used = packs.min(feed.waiting().div_ceil(Self::WIDTH));
        self.packs.resize_with(self.packs.len().max(self.used), Pack::blank);
        self.near.clear();
        self.eye = feed.eye();
        self.alive = feed.packs::<R>(&mut self.packs[..self.used]);
    }

    /// Nobody, before rays come that may all come from one eye.
    pub fn clear(&mut self, eye: bool) {
        (self.used, self.alive, self.eye) = (0, 0, eye);
        self.near.clear();
    }

    /// More rays, from a depth on.
    pub fn add<R: Rule<T::Lanes>>(&mut self, rays: &dyn Source<T>, wanted: &[Wanted], t: T) {
        let t = T::Lanes::splat(t);
        for next in wanted.chunks(Self::WIDTH) {
            if self.used == self.packs.len() {
                self.packs.push(Pack::blank());
            }
            let pack = &mut self.packs[self.used];
            self.alive += pack.begin::<R>(rays, next, &Start::unknown());
            pack.rays.t = pack.rays.t.max(t);
            pack.state.t = pack.rays.t;
            self.near.push(pack.rays.t.least());
            self.used += 1;
        }
    }

    pub fn packs(&self) -> &[Pack<T::Lanes>] {
        &self.packs[..self.used]
    }

    pub fn alive(&self) -> usize {
        self.alive
    }

    /// The points that the picked packs ask for, side by side.
    pub fn points(&self, picked: &[u32], until: T, p: &mut [Vec<T>; 3]) {
        for p in p.iter_mut() {
            p.resize(p.len().max(picked.len() * Self::WIDTH), T::of(0.0));
        }
        vectorise(Points { packs: &self.packs, picked, until, p });
    }

    /// Takes the field at those points in, for rays that ask for a sample of the span; ended rays go to the sink,
    /// and others come from the queue.
    #[allow(clippy::too_many_arguments)] // columns and limits of one call from one place
    pub fn step<R: Rule<T::Lanes>>(
        &mut self,
        rule: R,
        limit: &Threshold<T>,
        max_steps: u32,
        picked: &[u32],
        (p, r): (&[Vec<T>; 3], &[T]),
        span: Span<T>,
        feed: &mut Feed<T>,
        sink: &mut impl Sink<T>,
    ) {
        let (packs, mut threshold) = (&mut self.packs[..], T::of(0.0));
        let to = &mut threshold;
        let codes = blank_codes(&mut self.codes, picked.len());
        vectorise(Step { packs, rule, limit, max_steps, picked, p, r, span, codes, threshold: to });
        sink.hit(threshold);
        let ended = (picked, &self.codes[..]);
        let free = Ends { limit, max_steps, p, r, feed, sink }.take::<R>(&mut self.packs, ended);
        self.leave::<R>(free);
    }

    /// Looks for the nearest samples again that picked packs ask for; the least of these. All are picked where ranks have
    /// been closed since.
    pub fn note(&mut self, picked: &mut Vec<u32>) -> T {
        let Self { packs, used, near, .. } = self;
        if near.len() != *used {
            near.resize(*used, T::INFINITY);
            pick_all(near, picked);
        }
        let mut least = T::INFINITY;
        vectorise(Note { packs, picked, near, least: &mut least });
        least
    }

    /// The nearest sample asked for; infinite where no ray is under way.
    pub fn nearest(&self) -> T {
        self.near.iter().copied().fold(T::INFINITY, T::min)
    }

    /// The packs in which a ray asks for a sample before `until`.
    pub fn pick(&self, until: T, picked: &mut Vec<u32>) {
        pick_all(&self.near, picked);
        self.pick_again(until, picked);
    }

    /// The same among packs that were picked.
    pub fn pick_again(&self, until: T, picked: &mut Vec<u32>) {
        let mut n = 0;
        // Without a branch that nobody could guess.
        for i in 0..picked.len() {
            picked[n] = picked[i];
            n += usize::from(self.near[picked[i] as usize] < until);
        }
        picked.truncate(n);
    }

    /// Nothing lies from `from` to `to`: rays whose own ball reaches there and that ask for a sample before
    /// its end start anew at the end. A longer step tried into it proves nothing of what it left out: such
    /// rays take the plain step first.
    pub fn jump<R: Rule<T::Lanes>>(
        &mut self,
        (from, to): (T, T),
        picked: &mut Vec<u32>,
        sink: &mut impl Sink<T>,
    ) {
        self.pick(to, picked);
        let rule = std::marker::PhantomData::<R>;
        let codes = blank_codes(&mut self.codes, picked.len());
        vectorise(Jump { packs: &mut self.packs, rule, picked, codes, from, to });
        let free = pass::<T, R>(&mut self.packs, (picked, &self.codes), sink);
        self.leave::<R>(free);
        self.note(picked);
    }

    /// Rays that ask for a sample from `from` to `to` for the first time start anew there: the field is another one,
    /// and no step from one to the other tells a slope.
    pub fn enter<R: Rule<T::Lanes>>(&mut self, (from, to): (T, T), picked: &mut Vec<u32>) {
        self.pick(to, picked);
        let rule = std::marker::PhantomData::<R>;
        vectorise(Enter { packs: &mut self.packs, rule, picked, from, to });
        self.note(picked);
    }

    /// So many rays are gone. Closes the ranks once half of the lanes is free.
    fn leave<R: Rule<T::Lanes>>(&mut self, free: usize) {
        self.alive -= free;
        let kept = self.alive.div_ceil(Self::WIDTH);
        if kept < self.used && self.alive * 2 < self.used * Self::WIDTH {
            self.close_ranks::<R>(kept);
        }
    }

    /// The last rays move into the free lanes of the first packs.
    fn close_ranks<R: Rule<T::Lanes>>(&mut self, kept: usize) {
        let (front, back) = self.packs[..self.used].split_at_mut(kept);
        let (mut pack, mut lane) = (0, 0);
        for from in back.iter().rev() {
            for which in (0..Self::WIDTH).filter(|which| !from.is_free(*which)) {
                // There are as many gaps as rays behind them.
                while !front[pack].is_free(lane) {
                    (pack, lane) = if lane + 1 < Self::WIDTH { (pack, lane + 1) } else { (pack + 1, 0) };
                }
                front[pack].adopt::<R>(lane, (from, which), self.eye);
            }
        }
        self.used = kept;
    }
}

/// Every pack that has a nearest sample.
fn pick_all<T>(near: &[T], picked: &mut Vec<u32>) {
    picked.clear();
    picked.extend(0..near.len() as u32);
}

/// Room for the codes of so many packs; beyond them nobody has ended.
fn blank_codes(codes: &mut Vec<Eight>, packs: usize) -> &mut [Eight] {
    codes.resize(packs.div_ceil(EIGHT), [[0; WIDEST]; EIGHT]);
    if let Some(last) = codes.last_mut() {
        *last = [[0; WIDEST]; EIGHT];
    }
    codes
}
