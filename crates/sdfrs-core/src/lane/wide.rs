//! Eight f64 in a register of AVX-512: the arithmetic of a pack, but for the root, which does without the divider.
//!
//! Written in the processor's own instructions. As loops over lanes, LLVM would see the same loops in the packs that
//! go by the divider, compute in common what comes before the root, and shuffle numbers between the two ways.
//!
//! Law: bit for bit the pack's results (tests/laws, forced instruction sets).

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::{
    crowd::Crowd,
    grid::{Grid, Step},
    lane::{Pack, root::root},
    real::Real,
};

/// Named by what is compiled for AVX-512 alone: that is what the blocks below rely on.
#[derive(Debug, Clone, Copy)]
#[repr(transparent)]
pub struct Wide(__m512d);

type Lanes = Pack<f64, 8>;

impl Wide {
    /// What no op with a root needs goes the pack's way.
    #[inline(always)]
    #[allow(unsafe_code)]
    fn lanes(self) -> Lanes {
        // SAFETY: a register of eight f64 has their bytes.
        Pack(unsafe { std::mem::transmute::<__m512d, [f64; 8]>(self.0) })
    }
    #[inline(always)]
    #[allow(unsafe_code)]
    fn of(lanes: Lanes) -> Self {
        // SAFETY: as above.
        Wide(unsafe { std::mem::transmute::<[f64; 8], __m512d>(lanes.0) })
    }
}

macro_rules! operator {
    ($($trait:ident $name:ident $do:ident),*) => {$(
        impl $trait for Wide {
            type Output = Self;
            #[inline(always)]
            #[allow(unsafe_code)]
            fn $name(self, o: Self) -> Self {
                // SAFETY: the type's promise.
                Wide(unsafe { $do(self.0, o.0) })
            }
        }
    )*};
}
operator!(Add add _mm512_add_pd, Sub sub _mm512_sub_pd, Mul mul _mm512_mul_pd, Div div _mm512_div_pd);

impl Neg for Wide {
    type Output = Self;
    #[inline(always)]
    #[allow(unsafe_code)]
    fn neg(self) -> Self {
        // SAFETY: the type's promise (AVX-512 DQ has it for f64).
        Wide(unsafe { _mm512_xor_pd(self.0, _mm512_set1_pd(-0.0)) })
    }
}

macro_rules! by_lanes {
    ($($name:ident($($o:ident),*)),*) => {$(
        #[inline(always)]
        fn $name(self $(, $o: Self)*) -> Self {
            Self::of(self.lanes().$name($($o.lanes()),*))
        }
    )*};
}

// SAFETY (every block): the type's promise.
#[allow(unsafe_code)]
impl Real for Wide {
    type S = f64;
    const ONLY_VALUES: bool = true;
    #[inline(always)]
    fn splat(s: f64) -> Self {
        Wide(unsafe { _mm512_set1_pd(s) })
    }
    /// The instruction gives its second operand where neither is less, as the law wants.
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Wide(unsafe { _mm512_min_pd(self.0, o.0) })
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Wide(unsafe { _mm512_max_pd(self.0, o.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Wide(unsafe { _mm512_andnot_pd(_mm512_set1_pd(-0.0), self.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Wide(unsafe { root(self.0) })
    }
    #[inline(always)]
    fn select_lt(a: Self, b: Self, x: Self, y: Self) -> Self {
        Wide(unsafe { _mm512_mask_blend_pd(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(a.0, b.0), y.0, x.0) })
    }
    #[inline(always)]
    fn any_lt(a: Self, b: Self) -> bool {
        unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(a.0, b.0) != 0 }
    }
    by_lanes!(floor(), sin(), cos(), exp(), ln(), atan2(x));
    #[inline(always)]
    fn sample(grid: &Grid, step: Step, [x, y, z]: [Self; 3]) -> Self {
        Self::of(Lanes::sample(grid, step, [x.lanes(), y.lanes(), z.lanes()]))
    }
    #[inline(always)]
    fn sample_gradient(grid: &Grid, step: Step, [x, y, z]: [Self; 3]) -> (Self, [Self; 3]) {
        let (v, [dx, dy, dz]) = Lanes::sample_gradient(grid, step, [x.lanes(), y.lanes(), z.lanes()]);
        (Self::of(v), [Self::of(dx), Self::of(dy), Self::of(dz)])
    }
    #[inline(always)]
    fn nearest(crowd: &Crowd, [x, y, z]: [Self; 3]) -> [Self; 4] {
        let [x, y, z, r] = Lanes::nearest(crowd, [x.lanes(), y.lanes(), z.lanes()]);
        [Self::of(x), Self::of(y), Self::of(z), Self::of(r)]
    }
}
