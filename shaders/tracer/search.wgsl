// What the binary searches share: which segments stay open, where a hit is reported, the stack.
// Twin: the upper half of crates/sdfrs-trace/src/tracer/binary_search.rs and hit_at in split.rs.

// Whether the ball at a segment's centre leaves part of it open.
fn overlaps(s: Sample, half: f32) -> bool {
    if u.guards != 0u {
        return keep(s.r - keep(s.e * 0.5)) <= half;
    }
    return s.r < half;
}

fn is_invalid(r: f32) -> bool {
    return select(is_nan(r), !is_finite(r), u.guards != 0u);
}

// A hit in a segment too short to halve: at its centre, which is outside or within the threshold, or at
// its front end, which lies outside, where the centre is inside. The listings take the front end.
fn found(s: Sample, half: f32, range: Range, tally: ptr<function, Tally>) -> Next {
    var t = keep(s.t - half);
    if u.guards != 0u && s.r >= 0.0 {
        t = s.t;
    }
    return hit_at(t, s, range, tally);
}

// A hit at t, decided by the sample s.
fn hit_at(t: f32, s: Sample, range: Range, tally: ptr<function, Tally>) -> Next {
    stand(tally, t, s.r);
    let at = Sample(t, s.r, s.e, s.asked, s.scale);
    if t <= range.t_min {
        return hit_at_start(tally, at, range);
    }
    return hit(tally, at, range);
}
