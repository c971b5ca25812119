//! Where a repetition folds space its copies change places at once: whatever a cell's middle tells of one side tells
//! nothing of the other. Over random scenes of repeated parts `Exact` gives the unpruned trace to the bit, and
//! `Skip` its statuses but for rays that graze; most cells of such scenes have a fold inside.
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use common::{Random, bits, build, camera, trace};
use sdfrs_core::{Prune, Shape, Status, Value, eval::Native};
use sdfrs_trace::{Form, Tracer};

/// A part, moved out of its cell's middle, and copies of it or of a union with another.
fn repeated(random: &mut Random) -> Shape {
    let part = |random: &mut Random| {
        let part = match random.below(3) {
            0 => build("sphere", &[("radius", Value::Num(random.within(0.05, 0.25)))], &[]),
            1 => build("box", &[("size", random.vector(0.1, 0.4))], &[]),
            _ => build("torus", &[("major", Value::Num(0.2)), ("minor", Value::Num(0.06))], &[]),
        };
        build("translate", &[("offset", random.vector(-0.3, 0.3))], &[&part])
    };
    let (a, b) = (part(random), part(random));
    let k = if random.below(2) == 0 { 0.0 } else { 0.1 };
    let both = build("union", &[("k", Value::Num(k))], &[&a, &b]);
    let side = |random: &mut Random| if random.below(4) == 0 { 0.0 } else { random.within(0.6, 1.4) };
    let period = [random.within(0.6, 1.4), side(random), side(random)];
    let count = Value::Ints3(period.map(|p| if p > 0.0 { 1 + random.below(2) as i64 } else { 0 }));
    build("repeat", &[("period", Value::Vec3(period)), ("count", count)], &[&both])
}

fn compare<T: Native>(seed: u64) {
    let mut random = Random(seed);
    let (mut hit, mut other) = (0, 0);
    for scene in 0..60 {
        let parts: Vec<Shape> = (0..2 + random.below(3)).map(|_| repeated(&mut random)).collect();
        let shape = build("union", &[("k", Value::Num(0.0))], &parts.iter().collect::<Vec<_>>());
        let view = camera(&mut random);
        let (form, guards) = (Form::Y2023, true);
        let tracer = [Tracer::Basic { guards }, Tracer::Relaxed { omega: 1.5, form, guards }][scene % 2];
        let off = trace::<T>(&shape, &view, &tracer, Prune::Off);
        let exact = trace::<T>(&shape, &view, &tracer, Prune::Exact);
        for (i, (x, y)) in bits(&off).iter().zip(bits(&exact)).enumerate() {
            assert_eq!(*x, y, "seed {seed}, scene {scene}, {tracer:?}, ray {i}");
        }
        let skip = trace::<T>(&shape, &view, &tracer, Prune::Skip);
        hit += off.status.iter().filter(|s| **s == Status::Hit as u8).count();
        other += off.status.iter().zip(&skip.status).filter(|(a, b)| a != b).count();
    }
    assert!(hit > 20_000 && other * 2_000 < hit, "{hit} hits, {other} other statuses");
}

#[test]
fn folds_inside_cells_change_no_bit() {
    compare::<f32>(1);
    compare::<f64>(2);
}
