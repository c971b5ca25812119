//! Where interpreting a scene beats compiling it: `cargo run -p sdfrs-gpu --release --example break_even`.
//!
//! For unions of n boxes: what the first call costs over a later one (compiling), and a later one's time a
//! point, compiled and interpreted. Processor time where the adapter is one in software, so that other
//! work on the machine doesn't count; else wall time.

mod clock;

use std::{error::Error, time::Instant};

use sdfrs_core::{
    Shape, Value,
    graph::{Form, Graph},
};
use sdfrs_gpu::{
    Choice, Device, Emitted, GpuField,
    emit::{PART, emit_in_parts, emit_interpreted},
};

fn boxes(n: usize) -> Result<Shape, Box<dyn Error>> {
    let place = |i: usize, k: usize| ((i * k) % 97) as f64 / 48.5 - 1.0;
    let all = (0..n).map(|i| {
        let size = Value::Vec3([0.05 + 0.001 * (i % 50) as f64, 0.1, 0.15]);
        let cube = Shape::build("box", vec![("size".into(), size)], vec![])?;
        let offset = Value::Vec3([place(i, 31), place(i, 57), place(i, 83) + 1e-4 * i as f64]);
        Shape::build("translate", vec![("offset".into(), offset)], vec![cube])
    });
    Ok(Shape::build("union", vec![("k".into(), Value::Num(0.0))], all.collect::<Result<_, _>>()?)?)
}

fn measure(device: &std::sync::Arc<Device>, emitted: Emitted) -> Result<(f64, f64), Box<dyn Error>> {
    let start = Instant::now();
    let now = || clock::seconds(device.is_software(), start);
    let points: Vec<[f32; 3]> = (0..1 << 15).map(|i| [i as f32 * 6e-5 - 1.0, 0.3, -0.2]).collect();
    let before = now();
    let field = GpuField::of(device, emitted)?;
    field.evaluate(&points[..64])?;
    let first = now() - before;
    let before = now();
    let mut runs = 0;
    while runs < 3 || now() - before < 0.5 {
        field.evaluate(&points)?;
        runs += 1;
    }
    Ok((first, (now() - before) / f64::from(runs) / points.len() as f64))
}

fn main() -> Result<(), Box<dyn Error>> {
    let device = Device::request(Choice::Any)?;
    println!("{} ({})", device.info().name, device.info().driver);
    println!("boxes | first call, s: compiled, interpreted | ns a point: compiled, interpreted");
    for n in [10, 30, 100, 300, 600] {
        let graph = Graph::new(&boxes(n)?, Form::Value)?;
        let compiled = measure(&device, emit_in_parts(&graph, false, PART)?)?;
        let interpreted = measure(&device, emit_interpreted(&graph, false)?)?;
        let nanos = [compiled.1, interpreted.1].map(|s| s * 1e9);
        println!("{n:5} | {:.2} {:.2} | {:.0} {:.0}", compiled.0, interpreted.0, nanos[0], nanos[1]);
    }
    Ok(())
}
