// Coverage search: spans of the ray known to be empty, the nearest gap sampled first. 004, corrected.
// Twin: crates/sdfrs-trace/src/tracer/coverage_search.rs; coverage_spans.wgsl has learn and close.

// Spans kept at most; beyond them the walk takes basic steps from the cursor.
const SPANS: u32 = 32u;

struct State {
    // Everything before it is empty.
    cur: f32,
    end: f32,
    // Spans known empty, nearest on top of the stack.
    count: u32,
    // The sample in flight is a basic step from the cursor.
    at_cursor: u32,
    // The sample that hit, if any.
    has_hit: u32,
    hit: Sample,
}

fn walk_start(range: Range) -> State {
    var st: State;
    st.cur = range.t_min;
    st.end = range.t_max;
    return st;
}

fn walk_first(st: ptr<function, State>, range: Range) -> f32 {
    return keep(keep((*st).cur + (*st).end) * 0.5);
}

fn walk_step(st: ptr<function, State>, s: Sample, range: Range, tally: ptr<function, Tally>) -> Next {
    if !is_finite(s.r) {
        return done(INVALID);
    }
    stand(tally, s.t, s.r);
    var end = learn(st, s);
    if end.status == ASK {
        end = close(st, keep(s.e * 0.5));
    }
    if end.status == HIT {
        if (*st).has_hit != 0u {
            return hit_at(end.t, (*st).hit, range, tally);
        }
        return hit_at(end.t, s, range, tally);
    }
    if end.status == MISS {
        return end;
    }
    if spent(tally) {
        return done(OUT_OF_STEPS);
    }
    return Next(ASK, sample_next(st));
}

fn top_of(st: ptr<function, State>) -> f32 {
    if (*st).count == 0u {
        return (*st).end;
    }
    return stack_get((*st).count - 1u).x;
}

fn sample_next(st: ptr<function, State>) -> f32 {
    let full = (*st).count == SPANS;
    (*st).at_cursor = select(0u, 1u, full);
    if full {
        return (*st).cur;
    }
    return keep(keep((*st).cur + top_of(st)) * 0.5);
}
