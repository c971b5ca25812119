// Arithmetic in the order it is written: the bits of a value pass through an operation that changes
// nothing, which no compiler can know. Without it a + b - b may become a, and a * b + c one rounding.

fn keep(v: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(v) ^ u.zero);
}

fn keep3(v: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(bitcast<vec3<u32>>(v) ^ vec3<u32>(u.zero));
}
