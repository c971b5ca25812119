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
use crate::{Scene, clock, pruned_peer::TILES, scenes, trace};

/// What a picture is pruned by unasked.
const PRUNE: Prune = Prune::Auto { skip: true };
/// Seconds a rival gets for pictures.
const LONG: f64 = 1.0;

/// Runs jobs in turn; milliseconds each.
fn milliseconds<const N: usize>(jobs: [&mut dyn FnMut(); N]) -> [f64; N] {
    clock::minima(LONG, jobs).map(|s| s * 1e3)
}

/// The same of jobs of one kind.
fn each<const N: usize>(mut jobs: [impl FnMut(); N]) -> [f64; N] {
    milliseconds(jobs.each_mut().map(|job| job as &mut dyn FnMut()))
}

pub fn peers() {
    println!(
        "| scene, 512x512 | ours unpruned, ms | fidget JIT, 32x32 tiles | scalar loop | ours / JIT | scalar / ours | bar | with skip | rays that differ |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    const SIDE: usize = 512;
    let lines = trace::picture(SIDE);
    let batch = trace::Batch::picture(SIDE);
    for (scene, least) in [(scenes::csg(), 10.0), (scenes::spheres(1000), 100.0)] {
        let skips = least > 10.0;
        let program = Program::<f32>::for_tracing(&scene.shape).unwrap();
        let mut jit = scene.hand.jit();
        batch.trace(&program);
        let (a, b) = (batch.totals(), trace::waves(&mut jit, &lines));
        let differ = a.hits.abs_diff(b.hits);
        assert!(differ * 1000 <= lines.len(), "{a:?} {b:?}");
        let [ours, skip, jit, scalar] = milliseconds([
            &mut || {
                batch.trace(&program);
            },
            &mut || {
                batch.pruned(&program, Prune::Skip);
            },
            &mut || {
                black_box(trace::waves(&mut jit, &lines));
            },
            &mut || {
                black_box(trace::scalar(&scene, &lines));
            },
        ]);
        println!(
            "| {} | {ours:.1} | {jit:.1} | {scalar:.1} | {:.2} | {:.1} | >= {least}{}{} | {:.1} | {differ} |",
            scene.name,
            ours / jit,
            scalar / ours,
            if skips { " with skip" } else { "" },
            if scalar >= least * if skips { skip } else { ours } { "" } else { " (missed)" },
            scalar / skip
        );
    }
    println!();
}

/// What pruning is worth, and the strongest opponent: fidget with intervals and simplified tapes for each
/// tile and slab.
pub fn pruned() {
    println!(
        "| scene, 512x512 | unpruned, ms | exact | skip | unpruned / exact | bar | unpruned / skip | bar | fidget JIT, its own pruning | skip / JIT | bar |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    const SIDE: usize = 512;
    let lines = trace::picture(SIDE);
    let nested = trace::nested(SIDE, TILES);
    let batch = trace::Batch::picture(SIDE);
    for (scene, bars) in [
        (scenes::csg(), [None, Some(2.0), None]),
        (scenes::spheres(1000), [Some(8.0), Some(12.0), Some(12.0)]),
    ] {
        let program = Program::<f32>::for_tracing(&scene.shape).unwrap();
        batch.trace(&program);
        let whole = batch.totals();
        batch.pruned(&program, Prune::Exact);
        assert_eq!(whole, batch.totals(), "{}", scene.name);
        let mut jit = scene.hand.pruned_jit();
        let mut best = [f64::INFINITY; 4];
        for depths in [[0.5f32, 0.25], [1.0, 0.5], [2.0, 1.0]] {
            let peer = jit.trace(&nested, depths);
            assert!(whole.hits.abs_diff(peer.hits) * 1000 <= lines.len(), "{whole:?} {peer:?}");
            let times = milliseconds([
                &mut || {
                    batch.trace(&program);
                },
                &mut || {
                    batch.pruned(&program, Prune::Exact);
                },
                &mut || {
                    batch.pruned(&program, Prune::Skip);
                },
                &mut || {
                    black_box(jit.trace(&nested, depths));
                },
            ]);
            best = std::array::from_fn(|i| best[i].min(times[i]));
        }
        let [off, exact, skip, peer] = best;
        let gains = [off / exact, off / skip, peer / skip];
        let marks: Vec<String> = gains
            .iter()
            .zip(bars)
            .map(|(gain, bar)| {
                bar.map_or(String::new(), |bar| {
                    format!("{bar}{}", if *gain >= bar { "" } else { " (missed)" })
                })
            })
            .collect();
        println!(
            "| {} | {off:.1} | {exact:.1} | {skip:.1} | {:.1} | {} | {:.1} | {} | {peer:.1} | 1 / {:.1} | {} |",
            scene.name, gains[0], marks[0], gains[1], marks[1], gains[2], marks[2]
        );
    }
    println!();
}

/// The interpreter beside the same scene compiled by hand for AVX-512.
#[cfg(target_arch = "x86_64")]
pub fn packets() {
    use crate::packet;
    if !packet::available() {
        println!("no AVX-512 here: no packets\n");
        return;
    }
    const SIDE: usize = 512;
    let lines = trace::picture(SIDE);
    let (batch, rays) = (trace::Batch::picture(SIDE), packet::Rays::new(&lines));
    let scene = scenes::csg();
    let program = Program::<f32>::for_tracing(&scene.shape).unwrap();
    let (a, b) = (trace::scalar(&scene, &lines), packet::trace(&rays));
    assert_eq!(a, b, "packets and the scalar loop");
    let [ours, packets] = milliseconds([
        &mut || {
            batch.trace(&program);
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

/// Cost by the number of spheres, by turns.
pub fn growth() {
    const SIDE: usize = 512;
    const COUNTS: [usize; 4] = [100, 1_000, 10_000, 100_000];
    println!("| spheres, {SIDE}x{SIDE} | skip, ms | over 1,000 spheres | bar |\n|---|---|---|---|");
    let batch = trace::Batch::picture(SIDE);
    let programs = COUNTS.map(|n| Program::<f32>::for_tracing(&scenes::spheres(n).shape).unwrap());
    let times = each(programs.each_ref().map(|program| || batch.pruned(program, Prune::Skip)));
    let [_, thousand, ..] = times;
    for (n, ms) in COUNTS.iter().zip(times) {
        let (ratio, limit) = (ms / thousand, (*n == 100_000).then_some(6.0));
        println!("| {n} | {ms:.1} | {ratio:.2} | {} |", bar(limit, ratio));
    }
    println!();
}

/// What pictures of other sizes cost.
pub fn sizes() {
    println!("| ms | 256x256 | 512x512 | 1024x1024 | 2048x2048 |\n|---|---|---|---|---|");
    let batches = [256, 512, 1024, 2048].map(trace::Batch::picture);
    let spheres = [1_000, 10_000, 100_000].map(|n| (format!("{n} spheres"), scenes::spheres(n)));
    for (what, scene) in [("csg".to_owned(), scenes::csg())].into_iter().chain(spheres) {
        let program = Program::<f32>::for_tracing(&scene.shape).unwrap();
        for (name, prune) in [("exact", Prune::Exact), ("skip", Prune::Skip)] {
            let times = each(batches.each_ref().map(|batch| || batch.pruned(&program, prune)));
            let row = times.map(|ms| format!("{ms:.1}")).join(" | ");
            println!("| {what}, {name} | {row} |");
        }
    }
    println!();
}

/// Wall clock, because the point is not to wait; meaningless on a busy machine.
pub fn threads() {
    println!("| scene, 512x512 | one thread, ms | two | one / two | bar |\n|---|---|---|---|---|");
    const SIDE: usize = 512;
    let batch = trace::Batch::picture(SIDE);
    for scene in [scenes::csg(), scenes::spheres(1000)] {
        let program = Program::<f32>::for_tracing(&scene.shape).unwrap();
        let mut best = [f64::INFINITY; 2];
        // A host may put two processors on one core for seconds: only what lasts longer sees both.
        let begin = Instant::now();
        while begin.elapsed().as_secs_f64() < 6.0 * LONG {
            for (n, best) in best.iter_mut().enumerate() {
                pool::set_threads(n + 1);
                batch.trace(&program);
                let start = Instant::now();
                batch.trace(&program);
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

/// What a picture costs beside its rays' walks: normals, shading, arrays. Most rays are made on their way, the others never.
pub fn parts() {
    println!(
        "| scene, 1280x720 | picture, ms | its tracing | shading | beyond tracing | bar | its rays from arrays |"
    );
    println!("|---|---|---|---|---|---|---|");
    let camera = camera();
    for scene in [scenes::csg(), scenes::spheres(1000)] {
        let Scene { shape, name, .. } = &scene;
        let lines = camera_lines(&camera);
        let batch = trace::Batch::of(&lines, camera.width as usize);
        let program = Program::<f32>::for_tracing(shape).unwrap();
        let mut shading = f64::INFINITY;
        let [whole, tracing, arrays] = milliseconds([
            &mut || {
                let made = picture(shape, &camera);
                shading = shading.min(made.timings.shade_seconds * 1e3);
                black_box(made);
            },
            &mut || {
                let (tracer, control) = (Tracer::Basic { guards: true }, Control::new());
                black_box(
                    render::trace_camera::<f32>(shape, &camera, &tracer, &limits(), 10.0, &control).unwrap(),
                );
            },
            &mut || {
                batch.fresh(&program, PRUNE);
            },
        ]);
        let beyond = 1.0 - tracing / whole;
        println!(
            "| {name} | {whole:.1} | {tracing:.1} | {shading:.1} | {:.1} % | 15 %{} | {arrays:.1} |",
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

fn limits() -> Limits {
    Limits { eps: 1e-4, cone: 0.0, max_steps: 256, prune: PRUNE }
}

pub fn picture(shape: &Shape, camera: &Camera) -> Picture<f32> {
    let lights = [PointLight::at([4.0, 6.0, 3.0])];
    let scene = render::Scene { shape, camera, lights: &lights, surface: Surface::default() };
    render::render(&scene, &Tracer::Basic { guards: true }, &limits(), 10.0, &Control::new()).unwrap()
}

pub fn camera_lines(camera: &Camera) -> Vec<trace::Line> {
    let pixels = (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y)));
    let line = |(x, y)| {
        let (o, d) = camera.ray(x, y).unwrap();
        trace::Line { o: o.map(|v| v as f32), d: d.map(|v| v as f32) }
    };
    pixels.map(line).collect()
}
