// Basic sphere tracing: the step is the radius. Hart 1996; 000 Algorithm 1, 002 Algorithm 1.
// Twin: crates/sdfrs-trace/src/tracer/basic.rs. The rule that guarded.wgsl walks by.

fn rule_first(r: f32) -> f32 {
    return r;
}

fn rule_slope(m: f32, seen: f32) -> f32 {
    return m;
}

fn rule_next(r: f32, m: f32) -> f32 {
    return r;
}
