// The first root of a cell's interpolant along a line: the exact surface of a texture.
// Twin: crates/sdfrs-core/src/grid/voxel.rs, which has the reasons. Where that computes with NaN (turns of a
// cubic that has none) this has a number outside of the cell: compilers may assume that there is no NaN.

// Newton's steps in a bracket.
const NEWTON: u32 = 60u;
// No turn of the cubic: outside of the cell, which is 0 to 1.
const NOWHERE: f32 = 2.0;
// No root.
const NONE: f32 = -1.0;

// c.x + c.y s + c.z s^2 + c.w s^3
fn cubic_at(c: vec4<f32>, s: f32) -> f32 {
    return keep(c.x + keep(s * keep(c.y + keep(s * keep(c.z + keep(s * c.w))))));
}

fn cubic_slope(c: vec4<f32>, s: f32) -> f32 {
    let w = keep(keep(c.w + c.w) + c.w);
    return keep(c.y + keep(s * keep(keep(c.z + c.z) + keep(s * w))));
}

// Along x: linear in s.
fn linear(p: f32, q: f32, a: f32, b: f32) -> vec2<f32> {
    let d = keep(q - p);
    return vec2<f32>(keep(p + keep(a * d)), keep(b * d));
}

// Along y: of degree 2.
fn square(p: vec2<f32>, q: vec2<f32>, a: f32, b: f32) -> vec3<f32> {
    let d = vec2<f32>(keep(q.x - p.x), keep(q.y - p.y));
    let middle = keep(keep(p.y + keep(a * d.y)) + keep(b * d.x));
    return vec3<f32>(keep(p.x + keep(a * d.x)), middle, keep(b * d.y));
}

// The interpolant along a + s b, both in cell units.
fn cubic(c: Corners, a: vec3<f32>, b: vec3<f32>) -> vec4<f32> {
    let p = square(linear(c.low.x, c.low.y, a.x, b.x), linear(c.low.z, c.low.w, a.x, b.x), a.y, b.y);
    let q = square(linear(c.high.x, c.high.y, a.x, b.x), linear(c.high.z, c.high.w, a.x, b.x), a.y, b.y);
    let d = vec3<f32>(keep(q.x - p.x), keep(q.y - p.y), keep(q.z - p.z));
    return vec4<f32>(
        keep(p.x + keep(a.z * d.x)),
        keep(keep(p.y + keep(a.z * d.y)) + keep(b.z * d.x)),
        keep(keep(p.z + keep(a.z * d.z)) + keep(b.z * d.y)),
        keep(b.z * d.z),
    );
}

// Where the cubic turns, in order.
fn turns(cubic: vec4<f32>) -> vec2<f32> {
    let c = cubic.y;
    let b = cubic.z;
    let a = keep(keep(cubic.w + cubic.w) + cubic.w);
    let inside = keep(keep(b * b) - keep(a * c));
    if !(inside >= 0.0) {
        return vec2<f32>(NOWHERE);
    }
    let root = keep(sqrt(inside));
    let q = select(-keep(b + root), keep(root - b), b < 0.0);
    let s = select(NOWHERE, keep(q / a), a != 0.0);
    let t = select(NOWHERE, keep(c / q), q != 0.0);
    return select(vec2<f32>(t, s), vec2<f32>(s, t), s < t);
}

// The root in a piece that falls from above 0 to 0 or below.
fn root_in(cubic: vec4<f32>, first: f32, last: f32) -> f32 {
    var lo = first;
    var hi = last;
    var s = keep(keep(lo + hi) * 0.5);
    for (var i = 0u; i < NEWTON; i++) {
        let v = cubic_at(cubic, s);
        if v > 0.0 {
            lo = s;
        } else {
            hi = s;
        }
        let slope = cubic_slope(cubic, s);
        let newton = keep(s - keep(v / slope));
        var next = keep(keep(lo + hi) * 0.5);
        if slope != 0.0 && newton >= lo && newton <= hi {
            next = newton;
        }
        if next == s {
            break;
        }
        s = next;
    }
    return s;
}

// The least s in 0..1 where the interpolant along a + s b is 0 or below.
fn first_root(c: Corners, a: vec3<f32>, b: vec3<f32>) -> f32 {
    if all(c.low > vec4<f32>(0.0)) && all(c.high > vec4<f32>(0.0)) {
        return NONE;
    }
    let along = cubic(c, a, b);
    if !(cubic_at(along, 0.0) > 0.0) {
        return 0.0;
    }
    let ends = turns(along);
    var first = 0.0;
    for (var i = 0u; i < 3u; i++) {
        let to = select(select(1.0, ends.y, i == 1u), ends.x, i == 0u);
        // Turns outside of the cell part nothing.
        if !(to > first && to <= 1.0) {
            continue;
        }
        if !(cubic_at(along, to) > 0.0) {
            return root_in(along, first, to);
        }
        first = to;
    }
    return NONE;
}
