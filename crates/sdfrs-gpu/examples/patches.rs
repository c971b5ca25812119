//! What shortening programs saves: `cargo run -p sdfrs-gpu --release --example patches -- [SIZE] [spheres|boxes N]..`.
//!
//! For unions of n spheres (one op over a table) and of n boxes, a frame of SIZE x SIZE pixels by the scene as
//! straight lines, as one program for an interpreter, and as programs shortened patch by patch: seconds of the
//! first frame less a later one (compiling), seconds of a later frame, of these what the host took to shorten, and
//! operations of the program that a sample ran. Processor time of the whole process where the adapter is one in
//! software, so that other work on the machine doesn't count; else wall time.

mod clock;

use std::{error::Error, time::Instant};

use sdfrs_core::{
    Control, Field, Hits, Limits, Program, Prune, Shape, Value,
    graph::{Form, Graph},
};
use sdfrs_gpu::{
    Choice, Device, Emitted,
    camera::view,
    emit::{MAX_COST, PART, emit_in_parts, emit_interpreted, emit_patches, patches::Raster},
    march::{Compiled, From, Job},
};
use sdfrs_trace::{
    Tracer,
    camera::{Camera, Kind},
    stats::Summary,
};

type Failure = Box<dyn Error>;
const T_MAX: f32 = 100.0;

struct Random(u64);

impl Random {
    fn within(&mut self, lo: f64, hi: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        lo + (hi - lo) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Parts of a scene for which the whole program, as a tape and as straight lines, is worth waiting for.
const LONGEST: [usize; 2] = [1000, 10_000];
/// A frame of so many seconds is not repeated.
const LONG: f64 = 20.0;

/// n parts in a cube of side 4, as large as leaves gaps between them.
fn union(kind: &str, n: usize) -> Result<Shape, Failure> {
    let mut random = Random(7);
    let size = 1.2 / (n as f64).cbrt();
    let part = |_| {
        let r = size * random.within(0.3, 0.6);
        let offset = Value::Vec3([0; 3].map(|_| random.within(-2.0, 2.0)));
        let args = match kind {
            "spheres" => vec![("radius".into(), Value::Num(r))],
            _ => vec![("size".into(), Value::Vec3([r, 1.5 * r, 2.0 * r]))],
        };
        let op = if kind == "spheres" { "sphere" } else { "box" };
        let part = Shape::build(op, args, vec![])?;
        Shape::build("translate", vec![("offset".into(), offset)], vec![part])
    };
    let all = (0..n).map(part).collect::<Result<_, _>>()?;
    Ok(Shape::build("union", vec![("k".into(), Value::Num(0.0))], all)?)
}

struct Bench<'a> {
    device: &'a Device,
    program: Program<f32>,
    graph: Graph,
    raster: Raster,
    lipschitz: f64,
}

/// Seconds that the host took to shorten, and the scene's text.
type Made = (f64, Emitted);
/// None: it would take too long.
type Maker<'a> = &'a dyn Fn() -> Result<Option<Made>, Failure>;

impl Bench<'_> {
    fn now(&self, start: Instant) -> f64 {
        clock::seconds(self.device.is_software(), start)
    }

    fn frame(&self, made: Emitted) -> Result<(Hits<f32>, Summary), Failure> {
        let limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 300, prune: Prune::Off };
        let compiled = Compiled::of(self.device, made, self.program.ops())?;
        let control = Control::new();
        let from = From::Camera(view(&self.raster.frame, self.raster.width, self.raster.height), T_MAX);
        let tracer = Tracer::Basic { guards: true };
        let job = Job::new(self.device, &compiled, &tracer, &limits, T_MAX.into(), &from, &control)?;
        let pixels = (self.raster.width * self.raster.height) as usize;
        let (hits, course) =
            job.run(Hits::blank(pixels), &from, Some(self.raster.width), |_, _, _| Ok(()))?;
        let summary = Summary::of(&hits, course.walked, self.lipschitz);
        Ok((hits, summary))
    }

    fn row(&self, make: impl Fn() -> Result<Option<Made>, Failure>) -> Result<Option<Hits<f32>>, Failure> {
        let start = Instant::now();
        let (mut first, mut later, mut shortening) = (0.0, f64::INFINITY, 0.0);
        let mut found = None;
        for run in 0..3 {
            let before = self.now(start);
            let Some((planned, made)) = make()? else { return Ok(None) };
            found = Some(self.frame(made)?);
            let spent = self.now(start) - before;
            (first, shortening) = (if run == 0 { spent } else { first }, planned);
            later = if run > 0 { later.min(spent) } else { later };
            if spent > LONG {
                later = later.min(spent);
                break;
            }
        }
        let Some((hits, summary)) = found else { return Ok(None) };
        let compiling = if first == later { "-".into() } else { format!("{:.2}", (first - later).max(0.0)) };
        print!(" {compiling} | {later:.2} | {shortening:.2} | {:.1} |", summary.mean_ops);
        Ok(Some(hits))
    }
}

