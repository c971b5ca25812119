// Values, or values and gradients, of a batch of points: three numbers a point in, one or four out.
struct Batch {
    // 0 at run time, unknown to compilers; see `hold`.
    zero: u32,
    count: u32,
}

@group(0) @binding(0) var<uniform> u: Batch;
@group(0) @binding(1) var<storage, read> points: array<f32>;
@group(0) @binding(2) var<storage, read_write> values: array<f32>;

fn point(i: u32) -> vec3<f32> {
    return vec3<f32>(points[3u * i], points[3u * i + 1u], points[3u * i + 2u]);
}

@compute @workgroup_size(64)
fn evaluate(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < u.count {
        values[id.x] = field(point(id.x));
    }
}

@compute @workgroup_size(64)
fn evaluate_gradient(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < u.count {
        let g = field_gradient(point(id.x));
        values[4u * id.x] = g.x;
        values[4u * id.x + 1u] = g.y;
        values[4u * id.x + 2u] = g.z;
        values[4u * id.x + 3u] = g.w;
    }
}
