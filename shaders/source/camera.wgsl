// The rays of a camera, each made when it is asked for. Twin: crates/sdfrs-trace/src/camera.rs, which
// computes in f64 and rounds once; here in pairs (pair.wgsl), so that the two rarely differ by an ulp. A
// difference in every direction's last bit would change 1 to 5 % of the step counts.

fn pair_of(axis: u32, high: vec3<f32>, low: vec3<f32>) -> Pair {
    return Pair(high[axis], low[axis]);
}

// across * right + upwards * up, along one axis of the world.
fn offset(axis: u32, across: Pair, upwards: Pair) -> Pair {
    let x = pair_multiply(across, pair_of(axis, u.right, u.right_low));
    return pair_add(x, pair_multiply(upwards, pair_of(axis, u.up, u.up_low)));
}

fn ray_of(i: u32) -> Ray {
    let pixel = u.base + i;
    let scale = Pair(u.scale, u.scale_low);
    // Pixel centres in half pixels from the middle of the image: exact.
    let column = f32(2 * i32(pixel % u.width) + 1 - i32(u.width));
    let row = f32(i32(u.height) - 2 * i32(pixel / u.width) - 1);
    let across = pair_multiply(Pair(column, 0.0), scale);
    let upwards = pair_multiply(Pair(row, 0.0), scale);
    var v: array<Pair, 3>;
    if u.perspective == 0u {
        var origin = u.origin;
        for (var axis = 0u; axis < 3u; axis++) {
            let start = pair_of(axis, u.origin, u.origin_low);
            origin[axis] = pair_add(start, offset(axis, across, upwards)).high;
        }
        return Ray(origin, 0.0, unit_direction(u.forward), u.t_max);
    }
    var squares = Pair(0.0, 0.0);
    for (var axis = 0u; axis < 3u; axis++) {
        let ahead = pair_of(axis, u.forward, u.forward_low);
        v[axis] = pair_add(ahead, offset(axis, across, upwards));
        squares = pair_add(squares, pair_multiply(v[axis], v[axis]));
    }
    let inverse = pair_inverse_root(squares);
    var direction: vec3<f32>;
    for (var axis = 0u; axis < 3u; axis++) {
        direction[axis] = pair_multiply(v[axis], inverse).high;
    }
    return Ray(u.origin, 0.0, unit_direction(direction), u.t_max);
}

// Once more in f32, as rays that come as a batch are.
fn unit_direction(d: vec3<f32>) -> vec3<f32> {
    let squares = hold(hold(hold(d.x * d.x) + hold(d.y * d.y)) + hold(d.z * d.z));
    return d / sqrt(squares);
}
