// Auto-relaxed sphere tracing: the step to the touching ball of a plane whose slope is an exponential
// average of the slopes seen. 000 Algorithm 4.
// Twin: crates/sdfrs-trace/src/tracer/auto_relaxed.rs. The rule that guarded.wgsl walks by.

fn rule_first(r: f32) -> f32 {
    return r;
}

fn rule_slope(m: f32, seen: f32) -> f32 {
    return keep(m + keep(u.factor * keep(seen - m)));
}

fn rule_next(r: f32, m: f32) -> f32 {
    return keep(r * op_max(1.0, 2.0 / keep(1.0 - m)));
}
