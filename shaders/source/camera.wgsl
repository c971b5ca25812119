// The rays of a camera, each made when it is asked for. Twin: crates/sdfrs-trace/src/camera.rs, which
// computes in f64: directions here are an ulp or two apart, so the strict mode takes its rays from there.

fn ray_of(i: u32) -> Ray {
    let pixel = u.base + i;
    let px = pixel % u.width;
    let py = pixel / u.width;
    let across = f32(2 * i32(px) + 1 - i32(u.width)) / f32(u.height) * u.half_height;
    let upwards = f32(i32(u.height) - 2 * i32(py) - 1) / f32(u.height) * u.half_height;
    let offset = across * u.right + upwards * u.up;
    if u.perspective != 0u {
        return Ray(u.origin, 0.0, normalize(u.forward + offset), u.t_max);
    }
    return Ray(u.origin + offset, 0.0, u.forward, u.t_max);
}
