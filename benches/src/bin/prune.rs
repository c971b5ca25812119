//! What pruning is worth: tracing with and without, on one thread. `cargo run --release --bin prune [scene..]`
#![allow(clippy::unwrap_used)]

use sdfrs_benches::{clock, scenes};
use sdfrs_core::{Control, Hits, Limits, Prune, Shape};
use sdfrs_trace::{Camera, Tracer, camera::Kind, render::trace_camera};

fn run(shape: &Shape, prune: Prune) -> Hits<f32> {
    let camera = Camera {
        kind: Kind::Pinhole { fov_deg: 40.0 },
        origin: [2.4, 1.8, 3.2],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        width: 512,
        height: 512,
    };
    let limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 256, prune };
    trace_camera::<f32>(shape, &camera, &Tracer::Basic { guards: true }, &limits, 10.0, &Control::new())
        .unwrap()
        .0
}

fn main() {
    sdfrs_core::pool::set_threads(1);
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let mut all = scenes::all();
    for n in [100, 10_000, 100_000] {
        all.push(scenes::spheres(n));
    }
    for scene in all {
        if !wanted.is_empty() && !wanted.iter().any(|w| scene.name.contains(w.as_str())) {
            continue;
        }
        if scene.name == "raw maths" {
            continue;
        }
        let kinds = [Prune::Off, Prune::Exact, Prune::Skip];
        let hits = kinds.map(|k| run(&scene.shape, k));
        let same = (0..hits[0].t.len()).filter(|&i| hits[0].t[i] != hits[1].t[i]).count();
        let status = (0..hits[0].t.len()).filter(|&i| hits[0].status[i] != hits[2].status[i]).count();
        let steps = hits.each_ref().map(|h| h.steps.iter().map(|s| u64::from(*s)).sum::<u64>());
        let shape = &scene.shape;
        let [off, exact, skip] = clock::minima(
            0.6,
            [&mut || drop(run(shape, Prune::Off)), &mut || drop(run(shape, Prune::Exact)), &mut || {
                drop(run(shape, Prune::Skip))
            }],
        )
        .map(|s| s * 1e3);
        println!(
            "{:12} off {off:8.1} ms  exact {exact:8.1} ({:.2})  skip {skip:8.1} ({:.2})  steps {steps:?}  nodes {:?}  differ {same} {status} arena {}",
            scene.name,
            off / exact,
            off / skip,
            hits.each_ref().map(|h| h.work.node_evaluations),
            hits[2].work.arena_bytes
        );
    }
}
