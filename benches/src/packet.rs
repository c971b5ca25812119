//! The csg scene compiled by hand into packets of 16 rays: what an interpreter can be compared with.
//!
//! Two packets walk side by side, so that one's roots hide behind the other's; a lane whose ray has ended
//! takes the next ray. Law: the same hits and steps as the scalar loop, ray by ray ([`trace`] counts them).
#![allow(unsafe_code)]

use std::arch::x86_64::*;

use crate::{
    scenes::place,
    trace::{EPS, Line, MAX_STEPS, T_MAX, Totals},
};

/// Directions coordinate by coordinate; all rays start at one eye.
pub struct Rays {
    eye: [f32; 3],
    d: [Vec<f32>; 3],
}

impl Rays {
    pub fn new(lines: &[Line]) -> Self {
        let eye = lines.first().map_or([0.0; 3], |l| l.o);
        Self { eye, d: std::array::from_fn(|a| lines.iter().map(|l| l.d[a]).collect()) }
    }
}

/// Whether this processor has what the tracer is written in.
pub fn available() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("avx512dq")
}

/// Traces all rays.
///
/// # Panics
/// Where the processor lacks AVX-512.
pub fn trace(rays: &Rays) -> Totals {
    assert!(available(), "no AVX-512 here");
    // SAFETY: the features were asked for.
    unsafe { packets(rays) }
}

type V = __m512;
type P = [V; 3];

macro_rules! field {
    ($($name:ident ($($arg:ident: $t:ty),*) -> $r:ty $body:block)*) => {$(
        #[inline]
        #[target_feature(enable = "avx512f,avx512vl,avx512dq")]
        fn $name($($arg: $t),*) -> $r $body
    )*};
}

field! {
    c(v: f32) -> V { _mm512_set1_ps(v) }
    add(a: V, b: V) -> V { _mm512_add_ps(a, b) }
    sub(a: V, b: V) -> V { _mm512_sub_ps(a, b) }
    mul(a: V, b: V) -> V { _mm512_mul_ps(a, b) }
    min(a: V, b: V) -> V { _mm512_min_ps(a, b) }
    max(a: V, b: V) -> V { _mm512_max_ps(a, b) }
    abs(a: V) -> V { _mm512_abs_ps(a) }
    neg(a: V) -> V { _mm512_xor_ps(a, c(-0.0)) }
    len2(a: V, b: V) -> V { _mm512_sqrt_ps(add(mul(a, a), mul(b, b))) }
    len3(a: V, b: V, e: V) -> V { _mm512_sqrt_ps(add(add(mul(a, a), mul(b, b)), mul(e, e))) }
    at(p: P, o: [f32; 3]) -> P { [sub(p[0], c(o[0])), sub(p[1], c(o[1])), sub(p[2], c(o[2]))] }
    ball(p: P) -> V { sub(len3(p[0], p[1], p[2]), c(0.6)) }
    cuboid(p: P) -> V {
        let zero = c(0.0);
        let (x, y, z) = (sub(abs(p[0]), c(0.4)), sub(abs(p[1]), c(0.3)), sub(abs(p[2]), c(0.35)));
        add(len3(max(x, zero), max(y, zero), max(z, zero)), min(max(x, max(y, z)), zero))
    }
    torus(p: P) -> V { sub(len2(sub(len2(p[0], p[2]), c(0.5)), p[1]), c(0.15)) }
    cylinder(p: P) -> V {
        let zero = c(0.0);
        let (dx, dy) = (sub(len2(p[0], p[2]), c(0.25)), sub(abs(p[1]), c(0.7)));
        add(min(max(dx, dy), zero), len2(max(dx, zero), max(dy, zero)))
    }
    blend(a: V, b: V) -> V {
        let h = _mm512_div_ps(max(sub(c(0.1), abs(sub(a, b))), c(0.0)), c(0.1));
        sub(min(a, b), mul(mul(mul(h, h), c(0.1)), c(0.25)))
    }
    scene(p: P, places: &[[f32; 3]; 12]) -> V {
        let mut d = ball(at(p, places[0]));
        for i in [0, 4, 8] {
            d = if i > 0 { min(d, ball(at(p, places[i]))) } else { d };
            d = min(d, cuboid(at(p, places[i + 1])));
            d = blend(d, torus(at(p, places[i + 2])));
            d = max(d, neg(cylinder(at(p, places[i + 3]))));
        }
        d
    }
}

/// Sixteen rays on their way.
#[derive(Clone, Copy)]
struct Packet {
    d: P,
    t: V,
    steps: __m512i,
    live: __mmask16,
}

#[target_feature(enable = "avx512f,avx512vl,avx512dq")]
unsafe fn packets(rays: &Rays) -> Totals {
    let n = rays.d[0].len();
    let places: [[f32; 3]; 12] = std::array::from_fn(|i| place(i).map(|v| v as f32));
    let eye = rays.eye.map(|v| c(v));
    let mut sum = Totals { hits: 0, steps: 0 };
    let mut next = 0;
    let empty = Packet { d: [c(0.0); 3], t: c(0.0), steps: _mm512_setzero_si512(), live: 0 };
    let mut two = [empty; 2];
    loop {
        for p in &mut two {
            let free = !p.live;
            if free != 0 && next < n {
                let take = (free.count_ones() as usize).min(n - next);
                let lanes = lowest(free, take);
                for axis in 0..3 {
                    // SAFETY: an expanding load reads as many values as `lanes` has bits: `take`.
                    p.d[axis] = unsafe {
                        _mm512_mask_expandloadu_ps(p.d[axis], lanes, rays.d[axis].as_ptr().add(next))
                    };
                }
                p.t = _mm512_mask_mov_ps(p.t, lanes, c(0.0));
                p.steps = _mm512_mask_mov_epi32(p.steps, lanes, _mm512_setzero_si512());
                p.live |= lanes;
                next += take;
            }
        }
        if two[0].live | two[1].live == 0 {
            return sum;
        }
        let mut r = [c(0.0); 2];
        for (r, p) in r.iter_mut().zip(&two) {
            let q = [0, 1, 2].map(|a| add(eye[a], mul(p.t, p.d[a])));
            *r = scene(q, &places);
        }
        for (r, p) in r.into_iter().zip(&mut two) {
            sum.steps += u64::from(p.live.count_ones());
            p.steps = _mm512_add_epi32(p.steps, _mm512_set1_epi32(1));
            let hit = _mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(p.live, r, c(EPS));
            sum.hits += hit.count_ones() as usize;
            p.t = add(p.t, r);
            let on = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(p.live & !hit, p.t, c(T_MAX));
            p.live = _mm512_mask_cmplt_epi32_mask(on, p.steps, _mm512_set1_epi32(MAX_STEPS as i32));
        }
    }
}

/// The lowest `n` bits that are set.
fn lowest(mut mask: __mmask16, n: usize) -> __mmask16 {
    let mut kept = 0;
    for _ in 0..n {
        kept |= mask & mask.wrapping_neg();
        mask &= mask - 1;
    }
    kept
}
