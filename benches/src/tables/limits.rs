//! How far the physical limit is: arithmetic a second, and balls that cover a ray.

use std::hint::black_box;

use sdfrs_core::{Program, Scratch};

use super::SECONDS;
use crate::{clock, limits, points, scenes, trace};

/// Arithmetic of the evaluator against what the core can do.
pub fn arithmetic() {
    if sdfrs_core::eval::isa().name() != "avx512" {
        println!("the peak is measured in AVX-512 only\n");
        return;
    }
    let (single, double) = (limits::single(), limits::double());
    println!("| one core | + and *, 10^9/s | roots | quotients |\n|---|---|---|---|");
    for (name, p) in [("f32", &single), ("f64", &double)] {
        println!("| {name} | {:.1} | {:.2} | {:.2} |", p.simple / 1e9, p.roots / 1e9, p.quotients / 1e9);
    }
    println!();
    println!(
        "| scene, 1,024 points | + * < | roots | quotients | least, ns (f32) | ours | least / ours | least (f64) | f64 / f32 at best |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let n = 1024;
    let p = points(n, 1.4);
    let p = [&p[0][..], &p[1], &p[2]];
    for scene in scenes::all() {
        let work = scene.hand.work();
        let program = Program::<f32>::values(&scene.shape).unwrap();
        let (mut scratch, mut out) = (Scratch::new(), vec![0.0; n]);
        let [ours] = clock::minima(
            SECONDS,
            [&mut || program.evaluate(&mut scratch, black_box(p), black_box(&mut out))],
        )
        .map(|s| s * 1e9 / n as f64);
        let (least, most) = (single.least(work) * 1e9, double.least(work) * 1e9);
        println!(
            "| {} | {} | {} | {} | {least:.2} | {ours:.2} | {:.2} | {most:.2} | {:.2} |",
            scene.name,
            work.simple,
            work.roots,
            work.quotients,
            least / ours,
            most / least
        );
    }
    println!();
}

/// Samples a ray takes against the fewest balls on it that cover the way.
pub fn balls() {
    println!("| scene, rays | Hart's samples a ray | fewest balls | samples / balls |\n|---|---|---|---|");
    let lines = trace::picture(512);
    for (scene, every) in [(scenes::sphere(), 1013), (scenes::csg(), 1013), (scenes::spheres(1000), 8111)] {
        let (mut steps, mut fewest, mut rays) = (0u64, 0u64, 0u64);
        for line in lines.iter().step_by(every) {
            let (s, f) = scene.hand.balls(line);
            (steps, fewest, rays) = (steps + u64::from(s), fewest + u64::from(f), rays + 1);
        }
        println!(
            "| {}, {rays} | {:.1} | {:.1} | {:.2} |",
            scene.name,
            steps as f64 / rays as f64,
            fewest as f64 / rays as f64,
            steps as f64 / fewest as f64
        );
    }
    println!();
}
