// Gradients of the ops over tables and grids.

fn d_sphere_union(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, k: u32, n: u32) -> vec4<f32> {
    var d = op_sphere(x.w, y.w, z.w, consts[k]);
    var row = consts[k];
    for (var i = 1u; i < n; i++) {
        let v = op_sphere(x.w, y.w, z.w, consts[k + i]);
        if v < d {
            d = v;
            row = consts[k + i];
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

fn d_mandelbulb(px: vec4<f32>, py: vec4<f32>, pz: vec4<f32>, c: vec4<f32>) -> vec4<f32> {
    let n = u32(c.x);
    let iterations = u32(c.y);
    let one = vec4<f32>(0.0, 0.0, 0.0, 1.0);
    var x = pz;
    var y = px;
    var z = py;
    var r = d_length3(x, y, z);
    if !(r.w < 2.0) {
        return vec4<f32>(r.xyz, keep(r.w - c.z));
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

// The interpolant's own slope inside its cell.
fn slope_inside(place: Place, k: u32, kind: u32) -> vec3<f32> {
    let c = corners(place.cell, k, kind);
    let f = place.f;
    let ends = mix4(vec4<f32>(c.low.xz, c.high.xz), vec4<f32>(c.low.yw, c.high.yw), f.x);
    let near = mix_(ends.x, ends.y, f.y);
    let far = mix_(ends.z, ends.w, f.y);
    let dx = vec4<f32>(c.low.yw - c.low.xz, c.high.yw - c.high.xz);
    let slope = vec3<f32>(
        mix(mix(dx.x, dx.y, f.y), mix(dx.z, dx.w, f.y), f.z),
        mix(ends.y - ends.x, ends.w - ends.z, f.z),
        far - near,
    );
    return slope / consts[k + 3u].xyz;
}

// Differences of values half a cell to both sides, inside the box: continuous from voxel to voxel.
fn slope_across(at: vec3<f32>, k: u32, kind: u32) -> vec3<f32> {
    let lo = consts[k + 1u].xyz;
    let hi = consts[k + 2u].xyz;
    let p = clamp(at, lo, hi);
    var ends = array<vec3<f32>, 2>();
    var width = vec3<f32>(0.0);
    // One loop of six samples: compilers need not see the sampling six times.
    for (var i = 0u; i < 6u; i++) {
        let axis = i >> 1u;
        let half = consts[k + 3u][axis] * 0.5;
        var q = p;
        q[axis] = clamp(p[axis] + select(-half, half, (i & 1u) == 1u), lo[axis], hi[axis]);
        ends[i & 1u][axis] = sample(q.x, q.y, q.z, k, kind, 0u, 0u);
        width[axis] += select(-q[axis], q[axis], (i & 1u) == 1u);
    }
    return (ends[1] - ends[0]) / width;
}

fn d_sample(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, k: u32, kind: u32, rule: u32, step: u32) -> vec4<f32> {
    let value = sample(x.w, y.w, z.w, k, kind, rule, step);
    let place = locate(x.w, y.w, z.w, k);
    var slope = vec3<f32>(0.0);
    if step == 0u {
        slope = slope_inside(place, k, kind);
    } else {
        slope = slope_across(vec3<f32>(x.w, y.w, z.w), k, kind);
    }
    let d = op_length3(place.outside.x, place.outside.y, place.outside.z);
    if d > 0.0 {
        // On the box's side of the field the value falls by 1 along the way out, by the face's slope across.
        let away = place.outside / d;
        let across = select(vec3<f32>(0.0), slope, place.outside == vec3<f32>(0.0)) - away;
        slope = select(away, across, value > d);
    }
    return along(x, y, z, slope, value);
}

fn d_texture(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, k: u32, kind: u32, rule: u32) -> vec4<f32> {
    return d_sample(x, y, z, k, kind, rule, 0u);
}
fn d_texture_safe(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, k: u32, kind: u32, rule: u32) -> vec4<f32> {
    return d_sample(x, y, z, k, kind, rule, 1u);
}
fn d_texture_safe_negated(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, k: u32, kind: u32, rule: u32) -> vec4<f32> {
    return d_sample(x, y, z, k, kind, rule, 2u);
}
