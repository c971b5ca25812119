//! Criterion groups: `eval` asks what a point costs, `trace` what a picture costs; both against peers
//! in the same process. `cargo run -p sdfrs-benches --bin ratios` prints their ratios.
#![allow(clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sdfrs_benches::{points, scenes, trace};
use sdfrs_core::{Program, Scratch};

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
    let batch = trace::Batch::new(&lines);
    for scene in [scenes::csg(), scenes::spheres(1000)] {
        let program = Program::<f32>::for_tracing(&scene.shape).unwrap();
        let mut jit = scene.hand.jit();
        let (a, b) = (batch.trace(&program), trace::waves(&mut jit, &lines));
        assert!(a.hits.abs_diff(b.hits) * 1000 <= lines.len(), "{a:?} {b:?}");
        let mut group = c.benchmark_group(format!("trace/{}", scene.name));
        group.sample_size(10);
        group.bench_function("ours", |b| b.iter(|| batch.trace(&program)));
        group.bench_function("fidget", |b| b.iter(|| trace::waves(&mut jit, &lines)));
        group.bench_function("scalar", |b| b.iter(|| trace::scalar(&scene, &lines)));
        group.finish();
    }
}

criterion_group!(speed, eval, pictures);
criterion_main!(speed);
