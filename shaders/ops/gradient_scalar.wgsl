// Gradients, forward: a value with its derivatives is vec4(d/dx, d/dy, d/dz, value). The value is computed by the
// plain op, so it has the same bits. Twin of lane/dual.rs: at a kink the branch taken, at a zero length 0.

fn d_const(c: f32) -> vec4<f32> { return vec4<f32>(0.0, 0.0, 0.0, c); }
fn d_add(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> { return vec4<f32>(a.xyz + b.xyz, op_add(a.w, b.w)); }
fn d_sub(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> { return vec4<f32>(a.xyz - b.xyz, op_sub(a.w, b.w)); }
fn d_mul(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(a.xyz * b.w + b.xyz * a.w, op_mul(a.w, b.w));
}
fn d_div(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> {
    let q = op_div(a.w, b.w);
    return vec4<f32>((a.xyz - q * b.xyz) * (1.0 / b.w), q);
}
fn d_min(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> { return select(b, a, a.w < b.w); }
fn d_max(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> { return select(b, a, a.w > b.w); }
fn d_neg(a: vec4<f32>) -> vec4<f32> { return -a; }
fn d_abs(a: vec4<f32>) -> vec4<f32> { return vec4<f32>(a.xyz * side_of(a.w), abs(a.w)); }
fn d_sqrt(a: vec4<f32>) -> vec4<f32> {
    let s = op_sqrt(a.w);
    return vec4<f32>(a.xyz * select(0.0, 0.5 / s, 0.0 < s), s);
}
fn d_square(a: vec4<f32>) -> vec4<f32> { return d_mul(a, a); }
fn d_floor(a: vec4<f32>) -> vec4<f32> { return vec4<f32>(0.0, 0.0, 0.0, floor(a.w)); }
fn d_sign(a: vec4<f32>) -> vec4<f32> { return vec4<f32>(0.0, 0.0, 0.0, op_sign(a.w)); }
fn d_sin(a: vec4<f32>) -> vec4<f32> { return vec4<f32>(a.xyz * m_cos(a.w), m_sin(a.w)); }
fn d_cos(a: vec4<f32>) -> vec4<f32> { return vec4<f32>(-a.xyz * m_sin(a.w), m_cos(a.w)); }
fn d_tan(a: vec4<f32>) -> vec4<f32> { return d_div(d_sin(a), d_cos(a)); }
fn d_exp(a: vec4<f32>) -> vec4<f32> {
    let e = op_exp(a.w);
    return vec4<f32>(a.xyz * e, e);
}
fn d_log(a: vec4<f32>) -> vec4<f32> { return vec4<f32>(a.xyz / a.w, op_log(a.w)); }
fn one_plus(a: vec4<f32>, sign: f32) -> vec4<f32> { return vec4<f32>(a.xyz * sign, 1.0 + sign * a.w); }
fn d_asin(x: vec4<f32>) -> vec4<f32> { return d_atan2(x, d_sqrt(d_mul(one_plus(x, -1.0), one_plus(x, 1.0)))); }
fn d_acos(x: vec4<f32>) -> vec4<f32> { return d_atan2(d_sqrt(d_mul(one_plus(x, -1.0), one_plus(x, 1.0))), x); }
fn d_atan(a: vec4<f32>) -> vec4<f32> { return d_atan2(a, vec4<f32>(0.0, 0.0, 0.0, 1.0)); }
fn d_atan2(y: vec4<f32>, x: vec4<f32>) -> vec4<f32> {
    let n = y.w * y.w + x.w * x.w;
    return vec4<f32>((y.xyz * x.w - x.xyz * y.w) * select(0.0, 1.0 / n, 0.0 < n), m_atan2(y.w, x.w));
}
fn d_mod(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(a.xyz - b.xyz * floor(a.w / b.w), op_mod(a.w, b.w));
}
fn d_length2(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> {
    let d = op_length2(a.w, b.w);
    let i = inverse(d);
    return vec4<f32>(a.xyz * (a.w * i) + b.xyz * (b.w * i), d);
}
fn d_length3(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>) -> vec4<f32> {
    let d = op_length3(a.w, b.w, c.w);
    return along(a, b, c, vec3<f32>(a.w, b.w, c.w) * inverse(d), d);
}
fn d_select(a: vec4<f32>, b: vec4<f32>, x: vec4<f32>, y: vec4<f32>) -> vec4<f32> { return select(y, x, a.w < b.w); }

fn side_of(v: f32) -> f32 { return select(1.0, -1.0, v < 0.0); }
fn inverse(d: f32) -> f32 { return select(0.0, 1.0 / d, 0.0 < d); }
// The chain rule: `slope` is the derivative by the operands, `value` what they give.
fn along(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, slope: vec3<f32>, value: f32) -> vec4<f32> {
    return vec4<f32>(x.xyz * slope.x + y.xyz * slope.y + z.xyz * slope.z, value);
}

fn d_add_const(a: vec4<f32>, c: f32) -> vec4<f32> { return vec4<f32>(a.xyz, op_add_const(a.w, c)); }
fn d_sub_const(a: vec4<f32>, c: f32) -> vec4<f32> { return vec4<f32>(a.xyz, op_sub_const(a.w, c)); }
fn d_mul_const(a: vec4<f32>, c: f32) -> vec4<f32> { return vec4<f32>(a.xyz * c, op_mul_const(a.w, c)); }
fn d_div_const(a: vec4<f32>, c: f32) -> vec4<f32> { return vec4<f32>(a.xyz / c, op_div_const(a.w, c)); }
fn d_dot(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, c: vec4<f32>) -> vec4<f32> {
    return along(x, y, z, vec3<f32>(c.x, c.y, c.z), op_dot(x.w, y.w, z.w, c));
}
fn smin_slope(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>) -> vec3<f32> {
    let d = a.w - b.w;
    let h = op_max(c.x - abs(d), 0.0) * c.y;
    return select(b.xyz, a.xyz, a.w < b.w) + (a.xyz - b.xyz) * (2.0 * h * side_of(d));
}
fn d_smooth_min(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(smin_slope(a, b, c), op_smooth_min(a.w, b.w, c));
}
fn d_smooth_max(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(-smin_slope(-a, -b, c), op_smooth_max(a.w, b.w, c));
}
fn d_shell(a: vec4<f32>, c: f32) -> vec4<f32> { return vec4<f32>(a.xyz * side_of(a.w), op_shell(a.w, c)); }
fn d_elongate(x: vec4<f32>, c: f32) -> vec4<f32> {
    let inside = -c < x.w && x.w < c;
    return vec4<f32>(select(x.xyz, vec3<f32>(0.0), inside), op_elongate(x.w, c));
}
// Which of three values is the largest, with the ties of nested maxima.
fn largest(q: vec3<f32>) -> vec3<f32> {
    let rest = select(vec3<f32>(0.0, 0.0, 1.0), vec3<f32>(0.0, 1.0, 0.0), q.z < q.y);
    return select(rest, vec3<f32>(1.0, 0.0, 0.0), op_max(q.y, q.z) < q.x);
}
fn sides(p: vec3<f32>) -> vec3<f32> { return vec3<f32>(side_of(p.x), side_of(p.y), side_of(p.z)); }
fn d_elongate_inside(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, c: vec4<f32>) -> vec4<f32> {
    let p = vec3<f32>(x.w, y.w, z.w);
    let value = op_elongate_inside(p.x, p.y, p.z, c);
    let q = abs(p) - vec3<f32>(c.x, c.y, c.z);
    return along(x, y, z, select(vec3<f32>(0.0), largest(q) * sides(p), value < 0.0), value);
}
fn d_repeat(x: vec4<f32>, c: vec4<f32>) -> vec4<f32> { return vec4<f32>(x.xyz, op_repeat(x.w, c)); }
fn d_rotate_x(c: vec4<f32>, s: vec4<f32>, x: vec4<f32>, y: vec4<f32>) -> vec4<f32> {
    let slope = c.xyz * x.w + x.xyz * c.w - (s.xyz * y.w + y.xyz * s.w);
    return vec4<f32>(slope, op_rotate_x(c.w, s.w, x.w, y.w));
}
fn d_rotate_y(c: vec4<f32>, s: vec4<f32>, x: vec4<f32>, y: vec4<f32>) -> vec4<f32> {
    let slope = s.xyz * x.w + x.xyz * s.w + (c.xyz * y.w + y.xyz * c.w);
    return vec4<f32>(slope, op_rotate_y(c.w, s.w, x.w, y.w));
}
