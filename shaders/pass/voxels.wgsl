// The loop around the walk from voxel to voxel, as pass/march.wgsl is around the tracers; a step is a cell.
// Twin: trace in crates/sdfrs-trace/src/voxel.rs.

@compute @workgroup_size(8, 8)
fn voxels_begin(
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let n = place_of(thread, group, groups);
    if n >= u.rays {
        return;
    }
    let k = begin_ray(n);
    tallies[k] = Tally();
}

@compute @workgroup_size(8, 8)
fn voxels_pass(
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let n = place_of(thread, group, groups);
    if n >= u.count {
        return;
    }
    let k = active_ray(n);
    let line = line_of(k);
    var walker = walkers[k];
    var tally = tallies[k];
    var status = ASK;
    for (var i = 0u; i < u.steps && status == ASK; i++) {
        status = visit(&walker, line, &tally);
    }
    if status == ASK {
        walkers[k] = walker;
        keep_ray(k);
    } else {
        tally.outcome |= status;
    }
    tallies[k] = tally;
}
