// From voxel to voxel through a texture that stands alone, and in each the cubic's root (root.wgsl). Where the
// texture's own steps reach farther than the next voxel they are taken.
// Twin: Walk in crates/sdfrs-trace/src/voxel.rs, which has the reasons. The grid's constants begin at row 0.

// Cells along an edge of a brick.
const BRICK_CELLS: f32 = 8.0;

// A ray in cells: a point has its cell's number before the point and its place in the cell behind.
struct Line {
    o: vec3<f32>,
    t_min: f32,
    d: vec3<f32>,
    t_max: f32,
    // Length in the texture's space of a step of length 1.
    speed: f32,
    unused: f32,
    unused_too: f32,
    unused_three: f32,
}

// Where a ray stands.
struct Walker {
    cell: vec3<u32>,
    t: f32,
}

struct Wall {
    t: f32,
    axis: u32,
}

// Where a ray may be walked: inside the range and the grid's box.
struct Stretch {
    start: f32,
    end: f32,
}

fn line_at(line: Line, t: f32) -> vec3<f32> {
    return keep3(line.o + keep3(t * line.d));
}

// Where the line leaves a box of cells, and through which wall.
fn leaves(line: Line, low: vec3<f32>, high: vec3<f32>) -> Wall {
    // Farther than any wall.
    var wall = Wall(3.4e38, 0u);
    for (var a = 0u; a < 3u; a++) {
        let to = keep(keep(select(low[a], high[a], line.d[a] > 0.0) - line.o[a]) / line.d[a]);
        if line.d[a] != 0.0 && to < wall.t {
            wall = Wall(to, a);
        }
    }
    return wall;
}

fn stretch(line: Line, size: vec3<f32>) -> Stretch {
    var first = -3.4e38;
    var to = 3.4e38;
    for (var a = 0u; a < 3u; a++) {
        if line.d[a] == 0.0 {
            if !(line.o[a] >= 0.0 && line.o[a] <= size[a]) {
                return Stretch(1.0, 0.0);
            }
            continue;
        }
        let p = keep(keep(0.0 - line.o[a]) / line.d[a]);
        let q = keep(keep(size[a] - line.o[a]) / line.d[a]);
        first = op_max(first, op_min(p, q));
        to = op_min(to, op_max(p, q));
    }
    return Stretch(op_max(line.t_min, first), op_min(line.t_max, to));
}

fn cell_at(line: Line, t: f32, cells: vec3<f32>) -> vec3<u32> {
    let p = line_at(line, t);
    let x = op_min(op_max(p.x, 0.0), cells.x - 1.0);
    let y = op_min(op_max(p.y, 0.0), cells.y - 1.0);
    return vec3<u32>(u32(x), u32(y), u32(op_min(op_max(p.z, 0.0), cells.z - 1.0)));
}

// The line's place in a cell at t.
fn place_in(line: Line, t: f32, low: vec3<f32>) -> vec3<f32> {
    let p = line_at(line, t);
    let x = op_min(op_max(keep(p.x - low.x), 0.0), 1.0);
    let y = op_min(op_max(keep(p.y - low.y), 0.0), 1.0);
    return vec3<f32>(x, y, op_min(op_max(keep(p.z - low.z), 0.0), 1.0));
}

// How far the texture's own rule reaches from t on, in the ray's parameter.
fn texture_step(line: Line, t: f32) -> f32 {
    let p = line_at(line, t);
    let q = keep3(consts[1].xyz + keep3(p * consts[3].xyz));
    let v = op_max(sample(q.x, q.y, q.z, 0u, KIND, RULE, 1u), 0.0);
    // What rounding of the place may add to the value.
    return keep(keep(v * 0.999) / line.speed);
}

fn is_empty(cell: vec3<u32>) -> bool {
    if KIND < 2u {
        return false;
    }
    let count = bricks_along(0u);
    return grids[word(consts[5].z, consts[5].w) + brick_of(cell, count)] == 0xffffffffu;
}

