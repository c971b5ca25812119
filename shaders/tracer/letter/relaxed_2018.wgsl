// 002 Algorithm 2: d = r + (omega - 1) r. Twin: the Retry of crates/sdfrs-trace/src/tracer/relaxed.rs.

fn retry_length(r: f32, before: f32, d: f32) -> f32 {
    return keep(r + keep(keep(u.factor - 1.0) * r));
}
