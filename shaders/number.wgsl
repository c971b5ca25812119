// Vectors of what the ops have for one number: see ops/strict.wgsl.

fn keep3(v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(keep(v.x), keep(v.y), keep(v.z));
}
