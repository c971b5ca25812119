//! `W` lanes as an array; LLVM turns the fixed loops into vector instructions where the caller's
//! `target_feature` allows them. Same bits as scalar code: each lane is computed by itself.
//!
//! Loops are written out by macro: a closure that isn't inlined would cost a factor of 30.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::{
    crowd::{Crowd, Nearest},
    grid::{Grid, Step},
    lane::Mask,
    real::{Real, Scalar},
};

#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Pack<T, const W: usize>(pub [T; W]);

impl<T: Scalar, const W: usize> Pack<T, W> {
    /// The first `W` values of a slice; the last value again where the slice is shorter.
    #[inline(always)]
    pub fn load(src: &[T]) -> Self {
        if let Some(full) = src.first_chunk::<W>() {
            return Pack(*full);
        }
        Self::load_few(src)
    }
    /// Away from the usual way: together both would be one call to memcpy, of a length that is not known.
    #[cold]
    #[inline(never)]
    fn load_few(src: &[T]) -> Self {
        let mut r = Pack([src.last().copied().unwrap_or_default(); W]);
        r.0[..src.len()].copy_from_slice(src);
        r
    }
    #[inline(always)]
    pub fn store(self, dst: &mut [T]) {
        if let Some(full) = dst.first_chunk_mut::<W>() {
            *full = self.0;
            return;
        }
        for (d, v) in dst.iter_mut().zip(self.0) {
            *d = v;
        }
    }
}

impl<T: Scalar, const W: usize> Pack<T, W> {
    /// Least lane, by halves: a chain of sixteen comparisons would take as long as all the rest.
    #[inline(always)]
    pub fn least(mut self) -> T {
        let mut half = W / 2;
        while half > 0 {
            for l in 0..half {
                self.0[l] = Real::min(self.0[l], self.0[l + half]);
            }
            half /= 2;
        }
        self.0[0]
    }

    /// Small whole numbers as bytes.
    #[inline(always)]
    pub fn bytes(self, to: &mut [u8]) {
        if let Some(to) = to.first_chunk_mut::<W>() {
            for i in 0..W {
                to[i] = self.0[i].cell() as u8;
            }
        }
    }

    /// The number of a cell a lane.
    #[inline(always)]
    pub fn cells(self, to: &mut [u32]) {
        if let Some(to) = to.first_chunk_mut::<W>() {
            for i in 0..W {
                to[i] = self.0[i].cell();
            }
        }
    }

    /// Where `a < b`.
    #[inline(always)]
    pub fn below(a: Self, b: Self) -> Mask<W> {
        let mut r = Mask([0; W]);
        lanes!(i in r: if a.0[i] < b.0[i] { u32::MAX } else { 0 })
    }
    /// `x` where the truth value holds, else `y`.
    #[inline(always)]
    pub fn pick(truth: Mask<W>, mut x: Self, y: Self) -> Self {
        lanes!(i in x: if truth.0[i] != 0 { x.0[i] } else { y.0[i] })
    }
}

macro_rules! operator {
    ($($trait:ident $name:ident $op:tt),*) => {$(
        impl<T: Scalar, const W: usize> $trait for Pack<T, W> {
            type Output = Self;
            #[inline(always)]
            fn $name(mut self, o: Self) -> Self {
                lanes!(i in self: self.0[i] $op o.0[i])
            }
        }
    )*};
}
operator!(Add add +, Sub sub -, Mul mul *, Div div /);

impl<T: Scalar, const W: usize> Neg for Pack<T, W> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        lanes!(i in self: -self.0[i])
    }
}

macro_rules! unary {
    ($($name:ident),*) => {$(
        #[inline(always)]
        fn $name(mut self) -> Self {
            lanes!(i in self: T::$name(self.0[i]))
        }
    )*};
}

macro_rules! binary {
    ($($name:ident),*) => {$(
        #[inline(always)]
        fn $name(mut self, o: Self) -> Self {
            lanes!(i in self: T::$name(self.0[i], o.0[i]))
        }
    )*};
}

impl<T: Scalar, const W: usize> Real for Pack<T, W> {
    type S = T;
    const ONLY_VALUES: bool = true;
    #[inline(always)]
    fn splat(s: T) -> Self {
        Pack([s; W])
    }
    #[inline(always)]
    fn sin_cos(p: [Self; 3]) -> ([Self; 3], [Self; 3]) {
        let (mut s, mut c) = (p, p);
        for i in 0..W {
            let (sin, cos) = T::m_sin_cos([p[0].0[i], p[1].0[i], p[2].0[i]]);
            for a in 0..3 {
                (s[a].0[i], c[a].0[i]) = (sin[a], cos[a]);
            }
        }
        (s, c)
    }
    #[inline(always)]
    fn less<const FUSED: bool>(mut self, o: Self, one: Self) -> Self {
        if !FUSED {
            return self - o;
        }
        lanes!(i in self: self.0[i].times_less(one.0[i], o.0[i]))
    }
    unary!(abs, sqrt, floor, sin, cos, exp, ln);
    binary!(min, max, atan2);
    #[inline(always)]
    fn select_lt(a: Self, b: Self, mut x: Self, y: Self) -> Self {
        lanes!(i in x: if a.0[i] < b.0[i] { x.0[i] } else { y.0[i] })
    }
    #[inline(always)]
    fn any_lt(a: Self, b: Self) -> bool {
        let mut any = false;
        for i in 0..W {
            any |= a.0[i] < b.0[i];
        }
        any
    }
    #[inline(always)]
    fn sample(grid: &Grid, step: Step, p: [Self; 3]) -> Self {
        Pack(grid.sample_lanes(p.map(|v| v.0), step))
    }
    #[inline(always)]
    fn nearest(crowd: &Crowd, p: [Self; 3]) -> [Self; 4] {
        let levels = T::levels(crowd);
        let (mut nearest, mut spheres) = (Nearest::nobody(), [p[0]; 4]);
        for i in 0..W {
            // Neighbours are near the same spheres.
            nearest = crowd.nearest(levels, [p[0].0[i], p[1].0[i], p[2].0[i]], nearest);
            for a in 0..4 {
                spheres[a].0[i] = nearest.sphere[a];
            }
        }
        spheres
    }
    #[inline(always)]
    fn sample_gradient(grid: &Grid, step: Step, p: [Self; 3]) -> (Self, [Self; 3]) {
        let (mut v, mut g) = (p[0], p);
        for i in 0..W {
            let (value, slope) = grid.sample_gradient([p[0].0[i], p[1].0[i], p[2].0[i]], step);
            v.0[i] = value;
            for a in 0..3 {
                g[a].0[i] = slope[a];
            }
        }
        (v, g)
    }
}
