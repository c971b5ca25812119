//! Neighbours in an array, for a pack of lanes: the load of two at once, and their places apart.
//!
//! A trilinear sample is eight numbers in four places. Gathers are slower than loads, and numbers written one by one
//! are slow to read back as a vector; four lanes at a time, a row is four loads of two numbers and two writes of four.

use crate::grid::dense::Sample;
use crate::real::Scalar;

/// Fills `out` with what lies in `rows`, whose lengths are equal, at `at` and behind it: the first numbers of the first
/// row, the second ones, those of the second row .. Zeros where a lane's place isn't there.
#[inline(always)]
pub fn neighbours<S: Sample, T: Scalar, const W: usize>(
    rows: [&[S]; 4],
    at: &[usize; W],
    out: &mut [[T; W]; 8],
) {
    let n = rows[0].len();
    let mut last = 0;
    for i in 0..W {
        last = last.max(at[i]);
    }
    if rows.iter().any(|row| row.len() != n) || last >= n || last + 1 >= n {
        return;
    }
    let mut i = 0;
    while i < W {
        // Written out, as lanes are: a closure that isn't inlined costs more than the loads.
        let mut four = [at[i]; 4];
        for j in 1..4 {
            if i + j < W {
                four[j] = at[i + j];
            }
        }
        for k in 0..4 {
            let row = rows[k];
            // SAFETY: no place is above `last`, whose next one is below the length that all rows have.
            #[allow(unsafe_code)]
            let [first, second] = unsafe { S::pairs(row, four) };
            for j in 0..4 {
                if i + j < W {
                    (out[2 * k][i + j], out[2 * k + 1][i + j]) = (first[j].wide(), second[j].wide());
                }
            }
        }
        i += 4;
    }
}

/// Two neighbours in each of four places: the first ones, and the second ones.
///
/// # Safety
/// Each place and the next one exist.
#[inline(always)]
#[allow(unsafe_code)]
pub unsafe fn pairs<S: Copy>(row: &[S], at: [usize; 4]) -> [[S; 4]; 2] {
    // SAFETY: the caller's promise.
    unsafe {
        let p = row.as_ptr();
        let [a, b] = [p.add(at[0]), p.add(at[1])];
        let [c, d] = [p.add(at[2]), p.add(at[3])];
        [[*a, *b, *c, *d], [*a.add(1), *b.add(1), *c.add(1), *d.add(1)]]
    }
}

/// The same for f32, by instructions that every x86-64 has.
///
/// # Safety
/// As above.
#[inline(always)]
#[allow(unsafe_code)]
pub unsafe fn pairs_f32(row: &[f32], at: [usize; 4]) -> [[f32; 4]; 2] {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::*;
        // SAFETY: each load reads the eight bytes of two numbers that exist by the caller's promise; an __m128 and four
        // f32 have the same bytes.
        unsafe {
            let p = row.as_ptr();
            let (a, c) = (_mm_load_sd(p.add(at[0]).cast()), _mm_load_sd(p.add(at[2]).cast()));
            let ab = _mm_castpd_ps(_mm_loadh_pd(a, p.add(at[1]).cast()));
            let cd = _mm_castpd_ps(_mm_loadh_pd(c, p.add(at[3]).cast()));
            let halves = [_mm_shuffle_ps::<0b10_00_10_00>(ab, cd), _mm_shuffle_ps::<0b11_01_11_01>(ab, cd)];
            std::mem::transmute::<[__m128; 2], [[f32; 4]; 2]>(halves)
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    // SAFETY: the caller's promise.
    unsafe {
        pairs(row, at)
    }
}
