//! Tracers on the GPU, relative to enhanced sphere tracing: the table of Ban & Valasek 2023 on whatever adapter
//! there is. `python3 dev.py bench --gpu [adapter number, or any] [WIDTHxHEIGHT]` prints docs/gpu.md's.
//!
//! A frame's time is what the GPU was busy with its rays, by its own timestamps where it has them, without
//! shading, pipelines and the way of the results to the host; of a driver in software the process's processor
//! time, since its clock runs on while others have the processor. Minima of alternating runs in one process.
//! Before the clock starts every tracer must end its rays as on the CPU.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use sdfrs_core::{Control, Grid, GridValues, Hits, Limits, Program, Prune, Scratch, Shape, Status};
use sdfrs_gpu::{Choice, Device, dispatch::Course, march::Settings, render};
use sdfrs_trace::{
    Form, Tracer,
    camera::{Camera, Kind},
    render::trace_camera,
};

const SIZE: [u32; 2] = [640, 360];
const REPEATS: usize = 5;
const T_MAX: f64 = 100.0;
/// Caps of steps: one that no ray needs, and one as a game would set it.
const CAPS: [u32; 2] = [1000, 32];
/// Nodes along an edge of the discrete input.
const NODES: usize = 128;

fn tracers() -> [(&'static str, Tracer); 6] {
    let guards = true;
    let relaxed = |omega| Tracer::Relaxed { omega, form: Form::Y2023, guards };
    [
        ("basic", Tracer::Basic { guards }),
        ("relaxed 1.2", relaxed(1.2)),
        ("relaxed 1.5", relaxed(1.5)),
        ("enhanced 0.88", Tracer::Enhanced { omega: 0.88, form: Form::Y2023, guards }),
        ("auto-relaxed 0.3", Tracer::AutoRelaxed { beta: 0.3, guards }),
        ("auto-relaxed 0.2", Tracer::AutoRelaxed { beta: 0.2, guards }),
    ]
}
/// Row of the table that is 1.
const REFERENCE: usize = 3;

fn camera(size: [u32; 2]) -> Camera {
    Camera {
        kind: Kind::Pinhole { fov_deg: 40.0 },
        origin: [2.4, 1.8, 3.4],
        target: [0.0, -0.1, 0.0],
        up: [0.0, 1.0, 0.0],
        width: size[0],
        height: size[1],
    }
}

/// The same scene as a grid of samples.
fn discrete(shape: &Shape) -> Shape {
    let at = |i: usize| -1.6 + 3.2 * i as f32 / (NODES - 1) as f32;
    let mut p: [Vec<f32>; 3] = Default::default();
    for z in 0..NODES {
        for y in 0..NODES {
            for x in 0..NODES {
                for (column, i) in p.iter_mut().zip([x, y, z]) {
                    column.push(at(i));
                }
            }
        }
    }
    let mut values = vec![0f32; p[0].len()];
    let program = Program::<f32>::values(shape).unwrap();
    program.evaluate(&mut Scratch::new(), [&p[0], &p[1], &p[2]], &mut values);
    Shape::texture(Grid::new(GridValues::F32(values.into()), [NODES; 3], [-1.6; 3], [1.6; 3]).unwrap())
        .unwrap()
}

fn limits(max_steps: u32) -> Limits {
    Limits { eps: 1e-4, cone: 0.0, max_steps, prune: Prune::Off }
}

struct Bench {
    device: Arc<Device>,
    camera: Camera,
}

/// Seconds of the process's processor time.
fn spent() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let ticks = |i: usize| text.rsplit(')').next()?.split_whitespace().nth(i)?.parse::<f64>().ok();
    (ticks(11).unwrap_or_default() + ticks(12).unwrap_or_default()) / 100.0
}

impl Bench {
    fn frame(&self, shape: &Shape, tracer: &Tracer, cap: u32) -> (Hits<f32>, Course) {
        let walk = (tracer, &limits(cap), T_MAX);
        let (device, camera) = (&self.device, &self.camera);
        let (hits, _, course) =
            render::trace_camera(device, shape, camera, walk, Settings::default(), &Control::new()).unwrap();
        (hits, course)
    }

