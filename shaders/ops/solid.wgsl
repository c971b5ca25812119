// Whole primitives: operands x, y, z, constants from `k` on in the order of op.rs. Formulas after iq.

fn at(x: f32, y: f32, z: f32, k: u32) -> vec3<f32> {
    return vec3<f32>(keep(x - consts[k]), keep(y - consts[k + 1u]), keep(z - consts[k + 2u]));
}

fn op_sphere(x: f32, y: f32, z: f32, k: u32) -> f32 {
    let p = at(x, y, z, k);
    return keep(op_length3(p.x, p.y, p.z) - consts[k + 3u]);
}

fn op_box(x: f32, y: f32, z: f32, k: u32) -> f32 {
    let p = at(x, y, z, k);
    let r = consts[k + 6u];
    let qx = keep(abs(p.x) - keep(consts[k + 3u] - r));
    let qy = keep(abs(p.y) - keep(consts[k + 4u] - r));
    let qz = keep(abs(p.z) - keep(consts[k + 5u] - r));
    let outside = op_length3(op_max(qx, 0.0), op_max(qy, 0.0), op_max(qz, 0.0));
    return keep(keep(outside + op_min(op_max(qx, op_max(qy, qz)), 0.0)) - r);
}

fn op_torus(x: f32, y: f32, z: f32, k: u32) -> f32 {
    let p = at(x, y, z, k);
    return keep(op_length2(keep(op_length2(p.x, p.z) - consts[k + 3u]), p.y) - consts[k + 4u]);
}

fn op_cylinder(x: f32, y: f32, z: f32, k: u32) -> f32 {
    let p = at(x, y, z, k);
    let dx = keep(op_length2(p.x, p.z) - consts[k + 3u]);
    let dy = keep(abs(p.y) - consts[k + 4u]);
    return keep(op_min(op_max(dx, dy), 0.0) + op_length2(op_max(dx, 0.0), op_max(dy, 0.0)));
}

// Constants: one end, the other end relative to it, 1 / |other|^2, radius.
fn op_capsule(x: f32, y: f32, z: f32, k: u32) -> f32 {
    let p = at(x, y, z, k);
    let bx = consts[k + 3u];
    let by = consts[k + 4u];
    let bz = consts[k + 5u];
    let along = keep(keep(keep(keep(p.x * bx) + keep(p.y * by)) + keep(p.z * bz)) * consts[k + 6u]);
    let h = clamped(along, 0.0, 1.0);
    let away = op_length3(keep(p.x - keep(bx * h)), keep(p.y - keep(by * h)), keep(p.z - keep(bz * h)));
    return keep(away - consts[k + 7u]);
}

// Constants: centre, half height, radius at the bottom and at the top, 1 / |(r1 - r0, height)|^2.
fn op_cone(x: f32, y: f32, z: f32, k: u32) -> f32 {
    let p = at(x, y, z, k);
    let half = consts[k + 3u];
    let r0 = consts[k + 4u];
    let r1 = consts[k + 5u];
    let q = op_length2(p.x, p.z);
    let cap = keep(q - op_min(q, select(r1, r0, p.y < 0.0)));
    let over = keep(abs(p.y) - half);
    let kx = keep(r1 - r0);
    let ky = keep(half + half);
    let along = keep(keep(keep(keep(r1 - q) * kx) + keep(keep(half - p.y) * ky)) * consts[k + 6u]);
    let s = clamped(along, 0.0, 1.0);
    let bx = keep(keep(q - r1) + keep(kx * s));
    let by = keep(keep(p.y - half) + keep(ky * s));
    let d = op_min(op_length2(cap, over), op_length2(bx, by));
    return select(d, -d, bx < 0.0 && over < 0.0);
}

fn op_ellipsoid(x: f32, y: f32, z: f32, k: u32) -> f32 {
    let p = at(x, y, z, k);
    let e = vec3<f32>(keep(p.x / consts[k + 3u]), keep(p.y / consts[k + 4u]), keep(p.z / consts[k + 5u]));
    return keep(keep(op_length3(e.x, e.y, e.z) - 1.0) * consts[k + 6u]);
}

fn gyroid(x: f32, y: f32, z: f32) -> f32 {
    let xy = keep(m_sin(x) * m_cos(y));
    let yz = keep(m_sin(y) * m_cos(z));
    let zx = keep(m_sin(z) * m_cos(x));
    return keep(keep(xy + yz) + zx);
}

fn op_gyroid(x: f32, y: f32, z: f32, k: u32) -> f32 {
    let freq = consts[k];
    let g = gyroid(keep(x * freq), keep(y * freq), keep(z * freq));
    return keep(keep(abs(g) * consts[k + 1u]) - consts[k + 2u]);
}
