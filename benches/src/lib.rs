//! The scenes that the benches time, each for three rivals: the product (built from shapes), fidget's
//! JIT and a plain scalar loop (both from one formula written by hand).
//!
//! Law: before a clock starts, all three have given the same values ([`Scene::agree`]).
#![allow(clippy::unwrap_used, clippy::panic)]

pub mod clock;
pub mod fidget_peer;
pub mod number;
pub mod scenes;
pub mod trace;

use sdfrs_core::{Program, Scratch, Shape};

use fidget_peer::Jit;
use number::{Expr, Formula};

/// One scene for all rivals.
pub struct Scene {
    pub name: &'static str,
    pub shape: Shape,
    pub hand: Box<dyn Hand>,
}

/// The scene's formula in its two uses.
pub trait Hand {
    fn jit(&self) -> Jit;
    fn scalar(&self, p: [&[f32]; 3], out: &mut [f32]);
    /// One ray, Hart's loop.
    fn ray(&self, ray: &trace::Line) -> trace::End;
}

impl<F: Formula> Hand for F {
    fn jit(&self) -> Jit {
        Jit::new(self)
    }
    fn scalar(&self, p: [&[f32]; 3], out: &mut [f32]) {
        for i in 0..out.len() {
            out[i] = self.at([p[0][i], p[1][i], p[2][i]]);
        }
    }
    fn ray(&self, line: &trace::Line) -> trace::End {
        line.walk(|p| self.at(p))
    }
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
    let mut p: [Vec<f32>; 3] = Default::default();
    for _ in 0..n {
        for axis in &mut p {
            axis.push(random.within(-half as f64, half as f64) as f32);
        }
    }
    p
}
