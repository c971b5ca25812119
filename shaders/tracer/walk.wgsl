// What a step machine is: it asks for a sample, is told the field there, asks for the next or ends.
//
// Twin: crates/sdfrs-trace/src/tracer/walk.rs. A tracer's file declares State and the functions
// walk_start(range) -> State, walk_first(state, range) -> f32 and walk_step(state, sample, range, tally)
// -> Next.

// Where a ray may be walked.
struct Range {
    t_min: f32,
    t_max: f32,
}

// What the field said.
struct Sample {
    t: f32,
    r: f32,
    // Hit threshold here; with guards never below 4 ulp of max(|p|, t).
    e: f32,
    // The threshold without that floor.
    asked: f32,
    // max(|p|, |t|): what rounding is relative to.
    scale: f32,
}

// The next sample's parameter (status ASK), or the end.
struct Next {
    status: u32,
    t: f32,
}

fn done(status: u32) -> Next {
    return Next(status, 0.0);
}

fn spent(tally: ptr<function, Tally>) -> bool {
    return (*tally).steps >= u.max_steps;
}

// Asks for a sample, unless the budget is spent.
fn ask(t: f32, tally: ptr<function, Tally>) -> Next {
    return Next(select(ASK, OUT_OF_STEPS, spent(tally)), t);
}

// On from a sample at t of radius r to one at `next`, unless the range or the budget ends first.
fn onwards(t: f32, r: f32, next: f32, range: Range, tally: ptr<function, Tally>) -> Next {
    if keep(t + r) >= range.t_max {
        return done(MISS);
    }
    return ask(next, tally);
}
