//! The part of a list whose masks have a bit of a set, in order. Lists only: the same on every instruction set.
#![allow(unsafe_code)]

/// Places that `out` needs beyond what the list can fill.
pub const ROOM: usize = 16;

/// One by one, without a branch.
#[inline(always)]
fn plain(list: &[u32], masks: &[u16], bits: u16, out: &mut [u32], mut n: usize) -> usize {
    for (&item, &mask) in list.iter().zip(masks) {
        if let Some(place) = out.get_mut(n) {
            *place = item;
        }
        n += usize::from(mask & bits != 0);
    }
    n
}

/// # Safety
/// None is needed; the kernels' table asks for one signature.
#[inline(always)]
pub unsafe fn baseline(list: &[u32], masks: &[u16], bits: u16, out: &mut [u32]) -> usize {
    plain(list, masks, bits, out, 0)
}

#[cfg(target_arch = "x86_64")]
pub use x86::{avx2, avx512};

/// # Safety
/// As for `baseline`.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub unsafe fn sse41(list: &[u32], masks: &[u16], bits: u16, out: &mut [u32]) -> usize {
    plain(list, masks, bits, out, 0)
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::{ROOM, plain};

    /// # Safety
    /// The processor has AVX-512 F, BW and VL.
    #[inline(always)]
    pub unsafe fn avx512(list: &[u32], masks: &[u16], bits: u16, out: &mut [u32]) -> usize {
        assert!(masks.len() >= list.len() && out.len() >= list.len() + ROOM, "no room for a list");
        let (mut n, whole) = (0, list.len() / 16 * 16);
        // SAFETY: sixteen items from `at` on lie in list and masks; `out` has room for sixteen more than are kept.
        unsafe {
            let wanted = _mm256_set1_epi16(bits as i16);
            for at in (0..whole).step_by(16) {
                let items = _mm512_loadu_si512(list.as_ptr().add(at).cast());
                let mask = _mm256_loadu_si256(masks.as_ptr().add(at).cast());
                let kept = _mm256_test_epi16_mask(mask, wanted);
                _mm512_storeu_si512(out.as_mut_ptr().add(n).cast(), _mm512_maskz_compress_epi32(kept, items));
                n += kept.count_ones() as usize;
            }
            let rest = (list.len() - whole) as u32;
            if rest > 0 {
                let lanes = (1u16 << rest) - 1;
                let items = _mm512_maskz_loadu_epi32(lanes, list.as_ptr().add(whole).cast());
                let mask = _mm256_maskz_loadu_epi16(lanes, masks.as_ptr().add(whole).cast());
                let kept = _mm256_test_epi16_mask(mask, wanted);
                _mm512_storeu_si512(out.as_mut_ptr().add(n).cast(), _mm512_maskz_compress_epi32(kept, items));
                n += kept.count_ones() as usize;
            }
        }
        n
    }

    /// For each set of eight lanes, where they go.
    const FRONT: [[u32; 8]; 256] = {
        let mut table = [[0; 8]; 256];
        let mut set = 0;
        while set < 256 {
            let (mut lane, mut n) = (0, 0);
            while lane < 8 {
                if set >> lane & 1 == 1 {
                    table[set][n] = lane as u32;
                    n += 1;
                }
                lane += 1;
            }
            set += 1;
        }
        table
    };

    /// # Safety
    /// The processor has AVX2.
    #[inline(always)]
    pub unsafe fn avx2(list: &[u32], masks: &[u16], bits: u16, out: &mut [u32]) -> usize {
        assert!(masks.len() >= list.len() && out.len() >= list.len() + ROOM, "no room for a list");
        let (mut n, whole) = (0, list.len() / 8 * 8);
        // SAFETY: eight items from `at` on lie in list and masks; `out` has room for eight more than are kept.
        unsafe {
            let wanted = _mm_set1_epi16(bits as i16);
            for at in (0..whole).step_by(8) {
                let items = _mm256_loadu_si256(list.as_ptr().add(at).cast());
                let mask = _mm_and_si128(_mm_loadu_si128(masks.as_ptr().add(at).cast()), wanted);
                let none = _mm_cmpeq_epi16(mask, _mm_setzero_si128());
                let kept = !_mm_movemask_epi8(_mm_packs_epi16(none, none)) as usize & 255;
                let front = _mm256_loadu_si256(FRONT[kept].as_ptr().cast());
                let items = _mm256_permutevar8x32_epi32(items, front);
                _mm256_storeu_si256(out.as_mut_ptr().add(n).cast(), items);
                n += kept.count_ones() as usize;
            }
        }
        plain(&list[whole..], &masks[whole..], bits, out, n)
    }
}

#[cfg(test)]
mod tests {
    use sdfrs_core::eval::Isa;

    use crate::{kernels::Kernels, pick::ROOM};

    #[test]
    fn the_same_on_every_instruction_set() {
        for count in [0, 1, 7, 8, 9, 15, 16, 17, 100] {
            let list: Vec<u32> = (0..count).map(|i| 1000 + i).collect();
            let masks: Vec<u16> = (0..count).map(|i| ((i * i * 40503) >> 3) as u16).collect();
            for bits in [3u16, 12, 3 << 14, 0xffff, 0] {
                let kept = list.iter().zip(&masks).filter(|(_, m)| *m & bits != 0).map(|(i, _)| *i);
                let want: Vec<u32> = kept.collect();
                for isa in Isa::available() {
                    let mut out = vec![0; list.len() + ROOM];
                    let n = Kernels::of(isa).pick(&list, &masks, bits, &mut out);
                    assert_eq!(out[..n], want, "{isa:?}");
                }
            }
        }
    }
}
