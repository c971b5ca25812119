//! A picture of rays, traced by Hart's plain loop: one ray at a time, or 32x32 rays in waves.

use std::sync::Mutex;

use sdfrs_core::{
    Control, Hits, Limits, Program, Prune, Real, Status,
    eval::{Kernel, vectorise},
    lane::Pack,
};
use sdfrs_trace::{
    Tracer,
    march::{Bundle, Pixel, Ray, Source, WIDEST, trace_over},
};

use crate::{Scene, fidget_peer::Jit};

pub const EPS: f32 = 1e-4;
pub const MAX_STEPS: u32 = 256;
pub const T_MAX: f32 = 10.0;
/// Side of a tile of rays that step together.
pub const TILE: usize = 32;

#[derive(Debug, Clone, Copy)]
pub struct Line {
    pub o: [f32; 3],
    pub d: [f32; 3],
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct End {
    pub hit: bool,
    pub steps: u32,
}

impl Line {
    #[inline(always)]
    pub fn at(&self, t: f32) -> [f32; 3] {
        [self.o[0] + t * self.d[0], self.o[1] + t * self.d[1], self.o[2] + t * self.d[2]]
    }
    #[inline(always)]
    pub fn walk(&self, field: impl Fn([f32; 3]) -> f32) -> End {
        let mut t = 0.0;
        for steps in 1..=MAX_STEPS {
            let r = field(self.at(t));
            if r < EPS {
                return End { hit: true, steps };
            }
            t += r;
            if !(t <= T_MAX) {
                return End { hit: false, steps };
            }
        }
        End { hit: false, steps: MAX_STEPS }
    }
}

/// The ray of a pinhole camera through a pixel.
fn ray(side: usize, x: usize, y: usize) -> Line {
    Line { o: EYE, d: direction(side as f32, x as f32, y as f32) }
}
/// Its direction, or those of a pack of pixels.
#[inline(always)]
fn direction<R: Real>(side: R, x: R, y: R) -> [R; 3] {
    let half = R::c(0.5);
    let (u, v) = ((x + half) / side - half, half - (y + half) / side);
    let d = [u - R::c(0.14), v - R::c(0.28), R::c(-1.0)];
    let n = R::len3(d[0], d[1], d[2]);
    [d[0] / n, d[1] / n, d[2] / n]
}
const EYE: [f32; 3] = [0.6, 1.2, 4.2];

/// All rays of a picture, tile by tile.
pub fn picture(side: usize) -> Vec<Line> {
    nested(side, [TILE, TILE])
}

/// The same in tiles of tiles.
pub fn nested(side: usize, tiles: [usize; 2]) -> Vec<Line> {
    let [outer, inner] = tiles;
    let corners = |n: usize, step: usize| {
        (0..n).step_by(step).flat_map(move |y| (0..n).step_by(step).map(move |x| (x, y)))
    };
    let mut lines = Vec::with_capacity(side * side);
    for (ox, oy) in corners(side, outer) {
        for (ix, iy) in corners(outer, inner) {
            lines.extend(corners(inner, 1).map(|(x, y)| ray(side, ox + ix + x, oy + iy + y)));
        }
    }
    lines
}

/// Totals that two tracers must agree on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Totals {
    pub hits: usize,
    pub steps: u64,
}

pub fn scalar(scene: &Scene, lines: &[Line]) -> Totals {
    scene.hand.rays(lines)
}

/// Waves of one tile after the other through fidget's JIT.
pub fn waves(jit: &mut Jit, lines: &[Line]) -> Totals {
    let mut sum = Totals { hits: 0, steps: 0 };
    let mut p: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; TILE * TILE]);
    for tile in lines.chunks(TILE * TILE) {
        let mut t = vec![0f32; tile.len()];
        let mut active: Vec<u32> = (0..tile.len() as u32).collect();
        for _ in 0..MAX_STEPS {
            let n = active.len();
            if n == 0 {
                break;
            }
            for (i, &k) in active.iter().enumerate() {
                let q = tile[k as usize].at(t[k as usize]);
                (p[0][i], p[1][i], p[2][i]) = (q[0], q[1], q[2]);
            }
            sum.steps += n as u64;
            let kept = jit.eval([&p[0][..n], &p[1][..n], &p[2][..n]], |r| {
                let mut kept = 0;
                for i in 0..n {
                    let k = active[i];
                    if r[i] < EPS {
                        sum.hits += 1;
                        continue;
                    }
                    t[k as usize] += r[i];
                    active[kept] = k;
                    kept += usize::from(t[k as usize] <= T_MAX);
                }
                kept
            });
            active.truncate(kept);
        }
    }
    sum
}

