// The whole scene's program everywhere. Twin: none, see patches.wgsl.

// Counters of points by length: one that nobody counts with.
const LENGTHS: u32 = 1u;

fn select_patch(ray: u32) {}
fn program_at(t: f32) {}
fn enter(t: f32) {}
fn tell_points() {}
