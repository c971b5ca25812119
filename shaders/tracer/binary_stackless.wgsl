// Binary search by addresses (level : segment), the last listing of 003 with seg >>= 1 for its misprint.
// Twin: Stackless in crates/sdfrs-trace/src/tracer/binary_search.rs. A segment number has up to 49 bits:
// two words here, rounded to f32 once, as there (wide.wgsl).

struct State {
    level: u32,
    // Levels that follow from eps, or the fixed depth of the letter form.
    deepest: u32,
    segment: vec2<u32>,
}

// Deepest level of any search: twin of MAX_LEVEL in crates/sdfrs-trace/src/tracer/mod.rs.
const MAX_LEVEL: u32 = 48u;

fn walk_start(range: Range) -> State {
    return State(0u, deepest(range), vec2<u32>(0u));
}

// ceil(log2(range / eps)): doubling is exact.
fn deepest(range: Range) -> u32 {
    if u.guards == 0u {
        return u.max_level;
    }
    let length = keep(range.t_max - range.t_min);
    var reach = u.eps;
    var level = 0u;
    while level < MAX_LEVEL && reach < length {
        reach = reach * 2.0;
        level += 1u;
    }
    return level;
}

// Length of a segment.
fn length_at(level: u32, range: Range) -> f32 {
    return keep(keep(range.t_max - range.t_min) * bitcast<f32>((127u - level) << 23u));
}

fn centre(st: ptr<function, State>, range: Range) -> f32 {
    let number = keep(wide_float((*st).segment) + 0.5);
    return keep(range.t_min + keep(length_at((*st).level, range) * number));
}

fn walk_first(st: ptr<function, State>, range: Range) -> f32 {
    return centre(st, range);
}

fn walk_step(st: ptr<function, State>, s: Sample, range: Range, tally: ptr<function, Tally>) -> Next {
    if is_invalid(s.r) {
        return done(INVALID);
    }
    let half = keep(0.5 * length_at((*st).level, range));
    stand(tally, s.t, s.r);
    if overlaps(s, half) {
        if half < s.e || (*st).level > (*st).deepest {
            return found(s, half, range, tally);
        }
        (*st).level += 1u;
        (*st).segment = wide_double((*st).segment);
    } else if !skip(st) {
        return done(MISS);
    }
    return ask(centre(st, range), tally);
}

// Leaves the subtree; false at the end of the ray.
fn skip(st: ptr<function, State>) -> bool {
    while ((*st).segment.x & 1u) == 1u {
        (*st).segment = wide_halve((*st).segment);
        (*st).level -= 1u;
    }
    // An even number: nothing is carried.
    (*st).segment.x += 1u;
    return (*st).level != 0u;
}