/// The rays as the product takes them: those of a picture, row by row.
pub struct Batch<R = Eye> {
    rays: R,
    /// The last picture's memory: the peers keep theirs as well, and write no results.
    hits: Mutex<Hits<f32>>,
}

/// The camera of [`picture`], which makes its rays as they are needed; the peers get theirs made.
pub struct Eye {
    side: usize,
}

impl Source<f32> for Eye {
    fn count(&self) -> usize {
        self.side * self.side
    }
    fn ray(&self, i: usize) -> Ray<f32> {
        infinite(&ray(self.side, i % self.side, i / self.side))
    }
    fn width(&self) -> Option<usize> {
        Some(self.side)
    }
    fn eye(&self) -> Option<([f32; 3], f32)> {
        Some((EYE, T_MAX))
    }
    fn planar(&self) -> bool {
        true
    }
    fn bundle(&self, pixels: &[Pixel], to: &mut Bundle<Lanes>) {
        vectorise(Rays { side: self.side, pixels, to });
    }
}

type Lanes = Pack<f32, WIDEST>;

/// A pack of an eye's rays.
struct Rays<'a> {
    side: usize,
    pixels: &'a [Pixel],
    to: &'a mut Bundle<Lanes>,
}

impl Kernel for Rays<'_> {
    #[inline(always)]
    fn run(self) {
        let (mut x, mut y) = ([0u32; WIDEST], [0u32; WIDEST]);
        let last = self.pixels.len() - 1;
        for lane in 0..WIDEST {
            let pixel = self.pixels[lane.min(last)];
            (x[lane], y[lane]) = (pixel.x(), pixel.y());
        }
        let (x, y) = (Pack(x.map(|x| x as f32)), Pack(y.map(|y| y as f32)));
        *self.to = Bundle {
            origin: EYE.map(Lanes::splat),
            direction: direction(Lanes::splat(self.side as f32), x, y),
            t: Lanes::c(0.0),
            t_max: Lanes::splat(T_MAX),
        };
    }
}

/// Rays as arrays hold them.
pub struct Lines {
    rays: Vec<Ray<f32>>,
    width: usize,
}

fn infinite(l: &Line) -> Ray<f32> {
    Ray { origin: l.o, direction: l.d, t_min: 0.0, t_max: T_MAX }
}

impl Source<f32> for Lines {
    fn count(&self) -> usize {
        self.rays.len()
    }
    fn ray(&self, i: usize) -> Ray<f32> {
        self.rays[i]
    }
    fn width(&self) -> Option<usize> {
        Some(self.width)
    }
}

impl Batch {
    /// The rays of [`picture`].
    pub fn picture(side: usize) -> Self {
        Self { rays: Eye { side }, hits: Mutex::default() }
    }
}

impl Batch<Lines> {
    /// Any rays, made beforehand.
    pub fn of(lines: &[Line], width: usize) -> Self {
        Self { rays: Lines { rays: lines.iter().map(infinite).collect(), width }, hits: Mutex::default() }
    }
}

impl<R: Source<f32>> Batch<R> {
    pub fn trace(&self, field: &Program<f32>) {
        self.pruned(field, Prune::Off);
    }

    /// As `pruned`, into new memory.
    pub fn fresh(&self, field: &Program<f32>, prune: Prune) {
        *self.hits.lock().unwrap() = Hits::default();
        self.pruned(field, prune);
    }

    pub fn pruned(&self, field: &Program<f32>, prune: Prune) {
        let limits = Limits { eps: f64::from(EPS), max_steps: MAX_STEPS, cone: 0.0, prune };
        let tracer = Tracer::Basic { guards: true };
        let mut memory = self.hits.lock().unwrap();
        let old = std::mem::take(&mut *memory);
        *memory = trace_over(field, &tracer, &self.rays, &limits, &Control::new(), old).unwrap();
    }

    /// Of the last trace. Counted apart: that is no part of tracing.
    pub fn totals(&self) -> Totals {
        let hits = self.hits.lock().unwrap();
        let hit = hits.status.iter().filter(|s| **s == Status::Hit as u8).count();
        Totals { hits: hit, steps: hits.steps.iter().map(|s| u64::from(*s)).sum() }
    }
}
