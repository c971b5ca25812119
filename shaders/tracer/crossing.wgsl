// A safe step went through the surface: Illinois, regula falsi that halves the weight of an end kept
// twice in a row. Twin: Bracket in crates/sdfrs-trace/src/tracer/guarded.rs, and march/refine.rs there.

// Evaluations spent on a crossing at most.
const REFINEMENTS: u32 = 5u;
// Which end was replaced last.
const MOVED_A: u32 = 1u;
const MOVED_B: u32 = 2u;

// A surface between a (outside) and b (inside).
struct Bracket {
    a: f32,
    b: f32,
    // Half the threshold at b: aiming at it instead of 0 finds a point outside.
    aim: f32,
    // Field at the ends less the aim.
    fa: f32,
    fb: f32,
    // Field at a.
    r: f32,
    moved: u32,
    tries: u32,
}

fn cross_over(st: ptr<function, State>, s: Sample, tally: ptr<function, Tally>) -> Next {
    let aim = keep(s.e * 0.5);
    let fa = keep((*st).r - aim);
    (*st).bracket = Bracket((*st).t, s.t, aim, fa, keep(s.r - aim), (*st).r, 0u, 0u);
    return next_in((*st).bracket, tally);
}

fn next_in(b: Bracket, tally: ptr<function, Tally>) -> Next {
    let guess = keep(keep(b.a * b.fb) - keep(b.b * b.fa)) / keep(b.fb - b.fa);
    if spent(tally) || b.tries == REFINEMENTS || !(guess > b.a && guess < b.b) {
        stand(tally, b.a, b.r);
        return done(HIT);
    }
    return Next(ASK, guess);
}

fn refine(st: ptr<function, State>, s: Sample, tally: ptr<function, Tally>) -> Next {
    var b = (*st).bracket;
    b.tries += 1u;
    if s.r >= 0.0 && s.r <= s.e {
        stand(tally, s.t, s.r);
        return done(HIT);
    }
    let f = keep(s.r - b.aim);
    if f > 0.0 {
        b.a = s.t;
        b.fa = f;
        b.r = s.r;
        b.fb = select(b.fb, b.fb * 0.5, b.moved == MOVED_A);
        b.moved = MOVED_A;
    } else if f <= 0.0 {
        b.b = s.t;
        b.fb = f;
        b.fa = select(b.fa, b.fa * 0.5, b.moved == MOVED_B);
        b.moved = MOVED_B;
    } else {
        stand(tally, b.a, b.r);
        return done(HIT);
    }
    (*st).bracket = b;
    return next_in(b, tally);
}
