//! Sixteen f32 at once, one implementation an instruction set.
//!
//! No fused operation, and each lane by itself: the bits are those of scalar code. `min` and `max` give the second
//! operand where neither is less, as the processor's do.

/// Sixteen lanes in memory.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub struct Row(pub [f32; 16]);

impl Row {
    pub const ZERO: Row = Row([0.0; 16]);
}

/// The two right triangles of a folded one (`frames`), each number first for x >= 0, then for x < 0: the hypotenuse runs
/// from (w, 0) to (0, h), its normal is (nh, nw). Laid out for the kernels, which pick by the sign of x among four
/// neighbours.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub struct Halves {
    /// w, w, nh, nh
    pub first: [f32; 4],
    /// nw, nw, length, length
    pub second: [f32; 4],
}

impl Halves {
    pub fn new(widths: [f64; 2], height: f64) -> Self {
        let mut halves = Self::default();
        for (side, w) in widths.into_iter().enumerate() {
            let length = w.hypot(height);
            let (nh, nw) = if length > 0.0 { (height / length, w / length) } else { (1.0, 0.0) };
            (halves.first[side], halves.first[2 + side]) = (w as f32, nh as f32);
            (halves.second[side], halves.second[2 + side]) = (nw as f32, length as f32);
        }
        halves
    }
}

/// Sixteen lanes in registers. Values are made only inside functions compiled for the instruction set.
pub trait Lanes: Copy {
    type Mask: Copy;
    fn splat(v: f32) -> Self;
    fn load(from: &Row) -> Self;
    fn store(self, to: &mut Row);
    fn add(self, o: Self) -> Self;
    fn sub(self, o: Self) -> Self;
    fn mul(self, o: Self) -> Self;
    fn min(self, o: Self) -> Self;
    fn max(self, o: Self) -> Self;
    fn abs(self) -> Self;
    /// `minus` where the sign bit of `by` is set, else `plus`.
    fn by_sign(by: Self, minus: Self, plus: Self) -> Self;
    /// w, nh, nw and length of the half that the sign of `x` says.
    #[inline(always)]
    fn half(x: Self, h: &Halves) -> [Self; 4] {
        let ([w, wl, nh, nhl], [nw, nwl, length, lengthl]) = (h.first, h.second);
        [
            Self::by_sign(x, Self::splat(wl), Self::splat(w)),
            Self::by_sign(x, Self::splat(nhl), Self::splat(nh)),
            Self::by_sign(x, Self::splat(nwl), Self::splat(nw)),
            Self::by_sign(x, Self::splat(lengthl), Self::splat(length)),
        ]
    }
    fn less(self, o: Self) -> Self::Mask;
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// One bit a lane.
    fn bits(mask: Self::Mask) -> u16;
}

/// Arrays: whatever the compiler makes of them.
#[derive(Clone, Copy)]
pub struct Portable([f32; 16]);

macro_rules! each {
    ($i:ident => $value:expr) => {{
        let mut r = [Default::default(); 16];
        for $i in 0..16 {
            r[$i] = $value;
        }
        r
    }};
}

impl Lanes for Portable {
    type Mask = [u32; 16];
    #[inline(always)]
    fn splat(v: f32) -> Self {
        Self([v; 16])
    }
    #[inline(always)]
    fn load(from: &Row) -> Self {
        Self(from.0)
    }
    #[inline(always)]
    fn store(self, to: &mut Row) {
        to.0 = self.0;
    }
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self(each!(i => self.0[i] + o.0[i]))
    }
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self(each!(i => self.0[i] - o.0[i]))
    }
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self(each!(i => self.0[i] * o.0[i]))
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Self(each!(i => if self.0[i] < o.0[i] { self.0[i] } else { o.0[i] }))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Self(each!(i => if self.0[i] > o.0[i] { self.0[i] } else { o.0[i] }))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(each!(i => f32::from_bits(self.0[i].to_bits() & 0x7fff_ffff)))
    }
    #[inline(always)]
    fn by_sign(by: Self, minus: Self, plus: Self) -> Self {
        let mask: [u32; 16] = each!(i => ((by.0[i].to_bits() as i32) >> 31) as u32);
        Self::select(mask, minus, plus)
    }
    #[inline(always)]
    fn less(self, o: Self) -> Self::Mask {
        each!(i => if self.0[i] < o.0[i] { u32::MAX } else { 0 })
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self(each!(i => f32::from_bits(yes.0[i].to_bits() & mask[i] | no.0[i].to_bits() & !mask[i])))
    }
    #[inline(always)]
    fn bits(mask: Self::Mask) -> u16 {
        let mut bits = 0;
        for i in 0..16 {
            bits |= (mask[i] as u16 & 1) << i;
        }
        bits
    }
}

