// Between two operations in strict mode: the second is computed from the first as rounded.
fn keep(v: f32) -> f32 {
    return hold(v);
}
