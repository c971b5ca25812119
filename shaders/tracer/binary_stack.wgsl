// Binary search with the back halves on a stack: the first listing of 003. cut_back and cut_front,
// where a segment is cut, stand in binary_halves.wgsl and, for Klenert's change as printed, in
// letter/binary_split.wgsl. Twin: Stack in crates/sdfrs-trace/src/tracer/binary_search.rs.

struct State {
    x: f32,
    y: f32,
    count: u32,
}

fn walk_start(range: Range) -> State {
    return State(range.t_min, range.t_max, 0u);
}

fn walk_first(st: ptr<function, State>, range: Range) -> f32 {
    return keep(0.5 * keep((*st).y + (*st).x));
}

fn walk_step(st: ptr<function, State>, s: Sample, range: Range, tally: ptr<function, Tally>) -> Next {
    if is_invalid(s.r) {
        return done(INVALID);
    }
    let half = keep(0.5 * keep((*st).y - (*st).x));
    stand(tally, s.t, s.r);
    if overlaps(s, half) {
        if half < s.e {
            return found(s, half, range, tally);
        }
        if (*st).count == u.depth {
            return done(OUT_OF_STEPS);
        }
        stack_put((*st).count, vec2<f32>(cut_back(s), (*st).y));
        (*st).count += 1u;
        (*st).y = cut_front(s);
    } else {
        if (*st).count == 0u {
            return done(MISS);
        }
        (*st).count -= 1u;
        let span = stack_get((*st).count);
        (*st).x = span.x;
        (*st).y = span.y;
    }
    return ask(keep(0.5 * keep((*st).y + (*st).x)), tally);
}
