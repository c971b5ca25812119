//! What the machine can do at best, measured, and what a scene asks of it, counted.
//!
//! Law: what is counted is what the scalar loop executes ([`Counted`] is one of its numbers).

use std::{
    cell::Cell,
    hint::black_box,
    ops::{Add, Div, Mul, Neg, Sub},
};

use crate::{
    clock,
    number::{Formula, Number},
    trace::{EPS, Line, T_MAX},
};

/// Operations of one evaluation.
#[derive(Debug, Clone, Copy, Default)]
pub struct Work {
    /// Additions, multiplications, comparisons, signs: what two pipes do once a cycle.
    pub simple: u64,
    pub roots: u64,
    pub quotients: u64,
}

thread_local! {
    static WORK: Cell<Work> = const { Cell::new(Work { simple: 0, roots: 0, quotients: 0 }) };
}

fn count(simple: u64, roots: u64, quotients: u64) {
    WORK.with(|w| {
        let mut v = w.get();
        v.simple += simple;
        v.roots += roots;
        v.quotients += quotients;
        w.set(v);
    });
}

/// An f32 that counts.
#[derive(Clone, Copy)]
pub struct Counted(f32);

macro_rules! operator {
    ($($trait:ident $name:ident $op:tt $simple:literal $quotients:literal),*) => {$(
        impl $trait for Counted {
            type Output = Self;
            fn $name(self, o: Self) -> Self {
                count($simple, 0, $quotients);
                Counted(self.0 $op o.0)
            }
        }
    )*};
}
operator!(Add add + 1 0, Sub sub - 1 0, Mul mul * 1 0, Div div / 0 1);
impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        count(1, 0, 0);
        Counted(-self.0)
    }
}

impl Number for Counted {
    fn c(v: f64) -> Self {
        Counted(v as f32)
    }
    fn least(&self, o: &Self) -> Self {
        count(1, 0, 0);
        Counted(self.0.least(&o.0))
    }
    fn most(&self, o: &Self) -> Self {
        count(1, 0, 0);
        Counted(self.0.most(&o.0))
    }
    fn abs(&self) -> Self {
        count(1, 0, 0);
        Counted(self.0.abs())
    }
    fn sqrt(&self) -> Self {
        count(0, 1, 0);
        Counted(self.0.sqrt())
    }
    // Polynomials of our own: reduction, two series, the choice between them.
    fn sin(&self) -> Self {
        count(28, 0, 0);
        Counted(self.0.sin())
    }
    fn cos(&self) -> Self {
        // Beside the sine of the same angle only the choice is new.
        count(6, 0, 0);
        Counted(self.0.cos())
    }
    fn ln(&self) -> Self {
        count(22, 0, 1);
        Counted(self.0.ln())
    }
    fn pick(a: &Self, b: &Self, x: &Self, y: &Self) -> Self {
        count(2, 0, 0);
        Counted(f32::pick(&a.0, &b.0, &x.0, &y.0))
    }
}

/// What one evaluation executes.
pub fn work(formula: &impl Formula) -> Work {
    WORK.with(|w| w.set(Work::default()));
    formula.at([0.3, 0.4, 0.5].map(Counted));
    WORK.with(Cell::get)
}

/// Operations a second of one core.
#[derive(Debug, Clone, Copy)]
pub struct Peak {
    pub simple: f64,
    pub roots: f64,
    pub quotients: f64,
}

/// Independent chains: more than any latency times any width asks for.
const CHAINS: usize = 10;

#[cfg(target_arch = "x86_64")]
macro_rules! peak {
    ($name:ident $lanes:literal $set:ident $add:ident $mul:ident $sqrt:ident $div:ident) => {
        /// The best of many runs of arithmetic in registers.
        #[allow(unsafe_code)]
        pub fn $name() -> Peak {
            use std::arch::x86_64::*;
            /// `rounds` times `$op` in every chain.
            macro_rules! kernel {
                ($kernel:ident |$x:ident, $k:ident| $op:expr) => {
                    #[target_feature(enable = "avx512f")]
                    fn $kernel(rounds: usize) {
                        let $k = $set(black_box(1.25));
                        let mut chains = [$set(1.5); CHAINS];
                        for _ in 0..rounds {
                            for $x in &mut chains {
                                *$x = $op;
                            }
                        }
                        black_box(chains);
                    }
                };
            }
            kernel!(sums | x, k | $add(*x, k));
            kernel!(both | x, k | $add($mul(*x, k), k));
            kernel!(roots | x, _k | $sqrt(*x));
            kernel!(quotients | x, k | $div(k, *x));
            let rounds = 2000;
            // SAFETY: the caller has asked for AVX-512.
            let [sum, both, root, quotient] = clock::minima(
                0.2,
                [
                    &mut || unsafe { sums(black_box(rounds)) },
                    &mut || unsafe { both(black_box(rounds)) },
                    &mut || unsafe { roots(black_box(rounds)) },
                    &mut || unsafe { quotients(black_box(rounds)) },
                ],
            );
            let lanes = (rounds * CHAINS * $lanes) as f64;
            // Adders alone, or adders beside multipliers: whichever does more.
            Peak {
                simple: (lanes / sum).max(2.0 * lanes / both),
                roots: lanes / root,
                quotients: lanes / quotient,
            }
        }
    };
}
#[cfg(target_arch = "x86_64")]
peak!(single 16 _mm512_set1_ps _mm512_add_ps _mm512_mul_ps _mm512_sqrt_ps _mm512_div_ps);
#[cfg(target_arch = "x86_64")]
peak!(double 8 _mm512_set1_pd _mm512_add_pd _mm512_mul_pd _mm512_sqrt_pd _mm512_div_pd);

impl Peak {
    /// Least seconds for some work: adders and multipliers beside the divider, which does roots as well.
    pub fn least(&self, work: Work) -> f64 {
        let divider = work.roots as f64 / self.roots + work.quotients as f64 / self.quotients;
        divider.max(work.simple as f64 / self.simple)
    }
}

/// Samples on a ray: Hart's loop takes so many, and so many balls at best cover the same way.
pub fn balls(line: &Line, field: impl Fn([f32; 3]) -> f32) -> (u32, u32) {
    let (mut t, mut steps) = (0.0f32, 0);
    loop {
        let r = field(line.at(t));
        steps += 1;
        t += r;
        if r < EPS || !(t <= T_MAX) || steps == 1000 {
            break;
        }
    }
    let end = t.min(T_MAX);
    // Where balls may stand: a fine comb over the whole way, finer where they are small.
    let mut spans: Vec<(f32, f32)> = Vec::new();
    let mut at = 0.0f32;
    while at <= end {
        let r = field(line.at(at));
        spans.push((at - r, at + r));
        at += (r / 64.0).clamp(EPS / 4.0, 1e-2);
    }
    // Of all balls that leave no gap, the one that reaches furthest: the fewest in all.
    let (mut reached, mut used, mut next) = (0.0f32, 0, 0);
    while reached < end - EPS {
        let mut best = reached;
        while next < spans.len() && spans[next].0 + spans[next].1 <= 2.0 * reached {
            best = best.max(spans[next].1);
            next += 1;
        }
        for span in &spans[next..] {
            if span.0 <= reached {
                best = best.max(span.1);
            }
        }
        if best <= reached {
            break;
        }
        (reached, used) = (best, used + 1);
    }
    (steps, used)
}
