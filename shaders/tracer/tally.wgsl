// What a ray's walk has come to: counts, the last accepted sample, the steepest slope seen, the end.
// Twin: Tally in crates/sdfrs-trace/src/tracer/walk.rs.

// A sample that the walk stands on now.
fn stand(tally: ptr<function, Tally>, t: f32, r: f32) {
    (*tally).t = t;
    (*tally).r = r;
}

// An accepted step of `ratio` times its radius.
fn accept(tally: ptr<function, Tally>, ratio: f32) {
    (*tally).accepted += 1u;
    (*tally).ratios = keep((*tally).ratios + ratio);
}

fn flag(tally: ptr<function, Tally>, bit: u32) {
    (*tally).outcome |= bit << 8u;
}

// The slope between two samples; where rounding could fake one it doesn't count.
fn observe(tally: ptr<function, Tally>, r: f32, s: Sample, dz: f32) {
    let slope = abs(keep(s.r - r)) / dz;
    if dz > 512.0 * ULP * s.scale && slope > (*tally).witness {
        (*tally).witness = slope;
    }
}

// A hit at the sample, if it lies in range.
fn hit(tally: ptr<function, Tally>, s: Sample, range: Range) -> Next {
    if s.r > s.asked {
        flag(tally, FLAG_PRECISION);
    }
    return done(select(HIT, MISS, s.t > range.t_max));
}

// A hit at the first sample; inside where it is deeper than the threshold.
fn hit_at_start(tally: ptr<function, Tally>, s: Sample, range: Range) -> Next {
    if s.r < -s.e {
        flag(tally, FLAG_INSIDE);
    }
    return hit(tally, s, range);
}
