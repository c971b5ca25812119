//! Cones around patches of neighbouring rays, a lane each: they march as one ray would as long as the ball around a
//! sample holds the whole patch, and rays are made where that ends.
//!
//! Law: what a cone steps over holds no hit (tests below, crates/sdfrs-trace/tests/prune.rs).

use sdfrs_core::{
    Field, Real, Scalar, Scratch,
    eval::{Kernel, Lanes, Native, vectorise},
    lane::Truth,
    prune::Clearance,
};

use super::{
    Pixel, Source,
    beam::{Offsets, SHORTER},
    cells::Stretch,
    feed::Bundle,
    order::{QUAD, Rectangle},
    swarm::WIDEST,
};

/// A cone goes on while its steps are longer than this part of its width.
const WORTH: f64 = 0.5;
/// What rounding adds to offsets of directions and origins, in ulp of a direction.
const ROUNDED: f64 = 8.0;

/// Cones of as many patches as there are lanes: their mean rays, and how far the others are from these.
struct Cones<L: Lanes> {
    origin: [L; 3],
    direction: [L; 3],
    off: Offsets<L>,
    t_max: L,
    /// Nothing lies before this depth; and where the field is wanted next, infinite where nobody goes on.
    t: L,
    ask: L,
    /// The nearest of these.
    near: L::S,
    codes: [u8; WIDEST],
}

/// How a cone has ended.
mod code {
    /// Goes on, or has ended before.
    pub const NONE: u8 = 0;
    /// Nothing is in it.
    pub const PASSED: u8 = 1;
    /// Something is near.
    pub const STUCK: u8 = 2;
}

/// What becomes of a patch.
pub enum Patch<T> {
    /// None of its rays meets anything.
    Passed,
    /// Its rays go on from a depth.
    Rays(T),
}

/// The patches of a group of rays.
pub struct Patches<T: Native> {
    cones: Vec<Cones<T::Lanes>>,
    of: Vec<Rectangle>,
    /// The rays at their corners.
    pixels: [Vec<Pixel>; 4],
    corners: [Bundle<T::Lanes>; 4],
    p: [Vec<T>; 3],
    r: Vec<T>,
    /// Cones that are asked.
    picked: Vec<u32>,
    nearest: T,
}

impl<T: Native> Patches<T> {
    const WIDTH: usize = T::Lanes::WIDTH;

    pub fn new() -> Self {
        Self {
            cones: Vec::new(),
            of: Vec::new(),
            pixels: Default::default(),
            corners: [Bundle::blank(); 4],
            p: Default::default(),
            r: Vec::new(),
            picked: Vec::new(),
            nearest: T::INFINITY,
        }
    }

    /// Nobody.
    fn clear(&mut self) {
        self.of.clear();
        self.nearest = T::INFINITY;
    }

    /// Those of a rectangle of pixels of a planar source.
    pub fn begin(&mut self, rays: &dyn Source<T>, group: Rectangle) {
        self.clear();
        self.pixels.iter_mut().for_each(Vec::clear);
        group.squares(QUAD, |patch| {
            self.of.push(patch);
            for (corner, pixels) in patch.corners().into_iter().zip(&mut self.pixels) {
                pixels.push(corner);
            }
        });
        let n = self.of.len();
        self.cones.resize_with(n.div_ceil(Self::WIDTH), Cones::blank);
        for (cones, from) in self.cones.iter_mut().zip((0..n).step_by(Self::WIDTH)) {
            let to = n.min(from + Self::WIDTH);
            for (bundle, pixels) in self.corners.iter_mut().zip(&self.pixels) {
                rays.bundle(&pixels[from..to], bundle);
            }
            vectorise(Fit { corners: &self.corners, to: cones });
            (to - from..Self::WIDTH).for_each(|lane| cones.ask.set(lane, T::INFINITY));
            cones.near = cones.ask.least();
        }
        let n = self.cones.len() * Self::WIDTH;
        self.p.iter_mut().chain([&mut self.r]).for_each(|column| column.resize(n, T::of(0.0)));
        self.note();
    }

    pub fn under_way(&self) -> bool {
        self.nearest < T::INFINITY
    }

    /// The nearest sample asked for; infinite where all have ended.
    pub fn nearest(&self) -> T {
        self.nearest
    }

    fn note(&mut self) {
        self.nearest = self.cones.iter().map(|cones| cones.near).fold(T::INFINITY, T::min);
    }

