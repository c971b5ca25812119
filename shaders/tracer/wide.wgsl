// Whole numbers of 64 bits as (low, high) words, as far as the stackless search counts.
// Law: wide_float rounds once, to the nearest and ties to even, like `as f32` on the host.

fn wide_double(v: vec2<u32>) -> vec2<u32> {
    return vec2<u32>(v.x << 1u, (v.y << 1u) | (v.x >> 31u));
}

fn wide_halve(v: vec2<u32>) -> vec2<u32> {
    return vec2<u32>((v.x >> 1u) | (v.y << 31u), v.y >> 1u);
}

fn wide_float(v: vec2<u32>) -> f32 {
    if v.x == 0u && v.y == 0u {
        return 0.0;
    }
    // The highest bit moves to the top of `high`.
    var high = v.y;
    var low = v.x;
    var exponent = 63u;
    if high == 0u {
        high = low;
        low = 0u;
        exponent = 31u;
    }
    let shift = countLeadingZeros(high);
    if shift > 0u {
        high = (high << shift) | (low >> (32u - shift));
        low = low << shift;
    }
    exponent -= shift;
    let kept = high >> 8u;
    let rest = (high & 0xffu) | select(0u, 1u, low != 0u);
    let up = rest > 0x80u || (rest == 0x80u && (low != 0u || (kept & 1u) == 1u));
    // A carry out of the mantissa lands in the exponent, where it belongs.
    return bitcast<f32>(((exponent + 127u) << 23u) + (kept - 0x800000u) + select(0u, 1u, up));
}
