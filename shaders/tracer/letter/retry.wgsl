// The loop of 002's listings 2 and 3: a step whose balls come apart is tried again at once, with the
// signed radius in the test. Twin: crates/sdfrs-trace/src/tracer/retry.rs. Budgets count evaluations, so
// a retry is a step of its own; retry_length stands in relaxed_2018.wgsl and enhanced_2018.wgsl.

struct State {
    begun: u32,
    retrying: u32,
    t: f32,
    r: f32,
    before: f32,
    d: f32,
}

fn walk_start(range: Range) -> State {
    return State(0u, 0u, range.t_min, 0.0, 0.0, 0.0);
}

fn walk_step(st: ptr<function, State>, s: Sample, range: Range, tally: ptr<function, Tally>) -> Next {
    if is_nan(s.r) {
        return done(INVALID);
    }
    let begun = (*st).begun != 0u;
    let retrying = (*st).retrying != 0u;
    if begun {
        observe(tally, (*st).r, s, keep(s.t - (*st).t));
    }
    if !retrying && (*st).d > keep((*st).r + s.r) {
        (*tally).fallbacks += 1u;
        (*st).d = (*st).r;
        (*st).retrying = 1u;
        return ask(keep((*st).t + (*st).d), tally);
    }
    if begun {
        accept(tally, select((*st).d / (*st).r, 1.0, retrying));
    }
    (*st).before = (*st).r;
    (*st).t = s.t;
    (*st).r = s.r;
    (*st).retrying = 0u;
    stand(tally, s.t, s.r);
    if s.r <= s.e {
        return arrive(begun, tally, s, range);
    }
    (*st).begun = 1u;
    (*st).d = retry_length((*st).r, (*st).before, (*st).d);
    return onwards((*st).t, (*st).r, keep((*st).t + (*st).d), range, tally);
}
