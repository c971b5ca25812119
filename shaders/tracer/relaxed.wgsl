// Relaxed sphere tracing: steps of omega radii, taken back where the balls come apart. Keinert 2014;
// 000 Algorithm 2, 002 Algorithm 2 (which writes omega - 1).
// Twin: crates/sdfrs-trace/src/tracer/relaxed.rs. The rule that guarded.wgsl walks by.

fn rule_first(r: f32) -> f32 {
    return keep(u.factor * r);
}

fn rule_slope(m: f32, seen: f32) -> f32 {
    return m;
}

fn rule_next(r: f32, m: f32) -> f32 {
    return keep(u.factor * r);
}
