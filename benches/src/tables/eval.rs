//! What a point costs: values, precisions, gradients.

use std::hint::black_box;

use sdfrs_core::{Program, Scratch};

use super::{SECONDS, bar};
use crate::{Scene, clock, points, scenes};

/// The bars of issue 4: at 1,024 and at 16 points.
fn bars(name: &str) -> [Option<f64>; 2] {
    match name {
        "sphere" => [Some(1.0), None],
        "csg" => [Some(0.40), Some(0.55)],
        "spheres1000" => [Some(0.50), Some(0.8)],
        "gyroid" => [Some(0.08), None],
        "mandelbulb" => [Some(0.30), None],
        _ => [Some(1.0), Some(2.2)],
    }
}

pub fn eval() {
    println!(
        "| scene | points | ours, ns/point | fidget JIT | scalar loop | ours / JIT | bar | ours / scalar |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for scene in scenes::all() {
        let all = points(1024, 1.4);
        scene.agree([&all[0], &all[1], &all[2]]);
        for (n, bar_of) in [(1024, 0), (16, 1)] {
            let [ours, jit, scalar] = against(&scene, n, &all);
            let (a, b) = (ours / jit, ours / scalar);
            let bar = bar(bars(scene.name)[bar_of], a);
            println!(
                "| {} | {n} | {ours:.2} | {jit:.2} | {scalar:.2} | {a:.2} | {bar} | {b:.3} |",
                scene.name
            );
        }
    }
    println!();
}

/// Nanoseconds a point: ours, JIT, scalar loop.
fn against(scene: &Scene, n: usize, all: &[Vec<f32>; 3]) -> [f64; 3] {
    let p = [&all[0][..n], &all[1][..n], &all[2][..n]];
    let program = Program::<f32>::values(&scene.shape).unwrap();
    let (mut scratch, mut out, mut out2) = (Scratch::new(), vec![0.0; n], vec![0.0; n]);
    let mut jit = scene.hand.jit();
    clock::minima(
        SECONDS,
        [
            &mut || program.evaluate(&mut scratch, black_box(p), black_box(&mut out)),
            &mut || {
                black_box(jit.eval(black_box(p), |v| v[0]));
            },
            &mut || scene.hand.scalar(black_box(p), black_box(&mut out2)),
        ],
    )
    .map(|s| s * 1e9 / n as f64)
}

/// Spheres found by place against the same asked one by one, at points among them and around them.
pub fn crowds() {
    println!("| spheres | points | asked one by one, ns/point | found by place | ratio |");
    println!("|---|---|---|---|---|");
    for n in [4096, 10_000, 100_000] {
        let scene = scenes::spheres(n);
        let found = Program::<f32>::values(&scene.shape).unwrap();
        let asked = Program::<f32>::for_tracing(&scene.shape).unwrap();
        for (place, reach) in [("among them", 1.5), ("around them", 4.5)] {
            let n_points = 256;
            let p = points(n_points, reach);
            let p = [&p[0][..], &p[1], &p[2]];
            let (mut one, mut other) = (Scratch::new(), Scratch::new());
            let (mut a, mut b) = (vec![0f32; n_points], vec![0f32; n_points]);
            asked.evaluate(&mut one, p, &mut a);
            found.evaluate(&mut other, p, &mut b);
            assert_eq!(a, b, "{n} spheres");
            let [asked, found] = clock::minima(
                SECONDS,
                [&mut || asked.evaluate(&mut one, black_box(p), black_box(&mut a)), &mut || {
                    found.evaluate(&mut other, black_box(p), black_box(&mut b))
                }],
            )
            .map(|s| s * 1e9 / n_points as f64);
            println!("| {n} | {place} | {asked:.0} | {found:.0} | {:.1} |", asked / found);
        }
    }
    println!();
}

pub fn precision() {
    println!("| scene | f32, ns/point | f64 | f64 / f32 | bar | duals (f32) | duals / value | bar |");
    println!("|---|---|---|---|---|---|---|---|");
    for scene in scenes::all() {
        let n = 1024;
        let p = points(n, 1.4);
        let q: [Vec<f64>; 3] = std::array::from_fn(|i| p[i].iter().map(|v| f64::from(*v)).collect());
        let (p, q) = ([&p[0][..], &p[1], &p[2]], [&q[0][..], &q[1], &q[2]]);
        let (f32s, f64s) =
            (Program::<f32>::values(&scene.shape).unwrap(), Program::<f64>::values(&scene.shape).unwrap());
        let (mut single, mut duals, mut double) = (Scratch::new(), Scratch::new(), Scratch::new());
        let (mut a, mut b) = (vec![0f32; n], vec![0f64; n]);
        let mut g: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; n]);
        let [s, d, grad] = clock::minima(
            SECONDS,
            [
                &mut || f32s.evaluate(&mut single, black_box(p), black_box(&mut a)),
                &mut || f64s.evaluate(&mut double, black_box(q), black_box(&mut b)),
                &mut || {
                    let [v, x, y, z] = &mut g;
                    f32s.gradient(&mut duals, black_box(p), [v, x, y, z]);
                },
            ],
        )
        .map(|s| s * 1e9 / n as f64);
        println!(
            "| {} | {s:.2} | {d:.2} | {:.2} | {} | {grad:.2} | {:.2} | {} |",
            scene.name,
            d / s,
            bar(Some(2.5), d / s),
            grad / s,
            bar(Some(4.0), grad / s)
        );
    }
    println!();
}
