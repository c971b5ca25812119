// Grids of samples: the interpolant, its safe steps, its continuation outside. Twin of grid/, by eight loads:
// samplers weigh by 8 bits only. A grid has 8 rows of constants from `k` on:
//   0 nodes along x, y, z; kind    4 gap, edge of a brick
//   1 lo; rule                     5 where its nodes, its table of bricks and its slopes start in `grids`:
//   2 hi, divisor a                6   numbers of 16 bits, low before high
//   3 spacing, divisor s           7 slack of a position in a brick, in cells
// Compiled scenes name kind and rule as numbers, so that compilers see one case. `kind`: 0 dense f32, 1 dense f16; bricks of 2 f32, 3 f16, 4 bytes. `rule`: 0 one for the grid, 1 by bricks.

struct Place { cell: vec3<u32>, f: vec3<f32>, outside: vec3<f32> }
struct Corners { low: vec4<f32>, high: vec4<f32> }

fn word(low: f32, high: f32) -> u32 { return u32(low) + (u32(high) << 16u); }

// Cell, position in it, distance outside.
fn locate_axis(p: f32, lo: f32, hi: f32, h: f32, nodes: f32) -> vec3<f32> {
    let q = select(select(p, hi, hi < p), lo, p < lo);
    let v = keep(keep(q - lo) / h);
    // A NaN becomes some cell and stays NaN in the weights.
    let n = op_max(op_min(floor(v), nodes - 2.0), 0.0);
    return vec3<f32>(n, keep(v - n), keep(p - q));
}

fn locate(x: f32, y: f32, z: f32, k: u32) -> Place {
    let nodes = consts[k];
    let lo = consts[k + 1u];
    let hi = consts[k + 2u];
    let h = consts[k + 3u];
    let a = locate_axis(x, lo.x, hi.x, h.x, nodes.x);
    let b = locate_axis(y, lo.y, hi.y, h.y, nodes.y);
    let c = locate_axis(z, lo.z, hi.z, h.z, nodes.z);
    return Place(vec3<u32>(u32(a.x), u32(b.x), u32(c.x)), vec3<f32>(a.y, b.y, c.y), vec3<f32>(a.z, b.z, c.z));
}

// The half float in the low 16 bits; by integers, since small ones would pass through denormals.
fn half_float(bits: u32) -> f32 {
    let tiny = f32(bits & 0x3ffu) * 5.9604644775390625e-8;
    let normal = bitcast<f32>(((bits & 0x7fffu) << 13u) + 0x38000000u);
    let v = select(normal, tiny, (bits & 0x7c00u) == 0u);
    return bitcast<f32>(bitcast<u32>(v) | ((bits & 0x8000u) << 16u));
}

// A node; of bytes the number of steps.
fn node(first: u32, i: u32, kind: u32) -> f32 {
    if kind == 1u || kind == 3u {
        return half_float(grids[first + (i >> 1u)] >> (16u * (i & 1u)));
    }
    if kind == 4u {
        return f32((grids[first + (i >> 2u)] >> (8u * (i & 3u))) & 255u) - 128.0;
    }
    return bitcast<f32>(grids[first + i]);
}

fn eight(first: u32, base: u32, sy: u32, sz: u32, kind: u32) -> Corners {
    let up = base + sz;
    return Corners(
        vec4<f32>(node(first, base, kind), node(first, base + 1u, kind), node(first, base + sy, kind), node(first, base + sy + 1u, kind)),
        vec4<f32>(node(first, up, kind), node(first, up + 1u, kind), node(first, up + sy, kind), node(first, up + sy + 1u, kind)),
    );
}

// Bricks along each axis; a brick has 8 cells a side and 9 nodes.
fn bricks_along(k: u32) -> vec3<u32> { return (vec3<u32>(consts[k].xyz) + 6u) / 8u; }

fn brick_of(cell: vec3<u32>, count: vec3<u32>) -> u32 {
    let b = cell / 8u;
    return b.x + count.x * (b.y + count.y * b.z);
}

fn corners(cell: vec3<u32>, k: u32, kind: u32) -> Corners {
    let first = word(consts[k + 5u].x, consts[k + 5u].y);
    if kind < 2u {
        let n = vec3<u32>(consts[k].xyz);
        return eight(first, cell.x + n.x * (cell.y + n.y * cell.z), n.x, n.x * n.y, kind);
    }
    let count = bricks_along(k);
    let total = count.x * count.y * count.z;
    let table = word(consts[k + 5u].z, consts[k + 5u].w) + brick_of(cell, count);
    let slot = grids[table];
    if slot == 0xffffffffu {
        let far = vec4<f32>(bitcast<f32>(grids[table + total]));
        return Corners(far, far);
    }
    let p = cell % vec3<u32>(8u);
    var c = eight(first, slot * 729u + p.x + 9u * (p.y + 9u * p.z), 9u, 81u, kind);
    if kind == 4u {
        let scale = bitcast<f32>(grids[word(consts[k + 6u].x, consts[k + 6u].y) + slot]);
        c.low = vec4<f32>(keep(c.low.x * scale), keep(c.low.y * scale), keep(c.low.z * scale), keep(c.low.w * scale));
        c.high = vec4<f32>(keep(c.high.x * scale), keep(c.high.y * scale), keep(c.high.z * scale), keep(c.high.w * scale));
    }
    return c;
}

