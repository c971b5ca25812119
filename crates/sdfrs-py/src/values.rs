//! Values and slopes of a field at many points, in pieces over the pool.
//!
//! Law: the same bits for any number of threads and any way of cutting the points.

use rayon::prelude::*;
use sdfrs_core::{Control, Field, Program, Scratch, eval::Native, pool};

/// Points per piece: large enough to fill the lanes, small enough to stop soon.
const PIECE: usize = 4096;
/// Up to here the work is done on the calling thread.
pub const FEW: usize = 2048;

/// Coordinates apart, as the evaluator wants them.
fn split<T: Native>(points: &[[T; 3]]) -> [Vec<T>; 3] {
    std::array::from_fn(|axis| points.iter().map(|p| p[axis]).collect())
}

pub fn values<T: Native>(program: &Program<T>, points: &[[T; 3]], control: &Control) -> Vec<T> {
    let mut out = vec![T::default(); points.len()];
    let piece = |scratch: &mut Scratch<T>, (points, out): (&[[T; 3]], &mut [T])| {
        if !control.is_cancelled() {
            let [x, y, z] = split(points);
            program.eval(scratch, [&x, &y, &z], out);
            control.advance(points.len() as u64);
        }
    };
    if points.len() <= FEW {
        piece(&mut Scratch::new(), (points, &mut out));
    } else {
        pool::install(|| {
            points.par_chunks(PIECE).zip(out.par_chunks_mut(PIECE)).for_each_init(Scratch::new, piece)
        });
    }
    out
}

pub fn gradients<T: Native>(program: &Program<T>, points: &[[T; 3]], control: &Control) -> Vec<[T; 3]> {
    let mut out = vec![[T::default(); 3]; points.len()];
    let piece = |scratch: &mut Scratch<T>, (points, out): (&[[T; 3]], &mut [[T; 3]])| {
        if !control.is_cancelled() {
            let [x, y, z] = split(points);
            let n = points.len();
            let [mut v, mut gx, mut gy, mut gz] = std::array::from_fn(|_| vec![T::default(); n]);
            program.gradient(scratch, [&x, &y, &z], [&mut v, &mut gx, &mut gy, &mut gz]);
            for (i, slope) in out.iter_mut().enumerate() {
                *slope = [gx[i], gy[i], gz[i]];
            }
            control.advance(n as u64);
        }
    };
    if points.len() <= FEW {
        piece(&mut Scratch::new(), (points, &mut out));
    } else {
        pool::install(|| {
            points.par_chunks(PIECE).zip(out.par_chunks_mut(PIECE)).for_each_init(Scratch::new, piece)
        });
    }
    out
}
