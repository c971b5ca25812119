// Points counted by the length of the program they ran, once a slab and not once a sample.
// Twin: Cells::count in crates/sdfrs-trace/src/march/cells.rs.

// As many as the host has in crates/sdfrs-gpu/src/emit/patches.rs.
const LENGTHS: u32 = 1024u;

var<private> points_here: u32;

// The program for the sample at t, which is counted.
fn enter(t: f32) {
    go_to(t);
    program_at(t);
    points_here += 1u;
}

// What is at t: a program, or EMPTY.
fn go_to(t: f32) {
    if !is_there(t) {
        tell_points();
        find_program(t);
    }
}

fn tell_points() {
    if points_here > 0u {
        atomicAdd(&lists.points[u32(consts[program].w)], points_here);
    }
    points_here = 0u;
}
