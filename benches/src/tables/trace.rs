//! What a picture costs: against peers, against packets written by hand, by size, by threads, by parts.

use std::{hint::black_box, time::Instant};

use sdfrs_core::{Control, Limits, Program, Prune, Shape, pool};
use sdfrs_trace::{
    Tracer,
    camera::{Camera, Kind},
    render::{self, Picture},
    shade::{PointLight, Surface},
};

use super::bar;
use crate::{
    Scene, clock,
    pruned_peer::{Pruned, TILES},
    scenes, trace,
};

/// Seconds a rival gets for pictures.
const LONG: f64 = 1.0;

/// Runs jobs in turn; milliseconds each.
fn milliseconds<const N: usize>(jobs: [&mut dyn FnMut(); N]) -> [f64; N] {
    clock::minima(LONG, jobs).map(|s| s * 1e3)
}

/// Unpruned against fidget's JIT, pruned against the scalar loop: bars for the latter.
pub fn peers() {
    println!(
        "| scene, 512x512 | ours unpruned, ms | `exact` | `skip` | fidget JIT, 32x32 tiles | scalar loop | unpruned / JIT | scalar / skip | bar |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let lines = trace::picture(512);
    let batch = trace::Batch::new(512);
    for (scene, least) in [(scenes::csg(), 10.0), (scenes::spheres(1000), 100.0)] {
        let program = Program::<f32>::for_tracing(&scene.shape).unwrap();
        let mut jit = scene.hand.jit();
        alike(batch.trace(&program), trace::waves(&mut jit, &lines));
        let [ours, exact, skip, jit, scalar] = milliseconds([
            &mut || {
                black_box(batch.trace(&program));
            },
            &mut || {
                black_box(batch.pruned(&program, Prune::Exact));
            },
            &mut || {
                black_box(batch.pruned(&program, Prune::Skip));
            },
            &mut || {
                black_box(trace::waves(&mut jit, &lines));
            },
            &mut || {
                black_box(trace::scalar(&scene, &lines));
            },
        ]);
        println!(
            "| {} | {ours:.1} | {exact:.1} | {skip:.1} | {jit:.1} | {scalar:.1} | {:.2} | {:.1} | >= {least}{} |",
            scene.name,
            ours / jit,
            scalar / skip,
            if scalar >= least * skip { "" } else { " (missed)" }
        );
    }
    println!();
}

/// Panics unless two tracers hit the same rays, a few grazing ones apart.
fn alike(a: trace::Totals, b: trace::Totals) -> usize {
    let differ = a.hits.abs_diff(b.hits);
    assert!(differ <= 300, "{a:?} {b:?}");
    differ
}

/// The strongest opponent: fidget with intervals and simplified tapes for each tile and slab.
pub fn pruned() {
    println!(
        "| scene, 512x512 | unpruned, ms | `exact` | `skip` | fidget JIT, its own pruning | slabs | skip / JIT | bar | skip / unpruned | bar | exact / unpruned | bar | rays that differ |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let nested = trace::nested(512, TILES);
    let batch = trace::Batch::new(512);
    let limits = [(None, Some(0.5), None), (Some(1.0 / 12.0), Some(1.0 / 12.0), Some(1.0 / 8.0))];
    for (scene, bars) in [scenes::csg(), scenes::spheres(1000)].iter().zip(limits) {
        let program = Program::<f32>::for_tracing(&scene.shape).unwrap();
        let mut jit = scene.hand.pruned_jit();
        let depths = best_slabs(&mut jit, &nested);
        let off = batch.trace(&program);
        let differ =
            alike(off, jit.trace(&nested, depths)).max(alike(off, batch.pruned(&program, Prune::Skip)));
        assert_eq!(off, batch.pruned(&program, Prune::Exact));
        let [ours, exact, skip, peer] = milliseconds([
            &mut || {
                black_box(batch.trace(&program));
            },
            &mut || {
                black_box(batch.pruned(&program, Prune::Exact));
            },
            &mut || {
                black_box(batch.pruned(&program, Prune::Skip));
            },
            &mut || {
                black_box(jit.trace(&nested, depths));
            },
        ]);
        println!(
            "| {} | {ours:.1} | {exact:.1} | {skip:.1} | {peer:.1} | {} and {} | {:.3} | {} | {:.3} | {} | {:.3} | {} | {differ} |",
            scene.name,
            depths[0],
            depths[1],
            skip / peer,
            bar(bars.0, skip / peer),
            skip / ours,
            bar(bars.1, skip / ours),
            exact / ours,
            bar(bars.2, exact / ours)
        );
    }
    println!();
}

/// The depths that serve the opponent best.
fn best_slabs(jit: &mut Pruned, lines: &[trace::Line]) -> [f32; 2] {
    let mut best = (f64::INFINITY, [0.0; 2]);
    for depths in [[0.5, 0.25], [1.0, 0.5], [2.0, 1.0]] {
        let start = clock::cpu();
        black_box(jit.trace(lines, depths));
        let seconds = clock::cpu() - start;
        if seconds < best.0 {
            best = (seconds, depths);
        }
    }
    best.1
}

/// The interpreter beside the same scene compiled by hand for AVX-512.
#[cfg(target_arch = "x86_64")]
pub fn packets() {
    use crate::packet;
    if !packet::available() {
        println!("no AVX-512 here: no packets\n");
        return;
    }
    let lines = trace::picture(512);
    let (batch, rays) = (trace::Batch::new(512), packet::Rays::new(&lines));
    let scene = scenes::csg();
    let program = Program::<f32>::for_tracing(&scene.shape).unwrap();
    let (a, b) = (trace::scalar(&scene, &lines), packet::trace(&rays));
    assert_eq!(a, b, "packets and the scalar loop");
    let [ours, packets] = milliseconds([
        &mut || {
            black_box(batch.trace(&program));
        },
        &mut || {
            black_box(packet::trace(&rays));
        },
    ]);
    println!(
        "| scene, 512x512 | ours unpruned, ms | packets by hand | ours / packets | bar |\n|---|---|---|---|---|"
    );
    println!(
        "| csg | {ours:.1} | {packets:.1} | {:.2} | {} |\n",
        ours / packets,
        bar(Some(1.3), ours / packets)
    );
}

/// Cost by the number of spheres.
pub fn growth() {
    println!("| spheres, 512x512 | `skip`, ms | over 1,000 spheres | bar |\n|---|---|---|---|");
    let batch = trace::Batch::new(512);
    let programs = [100, 1_000, 10_000, 100_000]
        .map(|n| (n, Program::<f32>::for_tracing(&scenes::spheres(n).shape).unwrap()));
    let run = |i: usize| {
        black_box(batch.pruned(&programs[i].1, Prune::Skip));
    };
    let ms = milliseconds([&mut || run(0), &mut || run(1), &mut || run(2), &mut || run(3)]);
    for ((n, _), ms_of) in programs.iter().zip(ms) {
        let limit = (*n == 100_000).then_some(6.0);
        println!("| {n} | {ms_of:.1} | {:.2} | {} |", ms_of / ms[1], bar(limit, ms_of / ms[1]));
    }
    println!();
}

/// Wall clock, because the point is not to wait; meaningless on a busy machine.
pub fn threads() {
    println!("| scene, 512x512 | one thread, ms | two | one / two | bar |\n|---|---|---|---|---|");
    let batch = trace::Batch::new(512);
    for scene in [scenes::csg(), scenes::spheres(1000)] {
        let program = Program::<f32>::for_tracing(&scene.shape).unwrap();
        let mut best = [f64::INFINITY; 2];
        for _ in 0..5 {
            for (n, best) in best.iter_mut().enumerate() {
                pool::set_threads(n + 1);
                batch.trace(&program);
                let start = Instant::now();
                black_box(batch.trace(&program));
                *best = best.min(start.elapsed().as_secs_f64() * 1e3);
            }
        }
        let ratio = best[0] / best[1];
        let missed = if ratio >= 1.9 { "" } else { " (missed)" };
        println!("| {} | {:.1} | {:.1} | {ratio:.2} | >= 1.9{missed} |", scene.name, best[0], best[1]);
    }
    pool::set_threads(1);
    println!();
}

/// What a picture costs beside its rays' walks: camera, normals, shading, arrays.
pub fn parts() {
    println!("| scene, 1280x720 | picture, ms | its rays alone | shading | beyond tracing | bar |");
    println!("|---|---|---|---|---|---|");
    let camera = camera();
    for scene in [scenes::csg(), scenes::spheres(1000)] {
        let Scene { shape, name, .. } = &scene;
        let batch = camera_rays(&camera);
        let program = Program::<f32>::for_tracing(shape).unwrap();
        let mut shading = f64::INFINITY;
        let [whole, rays] = milliseconds([
            &mut || {
                let made = picture(shape, &camera);
                shading = shading.min(made.timings.shade_seconds * 1e3);
                black_box(made);
            },
            &mut || {
                black_box(batch.pruned(&program, Prune::Auto { skip: true }));
            },
        ]);
        let beyond = 1.0 - rays / whole;
        println!(
            "| {name} | {whole:.1} | {rays:.1} | {shading:.1} | {:.1} % | 15 %{} |",
            beyond * 100.0,
            if beyond <= 0.15 { "" } else { " (missed)" }
        );
    }
    println!();
}

/// The camera of the other pictures, for a screen.
pub fn camera() -> Camera {
    let kind = Kind::Pinhole { fov_deg: 40.0 };
    let (origin, up) = ([0.6, 1.2, 4.2], [0.0, 1.0, 0.0]);
    Camera { kind, origin, target: [0.0; 3], up, width: 1280, height: 720 }
}

pub fn picture(shape: &Shape, camera: &Camera) -> Picture<f32> {
    let lights = [PointLight::at([4.0, 6.0, 3.0])];
    let scene = render::Scene { shape, camera, lights: &lights, surface: Surface::default() };
    let limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 256, prune: Prune::Auto { skip: true } };
    render::render(&scene, &Tracer::Basic { guards: true }, &limits, 10.0, &Control::new()).unwrap()
}

/// Its rays, made beforehand.
pub fn camera_rays(camera: &Camera) -> trace::Batch {
    let pixels = (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y)));
    let line = |(x, y)| {
        let (o, d) = camera.ray(x, y).unwrap();
        trace::Line { o: o.map(|v| v as f32), d: d.map(|v| v as f32) }
    };
    trace::Batch::of_lines(pixels.map(line).collect(), camera.width as usize)
}
