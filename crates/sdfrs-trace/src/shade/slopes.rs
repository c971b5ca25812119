//! Gradients at many points: square by square along shortened programs, where that pays.
//!
//! Points of a square of pixels lie close together, so most of a scene cannot win there (see
//! `sdfrs_core::prune`); a ball around sixteen squares decides first. Law: what is left has the value's
//! bits in the ball, and so the gradient's (tests in `render`).

use sdfrs_core::{
    Field, Program, Prune, Real, Scratch,
    eval::Native,
    prune::{CELLS, Cell, Memory, Part, Probe, Pruner},
};

/// Operations from which on shortening pays: a probe and a rewrite cost as much as 64 gradients of so many.
const WORTH: u64 = 64;

/// A worker's memory.
pub struct Slopes<T: Native> {
    scratch: Scratch<T>,
    /// Of sixteen squares, and of each.
    probes: [Probe; 2],
    coarse: Part,
    fine: Part,
    memory: Memory,
    short: Program<T>,
}

impl<T: Native> Slopes<T> {
    pub fn new() -> Self {
        Self {
            scratch: Scratch::new(),
            probes: Default::default(),
            coarse: Part::blank(),
            fine: Part::blank(),
            memory: Memory::default(),
            short: Program::blank(),
        }
    }

    /// Values and slopes at `n` points; square `i` ends at `squares[i]`.
    pub fn run(
        &mut self,
        program: &Program<T>,
        prune: Prune,
        squares: &[usize],
        n: usize,
        points: &[Vec<T>; 3],
        out: &mut [Vec<T>; 4],
    ) {
        let worth = prune != Prune::Off && program.tape().ops() >= WORTH;
        let Some(pruner) = program.pruner().filter(|p| worth && p.has_choices()) else {
            return gradient(program, &mut self.scratch, 0..n, points, out);
        };
        let mut from = 0;
        for squares in squares.chunks(CELLS) {
            let to = squares[squares.len() - 1];
            self.probes[0].look(pruner.whole(), &[ball(points, from..to)]);
            self.probes[0].narrow(
                pruner,
                pruner.whole(),
                (0, f32::INFINITY),
                &mut self.memory,
                &mut self.coarse,
            );
            self.each(pruner, squares, from, points, out);
            from = to;
        }
    }

    /// Sixteen squares that share what is left around them.
    fn each(
        &mut self,
        pruner: &Pruner,
        squares: &[usize],
        first: usize,
        points: &[Vec<T>; 3],
        out: &mut [Vec<T>; 4],
    ) {
        let Self { scratch, probes, coarse, fine, memory, short } = self;
        let starts = || std::iter::once(first).chain(squares.iter().copied());
        let mut cells = [Cell::default(); CELLS];
        for (cell, (from, &to)) in cells.iter_mut().zip(starts().zip(squares)) {
            *cell = ball(points, from..to);
        }
        probes[1].look(coarse, &cells[..squares.len()]);
        for (i, (from, &to)) in starts().zip(squares).enumerate() {
            probes[1].narrow_last(pruner, coarse, (i, f32::INFINITY), memory, fine);
            pruner.program(fine, memory, short);
            gradient(short, scratch, from..to, points, out);
        }
    }
}

fn gradient<T: Native>(
    program: &Program<T>,
    scratch: &mut Scratch<T>,
    at: std::ops::Range<usize>,
    [x, y, z]: &[Vec<T>; 3],
    [v, dx, dy, dz]: &mut [Vec<T>; 4],
) {
    let out = [&mut v[at.clone()], &mut dx[at.clone()], &mut dy[at.clone()], &mut dz[at.clone()]];
    program.gradient(scratch, [&x[at.clone()], &y[at.clone()], &z[at]], out);
}

/// A ball around some of the points; an infinite one drops nothing.
fn ball<T: Native>(points: &[Vec<T>; 3], at: std::ops::Range<usize>) -> Cell {
    let mut centre = [0f64; 3];
    let (mut square, mut size) = (0.0, 0.0);
    for (centre, column) in centre.iter_mut().zip(points) {
        let (mut lo, mut hi) = (T::INFINITY, -T::INFINITY);
        for v in &column[at.clone()] {
            (lo, hi) = (Real::min(lo, *v), Real::max(hi, *v));
        }
        let half = 0.5 * hi.f64() - 0.5 * lo.f64();
        *centre = lo.f64() + half;
        square += half * half;
        size += centre.abs();
    }
    // The corner of the box is as far as any point; what rounding adds is that of `march`'s cells.
    let radius = f64::sqrt(square);
    let radius = radius + 8.0 * f64::from(f32::EPSILON) * (size + radius);
    let radius = if radius.is_finite() { radius as f32 } else { f32::INFINITY };
    Cell { centre: centre.map(|c| c as f32), radius, rod: None }
}
