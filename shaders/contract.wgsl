// The words that host and device exchange: what a pass is told, what a ray has come to, how rays end.
//
// Twin: crates/sdfrs-core/src/contract.rs, crates/sdfrs-trace/src/tracer/walk.rs and, byte for byte,
// crates/sdfrs-gpu/src/contract.rs. Law: a test compares every offset with the host's.

const MISS: u32 = 0u;
const HIT: u32 = 1u;
const OUT_OF_STEPS: u32 = 2u;
// The field was not a number.
const INVALID: u32 = 3u;
// Not an end: the ray goes on.
const ASK: u32 = 4u;

// The ray started inside the solid.
const FLAG_INSIDE: u32 = 1u;
// A safe step crossed the surface: the field is steeper than declared.
const FLAG_CROSSING: u32 = 2u;
// The floor of 4 ulp, not eps, decided this hit.
const FLAG_PRECISION: u32 = 4u;

// Spacing of numbers just above 1.
const ULP: f32 = 1.1920928955078125e-7;

struct Params {
    // Zero, which no compiler knows: see keep() in barrier/.
    zero: u32,
    // Rays of this tile, and the pixel or ray of the whole that is the tile's first.
    rays: u32,
    base: u32,
    // The part of the list of active rays that this dispatch advances.
    first: u32,
    count: u32,
    // Which half of the lists is read: 0 or 1.
    half_read: u32,
    // Evaluations that a ray may spend in this dispatch, and in all.
    steps: u32,
    max_steps: u32,
    // Whether the threshold has its floor of 4 ulp and the searches their guards.
    guards: u32,
    // Deepest level of a stackless search without guards.
    max_level: u32,
    // Entries of a ray's stack.
    depth: u32,
    // Whether the tile is whole rows of an image, stepped in blocks of 8 x 8 pixels.
    blocks: u32,
    eps: f32,
    cone: f32,
    // omega or beta.
    factor: f32,
    t_max: f32,
    // The camera's axes, and the height of a pixel at unit distance or in the world, each as the sum of two
    // numbers: see source/pair.wgsl and crates/sdfrs-trace/src/camera.rs.
    origin: vec3<f32>,
    scale: f32,
    forward: vec3<f32>,
    scale_low: f32,
    right: vec3<f32>,
    width: u32,
    up: vec3<f32>,
    height: u32,
    origin_low: vec3<f32>,
    perspective: u32,
    forward_low: vec3<f32>,
    unused: u32,
    right_low: vec3<f32>,
    unused_too: u32,
    up_low: vec3<f32>,
    unused_three: u32,
    albedo: vec3<f32>,
    // Packed as r | g << 8 | b << 16.
    background: u32,
}

// A ray that came from the host; the direction has unit length.
struct Ray {
    origin: vec3<f32>,
    t_min: f32,
    direction: vec3<f32>,
    t_max: f32,
}

// What a ray's walk has come to.
struct Tally {
    steps: u32,
    fallbacks: u32,
    accepted: u32,
    // Sum of length / radius over the accepted steps.
    ratios: f32,
    // Last accepted sample.
    t: f32,
    r: f32,
    // Largest observed slope.
    witness: f32,
    // Status in the low byte, flags in the next.
    outcome: u32,
}

@group(0) @binding(0) var<uniform> u: Params;

// The number of a thread in workgroups of 8x8, which lie in rows.
fn place_of(thread: u32, group: vec3<u32>, groups: vec3<u32>) -> u32 {
    return (group.y * groups.x + group.x) * 64u + thread;
}
