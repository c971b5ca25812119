// 002 Algorithm 3; a ratio of 0/0 (the first one) counts as 0.
// Twin: the Retry of crates/sdfrs-trace/src/tracer/enhanced.rs.

fn retry_length(r: f32, before: f32, d: f32) -> f32 {
    let top = keep(keep(d - before) + r);
    let bottom = keep(keep(d + before) - r);
    var ratio = 0.0;
    if !(top == 0.0 && bottom == 0.0) {
        ratio = keep(top / bottom);
    }
    return keep(r + keep(keep(u.factor * r) * ratio));
}
