// The loop around every tracer: a dispatch advances its part of the active rays by a bounded number of
// steps. Twin: crates/sdfrs-trace/src/march.rs. Law: steps equal the evaluations the field saw; what
// becomes of a ray depends on nothing but the ray.

// A walk between two passes.
struct Walker {
    // The sample asked for.
    at: f32,
    state: State,
}

@compute @workgroup_size(8, 8)
fn march_begin(
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let n = place_of(thread, group, groups);
    if n >= u.rays {
        return;
    }
    let k = begin_ray(n);
    let ray = ray_of(k);
    let range = Range(ray.t_min, ray.t_max);
    var state = walk_start(range);
    walkers[k].at = walk_first(&state, range);
    walkers[k].state = state;
    tallies[k] = Tally();
}

@compute @workgroup_size(8, 8)
fn march_pass(
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let n = place_of(thread, group, groups);
    if n >= u.count {
        return;
    }
    let k = active_ray(n);
    let ray = ray_of(k);
    let range = Range(ray.t_min, ray.t_max);
    var state = walkers[k].state;
    var tally = tallies[k];
    var next = Next(ASK, walkers[k].at);
    select_stack(k);
    select_patch(k);
    for (var i = 0u; i < u.steps && next.status == ASK; i++) {
        next = leap(&state, next, range, &tally);
        if next.status != ASK {
            break;
        }
        let s = look(ray, next.t);
        tally.steps += 1u;
        next = walk_step(&state, s, range, &tally);
        if next.status == HIT {
            atomicMax(&lists.threshold, bitcast<u32>(s.e));
        }
    }
    if next.status == ASK {
        walkers[k].at = next.t;
        walkers[k].state = state;
        keep_ray(k);
    } else {
        tally.outcome |= next.status;
    }
    tallies[k] = tally;
    tell_points();
}

// The sample at t.
fn look(ray: Ray, t: f32) -> Sample {
    let p = keep3(ray.origin + keep3(t * ray.direction));
    enter(t);
    let r = keep(field(p));
    let scale = max(max(abs(t), abs(p.x)), max(abs(p.y), abs(p.z)));
    let asked = op_max(u.eps, keep(u.cone * t));
    let e = select(asked, op_max(asked, 4.0 * ULP * scale), u.guards != 0u);
    return Sample(t, r, e, asked, scale);
}
