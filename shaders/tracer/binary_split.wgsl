// Binary search with the empty span around each centre cut out: Klenert's split (003), mended.
// Twin: crates/sdfrs-trace/src/tracer/split.rs.

struct State {
    // The open segment in hand; those behind it, nearest on top, are on the stack.
    x: f32,
    y: f32,
    // Nothing behind matters any more.
    end: f32,
    count: u32,
    // The sample that hit, if any.
    has_hit: u32,
    hit: Sample,
}

fn walk_start(range: Range) -> State {
    var st: State;
    st.x = range.t_min;
    st.y = range.t_max;
    st.end = range.t_max;
    return st;
}

fn walk_first(st: ptr<function, State>, range: Range) -> f32 {
    return keep(0.5 * keep((*st).x + (*st).y));
}

fn walk_step(st: ptr<function, State>, s: Sample, range: Range, tally: ptr<function, Tally>) -> Next {
    if !is_finite(s.r) {
        return done(INVALID);
    }
    stand(tally, s.t, s.r);
    if s.r <= s.e {
        (*st).has_hit = 1u;
        (*st).hit = s;
        (*st).count = 0u;
        (*st).end = keep(s.t + op_min(s.r, 0.0));
        (*st).y = (*st).end;
        if (*st).end <= (*st).x {
            return hit_at(op_min((*st).x, s.t), s, range, tally);
        }
    } else {
        if (*st).count == u.depth {
            return done(OUT_OF_STEPS);
        }
        let q = keep(s.r - keep(s.e * 0.5));
        stack_put((*st).count, vec2<f32>(keep(s.t + q), (*st).y));
        (*st).count += 1u;
        (*st).y = keep(s.t - q);
    }
    return close_gaps(st, s, range, tally);
}

// The next open segment, or the end.
fn close_gaps(st: ptr<function, State>, s: Sample, range: Range, tally: ptr<function, Tally>) -> Next {
    loop {
        let short = keep((*st).y - (*st).x) <= keep(s.e * 0.5);
        if (*st).has_hit != 0u && (*st).y == (*st).end && short {
            return hit_at(op_min((*st).x, (*st).end), (*st).hit, range, tally);
        }
        if (*st).y > (*st).x {
            break;
        }
        if (*st).count == 0u {
            if (*st).has_hit != 0u {
                return hit_at((*st).end, (*st).hit, range, tally);
            }
            return done(MISS);
        }
        (*st).count -= 1u;
        let span = stack_get((*st).count);
        (*st).x = span.x;
        (*st).y = span.y;
    }
    return ask(keep(0.5 * keep((*st).x + (*st).y)), tally);
}
