// 000 Algorithm 2 as printed: it begins with a step of length 0 from a radius of 0.
// Twin: Letter in crates/sdfrs-trace/src/tracer/relaxed.rs. On head-on rays its test holds by equality
// behind the surface, and sheets between two touching balls are skipped.

struct State {
    begun: u32,
    t: f32,
    r: f32,
    z: f32,
}

fn walk_start(range: Range) -> State {
    return State(0u, range.t_min, 0.0, 0.0);
}

fn walk_step(st: ptr<function, State>, s: Sample, range: Range, tally: ptr<function, Tally>) -> Next {
    if is_nan(s.r) {
        return done(INVALID);
    }
    let begun = (*st).begun != 0u;
    if begun {
        observe(tally, (*st).r, s, keep(s.t - (*st).t));
    }
    if (*st).z <= keep((*st).r + abs(s.r)) {
        if begun {
            accept(tally, (*st).z / (*st).r);
        }
        (*st).z = keep(u.factor * s.r);
        (*st).t = s.t;
        (*st).r = s.r;
        stand(tally, s.t, s.r);
        if s.r <= s.e {
            return arrive(begun, tally, s, range);
        }
    } else {
        (*tally).fallbacks += 1u;
        (*st).z = (*st).r;
    }
    (*st).begun = 1u;
    return onwards((*st).t, (*st).r, keep((*st).t + (*st).z), range, tally);
}
