// What a scene brings with it, in group 1: its constants (binding 0, `consts`, which the scene's text declares as
// long as it needs), so that moving an object changes no text, and its grids.
@group(1) @binding(1) var<storage, read> grids: array<u32>;

// The same bits, but no compiler can know: `u.zero` is 0 at run time. It keeps `(a + b) - b` from becoming `a`.
fn hold(v: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(v) ^ u.zero);
}

// By bits: compilers may assume that there is no NaN, and fold `v != v` away.
fn is_nan(v: f32) -> bool {
    return (bitcast<u32>(v) & 0x7fffffffu) > 0x7f800000u;
}

fn is_finite(v: f32) -> bool {
    return (bitcast<u32>(v) & 0x7f800000u) != 0x7f800000u;
}

fn nan() -> f32 {
    return bitcast<f32>(0x7fc00000u ^ u.zero);
}
