//! The closest point of a triangle, in f64 (Ericson, Real-Time Collision Detection, 5.1.5): decides between faces
//! that f32 cannot tell apart, where a sign hangs on it.

type P = [f64; 3];

fn sub(a: P, b: P) -> P {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub fn dot(a: P, b: P) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a + s u + t v
fn along(a: P, s: f64, u: P, t: f64, v: P) -> P {
    std::array::from_fn(|k| a[k] + s * u[k] + t * v[k])
}

pub fn closest_point([a, b, c]: [P; 3], p: P) -> P {
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = sub(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return along(a, d1 / (d1 - d3), ab, 0.0, ac);
    }
    let cp = sub(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return along(a, 0.0, ab, d2 / (d2 - d6), ac);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return along(b, (d4 - d3) / ((d4 - d3) + (d5 - d6)), sub(c, b), 0.0, ac);
    }
    let sum = va + vb + vc;
    along(a, vb / sum, ab, vc / sum, ac)
}

pub fn distance2(corners: [P; 3], p: P) -> (f64, P) {
    let q = closest_point(corners, p);
    let d = sub(p, q);
    (dot(d, d), q)
}
