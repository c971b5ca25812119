// A ray in cells, made here from the ray in the world. Twin: Placed::line in crates/sdfrs-trace/src/voxel.rs,
// which computes in f64: see lines.wgsl for its bits.

// The rows of constants behind the grid's eight: along x, y, z of the grid, cells a unit and the cell of the
// world's origin.
fn line_of(ray: u32) -> Line {
    let r = ray_of(ray);
    var line: Line;
    var along: vec3<f32>;
    for (var a = 0u; a < 3u; a++) {
        let row = consts[8u + a];
        line.o[a] = dot(row.xyz, r.origin) + row.w;
        line.d[a] = dot(row.xyz, r.direction);
        along[a] = line.d[a] * consts[3][a];
    }
    line.t_min = r.t_min;
    line.t_max = r.t_max;
    line.speed = length(along);
    return line;
}
