use super::Math;

const N: u32 = 1_000_000;

/// Numbers in [0, 1), from a fixed seed.
fn noise() -> impl FnMut() -> f64 {
    let mut s = 0x9e37_79b9_7f4a_7c15_u64;
    move || {
        s ^= s << 13;
        s ^= s >> 7;
        s ^= s << 17;
        (s >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn ulps32(got: f32, want: f64) -> f64 {
    let ulp = f64::from((want as f32).abs().next_up()) - f64::from((want as f32).abs());
    (f64::from(got) - want).abs() / ulp
}

fn ulps64(got: f64, want: f64) -> f64 {
    (got - want).abs() / (want.abs().next_up() - want.abs())
}

/// Worst error over N arguments drawn by `draw`, for one function in one precision.
fn worst(mut draw: impl FnMut(&mut dyn FnMut() -> f64) -> f64, error: impl Fn(f64) -> f64) -> f64 {
    let mut random = noise();
    let mut max = 0.0;
    for _ in 0..N {
        let x = draw(&mut random);
        let e = error(x);
        assert!(!e.is_nan(), "NaN at {x:e}");
        if e > max {
            max = e;
        }
    }
    max
}

#[test]
fn sine_and_cosine() {
    for range in [1.0, 10.0, 1e3, 1e4] {
        let draw = |r: &mut dyn FnMut() -> f64| f64::from(((r() * 2.0 - 1.0) * range) as f32);
        let s = worst(draw, |x| ulps32((x as f32).m_sin(), x.sin()));
        let c = worst(draw, |x| ulps32((x as f32).m_cos(), x.cos()));
        assert!(s <= 2.6 && c <= 2.6, "f32 range {range}: {s} {c}");
    }
    for range in [1.0, 10.0, 1e3, 1e6] {
        let draw = |r: &mut dyn FnMut() -> f64| (r() * 2.0 - 1.0) * range;
        let s = worst(draw, |x| ulps64(x.m_sin(), x.sin()));
        let c = worst(draw, |x| ulps64(x.m_cos(), x.cos()));
        assert!(s <= 2.5 && c <= 2.5, "f64 range {range}: {s} {c}");
    }
}

#[test]
fn sine_near_its_zeros() {
    for k in 1..6000_i32 {
        let x = (f64::from(k) * std::f64::consts::FRAC_PI_2) as f32;
        let (s, c) = (f64::from(x).sin(), f64::from(x).cos());
        assert!(ulps32(x.m_sin(), s) <= 2.6 && ulps32(x.m_cos(), c) <= 2.6, "{x}");
        let x = f64::from(k * 100) * std::f64::consts::FRAC_PI_2;
        assert!(ulps64(x.m_sin(), x.sin()) <= 2.5 && ulps64(x.m_cos(), x.cos()) <= 2.5, "{x}");
    }
}

#[test]
fn sine_far_out_is_the_sine_of_a_neighbour() {
    let mut random = noise();
    for _ in 0..N / 10 {
        let x = (1e4 + random() * 1.03e6) as f32;
        let ulp = f64::from(x.next_up() - x);
        assert!((f64::from(x.m_sin()) - f64::from(x).sin()).abs() <= ulp, "{x}");
        let x = 1e6 + random() * 1e12;
        assert!((x.m_cos() - x.cos()).abs() <= x.next_up() - x, "{x}");
    }
    assert!(1.1e6_f32.m_sin().is_nan() && 1.2e12_f64.m_cos().is_nan());
}

#[test]
fn exponential() {
    for range in [1.0, 80.0, 103.0] {
        let draw = |r: &mut dyn FnMut() -> f64| f64::from(((r() * 2.0 - 1.0) * range) as f32).min(88.7);
        let e = worst(draw, |x| ulps32((x as f32).m_exp(), f64::from(x as f32).exp()));
        assert!(e <= 2.6, "f32 range {range}: {e}");
    }
    for range in [1.0, 700.0, 745.0] {
        let draw = |r: &mut dyn FnMut() -> f64| ((r() * 2.0 - 1.0) * range).min(709.7);
        let e = worst(draw, |x| ulps64(x.m_exp(), x.exp()));
        assert!(e <= 2.5, "f64 range {range}: {e}");
    }
}

#[test]
fn logarithm() {
    let all = |r: &mut dyn FnMut() -> f64| f64::from(f32::from_bits((r() * f64::from(0x7f80_0000)) as u32));
    let near = |r: &mut dyn FnMut() -> f64| f64::from((0.5 + r()) as f32);
    for (name, e) in [
        ("all", worst(all, |x| if x == 0.0 { 0.0 } else { ulps32((x as f32).m_ln(), x.ln()) })),
        ("near one", worst(near, |x| if x == 1.0 { 0.0 } else { ulps32((x as f32).m_ln(), x.ln()) })),
    ] {
        assert!(e <= 2.6, "f32 {name}: {e}");
    }
    let all = |r: &mut dyn FnMut() -> f64| f64::from_bits((r() * 0x7ff0_0000_0000_0000_u64 as f64) as u64);
    let near = |r: &mut dyn FnMut() -> f64| 0.5 + r();
    let e = worst(all, |x| ulps64(x.m_ln(), x.ln())).max(worst(near, |x| ulps64(x.m_ln(), x.ln())));
    assert!(e <= 2.5, "f64: {e}");
}

#[test]
fn arc_tangent() {
    for scale in [1.0, 1e-3, 1e3] {
        let mut random = noise();
        let (mut single, mut double) = (0.0_f64, 0.0_f64);
        for _ in 0..N {
            let (y, x) = ((random() * 2.0 - 1.0) * scale, random() * 2.0 - 1.0);
            double = double.max(ulps64(y.m_atan2(x), y.atan2(x)));
            let (y, x) = (y as f32, x as f32);
            single = single.max(ulps32(y.m_atan2(x), f64::from(y).atan2(f64::from(x))));
        }
        assert!(single <= 2.6 && double <= 2.5, "scale {scale}: {single} {double}");
    }
}

macro_rules! special {
    ($name:ident, $T:ident) => {
        #[test]
        fn $name() {
            let (inf, nan, zero): ($T, $T, $T) = ($T::INFINITY, $T::NAN, 0.0);
            let same = |a: $T, b: $T| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
            for (i, (got, want)) in [
                (zero.m_sin(), 0.0),
                ((-zero).m_sin(), -0.0),
                ((-zero).m_cos(), 1.0),
                (inf.m_sin(), nan),
                ((-inf).m_cos(), nan),
                (nan.m_sin(), nan),
                (nan.m_cos(), nan),
                ($T::from_bits(1).m_sin(), $T::from_bits(1)),
                (zero.m_exp(), 1.0),
                (inf.m_exp(), inf),
                ((-inf).m_exp(), 0.0),
                ($T::MAX.m_exp(), inf),
                ($T::MIN.m_exp(), 0.0),
                (nan.m_exp(), nan),
                (zero.m_ln(), -inf),
                ((-zero).m_ln(), -inf),
                ((1.0 as $T).m_ln(), 0.0),
                ((-1.0 as $T).m_ln(), nan),
                ((-inf).m_ln(), nan),
                (inf.m_ln(), inf),
                (nan.m_ln(), nan),
                (nan.m_atan2(1.0), nan),
                ((1.0 as $T).m_atan2(nan), nan),
                (zero.m_atan2(nan), nan),
            ]
            .into_iter()
            .enumerate()
            {
                assert!(same(got, want), "{}: case {i}: {got} for {want}", stringify!($T));
            }
            let edge =
                [0.0, -0.0, 1.0, -1.0, inf, -inf, $T::MAX, $T::MIN, $T::MIN_POSITIVE, $T::from_bits(1)];
            for y in edge {
                for x in edge {
                    let (got, want) = (y.m_atan2(x), y.atan2(x));
                    let close = (got - want).abs() <= 2.0 * $T::EPSILON * want.abs();
                    assert!(
                        same(got, want) || (close && want != 0.0),
                        "atan2({y:e}, {x:e}) = {got} for {want}"
                    );
                }
            }
        }
    };
}
special!(special_values_f32, f32);
special!(special_values_f64, f64);
