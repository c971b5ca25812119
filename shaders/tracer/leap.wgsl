// Over slabs in which nothing is: a ray whose own ball reaches there starts anew at their end. A longer step
// tried into one proves nothing of what it left out: such a ray takes the plain step first.
//
// Twin: Jump in crates/sdfrs-trace/src/march/kernels.rs.

fn leap(st: ptr<function, State>, next: Next, range: Range, tally: ptr<function, Tally>) -> Next {
    var t = next.t;
    while (*st).phase != REFINING {
        go_to(t);
        if program != EMPTY {
            break;
        }
        let stands = keep((*st).t + (*st).r);
        if (*st).phase == FIRST || stands >= program_from {
            if program_until >= range.t_max {
                // No compiler may know that it is infinite.
                (*tally).r = bitcast<f32>(0x7f800000u ^ u.zero);
                return done(MISS);
            }
            t = program_until;
            (*st).phase = FIRST;
            (*st).t = t;
            (*st).r = 0.0;
            (*st).m = -1.0;
        } else {
            t = stands;
            (*st).z = (*st).r;
        }
    }
    return Next(ASK, t);
}