// Behind a brick without samples, or farther where its value reaches farther.
fn over_brick(line: Line, t: f32, cell: vec3<u32>) -> f32 {
    let brick = cell / vec3<u32>(8u);
    let low = vec3<f32>(brick) * BRICK_CELLS;
    let high = vec3<f32>(min(brick + 1u, bricks_along(0u))) * BRICK_CELLS;
    let wall = leaves(line, low, high).t;
    // Not to stay on the wall for the rounding of its place.
    let past = keep(wall + keep(keep(keep(abs(wall) + 1.0) * ULP) * 2.0));
    return op_max(past, keep(t + texture_step(line, t)));
}

// Misses, and rays out of steps.
fn ends(tally: ptr<function, Tally>, status: u32, t: f32) -> u32 {
    (*tally).t = t;
    // No compiler may know that it is infinite.
    (*tally).r = bitcast<f32>(0x7f800000u ^ u.zero);
    return status;
}

fn hits(tally: ptr<function, Tally>, line: Line, t: f32) -> u32 {
    (*tally).t = t;
    (*tally).r = 0.0;
    if t == line.t_min {
        (*tally).outcome |= FLAG_INSIDE << 8u;
    }
    return HIT;
}

// A visit to a cell; ASK while the ray goes on.
fn visit(walker: ptr<function, Walker>, line: Line, tally: ptr<function, Tally>) -> u32 {
    let cells = consts[0].xyz - 1.0;
    let s = stretch(line, cells);
    if (*tally).steps == 0u {
        if !(s.start <= s.end) {
            (*tally).steps = 1u;
            return ends(tally, MISS, 0.0);
        }
        (*walker) = Walker(cell_at(line, s.start, cells), s.start);
    }
    let t = (*walker).t;
    if (*tally).steps >= u.max_steps {
        return ends(tally, OUT_OF_STEPS, t);
    }
    (*tally).steps += 1u;
    let cell = (*walker).cell;
    if is_empty(cell) {
        let next = over_brick(line, t, cell);
        (*walker) = Walker(cell_at(line, next, cells), next);
        return go_on(tally, next < s.end);
    }
    let low = vec3<f32>(cell);
    let wall = leaves(line, low, low + 1.0);
    let out = op_max(op_min(wall.t, s.end), t);
    let a = place_in(line, t, low);
    let e = place_in(line, out, low);
    let root = first_root(corners(cell, 0u, KIND), a, keep3(e - a));
    if root >= 0.0 {
        return hits(tally, line, keep(t + keep(root * keep(out - t))));
    }
    if !(wall.t < s.end) {
        return ends(tally, MISS, 0.0);
    }
    let step = texture_step(line, out);
    let across = keep(out - t);
    // A step beyond the next cell is worth an evaluation there; a shorter one is not.
    if step > keep(across + across) {
        let next = keep(out + step);
        (*walker) = Walker(cell_at(line, next, cells), next);
        return go_on(tally, next < s.end);
    }
    return next_cell(walker, line, wall.axis, out, tally);
}

fn go_on(tally: ptr<function, Tally>, inside: bool) -> u32 {
    if inside {
        return ASK;
    }
    return ends(tally, MISS, 0.0);
}

// Through a cell's wall into its neighbour.
fn next_cell(walker: ptr<function, Walker>, line: Line, axis: u32, t: f32, tally: ptr<function, Tally>) -> u32 {
    var cell = (*walker).cell;
    let ahead = line.d[axis] > 0.0;
    let last = select(0u, u32(consts[0][axis]) - 2u, ahead);
    if cell[axis] == last {
        return ends(tally, MISS, 0.0);
    }
    cell[axis] = select(cell[axis] - 1u, cell[axis] + 1u, ahead);
    (*walker) = Walker(cell, t);
    return ASK;
}
