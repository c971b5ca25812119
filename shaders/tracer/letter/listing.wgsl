// What the printed listings share: they sample the start of the range first, and a hit there is one at the start.
// Twin: crates/sdfrs-trace/src/tracer/walk.rs, whose Tally the listings call.

fn walk_first(st: ptr<function, State>, range: Range) -> f32 {
    return range.t_min;
}

// A hit at the sample, the first one or a later one.
fn arrive(begun: bool, tally: ptr<function, Tally>, s: Sample, range: Range) -> Next {
    if begun {
        return hit(tally, s, range);
    }
    return hit_at_start(tally, s, range);
}
