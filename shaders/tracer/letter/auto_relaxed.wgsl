// 000 Algorithm 4 as printed. Twin: Letter in crates/sdfrs-trace/src/tracer/auto_relaxed.rs.
// Slopes near 1 make steps without bound, and head-on surfaces are passed by equality.

struct State {
    begun: u32,
    t: f32,
    r: f32,
    z: f32,
    m: f32,
}

fn walk_start(range: Range) -> State {
    return State(0u, range.t_min, 0.0, 0.0, -1.0);
}

fn walk_step(st: ptr<function, State>, s: Sample, range: Range, tally: ptr<function, Tally>) -> Next {
    if is_nan(s.r) {
        return done(INVALID);
    }
    let begun = (*st).begun != 0u;
    (*st).begun = 1u;
    var accepted = true;
    if !begun {
        (*st).r = s.r;
        (*st).z = s.r;
    } else {
        let dz = keep(s.t - (*st).t);
        observe(tally, (*st).r, s, dz);
        accepted = (*st).z <= keep((*st).r + abs(s.r));
        if accepted {
            accept(tally, (*st).z / (*st).r);
            let seen = keep(keep(s.r - (*st).r) / dz);
            (*st).m = keep(keep(keep(1.0 - u.factor) * (*st).m) + keep(u.factor * seen));
            (*st).t = s.t;
            (*st).r = s.r;
        } else {
            (*tally).fallbacks += 1u;
            (*st).m = -1.0;
        }
        (*st).z = keep(2.0 * (*st).r) / keep(1.0 - (*st).m);
    }
    if accepted {
        stand(tally, s.t, s.r);
        if s.r <= s.e {
            return arrive(begun, tally, s, range);
        }
    }
    return onwards((*st).t, (*st).r, keep((*st).t + (*st).z), range, tally);
}