#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2, Avx512, Sse41};

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod x86 {
    use std::arch::x86_64::*;

    use super::{Halves, Lanes, Row};

    /// Registers that make up sixteen lanes: `$i` numbers them, `$lane` is the first lane of each.
    macro_rules! registers {
        ($name:ident $register:ident $count:literal [$($i:literal $lane:literal),*]
         $set1:ident $load:ident $store:ident $add:ident $sub:ident $mul:ident $min:ident $max:ident
         $and:ident $blend:ident $movemask:ident $less:expr; $($more:tt)*) => {
            #[derive(Clone, Copy)]
            pub struct $name([$register; $count]);

            // SAFETY, for all blocks: values of this type are made and used only inside functions compiled for the
            // instruction set, which `Kernels::of` hands out where the processor has it; a Row holds sixteen
            // aligned f32.
            impl Lanes for $name {
                type Mask = [$register; $count];
                #[inline(always)]
                fn splat(v: f32) -> Self {
                    Self(unsafe { [$set1(v); $count] })
                }
                #[inline(always)]
                fn load(from: &Row) -> Self {
                    Self(unsafe { [$($load(from.0.as_ptr().add($lane)),)*] })
                }
                #[inline(always)]
                fn store(self, to: &mut Row) {
                    unsafe { $($store(to.0.as_mut_ptr().add($lane), self.0[$i]);)* }
                }
                #[inline(always)]
                fn add(self, o: Self) -> Self {
                    Self(unsafe { [$($add(self.0[$i], o.0[$i]),)*] })
                }
                #[inline(always)]
                fn sub(self, o: Self) -> Self {
                    Self(unsafe { [$($sub(self.0[$i], o.0[$i]),)*] })
                }
                #[inline(always)]
                fn mul(self, o: Self) -> Self {
                    Self(unsafe { [$($mul(self.0[$i], o.0[$i]),)*] })
                }
                #[inline(always)]
                fn min(self, o: Self) -> Self {
                    Self(unsafe { [$($min(self.0[$i], o.0[$i]),)*] })
                }
                #[inline(always)]
                fn max(self, o: Self) -> Self {
                    Self(unsafe { [$($max(self.0[$i], o.0[$i]),)*] })
                }
                #[inline(always)]
                fn abs(self) -> Self {
                    let digits = unsafe { $set1(f32::from_bits(0x7fff_ffff)) };
                    Self(unsafe { [$($and(self.0[$i], digits),)*] })
                }
                #[inline(always)]
                fn by_sign(by: Self, minus: Self, plus: Self) -> Self {
                    Self(unsafe { [$($blend(plus.0[$i], minus.0[$i], by.0[$i]),)*] })
                }
                #[inline(always)]
                fn less(self, o: Self) -> Self::Mask {
                    unsafe { [$($less(self.0[$i], o.0[$i]),)*] }
                }
                #[inline(always)]
                fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
                    Self(unsafe { [$($blend(no.0[$i], yes.0[$i], mask[$i]),)*] })
                }
                #[inline(always)]
                fn bits(mask: Self::Mask) -> u16 {
                    unsafe { 0 $(| ($movemask(mask[$i]) as u16) << ($lane))* }
                }
                $($more)*
            }
        };
    }

    registers! { Sse41 __m128 4 [0 0, 1 4, 2 8, 3 12]
    _mm_set1_ps _mm_load_ps _mm_store_ps _mm_add_ps _mm_sub_ps _mm_mul_ps _mm_min_ps _mm_max_ps
    _mm_and_ps _mm_blendv_ps _mm_movemask_ps _mm_cmplt_ps; }
    registers! { Avx2 __m256 2 [0 0, 1 8]
    _mm256_set1_ps _mm256_load_ps _mm256_store_ps _mm256_add_ps _mm256_sub_ps _mm256_mul_ps _mm256_min_ps _mm256_max_ps
    _mm256_and_ps _mm256_blendv_ps _mm256_movemask_ps _mm256_cmp_ps::<_CMP_LT_OQ>;
    // Two loads of four numbers, from which lanes pick: by blends it would be eight loads, and more registers than there are.
    #[inline(always)]
    fn half(x: Self, h: &Halves) -> [Self; 4] {
        let [a, b] = x.0;
        unsafe {
            let first = _mm256_broadcast_ps(&_mm_loadu_ps(h.first.as_ptr()));
            let second = _mm256_broadcast_ps(&_mm_loadu_ps(h.second.as_ptr()));
            let left = [_mm256_srli_epi32::<31>(_mm256_castps_si256(a)), _mm256_srli_epi32::<31>(_mm256_castps_si256(b))];
            let two = _mm256_set1_epi32(2);
            let upper = [_mm256_or_si256(left[0], two), _mm256_or_si256(left[1], two)];
            [
                Self([_mm256_permutevar_ps(first, left[0]), _mm256_permutevar_ps(first, left[1])]),
                Self([_mm256_permutevar_ps(first, upper[0]), _mm256_permutevar_ps(first, upper[1])]),
                Self([_mm256_permutevar_ps(second, left[0]), _mm256_permutevar_ps(second, left[1])]),
                Self([_mm256_permutevar_ps(second, upper[0]), _mm256_permutevar_ps(second, upper[1])]),
            ]
        }
    } }

    #[derive(Clone, Copy)]
    pub struct Avx512(__m512);

    // SAFETY, for all blocks: as above.
    impl Lanes for Avx512 {
        type Mask = __mmask16;
        #[inline(always)]
        fn splat(v: f32) -> Self {
            Self(unsafe { _mm512_set1_ps(v) })
        }
        #[inline(always)]
        fn load(from: &Row) -> Self {
            Self(unsafe { _mm512_load_ps(from.0.as_ptr()) })
        }
        #[inline(always)]
        fn store(self, to: &mut Row) {
            unsafe { _mm512_store_ps(to.0.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn add(self, o: Self) -> Self {
            Self(unsafe { _mm512_add_ps(self.0, o.0) })
        }
        #[inline(always)]
        fn sub(self, o: Self) -> Self {
            Self(unsafe { _mm512_sub_ps(self.0, o.0) })
        }
        #[inline(always)]
        fn mul(self, o: Self) -> Self {
            Self(unsafe { _mm512_mul_ps(self.0, o.0) })
        }
        #[inline(always)]
        fn min(self, o: Self) -> Self {
            Self(unsafe { _mm512_min_ps(self.0, o.0) })
        }
        #[inline(always)]
        fn max(self, o: Self) -> Self {
            Self(unsafe { _mm512_max_ps(self.0, o.0) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Self(unsafe { _mm512_abs_ps(self.0) })
        }
        #[inline(always)]
        fn by_sign(by: Self, minus: Self, plus: Self) -> Self {
            Self(unsafe {
                _mm512_mask_blend_ps(_mm512_movepi32_mask(_mm512_castps_si512(by.0)), plus.0, minus.0)
            })
        }
        #[inline(always)]
        fn less(self, o: Self) -> Self::Mask {
            unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, o.0) }
        }
        #[inline(always)]
        fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
            Self(unsafe { _mm512_mask_blend_ps(mask, no.0, yes.0) })
        }
        #[inline(always)]
        fn bits(mask: Self::Mask) -> u16 {
            mask
        }
    }
}
