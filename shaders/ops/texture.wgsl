// A grid of samples: the interpolant, its safe step, its continuation outside. Twin of grid.rs, by eight loads:
// samplers weigh by 8 bits only. A grid is a header of 16 words at `g`, then its values.

struct Cell { base: u32, f: vec3<f32>, outside: vec3<f32>, within: vec3<bool> }

fn header(i: u32) -> f32 { return bitcast<f32>(grids[i]); }

fn locate_axis(p: f32, g: u32, a: u32) -> vec2<f32> {
    let lo = header(g + 4u + a);
    let hi = header(g + 7u + a);
    let q = select(select(p, hi, p > hi), lo, p < lo);
    return vec2<f32>(keep(keep(q - lo) / header(g + 10u + a)), keep(p - q));
}

fn locate(x: f32, y: f32, z: f32, g: u32) -> Cell {
    let ax = locate_axis(x, g, 0u);
    let ay = locate_axis(y, g, 1u);
    let az = locate_axis(z, g, 2u);
    let nx = grids[g];
    let ny = grids[g + 1u];
    // A NaN becomes some cell here and stays NaN in the weights.
    let i = min(u32(floor(ax.x)), nx - 2u);
    let j = min(u32(floor(ay.x)), ny - 2u);
    let k = min(u32(floor(az.x)), grids[g + 2u] - 2u);
    let f = vec3<f32>(keep(ax.x - f32(i)), keep(ay.x - f32(j)), keep(az.x - f32(k)));
    let outside = vec3<f32>(ax.y, ay.y, az.y);
    return Cell(i + nx * (j + ny * k), f, outside, outside == vec3<f32>(0.0));
}

fn mix_(a: f32, b: f32, f: f32) -> f32 { return keep(a + keep(f * keep(b - a))); }

// The half float in the low 16 bits; by integers, since small ones would pass through denormals.
fn half_float(bits: u32) -> f32 {
    let tiny = f32(bits & 0x3ffu) * 5.9604644775390625e-8;
    let normal = bitcast<f32>(((bits & 0x7fffu) << 13u) + 0x38000000u);
    let v = select(normal, tiny, (bits & 0x7c00u) == 0u);
    return bitcast<f32>(bitcast<u32>(v) | ((bits & 0x8000u) << 16u));
}

// Words of a header: 0 nodes along x, y, z; 3 first word of the values; 4 lo; 7 hi; 10 spacing; 13 divisor and
// subtrahend of the safe step; 15 whether two half floats share a word.
fn node(g: u32, i: u32) -> f32 {
    let first = grids[g + 3u];
    if grids[g + 15u] == 1u {
        return half_float(grids[first + (i >> 1u)] >> (16u * (i & 1u)));
    }
    return bitcast<f32>(grids[first + i]);
}

struct Corners { low: vec4<f32>, high: vec4<f32> }

fn corners(g: u32, base: u32) -> Corners {
    let sy = grids[g];
    let sz = sy * grids[g + 1u];
    let low = vec4<f32>(node(g, base), node(g, base + 1u), node(g, base + sy), node(g, base + sy + 1u));
    let up = base + sz;
    return Corners(low, vec4<f32>(node(g, up), node(g, up + 1u), node(g, up + sy), node(g, up + sy + 1u)));
}

// What to make of an interpolated value: 0 itself, 1 a safe step to the surface, 2 the same for the complement.
fn stepped(g: u32, v: f32, step: u32) -> f32 {
    let a = header(g + 13u);
    let b = header(g + 14u);
    if step == 1u {
        return op_max(keep(v / a), keep(v - b));
    }
    if step == 2u {
        return op_min(keep(v / a), keep(v + b));
    }
    return v;
}

fn surround(v: f32, outside: vec3<f32>) -> f32 {
    let d = op_length3(outside.x, outside.y, outside.z);
    return select(v, op_max(d, keep(v - d)), d > 0.0);
}

fn sample(x: f32, y: f32, z: f32, g: u32, step: u32) -> f32 {
    let cell = locate(x, y, z, g);
    let c = corners(g, cell.base);
    let x0 = mix_(c.low.x, c.low.y, cell.f.x);
    let x1 = mix_(c.low.z, c.low.w, cell.f.x);
    let x2 = mix_(c.high.x, c.high.y, cell.f.x);
    let x3 = mix_(c.high.z, c.high.w, cell.f.x);
    let v = mix_(mix_(x0, x1, cell.f.y), mix_(x2, x3, cell.f.y), cell.f.z);
    return surround(stepped(g, v, step), cell.outside);
}

fn op_texture(x: f32, y: f32, z: f32, g: u32) -> f32 { return sample(x, y, z, g, 0u); }
fn op_texture_safe(x: f32, y: f32, z: f32, g: u32) -> f32 { return sample(x, y, z, g, 1u); }
fn op_texture_safe_negated(x: f32, y: f32, z: f32, g: u32) -> f32 { return sample(x, y, z, g, 2u); }
