// Pairs of operations that tapes fuse: both round, as they would one after the other.

fn op_mul_add(a: f32, b: f32, c: f32) -> f32 { return op_add(op_mul(a, b), c); }
fn op_mul_sub(a: f32, b: f32, c: f32) -> f32 { return op_sub(op_mul(a, b), c); }
fn op_sub_mul(a: f32, b: f32, c: f32) -> f32 { return op_sub(a, op_mul(b, c)); }
fn op_mul_mul_add(a: f32, b: f32, c: f32, d: f32) -> f32 { return op_add(op_mul(a, b), op_mul(c, d)); }
fn op_mul_mul_sub(a: f32, b: f32, c: f32, d: f32) -> f32 { return op_sub(op_mul(a, b), op_mul(c, d)); }
fn op_mul_add_const(a: f32, c: vec4<f32>) -> f32 { return op_add(op_mul(a, c.x), c.y); }
fn op_mul3(a: f32, b: f32, c: f32) -> f32 { return op_mul(op_mul(a, b), c); }
fn op_cut(a: f32, b: f32) -> f32 { return op_max(a, -b); }

fn d_mul_add(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>) -> vec4<f32> { return d_add(d_mul(a, b), c); }
fn d_mul_sub(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>) -> vec4<f32> { return d_sub(d_mul(a, b), c); }
fn d_sub_mul(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>) -> vec4<f32> { return d_sub(a, d_mul(b, c)); }
fn d_mul_mul_add(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>, d: vec4<f32>) -> vec4<f32> {
    return d_add(d_mul(a, b), d_mul(c, d));
}
fn d_mul_mul_sub(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>, d: vec4<f32>) -> vec4<f32> {
    return d_sub(d_mul(a, b), d_mul(c, d));
}
fn d_mul_add_const(a: vec4<f32>, c: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(a.xyz * c.x, op_mul_add_const(a.w, c));
}
fn d_mul3(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>) -> vec4<f32> { return d_mul(d_mul(a, b), c); }
fn d_cut(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> { return d_max(a, -b); }
