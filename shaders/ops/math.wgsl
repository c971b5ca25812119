// Sine, cosine, exponential, logarithm and arc tangent, polynomial by polynomial those of the CPU (math.rs):
// the built-in ones may err by 1e-4, and each driver has its own. Same law: within 2.6 ulp on sane drivers.

struct Quarter { q: u32, s: f32, c: f32 }

// Quadrant, and sine and cosine of what remains of v >= 0 after whole quarters of a turn.
fn quarter(v: f32) -> Quarter {
    let x = select(nan(), v, v <= 1048576.0);
    let n = hold(x * 0.63661977 + 12582912.0);
    let k = hold(n - 12582912.0);
    // pi/2 in parts of 11, 11, 11 and 24 bits.
    let r0 = hold(x - hold(k * 1.5703125));
    let r1 = hold(r0 - hold(k * 4.837512969970703e-4));
    let r2 = hold(r1 - hold(k * 7.549533620476723e-8));
    let r = hold(r2 - hold(k * 2.563344151594519e-12));
    let z = keep(r * r);
    let ps = keep(-1.6666654611e-1 + keep(z * keep(8.3321608736e-3 + keep(z * -1.9515295891e-4))));
    let pc = keep(4.166664568298827e-2 + keep(z * keep(-1.388731625493765e-3 + keep(z * 2.443315711809948e-5))));
    let s = keep(r + keep(keep(r * z) * ps));
    let c = keep(keep(1.0 - keep(0.5 * z)) + keep(keep(z * z) * pc));
    return Quarter(bitcast<u32>(n), s, c);
}

fn m_sin(x: f32) -> f32 {
    let t = quarter(abs(x));
    let v = select(t.c, t.s, (t.q & 1u) == 0u);
    // Bit 1 of the quadrant is the sign; the argument's own sign joins it.
    return bitcast<f32>(bitcast<u32>(v) ^ (((t.q << 30u) ^ bitcast<u32>(x)) & 0x80000000u));
}

fn m_cos(x: f32) -> f32 {
    let t = quarter(abs(x));
    let v = select(t.s, t.c, (t.q & 1u) == 0u);
    return bitcast<f32>(bitcast<u32>(v) ^ (((t.q + 1u) << 30u) & 0x80000000u));
}

fn pow2(e: u32) -> f32 {
    return bitcast<f32>((e - 127u) << 23u);
}

fn m_exp(v: f32) -> f32 {
    // Beyond the clamp the answer is infinity or zero anyway; a NaN passes both tests.
    let top = select(v, 89.0, v > 89.0);
    let x = select(top, -104.0, top < -104.0);
    let n = hold(x * 1.442695 + 12582912.0);
    let kf = hold(n - 12582912.0);
    let r = hold(hold(x - hold(kf * 0.693359375)) - hold(kf * -2.1219444e-4));
    var p = keep(1.3981999507e-3 + keep(r * 1.9875691500e-4));
    p = keep(8.3334519073e-3 + keep(r * p));
    p = keep(4.1665795894e-2 + keep(r * p));
    p = keep(1.6666665459e-1 + keep(r * p));
    p = keep(5.0000001201e-1 + keep(r * p));
    let y = keep(1.0 + keep(r + keep(keep(r * r) * p)));
    // 2^k in two halves: k reaches past the largest exponent and into the subnormals.
    let k = bitcast<u32>(n) - 0x4b400000u + 508u;
    let a = k >> 1u;
    return hold(y * pow2(a)) * pow2(k - a);
}

fn m_ln(v: f32) -> f32 {
    let bits = bitcast<u32>(v);
    let tiny = v < 1.17549435e-38;
    let x = select(v, v * 33554432.0, tiny);
    // x = m * 2^e with m in [sqrt(1/2), sqrt(2)), the exponent offset to stay positive.
    let t = bitcast<u32>(x) - 0x3f3504f3u + (128u << 23u);
    let e = t >> 23u;
    let m = bitcast<u32>(x) - ((e - 128u) << 23u);
    let k0 = hold(bitcast<f32>(0x4b000000u | e) - 8388736.0);
    let k = select(k0, k0 - 25.0, tiny);
    let f = hold(bitcast<f32>(m) - 1.0);
    let s = keep(f / keep(2.0 + f));
    let half = keep(keep(0.5 * f) * f);
    let z = keep(s * s);
    let p = keep(0.66666662693 + keep(z * keep(0.40000972152 + keep(z * keep(0.28498786688 + keep(z * 0.24279078841))))));
    let rest = keep(s * keep(half + keep(z * p)));
    let low = keep(half - keep(rest + keep(k * -2.1219444e-4)));
    let y = keep(keep(k * 0.693359375) - keep(low - f));
    if (bits & 0x7fffffffu) == 0u {
        return bitcast<f32>(0xff800000u ^ u.zero);
    }
    if bits >= 0x7f800000u {
        // Infinity is its own logarithm; NaN and everything below zero has none.
        return select(nan(), v, bits == 0x7f800000u);
    }
    return y;
}

fn m_atan2(y: f32, x: f32) -> f32 {
    let a = abs(y);
    let b = abs(x);
    let swap = a > b;
    let small = select(a, b, swap);
    let large = select(b, a, swap);
    // The scale keeps the sum finite and the threshold out of the subnormals.
    let scale = select(16777216.0, 0.5, large > 1.0);
    let p = hold(small * scale);
    let q = hold(large * scale);
    // atan(s/l) = pi/4 + atan((s-l)/(s+l)) keeps the polynomial's argument below 7/16.
    let steep = (p >= keep(0.41421356 * q)) && (q > 0.0);
    let difference = select(keep(p - q), 0.0, small == large);
    let over = select(small, difference, steep);
    let under = select(large, keep(p + q), steep);
    let w0 = keep(over / select(under, 1.0, large == 0.0));
    let z = keep(w0 * w0);
    let c = keep(-1.99777106478e-1 + keep(z * keep(1.38776856032e-1 + keep(z * -8.05374449538e-2))));
    let w1 = keep(w0 - keep(w0 * keep(z * keep(3.33329491539e-1 + keep(z * c)))));
    // The octants add a whole number of eighths of a turn and mirror w: counted first.
    let n1 = select(0.0, 1.0, steep);
    let n2 = select(n1, 2.0 - n1, swap);
    let w2 = select(w1, -w1, swap);
    let left = (bitcast<u32>(x) & 0x80000000u) != 0u;
    let n = select(n2, 4.0 - n2, left);
    let w = select(w2, -w2, left);
    let low = select(keep(n * -2.1855694e-8), -5.962440319251527e-9, n == 3.0);
    let r = keep(keep(n * 0.7853982) + keep(w + low));
    let turned = bitcast<f32>(bitcast<u32>(r) | (bitcast<u32>(y) & 0x80000000u));
    return select(turned, nan(), is_nan(x) || is_nan(y));
}
