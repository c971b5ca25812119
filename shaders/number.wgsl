// NaN and infinity are told by their bits: compilers may take it that there are none and fold v != v to
// false. Twin: is_nan, is_finite, min and max of crates/sdfrs-core/src/real.rs.

// The bits of infinity.
const INFINITE: u32 = 0x7f800000u;

fn is_nan(v: f32) -> bool {
    return (bitcast<u32>(v) & 0x7fffffffu) > INFINITE;
}

fn is_finite(v: f32) -> bool {
    return (bitcast<u32>(v) & 0x7fffffffu) < INFINITE;
}

fn lesser(a: f32, b: f32) -> f32 {
    return select(b, a, a < b);
}

fn larger(a: f32, b: f32) -> f32 {
    return select(b, a, a > b);
}
