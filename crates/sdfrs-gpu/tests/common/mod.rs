//! A device to test on, and comparisons with the CPU.
#![allow(dead_code, clippy::unwrap_used, clippy::panic)]

use std::sync::Arc;

use sdfrs_core::{
    Program, Scratch, Shape,
    graph::{Form, Graph},
    op::execute,
    tape::Tape,
};
use sdfrs_gpu::{Choice, Device};

pub mod grids;
#[path = "../../../sdfrs-core/tests/common/mod.rs"]
pub mod shapes;

/// Any adapter. Without one the test is left out, and says so; SDFRS_REQUIRE_GPU=1 makes that a failure.
pub fn device() -> Option<Arc<Device>> {
    match Device::request(Choice::Any) {
        Ok(device) => Some(device),
        Err(error) if std::env::var_os("SDFRS_REQUIRE_GPU").is_some() => panic!("{error}"),
        Err(error) => {
            eprintln!("left out: {error}");
            None
        }
    }
}

/// Points around the origin, some of them on planes of symmetry, where signs and ties are decided.
pub fn points(n: usize, radius: f64) -> Vec<[f32; 3]> {
    let mut random = shapes::Random(11);
    let mut all: Vec<[f32; 3]> = (0..n).map(|_| random.point(radius).map(|v| v as f32)).collect();
    all.extend([
        [0.0; 3],
        [0.5, 0.0, 0.0],
        [0.0, -0.25, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [-0.5, 0.5, 0.5],
    ]);
    all
}

fn columns(points: &[[f32; 3]]) -> [Vec<f32>; 3] {
    std::array::from_fn(|i| points.iter().map(|p| p[i]).collect())
}

/// The CPU's f32 values.
pub fn values(shape: &Shape, points: &[[f32; 3]]) -> Vec<f32> {
    let (p, mut out) = (columns(points), vec![0.0; points.len()]);
    let program = Program::<f32>::values(shape).unwrap();
    program.evaluate(&mut Scratch::new(), [&p[0], &p[1], &p[2]], &mut out);
    out
}

/// A graph as it stands, on the CPU.
#[allow(unsafe_code)]
pub fn run(graph: &Graph, points: &[[f32; 3]]) -> Vec<f32> {
    let tape = Tape::<f32>::plain(graph);
    points
        .iter()
        .map(|p| {
            let mut slots = vec![0f32; tape.slots().max(3)];
            slots[..3].copy_from_slice(p);
            for ins in tape.instructions() {
                // SAFETY: the tape is checked, and there is one value for each of its slots.
                unsafe { execute::<f32>(ins, slots.as_mut_ptr(), 1, &tape.tables()) };
            }
            slots[tape.root()]
        })
        .collect()
}

/// What a tracer walks, on the CPU.
pub fn walk(shape: &Shape, points: &[[f32; 3]]) -> Vec<f32> {
    let (p, mut out) = (columns(points), vec![0.0; points.len()]);
    let program = Program::<f32>::for_tracing(shape).unwrap();
    program.evaluate(&mut Scratch::new(), [&p[0], &p[1], &p[2]], &mut out);
    out
}

/// The CPU's f32 gradients and values.
pub fn gradients(shape: &Shape, points: &[[f32; 3]]) -> Vec<[f32; 4]> {
    gradients_of(shape, Form::Value, points)
}

pub fn gradients_of(shape: &Shape, form: Form, points: &[[f32; 3]]) -> Vec<[f32; 4]> {
    let program = match form {
        Form::Value => Program::<f32>::values(shape),
        _ => Program::<f32>::for_tracing(shape),
    };
    let p = columns(points);
    let mut out: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; points.len()]);
    let [v, x, y, z] = &mut out;
    program.unwrap().gradient(&mut Scratch::new(), [&p[0], &p[1], &p[2]], [v, x, y, z]);
    (0..points.len()).map(|i| [out[1][i], out[2][i], out[3][i], out[0][i]]).collect()
}
