// The guarded sphere tracing loop that basic, relaxed, enhanced and auto-relaxed share.
//
// Twin: crates/sdfrs-trace/src/tracer/guarded.rs, which has the reasons and takes a pack of rays at once,
// selecting where this branches. The rule of a stepper,
// rule_first, rule_slope and rule_next, stands in the stepper's own file; crossing.wgsl refines.

// Phases of a ray.
const FIRST: u32 = 0u;
const WALKING: u32 = 1u;
const REFINING: u32 = 2u;

struct State {
    phase: u32,
    t: f32,
    r: f32,
    // Step to try.
    z: f32,
    m: f32,
    bracket: Bracket,
}

fn walk_start(range: Range) -> State {
    var st: State;
    st.t = range.t_min;
    st.m = -1.0;
    return st;
}

fn walk_first(st: ptr<function, State>, range: Range) -> f32 {
    return range.t_min;
}

fn walk_step(st: ptr<function, State>, s: Sample, range: Range, tally: ptr<function, Tally>) -> Next {
    if (*st).phase == FIRST {
        return begin(st, s, range, tally);
    }
    if (*st).phase == REFINING {
        return refine(st, s, tally);
    }
    let dz = keep(s.t - (*st).t);
    let basic = !((*st).z > (*st).r);
    if !is_finite(s.r) {
        if basic {
            return done(INVALID);
        }
        return fall_back(st, range, tally);
    }
    observe(tally, (*st).r, s, dz);
    let ulp = ULP * abs(s.t);
    if !basic && !(keep(dz + keep(2.0 * ulp)) <= keep((*st).r + s.r)) {
        return fall_back(st, range, tally);
    }
    accept(tally, select(dz / (*st).r, 1.0, basic));
    if s.r < -s.e {
        flag(tally, FLAG_CROSSING);
        (*st).phase = REFINING;
        return cross_over(st, s, tally);
    }
    let seen = op_min(op_max(keep(s.r - (*st).r) / dz, -1.0), 0.9);
    (*st).m = rule_slope((*st).m, seen);
    (*st).t = s.t;
    (*st).r = s.r;
    stand(tally, s.t, s.r);
    if s.r <= s.e {
        return hit(tally, s, range);
    }
    if s.t >= range.t_max {
        return done(MISS);
    }
    (*st).z = rule_next((*st).r, (*st).m);
    return advance(st, range, tally);
}

fn begin(st: ptr<function, State>, s: Sample, range: Range, tally: ptr<function, Tally>) -> Next {
    (*st).phase = WALKING;
    (*st).r = s.r;
    stand(tally, s.t, s.r);
    if !is_finite(s.r) {
        return done(INVALID);
    }
    if s.r <= s.e {
        return hit_at_start(tally, s, range);
    }
    (*st).z = rule_first(s.r);
    return advance(st, range, tally);
}

fn advance(st: ptr<function, State>, range: Range, tally: ptr<function, Tally>) -> Next {
    return onwards((*st).t, (*st).r, op_min(keep((*st).t + (*st).z), range.t_max), range, tally);
}

fn fall_back(st: ptr<function, State>, range: Range, tally: ptr<function, Tally>) -> Next {
    (*tally).fallbacks += 1u;
    (*st).z = (*st).r;
    (*st).m = -1.0;
    return advance(st, range, tally);
}
