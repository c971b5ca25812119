// What a sample of the coverage search says, and which gaps it closes; ASK means that the search goes on.
// Twin: learn and close in crates/sdfrs-trace/src/tracer/coverage_search.rs.

fn learn(st: ptr<function, State>, s: Sample) -> Next {
    if s.r <= s.e {
        (*st).has_hit = 1u;
        (*st).hit = s;
        (*st).count = 0u;
        (*st).end = keep(s.t + op_min(s.r, 0.0));
        if (*st).end <= (*st).cur {
            return Next(HIT, op_min((*st).cur, s.t));
        }
        return Next(ASK, 0.0);
    }
    let q = keep(s.r - keep(s.e * 0.5));
    if (*st).at_cursor != 0u {
        (*st).cur = keep(s.t + q);
        return Next(ASK, 0.0);
    }
    let low = keep(s.t - q);
    var high = keep(s.t + q);
    let reaches = high >= top_of(st);
    if reaches && (*st).count > 0u {
        let top = (*st).count - 1u;
        stack_put(top, vec2<f32>(low, op_max(stack_get(top).y, high)));
        return Next(ASK, 0.0);
    }
    if reaches && (*st).has_hit != 0u {
        if low <= (*st).cur {
            return Next(HIT, (*st).end);
        }
        high = (*st).end;
    }
    stack_put((*st).count, vec2<f32>(low, high));
    (*st).count += 1u;
    return Next(ASK, 0.0);
}

// Moves the cursor over what is known to be empty.
fn close(st: ptr<function, State>, half_e: f32) -> Next {
    loop {
        let top = top_of(st);
        let last = (*st).has_hit != 0u && (*st).count == 0u && keep(top - (*st).cur) <= half_e;
        if !(top <= (*st).cur || last) {
            break;
        }
        if (*st).count == 0u {
            if (*st).has_hit != 0u {
                return Next(HIT, op_min((*st).cur, (*st).end));
            }
            return done(MISS);
        }
        (*st).count -= 1u;
        (*st).cur = op_max((*st).cur, stack_get((*st).count).y);
        if (*st).cur >= (*st).end && (*st).has_hit == 0u {
            return done(MISS);
        }
    }
    return Next(ASK, 0.0);
}
