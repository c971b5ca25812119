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

@compute @workgroup_size(8, 8)
fn evaluate(@builtin(local_invocation_index) thread: u32, @builtin(workgroup_id) group: vec3<u32>) {
    let i = group.x * 64u + thread;
    if i < u.count {
        values[i] = field(point(i));
    }
}

@compute @workgroup_size(8, 8)
fn evaluate_gradient(@builtin(local_invocation_index) thread: u32, @builtin(workgroup_id) group: vec3<u32>) {
    let i = group.x * 64u + thread;
    if i < u.count {
        let g = field_gradient(point(i));
        values[4u * i] = g.x;
        values[4u * i + 1u] = g.y;
        values[4u * i + 2u] = g.z;
        values[4u * i + 3u] = g.w;
    }
}