    /// Those that ask for a sample before a depth.
    fn pick(&mut self, to: T) {
        self.picked.clear();
        self.picked.extend((0..).zip(&self.cones).filter(|(_, cones)| cones.near < to).map(|(i, _)| i));
    }

    /// Nothing lies up to a depth.
    pub fn jump(&mut self, to: T, take: impl FnMut(Rectangle, Patch<T>)) {
        if !self.under_way() {
            return;
        }
        self.pick(to);
        vectorise(Jump { cones: &mut self.cones, picked: &self.picked, to });
        self.settle(take);
    }

    /// Those that ask for a sample in a stretch take it, and go on at most to its end; the number of points.
    pub fn step(
        &mut self,
        stretch: &Stretch<T>,
        scratch: &mut Scratch<T>,
        take: impl FnMut(Rectangle, Patch<T>),
    ) -> u64 {
        let (to, clearance) = (T::of(stretch.to), stretch.clearance);
        self.pick(to);
        let Self { cones, picked, p, r, .. } = self;
        let n = picked.len() * Self::WIDTH;
        vectorise(Points { cones, picked, to, p });
        stretch.program.eval(scratch, p.each_ref().map(|p| &p[..n]), &mut r[..n]);
        vectorise(Step { cones, picked, r, clearance, to });
        self.settle(take);
        n as u64
    }

    /// All that are left go on as rays.
    pub fn stop(&mut self, mut take: impl FnMut(Rectangle, Patch<T>)) {
        for (i, patch) in self.of.iter().enumerate() {
            let (cones, lane) = (&self.cones[i / Self::WIDTH], i % Self::WIDTH);
            if cones.ask.lane(lane) < T::INFINITY {
                take(*patch, Patch::Rays(cones.t.lane(lane)));
            }
        }
        self.clear();
    }

    /// Hands over what has ended.
    fn settle(&mut self, mut take: impl FnMut(Rectangle, Patch<T>)) {
        for &number in &self.picked {
            let (cones, from) = (&self.cones[number as usize], number as usize * Self::WIDTH);
            if cones.codes == [code::NONE; WIDEST] {
                continue;
            }
            for (lane, patch) in self.of[from..].iter().take(Self::WIDTH).enumerate() {
                match cones.codes[lane] {
                    code::PASSED => take(*patch, Patch::Passed),
                    code::STUCK => take(*patch, Patch::Rays(cones.t.lane(lane))),
                    _ => {}
                }
            }
        }
        self.note();
    }
}

impl<L: Lanes> Cones<L> {
    fn blank() -> Self {
        let zero = L::c(0.0);
        Self {
            origin: [zero; 3],
            direction: [zero; 3],
            off: Offsets { along: zero, apart: zero, bulge: zero, spread: zero },
            t_max: zero,
            t: zero,
            ask: zero,
            near: L::S::INFINITY,
            codes: [0; WIDEST],
        }
    }

    /// They have come to a depth; some have been stopped there.
    #[inline(always)]
    fn advance(&mut self, on: L::Mask, t: L, stuck: L::Mask) {
        self.t = L::pick(on, t, self.t);
        let passed = on & !L::lt(t, self.t_max);
        let stuck = on & stuck & !passed;
        self.ask = L::pick(passed | stuck, L::splat(L::S::INFINITY), L::pick(on, t, self.ask));
        let c = |code: u8| L::c(f64::from(code));
        L::pick(passed, c(code::PASSED), L::pick(stuck, c(code::STUCK), c(code::NONE)))
            .bytes(&mut self.codes);
        self.near = self.ask.least();
    }
}

