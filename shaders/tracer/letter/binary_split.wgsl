// Klenert's split as printed: tcen + d - th and tcen - d + th. It does not end where a centre is inside,
// because its halves grow. Twin: Stack with split in crates/sdfrs-trace/src/tracer/binary_search.rs.

fn cut_back(s: Sample) -> f32 {
    return keep(keep(s.t + s.r) - s.e);
}

fn cut_front(s: Sample) -> f32 {
    return keep(keep(s.t - s.r) + s.e);
}
