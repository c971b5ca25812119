#![allow(clippy::unwrap_used)]
use sdfrs_benches::scenes;
use sdfrs_core::{Control, Limits, Prune};
use sdfrs_trace::{Camera, Tracer, camera::Kind, render::trace_camera};
fn main() {
    sdfrs_core::pool::set_threads(1);
    let a: Vec<String> = std::env::args().collect();
    let scene = match a[1].as_str() {
        "csg" => scenes::csg(),
        "sphere" => scenes::sphere(),
        n => scenes::spheres(n.parse().unwrap()),
    };
    let prune = match a[2].as_str() {
        "off" => Prune::Off,
        "exact" => Prune::Exact,
        _ => Prune::Skip,
    };
    let camera = Camera {
        kind: Kind::Pinhole { fov_deg: 40.0 },
        origin: [2.4, 1.8, 3.2],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        width: 512,
        height: 512,
    };
    let limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 256, prune };
    for i in 0..a[3].parse::<usize>().unwrap() {
        let (h, s) = trace_camera::<f32>(
            &scene.shape,
            &camera,
            &Tracer::Basic { guards: true },
            &limits,
            10.0,
            &Control::new(),
        )
        .unwrap();
        if i == 0 {
            let lanes: u64 = h.work.lengths.values().sum();
            println!(
                "steps {} lanes {} mean {:.1} p50 {} p99 {} nodes {}",
                s.evaluations, lanes, s.mean_ops, s.p50_ops, s.p99_ops, s.node_evaluations
            );
        }
    }
}
