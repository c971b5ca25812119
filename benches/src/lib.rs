//! The scenes that the benches time, each for three rivals: the product (built from shapes), fidget's
//! JIT and a plain scalar loop (both from one formula written by hand).
//!
//! Law: before a clock starts, all three have given the same values ([`Scene::agree`]).
#![allow(clippy::unwrap_used, clippy::panic)]

/// Calls a plain loop in the version for this processor.
macro_rules! native {
    ($name:ident ($($arg:expr),*)) => {{
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            // SAFETY: the features were asked for; every processor with AVX2 has the smaller ones beside it.
            #[allow(unsafe_code)]
            unsafe {
                if has!("avx512f") && has!("avx512vl") && has!("avx512dq") && has!("avx512bw") {
                    return crate::native::avx512::$name($($arg),*);
                }
                if has!("avx2") && has!("fma") {
                    return crate::native::avx2::$name($($arg),*);
                }
            }
        }
        crate::$name($($arg),*)
    }};
}

pub mod clock;
pub mod fidget_peer;
pub mod limits;
pub mod number;
#[cfg(target_arch = "x86_64")]
pub mod packet;
pub mod pruned_peer;
pub mod scenes;
pub mod tables;
pub mod trace;

use sdfrs_core::{Program, Scratch, Shape};

use fidget_peer::Jit;
use number::{Expr, Formula};
use pruned_peer::Pruned;

/// One scene for all rivals.
pub struct Scene {
    pub name: &'static str,
    pub shape: Shape,
    pub hand: Box<dyn Hand>,
}

/// The scene's formula in its uses.
pub trait Hand {
    fn jit(&self) -> Jit;
    fn pruned_jit(&self) -> Pruned;
    fn scalar(&self, p: [&[f32]; 3], out: &mut [f32]);
    /// Hart's loop, one ray after the other.
    fn rays(&self, lines: &[trace::Line]) -> trace::Totals;
    fn work(&self) -> limits::Work;
    /// Samples of Hart's loop on a ray, and the fewest balls that cover it.
    fn balls(&self, line: &trace::Line) -> (u32, u32);
}

impl<F: Formula> Hand for F {
    fn jit(&self) -> Jit {
        Jit::new(self)
    }
    fn pruned_jit(&self) -> Pruned {
        Pruned::new(self)
    }
    fn scalar(&self, p: [&[f32]; 3], out: &mut [f32]) {
        native!(values(self, p, out))
    }
    fn rays(&self, lines: &[trace::Line]) -> trace::Totals {
        native!(walk(self, lines))
    }
    fn work(&self) -> limits::Work {
        limits::work(self)
    }
    fn balls(&self, line: &trace::Line) -> (u32, u32) {
        limits::balls(line, |p| self.at(p))
    }
}

#[inline(always)]
fn values<F: Formula>(formula: &F, p: [&[f32]; 3], out: &mut [f32]) {
    for i in 0..out.len() {
        out[i] = formula.at([p[0][i], p[1][i], p[2][i]]);
    }
}

#[inline(always)]
fn walk<F: Formula>(formula: &F, lines: &[trace::Line]) -> trace::Totals {
    let mut sum = trace::Totals { hits: 0, steps: 0 };
    for line in lines {
        let end = line.walk(|p| formula.at(p));
        sum.hits += usize::from(end.hit);
        sum.steps += u64::from(end.steps);
    }
    sum
}

/// The plain loops as `-C target-cpu=native` would compile them, for the processor that runs.
mod native {
    use super::{Formula, trace};

    macro_rules! version {
        ($name:ident $features:tt) => {
            #[allow(unsafe_code)]
            pub mod $name {
                use super::{Formula, trace};

                #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
                pub unsafe fn values<F: Formula>(formula: &F, p: [&[f32]; 3], out: &mut [f32]) {
                    crate::values(formula, p, out);
                }
                #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
                pub unsafe fn walk<F: Formula>(formula: &F, lines: &[trace::Line]) -> trace::Totals {
                    crate::walk(formula, lines)
                }
            }
        };
    }
    version!(avx512 "avx512f,avx512vl,avx512dq,avx512bw,fma,bmi1,bmi2,lzcnt,popcnt");
    version!(avx2 "avx2,fma,bmi1,bmi2,lzcnt,popcnt");
}

impl Scene {
    pub fn new(name: &'static str, shape: Shape, hand: impl Formula + 'static) -> Self {
        Self { name, shape, hand: Box::new(hand) }
    }

    /// A scene that is nothing but its formula.
    pub fn raw(name: &'static str, hand: impl Formula + 'static) -> Self {
        let shape = hand.at(["x", "y", "z"].map(Expr::coordinate)).0;
        Self::new(name, shape, hand)
    }

    /// Panics unless all rivals give the same values at `p`.
    pub fn agree(&self, p: [&[f32]; 3]) {
        let n = p[0].len();
        let (mut ours, mut scalar) = (vec![0.0; n], vec![0.0; n]);
        Program::<f32>::values(&self.shape).unwrap().evaluate(&mut Scratch::new(), p, &mut ours);
        self.hand.scalar(p, &mut scalar);
        let jit = self.hand.jit().eval(p, |v| v.to_vec());
        // An escape-time formula amplifies the last bit near its boundary, so a few points may differ.
        let close = |a: f32, b: f32| (a - b).abs() <= 1e-4 * (1.0 + b.abs());
        let off = (0..n).filter(|&i| !(close(ours[i], scalar[i]) && close(ours[i], jit[i]))).count();
        assert!(
            off * 100 <= n,
            "{}: {off} of {n} values differ, e.g. {:?}",
            self.name,
            (ours[0], scalar[0], jit[0])
        );
    }
}

/// Points in a cube, the same on every run.
pub fn points(n: usize, half: f32) -> [Vec<f32>; 3] {
    let mut random = scenes::Random(1);
    // Of different lengths, so that arrays of a page's size do not begin at one place of their pages: stores
    // to one would look like stores to the others (a sphere then takes 0.5 ns instead of 0.2).
    let mut p: [Vec<f32>; 3] = std::array::from_fn(|axis| Vec::with_capacity(n + 272 * (axis + 1)));
    for _ in 0..n {
        for axis in &mut p {
            axis.push(random.within(-half as f64, half as f64) as f32);
        }
    }
    p
}
