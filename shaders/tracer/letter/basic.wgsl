// Algorithm 1 as printed (000, 002). Twin: Letter in crates/sdfrs-trace/src/tracer/basic.rs.
// It stalls where r falls below an ulp of t.

struct State {
    begun: u32,
    t: f32,
    r: f32,
}

fn walk_start(range: Range) -> State {
    return State(0u, range.t_min, 0.0);
}

fn walk_step(st: ptr<function, State>, s: Sample, range: Range, tally: ptr<function, Tally>) -> Next {
    let begun = (*st).begun != 0u;
    if begun {
        observe(tally, (*st).r, s, keep(s.t - (*st).t));
        accept(tally, 1.0);
    }
    (*st) = State(1u, s.t, s.r);
    stand(tally, s.t, s.r);
    if is_nan(s.r) {
        return done(INVALID);
    }
    if s.r <= s.e {
        return arrive(begun, tally, s, range);
    }
    return onwards(s.t, s.r, keep(s.t + s.r), range, tally);
}
