//! Random scenes, cameras, and results as bits.
#![allow(clippy::unwrap_used, dead_code)]

use sdfrs_core::{Control, Hits, Limits, Prune, Shape, eval::Native};
use sdfrs_trace::{Camera, Tracer, camera::Kind, render::trace_camera};

#[path = "../../../sdfrs-core/tests/common/mod.rs"]
mod shapes;

pub use shapes::{Random, build};

pub fn camera(random: &mut Random) -> Camera {
    let kind = if random.below(4) == 0 {
        Kind::Orthographic { extent: 4.0 }
    } else {
        Kind::Pinhole { fov_deg: 45.0 }
    };
    let at = |r: &mut Random| [r.within(-3.0, 3.0), r.within(1.0, 3.0), r.within(3.0, 5.0)];
    Camera { kind, origin: at(random), target: [0.0; 3], up: [0.0, 1.0, 0.0], width: 53, height: 37 }
}

pub fn trace<T: Native>(shape: &Shape, camera: &Camera, tracer: &Tracer, prune: Prune) -> Hits<T> {
    let limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 300, prune };
    trace_camera::<T>(shape, camera, tracer, &limits, 20.0, &Control::new()).unwrap().0
}

pub fn bits<T: Native>(h: &Hits<T>) -> Vec<[u64; 7]> {
    let of = |v: &[T], i: usize| v[i].f64().to_bits();
    (0..h.t.len())
        .map(|i| {
            let counts = [u64::from(h.status[i]), u64::from(h.steps[i]), u64::from(h.fallbacks[i])];
            [
                of(&h.t, i),
                counts[0],
                counts[1],
                counts[2],
                of(&h.multiplier, i),
                of(&h.witness, i),
                u64::from(h.flags[i]),
            ]
        })
        .collect()
}
