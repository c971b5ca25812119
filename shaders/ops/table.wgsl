// Ops over a table of constants of any length.

// Least of |p - c| - r over the n rows of cx, cy, cz, r from `k` on. Only a sphere with |p - c|^2 < (d + r)^2 can lower the
// minimum: the others need no root. The slack covers every rounding, so that no bit depends on it.
fn op_sphere_union(x: f32, y: f32, z: f32, k: u32, n: u32) -> f32 {
    var d = op_sphere(x, y, z, consts[k]);
    for (var i = 1u; i < n; i++) {
        let row = consts[k + i];
        let p = at(x, y, z, row);
        let reach = keep(d + row.w);
        let square = keep(keep(keep(p.x * p.x) + keep(p.y * p.y)) + keep(p.z * p.z));
        if square < reach * reach * 1.0000019 + 1.17549435e-38 {
            d = op_min(keep(keep(sqrt(square)) - row.w), d);
        }
    }
    return d;
}

// (x + i y)^n by squaring, n at least 1.
fn complex_power(re: f32, im: f32, power: u32) -> vec2<f32> {
    var x = re;
    var y = im;
    var n = power;
    while (n & 1u) == 0u && n > 0u {
        let t = keep(keep(x * x) - keep(y * y));
        y = keep(keep(x + x) * y);
        x = t;
        n >>= 1u;
    }
    var a = x;
    var b = y;
    while n > 1u {
        let t = keep(keep(x * x) - keep(y * y));
        y = keep(keep(x + x) * y);
        x = t;
        n >>= 1u;
        if (n & 1u) == 1u {
            let s = keep(keep(a * x) - keep(b * y));
            b = keep(keep(a * y) + keep(b * x));
            a = s;
        }
    }
    return vec2<f32>(a, b);
}

fn real_power(v: f32, n: u32) -> f32 {
    var r = v;
    for (var i = 1u; i < n; i++) {
        r = keep(r * v);
    }
    return r;
}

// Distance estimate of the Mandelbulb; table: power, iterations, start of the outer field. The pole is y.
fn op_mandelbulb(px: f32, py: f32, pz: f32, c: vec4<f32>) -> f32 {
    let n = u32(c.x);
    let iterations = u32(c.y);
    var x = pz;
    var y = px;
    var z = py;
    let first = op_length3(x, y, z);
    if !(first < 2.0) {
        return keep(first - c.z);
    }
    var dr = 1.0;
    var r = first;
    for (var i = 0u; i < iterations && r < 2.0; i++) {
        let rho = op_length2(x, y);
        let safe = select(1.0, rho, 0.0 < rho);
        let ca = select(1.0, keep(x / safe), 0.0 < rho);
        let sa = keep(y / safe);
        // (z + i rho)^n carries r^n and n times the polar angle; the azimuth is kept of unit length.
        let p = complex_power(z, rho, n);
        let a = complex_power(ca, sa, n);
        dr = keep(keep(keep(real_power(r, n - 1u) * f32(n)) * dr) + 1.0);
        x = keep(keep(p.y * a.x) + pz);
        y = keep(keep(p.y * a.y) + px);
        z = keep(p.x + py);
        r = op_length3(x, y, z);
    }
    let inside = op_max(r, 1e-30);
    return keep(keep(keep(0.5 * m_ln(inside)) * r) / dr);
}
