//! Pixels that show a surface, in clusters of what lies close together: squares of the picture, cut where
//! their depths are far apart.
//!
//! Law: every pixel that shows a surface is in one cluster, whatever the depths are (tests below).

use sdfrs_core::{
    Real, Status,
    eval::{Kernel, Lanes, Native, vectorise},
};

use super::direct::shows_surface;
use crate::{
    camera::Frame,
    march::{Pixel, WIDEST},
};

/// Pixels along the squares.
pub const SQUARE: usize = 16;
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
    pixels: Vec<Pixel>,
    depths: Vec<T>,
    len: usize,
    pub list: Vec<Cluster>,
    /// The farther part of a cluster that is cut.
    far: [(Pixel, T); SQUARE * SQUARE],
}

impl<T: Native> Clusters<T> {
    pub fn new() -> Self {
        let far = [(Pixel::default(), T::default()); SQUARE * SQUARE];
        Self { pixels: Vec::new(), depths: Vec::new(), len: 0, list: Vec::new(), far }
    }

    /// Makes room for so many pixels, and forgets all.
    pub fn begin(&mut self, most: usize) {
        let most = most.max(self.pixels.len());
        self.pixels.resize(most, Pixel::default());
        self.depths.resize(most, T::default());
        self.len = 0;
        self.list.clear();
    }

    /// Pixels next to each other: those that show a surface.
    #[inline(always)]
    pub fn add(&mut self, first: Pixel, depths: &[T; SQUARE], statuses: &[u8; SQUARE]) {
        let to = self.len..self.len + SQUARE;
        let (pixels, room) = (&mut self.pixels[to.clone()], &mut self.depths[to]);
        if *statuses == [Status::Hit as u8; SQUARE] {
            room.copy_from_slice(depths);
            pixels.iter_mut().zip(first.0..).for_each(|(to, pixel)| *to = Pixel(pixel));
            self.len += SQUARE;
            return;
        }
        // All are written, because where a surface ends nobody can guess.
        let mut at = 0;
        for ((pixel, depth), status) in (first.0..).zip(depths).zip(statuses) {
            (pixels[at % SQUARE], room[at % SQUARE]) = (Pixel(pixel), *depth);
            at += usize::from(shows_surface(*status));
        }
        self.len += at;
    }

    pub fn len(&self) -> usize {
        self.len
    }
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels[..self.len]
    }
    pub fn depths(&self) -> &[T] {
        &self.depths[..self.len]
    }

    /// The pixels from `from` on as clusters, none much deeper than its square is wide.
    pub fn close(&mut self, from: usize, frame: &Frame) {
        if from < self.len {
            self.cut(from, self.len, frame);
        }
    }

    fn cut(&mut self, from: usize, to: usize, frame: &Frame) {
        let [near, far] = extent(&self.depths[from..to]);
        // A walk that ran out of steps may be anywhere, and where nothing is known nothing is cut.
        if to - from > FEW && far - near > frame.span(DEEP * SQUARE, near) {
            let middle = self.part(from, to, 0.5 * near + 0.5 * far);
            if middle > from && middle < to {
                self.cut(from, middle, frame);
                return self.cut(middle, to, frame);
            }
        }
        self.list.push(Cluster { from, to, near });
    }

    /// Puts pixels nearer than `depth` first, in the order in which they were; where the others begin.
    fn part(&mut self, from: usize, to: usize, depth: f64) -> usize {
        let (pixels, depths) = (&mut self.pixels[from..to], &mut self.depths[from..to]);
        let (mut near, mut far) = (0, 0);
        // Without a branch that nobody could guess.
        for i in 0..pixels.len() {
            let (pixel, t) = (pixels[i], depths[i]);
            let nearer = t.f64() < depth;
            (pixels[near], depths[near]) = (pixel, t);
            self.far[far % self.far.len()] = (pixel, t);
            near += usize::from(nearer);
            far += usize::from(!nearer);
        }
        for ((pixel, t), far) in pixels[near..].iter_mut().zip(&mut depths[near..]).zip(&self.far) {
            (*pixel, *t) = *far;
        }
        from + near
    }
}

/// Least and largest of some numbers; not finite where one of them is not.
pub fn extent<T: Native>(of: &[T]) -> [f64; 2] {
    let [found] = extents([of]);
    found
}

/// Those of several columns.
pub fn extents<T: Native, const N: usize>(of: [&[T]; N]) -> [[f64; 2]; N] {
    let mut found = [[f64::INFINITY, -f64::INFINITY]; N];
    vectorise(Extents { of, found: &mut found });
    found
}

struct Extents<'a, T, const N: usize> {
    of: [&'a [T]; N],
    found: &'a mut [[f64; 2]; N],
}