fn mix_(a: f32, b: f32, f: f32) -> f32 { return keep(a + keep(f * keep(b - a))); }
fn mix4(a: vec4<f32>, b: vec4<f32>, f: f32) -> vec4<f32> {
    return vec4<f32>(mix_(a.x, b.x, f), mix_(a.y, b.y, f), mix_(a.z, b.z, f), mix_(a.w, b.w, f));
}

// The lower bounds of grid/slope.rs: one for the grid.
fn safe(v: f32, k: u32) -> f32 {
    return op_max(keep(v / consts[k + 2u].w), keep(keep(v / consts[k + 3u].w) - consts[k + 4u].x));
}

// The reach of a value in a brick of slope `b` whose walls are `e` away.
fn reach(m: f32, b: f32, e: f32, a: f32) -> f32 {
    return op_min(keep(m / b), keep(keep(m / a) + keep(e * keep(1.0 - keep(b / a)))));
}

fn by_bricks(v: f32, place: Place, k: u32) -> f32 {
    let slopes = word(consts[k + 6u].z, consts[k + 6u].w);
    let count = bricks_along(k);
    let brick = brick_of(place.cell, count);
    let own = bitcast<f32>(grids[slopes + brick]);
    let near = bitcast<f32>(grids[slopes + count.x * count.y * count.z + brick]);
    let h = consts[k + 3u];
    let slack = consts[k + 7u];
    let p = vec3<f32>(place.cell % vec3<u32>(8u));
    let x = keep(p.x + place.f.x);
    let y = keep(p.y + place.f.y);
    let z = keep(p.z + place.f.z);
    let wx = keep(keep(op_min(x, keep(8.0 - x)) - slack.x) * h.x);
    let wy = keep(keep(op_min(y, keep(8.0 - y)) - slack.y) * h.y);
    let wz = keep(keep(op_min(z, keep(8.0 - z)) - slack.z) * h.z);
    let wall = op_max(op_min(op_min(wx, wy), wz), 0.0);
    let far = keep(keep(wall + consts[k + 4u].y) * 0.99999988);
    let m = abs(v);
    let a = consts[k + 2u].w;
    let best = keep(op_max(reach(m, own, wall, a), reach(m, near, far, a)) * 0.99999905);
    let step = op_max(safe(m, k), best);
    return select(step, -step, v < 0.0);
}

// What to make of an interpolated value; `step`: 0 itself, 1 a safe step to the surface, 2 for the complement.
fn stepped(v: f32, place: Place, k: u32, rule: u32, step: u32) -> f32 {
    if step == 0u {
        return v;
    }
    if rule == 1u {
        return by_bricks(v, place, k);
    }
    return select(-safe(-v, k), safe(v, k), step == 1u);
}

fn surround(v: f32, outside: vec3<f32>) -> f32 {
    let d = op_length3(outside.x, outside.y, outside.z);
    return select(v, op_max(d, keep(v - d)), 0.0 < d);
}

fn sample(x: f32, y: f32, z: f32, k: u32, kind: u32, rule: u32, step: u32) -> f32 {
    let place = locate(x, y, z, k);
    let c = corners(place.cell, k, kind);
    let f = place.f;
    let ends = mix4(vec4<f32>(c.low.xz, c.high.xz), vec4<f32>(c.low.yw, c.high.yw), f.x);
    let v = mix_(mix_(ends.x, ends.y, f.y), mix_(ends.z, ends.w, f.y), f.z);
    return surround(stepped(v, place, k, rule, step), place.outside);
}

fn op_texture(x: f32, y: f32, z: f32, k: u32, kind: u32, rule: u32) -> f32 {
    return sample(x, y, z, k, kind, rule, 0u);
}
fn op_texture_safe(x: f32, y: f32, z: f32, k: u32, kind: u32, rule: u32) -> f32 {
    return sample(x, y, z, k, kind, rule, 1u);
}
fn op_texture_safe_negated(x: f32, y: f32, z: f32, k: u32, kind: u32, rule: u32) -> f32 {
    return sample(x, y, z, k, kind, rule, 2u);
}
