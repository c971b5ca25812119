// Rays in cells, made by the host in f64 and rounded once. Twin: Placed::line in crates/sdfrs-trace/src/voxel.rs.

@group(0) @binding(5) var<storage, read_write> lines: array<Line>;

fn line_of(ray: u32) -> Line {
    return lines[ray];
}
