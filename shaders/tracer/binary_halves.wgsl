// A segment is cut at its centre. Twin: Stack without split in binary_search.rs.

fn cut_back(s: Sample) -> f32 {
    return s.t;
}

fn cut_front(s: Sample) -> f32 {
    return s.t;
}
