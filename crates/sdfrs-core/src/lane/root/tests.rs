use super::root;
use crate::isa::{Isa, best};
use std::arch::x86_64::*;

/// Random words, from a fixed seed.
fn noise() -> impl FnMut() -> u64 {
    let mut s = 0x9e37_79b9_7f4a_7c15_u64;
    move || {
        s ^= s << 13;
        s ^= s >> 7;
        s ^= s << 17;
        s
    }
}

/// Asserts the bits of eight roots, or counts what must not be counted on.
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw")]
#[allow(unsafe_code)]
fn same(a: [f64; 8]) {
    // SAFETY: this function's own features; eight numbers each.
    let got = unsafe {
        let mut got = [0.0; 8];
        _mm512_storeu_pd(got.as_mut_ptr(), root(_mm512_loadu_pd(a.as_ptr())));
        got
    };
    for (a, got) in a.into_iter().zip(got) {
        let want = a.sqrt();
        assert!(
            got.to_bits() == want.to_bits() || (got.is_nan() && want.is_nan()),
            "the root of {a:e} ({:#x}): {got:e} for {want:e}",
            a.to_bits()
        );
    }
}

/// The roots of so many packs that `draw` gives.
#[allow(unsafe_code)]
fn law(packs: usize, mut draw: impl FnMut() -> f64) {
    if best() < Isa::Avx512 {
        eprintln!("no AVX-512 here: nothing to compare");
        return;
    }
    for _ in 0..packs {
        let mut a = [0.0; 8];
        for v in &mut a {
            *v = draw();
        }
        // SAFETY: asked for above.
        unsafe { same(a) };
    }
}

/// A whole number of 53 digits.
fn digits(word: u64) -> u128 {
    u128::from(1 << 52 | word >> 12)
}

#[test]
fn any_mantissa() {
    let mut random = noise();
    // Both parities of the exponent.
    law(1_000_000, || f64::from_bits(random() >> 12 | (1023 + (random() & 1)) << 52));
}

#[test]
fn any_bits() {
    let mut random = noise();
    law(1_000_000, || f64::from_bits(random()));
}

/// The hardest to round: next to `(m + 1/2)^2`, from below and from above, and next to whole squares.
#[test]
fn halves_between_two_roots() {
    let mut random = noise();
    law(1_000_000, || {
        let m = digits(random());
        let between = m * m + if random() & 1 == 0 { m } else { 0 };
        let near = f64::from_bits((between as f64).to_bits().wrapping_add(random() % 5).wrapping_sub(2));
        near * [1.0, 0.25, 2f64.powi(-104), 2f64.powi(-900), 2f64.powi(800)][(random() % 5) as usize]
    });
}

/// `m^2 + m = j` in the last 52 or 53 digits: roots that lie within `j / 2^54` ulp of a half, as close as any do.
#[test]
fn the_closest_of_all() {
    let mut hard = Vec::new();
    for j in (-4000_i128..4000).step_by(2) {
        for bits in [52, 53] {
            let modulus = 1_u128 << bits;
            let wanted = j.rem_euclid(modulus as i128) as u128;
            // One digit of m after the other; m even or odd to begin with.
            for first in [0_u128, 1] {
                let mut m = first;
                for digit in 1..bits {
                    if (m * m + m).wrapping_sub(wanted) >> digit & 1 == 1 {
                        m += 1 << digit;
                    }
                }
                for m in [m, m + (1 << 52)] {
                    let square = (m * m + m).wrapping_add_signed(-j);
                    let a = square as f64;
                    if m >> 52 == 1 && a as u128 == square {
                        hard.push(a);
                    }
                }
            }
        }
    }
    assert!(hard.len() > 4000, "{}", hard.len());
    let mut next = hard.iter().cycle();
    law(hard.len(), || next.next().copied().unwrap_or_default());
}

#[test]
fn every_exponent_and_special_values() {
    let mut random = noise();
    let mut exponent = 0;
    law(100_000, || {
        exponent = (exponent + 1) % 2048;
        f64::from_bits(random() >> 12 | exponent << 52)
    });
    let edge = [
        0.0,
        f64::from_bits(1),
        f64::MIN_POSITIVE,
        super::SMALLEST,
        1.0,
        4.0,
        f64::MAX,
        f64::INFINITY,
        f64::NAN,
    ];
    let near = |v: f64| [v, v.next_down(), v.next_up(), -v];
    // Each beside each other: one lane's way must not show in another's.
    let all: Vec<f64> = edge.into_iter().flat_map(near).collect();
    let mut pairs = all.iter().flat_map(|a| all.iter().flat_map(move |b| [*a, *b])).cycle();
    law(all.len() * all.len() / 4, || pairs.next().unwrap_or_default());
}
