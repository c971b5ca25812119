// 000 Algorithm 3 as printed. Twin: Letter in crates/sdfrs-trace/src/tracer/enhanced.rs.
// Where the field rises along the ray its denominator vanishes and the walk leaps over surfaces.

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
    if !begun {
        (*st).r = s.r;
        (*st).z = s.r;
        stand(tally, s.t, s.r);
    } else {
        let dz = keep(s.t - (*st).t);
        let r = (*st).r;
        let big = s.r;
        observe(tally, r, s, dz);
        if (*st).z <= keep(r + abs(big)) {
            accept(tally, (*st).z / r);
            let top = keep(keep(u.factor * big) * keep(keep(dz + big) - r));
            (*st).z = keep(big + keep(top / keep(dz - keep(big - r))));
            (*st).t = s.t;
            (*st).r = big;
            stand(tally, s.t, big);
        } else {
            (*tally).fallbacks += 1u;
            (*st).z = r;
            return onwards((*st).t, (*st).r, keep((*st).t + (*st).z), range, tally);
        }
    }
    if s.r <= s.e {
        return arrive(begun, tally, s, range);
    }
    (*st).begun = 1u;
    return onwards((*st).t, (*st).r, keep((*st).t + (*st).z), range, tally);
}