#[inline(always)]
fn dot<L: Real>(a: [L; 3], b: [L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cones around the rays at four corners.
struct Fit<'a, L: Lanes> {
    corners: &'a [Bundle<L>; 4],
    to: &'a mut Cones<L>,
}

impl<L: Lanes> Kernel for Fit<'_, L> {
    #[inline(always)]
    fn run(self) {
        let Self { corners: [a, b, c, d], to } = self;
        let quarter = L::c(0.25);
        for i in 0..3 {
            to.origin[i] = quarter * (a.origin[i] + b.origin[i] + c.origin[i] + d.origin[i]);
            to.direction[i] = quarter * (a.direction[i] + b.direction[i] + c.direction[i] + d.direction[i]);
        }
        let (length, one, zero) = (dot(to.direction, to.direction).sqrt(), L::c(1.0), L::c(0.0));
        let inverse = one / length;
        let (mut offsets, mut far) = ([[zero; 2]; 2], zero);
        for ray in [a, b, c, d] {
            for (which, (v, mean)) in
                [(ray.origin, to.origin), (ray.direction, to.direction)].into_iter().enumerate()
            {
                let off = [v[0] - mean[0], v[1] - mean[1], v[2] - mean[2]];
                let [along, apart] = &mut offsets[which];
                *along = along.max((dot(off, to.direction) * inverse).abs());
                *apart = apart.max(dot(off, off));
                far = far.max(v[0].abs()).max(v[1].abs()).max(v[2].abs());
            }
            (to.t, to.t_max) = (ray.t, ray.t_max);
        }
        let (slack, ulp) = (L::c(1.0 / SHORTER), L::c(ROUNDED) * L::splat(L::S::EPS));
        let [[along, apart], [bulge, spread]] = offsets;
        // Directions between others lie in a cap around their mean, and the farthest along it in its middle. A cap is
        // smaller than half a sphere: others are never passed.
        let spread = spread.sqrt() * slack + ulp;
        to.off = Offsets {
            along: along * slack + ulp * far,
            apart: apart.sqrt() * slack + ulp * far,
            bulge: bulge.max((one - length).abs()) * slack + ulp,
            spread: L::pick(L::lt(spread, one), spread, L::splat(L::S::INFINITY)),
        };
        to.ask = to.t;
        to.codes = [code::NONE; WIDEST];
    }
}

/// Nothing lies up to a depth.
struct Jump<'a, L: Lanes> {
    cones: &'a mut [Cones<L>],
    picked: &'a [u32],
    to: L::S,
}

impl<L: Lanes> Kernel for Jump<'_, L> {
    #[inline(always)]
    fn run(self) {
        let to = L::splat(self.to);
        for &number in self.picked {
            let cones = &mut self.cones[number as usize];
            cones.advance(L::lt(cones.ask, to), to, !<L::Mask as Truth>::ALL);
        }
    }
}

/// Where the field is wanted.
struct Points<'a, T: Native> {
    cones: &'a [Cones<T::Lanes>],
    picked: &'a [u32],
    to: T,
    p: &'a mut [Vec<T>; 3],
}

impl<T: Native> Kernel for Points<'_, T> {
    #[inline(always)]
    fn run(self) {
        let [x, y, z] = self.p.each_mut().map(|p| p.chunks_exact_mut(T::Lanes::WIDTH));
        for (&number, ((x, y), z)) in self.picked.iter().zip(x.zip(y).zip(z)) {
            let Cones { origin, direction, ask, .. } = &self.cones[number as usize];
            // Points that are no numbers cost most.
            let t = ask.min(T::Lanes::splat(self.to));
            (origin[0] + t * direction[0]).store(x);
            (origin[1] + t * direction[1]).store(y);
            (origin[2] + t * direction[2]).store(z);
        }
    }
}

/// Cones take a sample in.
struct Step<'a, T: Native> {
    cones: &'a mut [Cones<T::Lanes>],
    picked: &'a [u32],
    r: &'a [T],
    clearance: Clearance,
    to: T,
}

impl<T: Native> Kernel for Step<'_, T> {
    #[inline(always)]
    fn run(self) {
        let Clearance { above, slope } = self.clearance;
        let (zero, to) = (T::Lanes::c(0.0), T::Lanes::splat(self.to));
        let (above, scale) = (T::Lanes::c(f64::from(above)), T::Lanes::c(SHORTER / f64::from(slope)));
        for (&number, r) in self.picked.iter().zip(self.r.chunks_exact(T::Lanes::WIDTH)) {
            let cones = &mut self.cones[number as usize];
            let on = T::Lanes::lt(cones.ask, to);
            // The ball without a hit, and the part of the cone's axis around which all of it lies in the ball.
            let ball = ((T::Lanes::load(r) - above) * scale).max(zero);
            let [half, across] = cones.off.inside(cones.t, ball);
            let ahead = (cones.t + half * T::Lanes::c(SHORTER)).min(to);
            // What is no number goes nowhere.
            let t = T::Lanes::pick(T::Lanes::lt(cones.t, ahead), ahead, cones.t);
            let goes = !T::Lanes::lt(t, to) | T::Lanes::lt(across * T::Lanes::c(WORTH), half);
            cones.advance(on, t, !goes);
        }
    }
}

#[cfg(test)]
mod tests;
