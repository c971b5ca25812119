//! Pixels that show a surface, in clusters of what lies close together: squares of the picture, cut where
//! their depths are far apart.
//!
//! Law: every pixel that shows a surface is in one cluster, whatever the depths are (tests below).

use sdfrs_core::{
    Real,
    eval::{Kernel, Lanes, Native, vectorise},
};

use crate::{camera::Frame, march::{WIDEST, Wanted}};

/// A cluster is at most so many times as deep as its square is wide, unless it is small.
const DEEP: usize = 3;
/// Pixels that are not worth being cut.
const FEW: usize = 16;

/// Pixels next to each other in [`Clusters`], all about as far away.
#[derive(Debug, Clone, Copy)]
pub struct Cluster {
    pub from: usize,
    pub to: usize,
    /// Depth of the nearest.
    pub near: f64,
}

/// Pixels to be lit, in the order of their clusters.
pub struct Clusters<T> {
    /// Room for a block's; the first `len` count.
    pixels: Vec<Wanted>,
    depths: Vec<T>,
    len: usize,
    pub list: Vec<Cluster>,
}

impl<T: Native> Clusters<T> {
    pub fn new() -> Self {
        Self { pixels: Vec::new(), depths: Vec::new(), len: 0, list: Vec::new() }
    }

    /// Makes room for so many pixels, and forgets all.
    pub fn begin(&mut self, most: usize) {
        let most = most.max(self.pixels.len());
        self.pixels.resize(most, Wanted { x: 0, y: 0, place: 0 });
        self.depths.resize(most, T::default());
        self.len = 0;
        self.list.clear();
    }

    /// Some pixels next to each other, those that are lit. All are written, because where a surface ends nobody
    /// can guess.
    #[inline(always)]
    pub fn add(&mut self, first: Wanted, depths: &[T], lit: impl Iterator<Item = bool>) {
        let mut len = self.len;
        for ((i, depth), lit) in (0..).zip(depths).zip(lit) {
            self.pixels[len] = Wanted { x: first.x + i, place: first.place + i, ..first };
            self.depths[len] = *depth;
            len += usize::from(lit);
        }
        self.len = len;
    }

    pub fn len(&self) -> usize {
        self.len
    }
    pub fn pixels(&self) -> &[Wanted] {
        &self.pixels[..self.len]
    }
    pub fn depths(&self) -> &[T] {
        &self.depths[..self.len]
    }

    /// The pixels from `from` on as clusters, none much deeper than `side` pixels are wide.
    pub fn close(&mut self, from: usize, side: usize, frame: &Frame) {
        if from < self.len {
            self.cut(from, self.len, side, frame);
        }
    }

    fn cut(&mut self, from: usize, to: usize, side: usize, frame: &Frame) {
        let [near, far] = extent(&self.depths[from..to]);
        // A walk that ran out of steps may be anywhere, and where nothing is known nothing is cut.
        if to - from > FEW && far - near > frame.span(DEEP * side, near) {
            let middle = self.part(from, to, 0.5 * near + 0.5 * far);
            if middle > from && middle < to {
                self.cut(from, middle, side, frame);
                return self.cut(middle, to, side, frame);
            }
        }
        self.list.push(Cluster { from, to, near });
    }

    /// Puts pixels nearer than `depth` first; where the others begin.
    fn part(&mut self, from: usize, to: usize, depth: f64) -> usize {
        let mut at = from;
        for i in from..to {
            if self.depths[i].f64() < depth {
                self.depths.swap(i, at);
                self.pixels.swap(i, at);
                at += 1;
            }
        }
        at
    }
}

/// Least and largest of some numbers; not finite where one of them is not.
pub fn extent<T: Native>(of: &[T]) -> [f64; 2] {
    let mut found = [f64::INFINITY, -f64::INFINITY];
    vectorise(Extent { of, found: &mut found });
    found
}

struct Extent<'a, T> {
    of: &'a [T],
    found: &'a mut [f64; 2],
}

impl<T: Native> Kernel for Extent<'_, T> {
    #[inline(always)]
    fn run(self) {
        let (mut lo, mut hi) = (T::Lanes::splat(T::INFINITY), T::Lanes::splat(-T::INFINITY));
        // What is not a number leaves a difference that is none: it is neither below nor above, nor is its sum.
        let mut sum = T::Lanes::c(0.0);
        for run in self.of.chunks(T::Lanes::WIDTH) {
            let v = T::Lanes::load(run);
            (lo, hi, sum) = (lo.min(v), hi.max(v), sum + (v - v));
        }
        let mut spoilt = [T::default(); WIDEST];
        sum.store(&mut spoilt);
        *self.found = if spoilt.iter().all(|v| *v == T::default()) {
            [lo.least().f64(), -(-hi).least().f64()]
        } else {
            [-f64::INFINITY, f64::INFINITY]
        };
    }
}