fn bench(device: &Device, kind: &str, n: usize, size: u32) -> Result<(), Failure> {
    let shape = union(kind, n)?;
    let camera = Camera {
        kind: Kind::Pinhole { fov_deg: 40.0 },
        origin: [4.5, 3.0, 5.5],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        width: size,
        height: size,
    };
    let raster = Raster {
        frame: camera.frame()?,
        width: size,
        height: size,
        t_max: T_MAX,
        eps: 1e-4,
        cone: 0.0,
        skip: false,
    };
    let (program, graph) = (Program::<f32>::for_tracing(&shape)?, Graph::new(&shape, Form::Walk)?);
    let bench = Bench { device, program, graph, raster, lipschitz: shape.lipschitz() };
    let now = Instant::now;
    let lines = || {
        let fits = if kind == "spheres" { n <= LONGEST[1] } else { n * 32 <= MAX_COST };
        Ok(if fits { Some((0.0, emit_in_parts(&bench.graph, false, PART)?)) } else { None })
    };
    let tape = || Ok(Some((0.0, emit_interpreted(&bench.graph, false)?)));
    let patches = |skip: bool| {
        let start = now();
        let before = bench.now(start);
        let Some(pruner) = bench.program.pruner() else { return Ok(None) };
        let raster = Raster { skip, ..bench.raster };
        let made = emit_patches(&bench.graph, pruner, &raster, false, &Control::new())?;
        Ok(made.map(|made| (bench.now(start) - before, made)))
    };
    let (exact, skip) = (|| patches(false), || patches(true));
    let makers: [(&str, Maker); 4] =
        [("straight lines", &lines), ("tape", &tape), ("patches, exact", &exact), ("patches, skip", &skip)];
    let mut all: Vec<Hits<f32>> = Vec::new();
    for (name, make) in makers {
        if name == "tape" && n > LONGEST[0] {
            continue;
        }
        print!("| {n} {kind} | {name} |");
        match bench.row(make)? {
            Some(hits) => all.push(hits),
            None => print!(" - | - | - | - |"),
        }
        println!();
    }
    let [first, others @ ..] = &all[..] else { return Ok(()) };
    for other in others {
        let same = first.status.iter().zip(&other.status).filter(|(a, b)| a == b).count();
        assert!(same as f64 >= 0.999 * first.status.len() as f64, "{same} of {} rays", first.status.len());
    }
    Ok(())
}

fn main() -> Result<(), Failure> {
    let device = Device::request(Choice::Any)?;
    println!("{} ({})\n", device.info().name, device.info().driver);
    let given: Vec<String> = std::env::args().skip(1).collect();
    let size = given.first().map_or(Ok(512), |size| size.parse())?;
    let all = [
        "spheres", "1000", "spheres", "10000", "spheres", "100000", "boxes", "100", "boxes", "300", "boxes",
        "1000",
    ];
    let asked: Vec<&str> = given.iter().skip(1).map(String::as_str).collect();
    println!("| scene | as | compiling, s | frame, s | of these shortening | operations a sample |");
    println!("|---|---|---|---|---|---|");
    for pair in (if asked.is_empty() { &all[..] } else { &asked[..] }).chunks_exact(2) {
        bench(&device, pair[0], pair[1].parse()?, size)?;
    }
    Ok(())
}
