// Whole primitives: operands x, y, z, constants four by four in the order of op.rs. Formulas after iq.

fn at(x: f32, y: f32, z: f32, centre: vec4<f32>) -> vec3<f32> {
    return vec3<f32>(keep(x - centre.x), keep(y - centre.y), keep(z - centre.z));
}

fn op_sphere(x: f32, y: f32, z: f32, c: vec4<f32>) -> f32 {
    let p = at(x, y, z, c);
    return keep(op_length3(p.x, p.y, p.z) - c.w);
}

fn op_box(x: f32, y: f32, z: f32, c: vec4<f32>, d: vec4<f32>) -> f32 {
    let p = at(x, y, z, c);
    let r = d.z;
    let qx = keep(abs(p.x) - keep(c.w - r));
    let qy = keep(abs(p.y) - keep(d.x - r));
    let qz = keep(abs(p.z) - keep(d.y - r));
    let outside = op_length3(op_max(qx, 0.0), op_max(qy, 0.0), op_max(qz, 0.0));
    return keep(keep(outside + op_min(op_max(qx, op_max(qy, qz)), 0.0)) - r);
}

fn op_torus(x: f32, y: f32, z: f32, c: vec4<f32>, d: vec4<f32>) -> f32 {
    let p = at(x, y, z, c);
    return keep(op_length2(keep(op_length2(p.x, p.z) - c.w), p.y) - d.x);
}

fn op_cylinder(x: f32, y: f32, z: f32, c: vec4<f32>, d: vec4<f32>) -> f32 {
    let p = at(x, y, z, c);
    let dx = keep(op_length2(p.x, p.z) - c.w);
    let dy = keep(abs(p.y) - d.x);
    return keep(op_min(op_max(dx, dy), 0.0) + op_length2(op_max(dx, 0.0), op_max(dy, 0.0)));
}

// Constants: one end, the other end relative to it, 1 / |other|^2, radius.
fn op_capsule(x: f32, y: f32, z: f32, c: vec4<f32>, d: vec4<f32>) -> f32 {
    let p = at(x, y, z, c);
    let bx = c.w;
    let by = d.x;
    let bz = d.y;
    let along = keep(keep(keep(keep(p.x * bx) + keep(p.y * by)) + keep(p.z * bz)) * d.z);
    let h = clamped(along, 0.0, 1.0);
    let away = op_length3(keep(p.x - keep(bx * h)), keep(p.y - keep(by * h)), keep(p.z - keep(bz * h)));
    return keep(away - d.w);
}

// Constants: centre, half height, radius at the bottom and at the top, 1 / |(r1 - r0, height)|^2.
fn op_cone(x: f32, y: f32, z: f32, c: vec4<f32>, d: vec4<f32>) -> f32 {
    let p = at(x, y, z, c);
    let half = c.w;
    let r0 = d.x;
    let r1 = d.y;
    let q = op_length2(p.x, p.z);
    let cap = keep(q - op_min(q, select(r1, r0, p.y < 0.0)));
    let over = keep(abs(p.y) - half);
    let kx = keep(r1 - r0);
    let ky = keep(half + half);
    let along = keep(keep(keep(keep(r1 - q) * kx) + keep(keep(half - p.y) * ky)) * d.z);
    let s = clamped(along, 0.0, 1.0);
    let bx = keep(keep(q - r1) + keep(kx * s));
    let by = keep(keep(p.y - half) + keep(ky * s));
    let away = op_min(op_length2(cap, over), op_length2(bx, by));
    return select(away, -away, bx < 0.0 && over < 0.0);
}

fn op_ellipsoid(x: f32, y: f32, z: f32, c: vec4<f32>, d: vec4<f32>) -> f32 {
    let p = at(x, y, z, c);
    let e = vec3<f32>(keep(p.x / c.w), keep(p.y / d.x), keep(p.z / d.y));
    return keep(keep(op_length3(e.x, e.y, e.z) - 1.0) * d.z);
}

fn gyroid(x: f32, y: f32, z: f32) -> f32 {
    let xy = keep(m_sin(x) * m_cos(y));
    let yz = keep(m_sin(y) * m_cos(z));
    let zx = keep(m_sin(z) * m_cos(x));
    return keep(keep(xy + yz) + zx);
}

fn op_gyroid(x: f32, y: f32, z: f32, c: vec4<f32>) -> f32 {
    let freq = c.x;
    let g = gyroid(keep(x * freq), keep(y * freq), keep(z * freq));
    return keep(keep(abs(g) * c.y) - c.z);
}
