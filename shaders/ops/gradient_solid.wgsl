// Primitives with their gradients: the slope by their own operands, then the chain rule.

fn d_sphere(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, c: vec4<f32>) -> vec4<f32> {
    let p = at(x.w, y.w, z.w, c);
    return along(x, y, z, p * inverse(op_length3(p.x, p.y, p.z)), op_sphere(x.w, y.w, z.w, c));
}

fn d_box(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, c: vec4<f32>, d: vec4<f32>) -> vec4<f32> {
    let p = at(x.w, y.w, z.w, c);
    let q = abs(p) - (vec3<f32>(c.w, d.x, d.y) - d.z);
    let m = max(q, vec3<f32>(0.0));
    let inner = select(vec3<f32>(0.0), largest(q), op_max(q.x, op_max(q.y, q.z)) < 0.0);
    return along(x, y, z, (m * inverse(length(m)) + inner) * sides(p), op_box(x.w, y.w, z.w, c, d));
}

fn d_torus(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, c: vec4<f32>, d: vec4<f32>) -> vec4<f32> {
    let p = at(x.w, y.w, z.w, c);
    let ring = op_length2(p.x, p.z);
    let q = ring - c.w;
    let i = inverse(op_length2(q, p.y));
    let across = q * i * inverse(ring);
    return along(x, y, z, vec3<f32>(p.x * across, p.y * i, p.z * across), op_torus(x.w, y.w, z.w, c, d));
}

fn d_cylinder(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, c: vec4<f32>, d: vec4<f32>) -> vec4<f32> {
    let p = at(x.w, y.w, z.w, c);
    let ring = op_length2(p.x, p.z);
    let q = vec2<f32>(ring - c.w, abs(p.y) - d.x);
    let m = max(q, vec2<f32>(0.0));
    let nearest = select(vec2<f32>(0.0, 1.0), vec2<f32>(1.0, 0.0), q.y < q.x);
    let slope = m * inverse(length(m)) + select(vec2<f32>(0.0), nearest, op_max(q.x, q.y) < 0.0);
    let across = slope.x * inverse(ring);
    let by_point = vec3<f32>(p.x * across, slope.y * side_of(p.y), p.z * across);
    return along(x, y, z, by_point, op_cylinder(x.w, y.w, z.w, c, d));
}

fn d_capsule(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, c: vec4<f32>, d: vec4<f32>) -> vec4<f32> {
    let p = at(x.w, y.w, z.w, c);
    let b = vec3<f32>(c.w, d.x, d.y);
    let t = dot(p, b) * d.z;
    let e = p - b * clamped(t, 0.0, 1.0);
    let away = e * inverse(length(e));
    let moving = select(0.0, dot(away, b) * d.z, 0.0 < t && t < 1.0);
    return along(x, y, z, away - b * moving, op_capsule(x.w, y.w, z.w, c, d));
}

fn d_cone(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, c: vec4<f32>, d: vec4<f32>) -> vec4<f32> {
    let p = at(x.w, y.w, z.w, c);
    let half = c.w;
    let r1 = d.y;
    let q = op_length2(p.x, p.z);
    let end = select(r1, d.x, p.y < 0.0);
    // Everything below is by (q, y), in the plane through the axis.
    let cap = vec2<f32>(q - op_min(q, end), abs(p.y) - half);
    let cap_q = select(1.0, 0.0, q < end);
    let e = vec2<f32>(r1 - d.x, half + half);
    let t = ((r1 - q) * e.x + (half - p.y) * e.y) * d.z;
    let side = vec2<f32>(q - r1, p.y - half) + e * clamped(t, 0.0, 1.0);
    let moving = select(0.0, dot(side, e) * d.z, 0.0 < t && t < 1.0);
    let a = op_length2(cap.x, cap.y);
    let b = op_length2(side.x, side.y);
    let by_cap = vec2<f32>(cap.x * cap_q, cap.y * side_of(p.y)) * inverse(a);
    let by_side = (side - e * moving) * inverse(b);
    var slope = select(by_side, by_cap, a < b);
    if side.x < 0.0 && cap.y < 0.0 {
        slope = -slope;
    }
    let across = slope.x * inverse(q);
    return along(x, y, z, vec3<f32>(p.x * across, slope.y, p.z * across), op_cone(x.w, y.w, z.w, c, d));
}

fn d_ellipsoid(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, c: vec4<f32>, d: vec4<f32>) -> vec4<f32> {
    let r = vec3<f32>(c.w, d.x, d.y);
    let e = at(x.w, y.w, z.w, c) / r;
    return along(x, y, z, e * inverse(length(e)) / r * d.z, op_ellipsoid(x.w, y.w, z.w, c, d));
}

fn d_gyroid(x: vec4<f32>, y: vec4<f32>, z: vec4<f32>, c: vec4<f32>) -> vec4<f32> {
    let p = vec3<f32>(x.w, y.w, z.w) * c.x;
    let s = vec3<f32>(m_sin(p.x), m_sin(p.y), m_sin(p.z));
    let t = vec3<f32>(m_cos(p.x), m_cos(p.y), m_cos(p.z));
    let g = s.x * t.y + s.y * t.z + s.z * t.x;
    let slope = t.xyz * t.yzx - s.zxy * s.xyz;
    return along(x, y, z, slope * (side_of(g) * c.x * c.y), op_gyroid(x.w, y.w, z.w, c));
}
