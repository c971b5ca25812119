// Shortened programs: which one a sample runs, by its pixel's patch and its depth.
//
// The table (host: crates/sdfrs-gpu/src/emit/patches.rs): patches along a row, pixels along their side; for
// each patch, and behind the last, where its slabs begin; slabs as (end, first row of the program), nearest
// first, from depth 0 on. Behind the last slab and in front of 0 the whole scene's program runs, at row 0.
// Twin: Cells::find in crates/sdfrs-trace/src/march/cells.rs.

@group(1) @binding(2) var<storage, read> patches: array<u32>;

// Instead of a program's first row: nothing is here.
const EMPTY: u32 = 0xffffffffu;

// The patch's slabs, and the depths between which `program` is the one to run.
var<private> first_slab: u32;
var<private> last_slab: u32;
var<private> program_from: f32;
var<private> program_until: f32;

fn select_patch(ray: u32) {
    let pixel = u.base + ray;
    let side = patches[1];
    let n = (pixel / u.width / side) * patches[0] + (pixel % u.width) / side;
    first_slab = patches[2u + n];
    last_slab = patches[3u + n];
    // Nowhere yet.
    program_from = 1.0;
    program_until = 0.0;
}

// Whether `program` is the one to run at t.
fn is_there(t: f32) -> bool {
    return program_from <= t && t < program_until && !is_nan(t);
}

// The program for the sample at t; the whole scene's where nothing was expected.
fn program_at(t: f32) {
    if !is_there(t) {
        find_program(t);
    }
    if program == EMPTY {
        program = 0u;
    }
}

fn find_program(t: f32) {
    program = 0u;
    program_from = 1.0;
    program_until = 0.0;
    if is_nan(t) || t < 0.0 {
        return;
    }
    // The first slab that ends behind t.
    var a = first_slab;
    var b = last_slab;
    while a < b {
        let middle = a + 2u * ((b - a) >> 2u);
        if t < bitcast<f32>(patches[middle]) {
            b = middle;
        } else {
            a = middle + 2u;
        }
    }
    if a > first_slab {
        program_from = bitcast<f32>(patches[a - 2u]);
    } else {
        program_from = 0.0;
    }
    if a < last_slab {
        program_until = bitcast<f32>(patches[a]);
        program = patches[a + 1u];
    } else {
        program_until = 3.4e38;
    }
}
