// Between two operations in plain mode: compilers may regroup and contract them.
fn keep(v: f32) -> f32 {
    return v;
}