impl<T: Native, const N: usize> Kernel for Extents<'_, T, N> {
    #[inline(always)]
    fn run(self) {
        for (of, found) in self.of.iter().zip(self.found) {
            let (mut lo, mut hi) = (T::Lanes::splat(T::INFINITY), T::Lanes::splat(-T::INFINITY));
            // Nothing times what is not finite is not a number, nor is its sum with others.
            let (zero, mut sum) = (T::Lanes::c(0.0), T::Lanes::c(0.0));
            for run in of.chunks(T::Lanes::WIDTH) {
                let v = T::Lanes::load(run);
                (lo, hi, sum) = (lo.min(v), hi.max(v), sum + v * zero);
            }
            let mut spoilt = [T::default(); WIDEST];
            sum.store(&mut spoilt);
            *found = if spoilt.iter().all(|v| *v == T::default()) {
                [lo.least().f64(), -(-hi).least().f64()]
            } else {
                [-f64::INFINITY, f64::INFINITY]
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Kind};

    fn frame() -> Frame {
        let kind = Kind::Pinhole { fov_deg: 40.0 };
        let (origin, up) = ([0.0, 0.0, 5.0], [0.0, 1.0, 0.0]);
        Camera { kind, origin, target: [0.0; 3], up, width: 64, height: 64 }.frame().unwrap()
    }

    fn clusters(depths: &[f32], statuses: &[u8]) -> Clusters<f32> {
        let mut all = Clusters::new();
        all.begin(SQUARE * SQUARE);
        for (y, (depths, statuses)) in (0..).zip(depths.chunks(SQUARE).zip(statuses.chunks(SQUARE))) {
            all.add(Pixel::at(0, y), depths.first_chunk().unwrap(), statuses.first_chunk().unwrap());
        }
        all.close(0, &frame());
        all
    }

    #[test]
    fn every_lit_pixel_is_in_one_cluster_and_none_is_deep() {
        // Two walls, a slope, and one that went astray.
        let depth = |i: usize| match i % 7 {
            0 => 2.0,
            1 => 40.0,
            2 => 4.0 + i as f32 * 0.1,
            4 if i == 179 => f32::MAX,
            _ => 3.0,
        };
        let depths: Vec<f32> = (0..SQUARE * SQUARE).map(depth).collect();
        // One row is full.
        let hit = |i: usize| if !i.is_multiple_of(5) || i / SQUARE == 3 { Status::Hit } else { Status::Miss };
        let statuses: Vec<u8> = (0..depths.len()).map(|i| hit(i) as u8).collect();
        let all = clusters(&depths, &statuses);
        let number = |pixel: &Pixel| pixel.y() as usize * SQUARE + pixel.x() as usize;
        let mut seen: Vec<usize> = all.pixels().iter().map(number).collect();
        for (i, t) in seen.iter().zip(all.depths()) {
            assert_eq!(*t, depths[*i]);
        }
        seen.sort_unstable();
        let want = (0..).zip(&statuses).filter(|(_, s)| **s == Status::Hit as u8).map(|(i, _)| i);
        assert!(seen.into_iter().eq(want));
        let mut at = 0;
        for cluster in &all.list {
            assert_eq!(cluster.from, at);
            at = cluster.to;
            let [near, far] = extent(&all.depths()[cluster.from..cluster.to]);
            assert_eq!(near, cluster.near);
            let deep = far - near > frame().span(DEEP * SQUARE, near);
            assert!(!deep || cluster.to - cluster.from <= FEW, "{cluster:?}");
        }
        assert!(at == all.len() && all.list.len() > 3, "{:?}", all.list);
    }

    #[test]
    fn a_flat_square_is_one_cluster_and_an_empty_one_none() {
        let n = SQUARE * SQUARE;
        assert_eq!(clusters(&vec![3.0; n], &vec![Status::Hit as u8; n]).list.len(), 1);
        assert!(clusters(&vec![3.0; n], &vec![Status::Miss as u8; n]).list.is_empty());
        // Nothing is known of what is not a number: it stays together.
        assert_eq!(clusters(&vec![f32::NAN; n], &vec![Status::OutOfSteps as u8; n]).list.len(), 1);
    }

    #[test]
    fn extents_are_those_of_the_numbers() {
        for n in [1usize, 15, 16, 17, 40] {
            let of: Vec<f64> = (0..n).map(|i| (i as f64 * 1.7).sin() - 2.0).collect();
            let least = of.iter().copied().fold(f64::INFINITY, f64::min);
            let most = of.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            assert_eq!(extent(&of), [least, most]);
            for spoiler in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut of = of.clone();
                of[n / 2] = spoiler;
                assert_eq!(extent(&of), [f64::NEG_INFINITY, f64::INFINITY]);
            }
        }
    }
}
