// Enhanced sphere tracing: the step to the ball that would touch this one if the surface were flat.
// 002 and 001 Algorithm 3, 000 Algorithm 3.
// Twin: crates/sdfrs-trace/src/tracer/enhanced.rs. The rule that guarded.wgsl walks by.

fn rule_first(r: f32) -> f32 {
    return r;
}

fn rule_slope(m: f32, seen: f32) -> f32 {
    return seen;
}

fn rule_next(r: f32, m: f32) -> f32 {
    return keep(r * keep(1.0 + keep(keep(u.factor * keep(1.0 + m)) / keep(1.0 - m))));
}
