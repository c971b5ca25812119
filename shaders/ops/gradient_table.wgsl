// Gradients of the ops over tables and grids.

fn d_sphere_union(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, k: u32, n: u32) -> vec4<f32> {
    var d = op_sphere(x.w, y.w, z.w, k);
    var row = k;
    for (var i = 1u; i < n; i++) {
        let v = op_sphere(x.w, y.w, z.w, k + 4u * i);
        if v < d {
            d = v;
            row = k + 4u * i;
        }
    }
    return d_sphere(x, y, z, row);
}

// d(w^n) = n w^(n-1) dw; w^n itself by the plain route, for its bits.
fn d_complex_power(x: vec4<f32>, y: vec4<f32>, n: u32) -> mat2x4<f32> {
    if n < 2u {
        return mat2x4<f32>(x, y);
    }
    let w = complex_power(x.w, y.w, n);
    let s = complex_power(x.w, y.w, n - 1u) * f32(n);
    return mat2x4<f32>(
        vec4<f32>(s.x * x.xyz - s.y * y.xyz, w.x),
        vec4<f32>(s.x * y.xyz + s.y * x.xyz, w.y),
    );
}

fn d_real_power(v: vec4<f32>, n: u32) -> vec4<f32> {
    if n < 2u {
        return v;
    }
    let before = real_power(v.w, n - 1u);
    return vec4<f32>(v.xyz * (before * f32(n)), keep(before * v.w));
}

fn d_mandelbulb(px: vec4<f32>, py: vec4<f32>, pz: vec4<f32>, k: u32) -> vec4<f32> {
    let n = u32(consts[k]);
    let iterations = u32(consts[k + 1u]);
    let one = vec4<f32>(0.0, 0.0, 0.0, 1.0);
    var x = pz;
    var y = px;
    var z = py;
    var r = d_length3(x, y, z);
    if !(r.w < 2.0) {
        return vec4<f32>(r.xyz, keep(r.w - consts[k + 2u]));
    }
    var dr = one;
    for (var i = 0u; i < iterations && r.w < 2.0; i++) {
        let rho = d_length2(x, y);
        let safe = select(one, rho, 0.0 < rho.w);
        let ca = select(one, d_div(x, safe), 0.0 < rho.w);
        let p = d_complex_power(z, rho, n);
        let a = d_complex_power(ca, d_div(y, safe), n);
        dr = d_add(d_mul(d_real_power(r, n - 1u) * f32(n), dr), one);
        x = d_add(d_mul(p[1], a[0]), pz);
        y = d_add(d_mul(p[1], a[1]), px);
        z = d_add(p[0], py);
        r = d_length3(x, y, z);
    }
    let inside = select(vec4<f32>(0.0, 0.0, 0.0, 1e-30), r, 1e-30 < r.w);
    return d_div(d_mul(0.5 * d_log(inside), r), dr);
}

fn d_sample(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, g: u32, step: u32) -> vec4<f32> {
    let cell = locate(x.w, y.w, z.w, g);
    let c = corners(g, cell.base);
    let f = cell.f;
    let ends = vec4<f32>(mix_(c.low.x, c.low.y, f.x), mix_(c.low.z, c.low.w, f.x), mix_(c.high.x, c.high.y, f.x), mix_(c.high.z, c.high.w, f.x));
    let near = mix_(ends.x, ends.y, f.y);
    let far = mix_(ends.z, ends.w, f.y);
    let v = mix_(near, far, f.z);
    let dx = vec4<f32>(c.low.yw - c.low.xz, c.high.yw - c.high.xz);
    let slope = vec3<f32>(
        mix(mix(dx.x, dx.y, f.y), mix(dx.z, dx.w, f.y), f.z),
        mix(ends.y - ends.x, ends.w - ends.z, f.z),
        far - near,
    );
    let value = stepped(g, v, step);
    let divided = step != 0u && value == keep(v / header(g + 13u));
    let spacing = vec3<f32>(header(g + 10u), header(g + 11u), header(g + 12u));
    var by_point = slope / (spacing * select(1.0, header(g + 13u), divided));
    let d = op_length3(cell.outside.x, cell.outside.y, cell.outside.z);
    if d > 0.0 {
        let away = cell.outside / d;
        let across = select(vec3<f32>(0.0), by_point, cell.within) - away;
        by_point = select(away, across, value - d > d);
    }
    return along(x, y, z, by_point, surround(value, cell.outside));
}

fn d_texture(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, g: u32) -> vec4<f32> { return d_sample(x, y, z, g, 0u); }
fn d_texture_safe(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, g: u32) -> vec4<f32> { return d_sample(x, y, z, g, 1u); }
fn d_texture_safe_negated(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, g: u32) -> vec4<f32> {
    return d_sample(x, y, z, g, 2u);
}
