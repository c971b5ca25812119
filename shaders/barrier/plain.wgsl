// Arithmetic as the compiler likes it: faster than barrier/strict.wgsl, and a rounding or two apart.

fn keep(v: f32) -> f32 {
    return v;
}

fn keep3(v: vec3<f32>) -> vec3<f32> {
    return v;
}
