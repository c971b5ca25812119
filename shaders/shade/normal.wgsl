// Normals: the field's gradient at the hit at unit length, or the way back along the ray where it has no
// direction. Twin: crates/sdfrs-trace/src/shade/normal.rs.

fn unit_normal(g: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    let most = max(abs(g.x), max(abs(g.y), abs(g.z)));
    let usable = is_finite(g.x) && is_finite(g.y) && is_finite(g.z) && most > 0.0;
    if !usable {
        return -direction;
    }
    // Scaled first: squares of a tiny gradient would vanish.
    let scaled = g / most;
    let squares = keep(keep(scaled.x * scaled.x) + keep(scaled.y * scaled.y));
    return scaled / sqrt(keep(squares + keep(scaled.z * scaled.z)));
}
