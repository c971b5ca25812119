// The scalar rows of the op table, and the steps of transforms; operands first, then constants.
// Order of operations as in op.rs. min and max are `if a < b {a} else {b}`, so that NaN goes the same way.

fn op_const(c: f32) -> f32 { return c; }
fn op_add(a: f32, b: f32) -> f32 { return keep(a + b); }
fn op_sub(a: f32, b: f32) -> f32 { return keep(a - b); }
fn op_mul(a: f32, b: f32) -> f32 { return keep(a * b); }
fn op_div(a: f32, b: f32) -> f32 { return keep(a / b); }
fn op_min(a: f32, b: f32) -> f32 { return select(b, a, a < b); }
fn op_max(a: f32, b: f32) -> f32 { return select(b, a, a > b); }
fn op_neg(a: f32) -> f32 { return -a; }
fn op_abs(a: f32) -> f32 { return abs(a); }
fn op_sqrt(a: f32) -> f32 { return keep(sqrt(a)); }
fn op_square(a: f32) -> f32 { return keep(a * a); }
fn op_floor(a: f32) -> f32 { return floor(a); }
fn op_sign(a: f32) -> f32 { return select(select(0.0, -1.0, a < 0.0), 1.0, 0.0 < a); }
fn op_sin(a: f32) -> f32 { return m_sin(a); }
fn op_cos(a: f32) -> f32 { return m_cos(a); }
fn op_tan(a: f32) -> f32 { return keep(m_sin(a) / m_cos(a)); }
fn op_exp(a: f32) -> f32 { return keep(m_exp(a)); }
fn op_log(a: f32) -> f32 { return keep(m_ln(a)); }
// sqrt((1 - x)(1 + x)) keeps its digits near 1.
fn op_asin(x: f32) -> f32 { return m_atan2(x, keep(sqrt(keep(keep(1.0 - x) * keep(1.0 + x))))); }
fn op_acos(x: f32) -> f32 { return m_atan2(keep(sqrt(keep(keep(1.0 - x) * keep(1.0 + x)))), x); }
fn op_atan(a: f32) -> f32 { return m_atan2(a, 1.0); }
fn op_atan2(y: f32, x: f32) -> f32 { return m_atan2(y, x); }
fn op_mod(a: f32, b: f32) -> f32 { return keep(a - keep(b * floor(keep(a / b)))); }
fn op_length2(a: f32, b: f32) -> f32 { return keep(sqrt(keep(keep(a * a) + keep(b * b)))); }
fn op_length3(a: f32, b: f32, c: f32) -> f32 {
    return keep(sqrt(keep(keep(keep(a * a) + keep(b * b)) + keep(c * c))));
}
fn op_select(a: f32, b: f32, x: f32, y: f32) -> f32 { return select(y, x, a < b); }

fn op_add_const(a: f32, c: f32) -> f32 { return keep(a + c); }
fn op_sub_const(a: f32, c: f32) -> f32 { return keep(a - c); }
fn op_mul_const(a: f32, c: f32) -> f32 { return keep(a * c); }
fn op_div_const(a: f32, c: f32) -> f32 { return keep(a / c); }
fn op_dot(x: f32, y: f32, z: f32, c: vec4<f32>) -> f32 {
    let xy = keep(keep(x * c.x) + keep(y * c.y));
    return keep(keep(xy + keep(z * c.z)) + c.w);
}
fn clamped(x: f32, lo: f32, hi: f32) -> f32 { return op_min(op_max(x, lo), hi); }
// Quadratic smooth minimum; 1-Lipschitz in (a, b). `c` = its width, 1 / (4 width).
fn op_smooth_min(a: f32, b: f32, c: vec4<f32>) -> f32 {
    let h = op_max(keep(c.x - abs(keep(a - b))), 0.0);
    return keep(op_min(a, b) - keep(keep(h * c.y) * h));
}
fn op_smooth_max(a: f32, b: f32, c: vec4<f32>) -> f32 { return -op_smooth_min(-a, -b, c); }
fn op_shell(a: f32, c: f32) -> f32 { return keep(abs(a) - c); }
fn op_elongate(x: f32, c: f32) -> f32 { return keep(x - clamped(x, -c, c)); }
fn op_elongate_inside(x: f32, y: f32, z: f32, c: vec4<f32>) -> f32 {
    let q = vec3<f32>(keep(abs(x) - c.x), keep(abs(y) - c.y), keep(abs(z) - c.z));
    return op_min(op_max(q.x, op_max(q.y, q.z)), 0.0);
}
// Coordinate within the nearest cell, or a neighbouring one; constants: period, lo, hi, off.
fn op_repeat(x: f32, c: vec4<f32>) -> f32 {
    let v = keep(x / c.x);
    let cell = floor(keep(v + 0.5));
    let side = select(c.w, -c.w, v < cell);
    return keep(x - keep(c.x * clamped(keep(cell + side), c.y, c.z)));
}
fn op_rotate_x(c: f32, s: f32, x: f32, y: f32) -> f32 { return keep(keep(c * x) - keep(s * y)); }
fn op_rotate_y(c: f32, s: f32, x: f32, y: f32) -> f32 { return keep(keep(s * x) + keep(c * y)); }
