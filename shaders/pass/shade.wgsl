// Normals and colours of all pixels of a tile, from what its rays have come to.
// Twin: Shading in crates/sdfrs-trace/src/render.rs.

// As much of a pixel as the host reads back.
struct Shaded {
    normal_x: f32,
    normal_y: f32,
    normal_z: f32,
    // r | g << 8 | b << 16.
    rgb: u32,
}

@group(0) @binding(2) var<storage, read> tallies: array<Tally>;
@group(0) @binding(4) var<storage, read_write> shaded: array<Shaded>;

@compute @workgroup_size(8, 8)
fn shade_pass(
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let k = place_of(thread, group, groups);
    if k >= u.count {
        return;
    }
    let i = u.first + k;
    let status = tallies[i].outcome & 0xffu;
    // A ray out of steps shows the surface it was closing in on.
    if status == HIT || status == OUT_OF_STEPS {
        let ray = ray_of(i);
        select_patch(i);
        program_at(tallies[i].t);
        let p = keep3(ray.origin + keep3(tallies[i].t * ray.direction));
        let n = unit_normal(field_gradient(p).xyz, ray.direction);
        shaded[i] = Shaded(n.x, n.y, n.z, lit(p, n));
    } else {
        shaded[i] = Shaded(0.0, 0.0, 0.0, select(u.background, INVALID_RGB, status == INVALID));
    }
}
