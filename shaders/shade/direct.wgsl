// Point lights on a matt surface (Lambert 1760), without fall-off, under a little even light, as sRGB.
// Twin: crates/sdfrs-trace/src/shade/direct.rs. Law: the same colours within 1/255.

const AMBIENT: f32 = 0.15;
// Pixels on which the field was not a number.
const INVALID_RGB: u32 = 0xff00ffu;

struct Light {
    position: vec3<f32>,
    unused: f32,
    // Linear, times the intensity and the share of the lamps.
    color: vec3<f32>,
    unused_too: f32,
}

@group(0) @binding(3) var<storage, read> lights: array<Light>;

// Cosine of the angle between a unit normal and the way to the light; 0 behind, and at the lamp itself.
fn cosine(n: vec3<f32>, l: vec3<f32>) -> f32 {
    let most = max(abs(l.x), max(abs(l.y), abs(l.z)));
    let along = dot(n, l / max(most, 1e-30));
    if !(along > 0.0) || !is_finite(most) {
        return 0.0;
    }
    return along / length(l / most);
}

// One channel of IEC 61966-2-1, rounded to 8 bits.
fn srgb(linear: f32) -> u32 {
    let v = clamp(linear, 0.0, 1.0);
    let curve = 1.055 * pow(max(v, 1e-6), 1.0 / 2.4) - 0.055;
    return u32(select(curve, 12.92 * v, v <= 0.0031308) * 255.0 + 0.5);
}

// The pixel of a ray that ended at p with a normal.
fn lit(p: vec3<f32>, n: vec3<f32>) -> u32 {
    var light = vec3<f32>(AMBIENT);
    for (var i = 0u; i < arrayLength(&lights); i++) {
        light += lights[i].color * cosine(n, lights[i].position - p);
    }
    let c = u.albedo * light;
    return srgb(c.x) | (srgb(c.y) << 8u) | (srgb(c.z) << 16u);
}