    /// Seconds of a frame, and the clock's name. Ticks of processor time are long: frames until they are many.
    fn seconds(&self, shape: &Shape, tracer: &Tracer, cap: u32) -> (f64, &'static str) {
        if !self.device.is_software() || spent() == 0.0 {
            let course = self.frame(shape, tracer, cap).1;
            return (course.seconds, if course.by_timestamps { "timestamps" } else { "the wall's clock" });
        }
        let (start, mut frames) = (spent(), 0.0);
        while spent() - start < 0.6 {
            self.frame(shape, tracer, cap);
            frames += 1.0;
        }
        ((spent() - start) / frames, "processor time")
    }

    /// Share of the rays on which the GPU and the CPU agree about the end.
    fn agreement(&self, shape: &Shape, tracer: &Tracer, cap: u32) -> f64 {
        let gpu = self.frame(shape, tracer, cap).0;
        let (cpu, _) =
            trace_camera::<f32>(shape, &self.camera, tracer, &limits(cap), T_MAX, &Control::new()).unwrap();
        let same = gpu.status.iter().zip(&cpu.status).filter(|(a, b)| a == b).count();
        same as f64 / cpu.status.len() as f64
    }

    fn table(&self, input: &str, shape: &Shape, cap: u32) {
        for (name, tracer) in tracers() {
            let same = self.agreement(shape, &tracer, cap);
            assert!(same > 0.999, "{name}, {input}: {same} of the rays end as on the CPU");
        }
        let (mut best, mut clock) = ([f64::INFINITY; 6], "");
        for _ in 0..REPEATS {
            for (best, (_, tracer)) in best.iter_mut().zip(tracers()) {
                let (seconds, by) = self.seconds(shape, &tracer, cap);
                (*best, clock) = (best.min(seconds), by);
            }
        }
        for (seconds, (name, tracer)) in best.iter().zip(tracers()) {
            let hits = self.frame(shape, &tracer, cap).0;
            let steps = hits.steps.iter().map(|&n| f64::from(n)).sum::<f64>() / hits.steps.len() as f64;
            let found = hits.status.iter().filter(|&&s| s == Status::Hit as u8).count();
            println!(
                "| {name} | {input} | {cap} | {:.2} ({clock}) | {:.2} | {steps:.1} | {:.1} % |",
                seconds * 1e3,
                seconds / best[REFERENCE],
                100.0 * found as f64 / hits.steps.len() as f64
            );
        }
    }
}

/// Columns and rows of a picture, as 640x360.
fn size(text: &str) -> Option<[u32; 2]> {
    let (width, height) = text.split_once('x')?;
    Some([width.parse().ok()?, height.parse().ok()?])
}

fn main() {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let choice = match given.first().map(String::as_str) {
        None | Some("any") => Choice::Any,
        Some(number) => Choice::Index(number.parse().unwrap()),
    };
    let size = given.get(1).map_or(SIZE, |text| size(text).unwrap());
    let device = Device::request(choice).unwrap_or_else(|error| {
        eprintln!("{error}");
        std::process::exit(1)
    });
    let procedural = sdfrs_benches::scenes::csg().shape;
    let inputs = [("procedural", procedural.clone()), ("discrete", discrete(&procedural))];
    let info = device.info();
    let note = if device.is_software() { ", in software on the processor" } else { "" };
    println!("Adapter: {} ({}, {}{note}).", info.name, info.backend, info.driver);
    println!("Frame: {} x {}, eps 1e-4, {NODES} nodes along an edge of the grid.\n", size[0], size[1]);
    println!("| tracer | input | cap | ms per frame | relative | steps a ray | hits |");
    println!("|---|---|---|---|---|---|---|");
    let bench = Bench { device, camera: camera(size) };
    for (input, shape) in &inputs {
        for cap in CAPS {
            bench.table(input, shape, cap);
        }
    }
}
