//! Criterion groups, a question each: `eval` what a point costs, `precision` what f64 and gradients cost,
//! `trace` what a picture costs, `growth` how that grows, `threads` what a second one brings, `parts` what a
//! picture costs beside its rays; against peers in the same process. `cargo run -p sdfrs-benches --bin ratios` prints their ratios.
#![allow(clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sdfrs_benches::{points, pruned_peer::TILES, scenes, tables, trace};
use sdfrs_core::{Program, Prune, Scratch};

fn eval(c: &mut Criterion) {
    for scene in scenes::all() {
        let all = points(1024, 1.4);
        scene.agree([&all[0], &all[1], &all[2]]);
        let program = Program::<f32>::values(&scene.shape).unwrap();
        for n in [1024usize, 16] {
            let p = [&all[0][..n], &all[1][..n], &all[2][..n]];
            let mut group = c.benchmark_group(format!("eval/{}/{n}", scene.name));
            group.throughput(Throughput::Elements(n as u64));
            let (mut scratch, mut out) = (Scratch::new(), vec![0.0; n]);
            group.bench_function("ours", |b| {
                b.iter(|| program.evaluate(&mut scratch, black_box(p), &mut out))
            });
            let mut jit = scene.hand.jit();
            group.bench_function("fidget", |b| {
                b.iter(|| {
                    black_box(jit.eval(black_box(p), |v| v[0]));
                })
            });
            group.bench_function("scalar", |b| {
                b.iter(|| scene.hand.scalar(black_box(p), black_box(&mut out)))
            });
            group.finish();
        }
    }
}

fn pictures(c: &mut Criterion) {
    sdfrs_core::pool::set_threads(1);
    let lines = trace::picture(512);
    let batch = trace::Batch::picture(512);
    for scene in [scenes::csg(), scenes::spheres(1000)] {
        let program = Program::<f32>::for_tracing(&scene.shape).unwrap();
        let mut jit = scene.hand.jit();
        batch.trace(&program);
        let (a, b) = (batch.totals(), trace::waves(&mut jit, &lines));
        assert!(a.hits.abs_diff(b.hits) * 1000 <= lines.len(), "{a:?} {b:?}");
        let mut group = c.benchmark_group(format!("trace/{}", scene.name));
        group.sample_size(10);
        group.bench_function("ours", |b| b.iter(|| batch.trace(&program)));
        group.bench_function("fidget", |b| b.iter(|| trace::waves(&mut jit, &lines)));
        group.bench_function("scalar", |b| b.iter(|| trace::scalar(&scene, &lines)));
        group.finish();
    }
}

fn precision(c: &mut Criterion) {
    for scene in scenes::all() {
        let n = 1024;
        let p = points(n, 1.4);
        let q: [Vec<f64>; 3] = std::array::from_fn(|i| p[i].iter().map(|v| f64::from(*v)).collect());
        let (p, q) = ([&p[0][..], &p[1], &p[2]], [&q[0][..], &q[1], &q[2]]);
        let (single, double) =
            (Program::<f32>::values(&scene.shape).unwrap(), Program::<f64>::values(&scene.shape).unwrap());
        let mut group = c.benchmark_group(format!("precision/{}", scene.name));
        group.throughput(Throughput::Elements(n as u64));
        let (mut scratch, mut out) = (Scratch::new(), vec![0f32; n]);
        group.bench_function("f32", |b| b.iter(|| single.evaluate(&mut scratch, black_box(p), &mut out)));
        let mut g: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; n]);
        group.bench_function("gradient", |b| {
            b.iter(|| {
                let [v, x, y, z] = &mut g;
                single.gradient(&mut scratch, black_box(p), [v, x, y, z]);
            })
        });
        let (mut scratch, mut out) = (Scratch::new(), vec![0f64; n]);
        group.bench_function("f64", |b| b.iter(|| double.evaluate(&mut scratch, black_box(q), &mut out)));
        group.finish();
    }
}

fn pruned_peer(c: &mut Criterion) {
    sdfrs_core::pool::set_threads(1);
    let lines = trace::nested(512, TILES);
    for scene in [scenes::csg(), scenes::spheres(1000)] {
        let mut jit = scene.hand.pruned_jit();
        let mut group = c.benchmark_group(format!("trace/{}", scene.name));
        group.sample_size(10);
        group.bench_function("fidget, pruned", |b| b.iter(|| jit.trace(&lines, [1.0, 0.5])));
        group.finish();
    }
}

#[cfg(target_arch = "x86_64")]
fn packets(c: &mut Criterion) {
    use sdfrs_benches::packet;
    if packet::available() {
        let rays = packet::Rays::new(&trace::picture(512));
        let mut group = c.benchmark_group("trace/csg");
        group.sample_size(10);
        group.bench_function("packets by hand", |b| b.iter(|| packet::trace(&rays)));
        group.finish();
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn packets(_: &mut Criterion) {}

fn growth(c: &mut Criterion) {
    sdfrs_core::pool::set_threads(1);
    let batch = trace::Batch::picture(512);
    let mut group = c.benchmark_group("growth");
    group.sample_size(10);
    for n in [100, 1_000, 10_000, 100_000] {
        let program = Program::<f32>::for_tracing(&scenes::spheres(n).shape).unwrap();
        group.bench_function(format!("{n} spheres"), |b| b.iter(|| batch.pruned(&program, Prune::Skip)));
    }
    group.finish();
}

fn threads(c: &mut Criterion) {
    let batch = trace::Batch::picture(512);
    let program = Program::<f32>::for_tracing(&scenes::csg().shape).unwrap();
    let mut group = c.benchmark_group("threads");
    group.sample_size(10);
    for n in [1, 2] {
        sdfrs_core::pool::set_threads(n);
        group.bench_function(n.to_string(), |b| b.iter(|| batch.trace(&program)));
    }
    group.finish();
}

fn parts(c: &mut Criterion) {
    sdfrs_core::pool::set_threads(1);
    let scene = scenes::csg();
    let camera = tables::trace::camera();
    let batch = trace::Batch::of(&tables::trace::camera_lines(&camera), camera.width as usize);
    let program = Program::<f32>::for_tracing(&scene.shape).unwrap();
    let mut group = c.benchmark_group("parts");
    group.sample_size(10);
    group.bench_function("picture", |b| b.iter(|| tables::trace::picture(&scene.shape, &camera)));
    group.bench_function("rays", |b| b.iter(|| batch.pruned(&program, Prune::Auto { skip: true })));
    group.finish();
}

criterion_group!(speed, eval, precision, pictures, pruned_peer, packets, growth, threads, parts);
criterion_main!(speed);
