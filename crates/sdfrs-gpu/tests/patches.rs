//! Programs shortened patch by patch of a picture: the same bits as the whole scene's, in less work.
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;
mod rays;

use common::shapes::{Random, build, grid, moved, num, vec3};
use rays::{bits, different};
use sdfrs_core::{Control, Hits, Limits, Prune, Shape, Value};
use sdfrs_gpu::{
    Device,
    march::Settings,
    render::{render, trace_camera},
};
use sdfrs_trace::{
    Form, SearchForm, Tracer,
    camera::{Camera, Kind},
    render::Scene,
    shade::Surface,
    stats::Summary,
};

const LIMITS: Limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 300, prune: Prune::Off };

fn camera(kind: Kind) -> Camera {
    Camera { kind, ..rays::camera(75, 52) }
}

fn union(all: &[Shape], k: f64) -> Shape {
    build("union", &[("k", num(k))], &all.iter().collect::<Vec<_>>())
}

fn spheres(n: usize) -> Shape {
    let mut random = Random(5);
    let mut ball = || {
        let [x, y, z] = random.point(1.0);
        moved(&build("sphere", &[("radius", num(0.04 + 0.05 * random.unit()))], &[]), x, y, z)
    };
    union(&(0..n).map(|_| ball()).collect::<Vec<_>>(), 0.0)
}

/// Unions, smooth ones, complements, repetitions and textures, of + - * / sqrt min max floor alone.
fn scenes() -> Vec<(&'static str, Shape)> {
    let cube = build("box", &[("size", vec3(0.5, 0.4, 0.3))], &[]);
    let bore = build("cylinder", &[("radius", num(0.1)), ("height", num(3.0))], &[]);
    let drilled = build("difference", &[("k", num(0.03))], &[&cube, &bore]);
    let mut random = Random(2);
    let mut place = |shape: &Shape| {
        let [x, y, z] = random.point(1.2);
        moved(shape, x, y, z)
    };
    let parts: Vec<Shape> = (0..12).map(|i| place(if i % 3 == 0 { &drilled } else { &cube })).collect();
    let count = Value::Ints3([3, 1, 3]);
    let rows = build("repeat", &[("period", vec3(0.7, 0.0, 0.7)), ("count", count)], &[&drilled]);
    let texture = Shape::texture(grid(17)).unwrap();
    let mixed = [moved(&texture, 0.4, 0.2, 0.0), moved(&rows, 0.0, -0.9, 0.0), place(&cube), place(&drilled)];
    vec![
        ("spheres", spheres(150)),
        ("boxes", union(&parts, 0.0)),
        ("soft", union(&parts, 0.1)),
        ("mixed", union(&mixed, 0.0)),
    ]
}

fn trace(
    device: &Device,
    shape: &Shape,
    camera: &Camera,
    tracer: &Tracer,
    (prune, strict): (Prune, bool),
) -> (Hits<f32>, Summary) {
    let limits = Limits { prune, ..LIMITS };
    let (hits, summary, _) =
        trace_camera(device, shape, camera, (tracer, &limits, 30.0), Settings { strict }, &Control::new())
            .unwrap();
    (hits, summary)
}

/// The whole scene's, which strict mode has to find bit by bit.
fn on_cpu(shape: &Shape, camera: &Camera, tracer: &Tracer) -> Hits<f32> {
    sdfrs_trace::render::trace_camera(shape, camera, tracer, &LIMITS, 30.0, &Control::new()).unwrap().0
}

fn assert_same(name: &str, a: &Hits<f32>, b: &Hits<f32>) {
    let wrong = different(a, b);
    let first = wrong.first().map(|&i| (i, bits(a, i), bits(b, i), a.t[i], b.t[i]));
    assert_eq!(first, None, "{name}: {} rays of {}", wrong.len(), a.t.len());
    assert_eq!(a.threshold.to_bits(), b.threshold.to_bits(), "{name}");
}

#[test]
fn strict_bits_are_those_of_the_whole_scene_and_of_the_cpu() {
    let Some(device) = common::device() else { return };
    let tracer = Tracer::Enhanced { omega: 0.88, form: Form::Y2023, guards: true };
    for (name, shape) in scenes() {
        for kind in [Kind::Pinhole { fov_deg: 50.0 }, Kind::Orthographic { extent: 3.0 }] {
            let camera = camera(kind);
            let (short, summary) = trace(&device, &shape, &camera, &tracer, (Prune::Exact, true));
            let cpu = on_cpu(&shape, &camera, &tracer);
            assert_same(&format!("{name}, {kind:?}"), &short, &cpu);
            // Every step is counted, by the program that it ran.
            assert_eq!(summary.prune, "exact");
            let counted: u64 = short.work.lengths.values().sum();
            assert_eq!(counted, summary.evaluations, "{name}");
            let whole = sdfrs_core::Field::ops(&sdfrs_core::Program::<f32>::for_tracing(&shape).unwrap());
            assert!(summary.mean_ops < whole as f64, "{name}: {} of {whole}", summary.mean_ops);
            assert!(short.work.lengths.keys().all(|ops| *ops <= whole) && summary.arena_bytes > 0);
        }
    }
}

/// One tracer of each family: the texts around the field are the same for the others.
#[test]
fn every_kind_of_walk_runs_shortened_programs() {
    let Some(device) = common::device() else { return };
    let camera = camera(Kind::Pinhole { fov_deg: 50.0 }).resized(40, 33);
    let shape = spheres(60);
    for tracer in [
        Tracer::AutoRelaxed { beta: 0.3, guards: true },
        Tracer::AutoRelaxed { beta: 0.3, guards: false },
        Tracer::Relaxed { omega: 1.5, form: Form::Y2018, guards: false },
        Tracer::BinarySearch { form: SearchForm::Stackless, max_level: 18, guards: true },
        Tracer::BinarySearch { form: SearchForm::Split, max_level: 18, guards: true },
        Tracer::CoverageSearch { guards: true },
    ] {
        let (short, summary) = trace(&device, &shape, &camera, &tracer, (Prune::Exact, true));
        assert_eq!(summary.prune, "exact");
        assert_same(&format!("{tracer:?}"), &short, &on_cpu(&shape, &camera, &tracer));
    }
}

/// Cells proven empty are leapt over: fewer steps, the same surfaces but for rays that graze one.
#[test]
fn skipping_finds_the_same_surfaces() {
    let Some(device) = common::device() else { return };
    let camera = camera(Kind::Pinhole { fov_deg: 50.0 });
    let guards = true;
    let form = Form::Y2023;
    let tracers = [
        Tracer::Basic { guards },
        Tracer::Relaxed { omega: 1.5, form, guards },
        Tracer::Enhanced { omega: 0.88, form, guards },
        Tracer::AutoRelaxed { beta: 0.3, guards },
    ];
    for (name, shape) in scenes() {
        // One text of ops for all four: compiling takes longest.
        for tracer in if name == "mixed" { &tracers[..] } else { &tracers[3..] } {
            let (skip, summary) = trace(&device, &shape, &camera, tracer, (Prune::Skip, true));
            let whole = on_cpu(&shape, &camera, tracer);
            let steps: u64 = whole.steps.iter().map(|n| u64::from(*n)).sum();
            assert_eq!(summary.prune, "skip");
            assert!(summary.evaluations < steps, "{name}: {} of {steps}", summary.evaluations);
            assert_eq!(skip.work.lengths.values().sum::<u64>(), summary.evaluations, "{name}");
            let n = whole.t.len();
            let other = (0..n).filter(|&i| skip.status[i] != whole.status[i]).count();
            // Measured at the hit: the ray stands within the threshold, whichever way it came.
            let deep = (0..n).filter(|&i| skip.status[i] == 1 && !(skip.distance[i].abs() <= 2e-4)).count();
            assert!(other * 1000 <= n && deep == 0, "{name} {tracer:?}: {other} other, {deep} deep");
            let apart = |i: &usize| {
                skip.status[*i] == 1 && whole.status[*i] == 1 && (skip.t[*i] - whole.t[*i]).abs() > 5e-4
            };
            let apart = (0..n).filter(apart).count();
            assert!(apart * 100 <= n, "{name} {tracer:?}: {apart} of {n}");
        }
    }
}

/// The promise of plain mode, and the comparison's own sharpness: another scene differs.
#[test]
fn plain_mode_finds_the_same() {
    let Some(device) = common::device() else { return };
    let camera = camera(Kind::Pinhole { fov_deg: 50.0 });
    let tracer = Tracer::Basic { guards: true };
    let shares = |a: &Hits<f32>, b: &Hits<f32>| {
        let n = a.t.len() as f64;
        let share = |same: &dyn Fn(usize) -> bool| (0..a.t.len()).filter(|&i| same(i)).count() as f64 / n;
        (share(&|i| a.status[i] == b.status[i]), share(&|i| a.steps[i] == b.steps[i]))
    };
    for (name, shape) in scenes() {
        let (short, _) = trace(&device, &shape, &camera, &tracer, (Prune::Exact, false));
        let (whole, _) = trace(&device, &shape, &camera, &tracer, (Prune::Off, false));
        let (status, steps) = shares(&short, &whole);
        assert!(status >= 0.999 && steps >= 0.99, "{name}: {status} {steps}");
        let grown = build("dilate", &[("radius", num(0.003))], &[&shape]);
        let (grown, _) = trace(&device, &grown, &camera, &tracer, (Prune::Exact, false));
        assert!(shares(&grown, &whole).1 < 0.9, "{name}");
    }
}

/// Normals come from shortened programs too.
#[test]
fn pictures_are_the_same() {
    let Some(device) = common::device() else { return };
    let camera = camera(Kind::Pinhole { fov_deg: 50.0 });
    let tracer = Tracer::Basic { guards: true };
    for (name, shape) in scenes() {
        let scene = Scene { shape: &shape, camera: &camera, lights: &[], surface: Surface::default() };
        let picture = |prune| {
            let limits = Limits { prune, ..LIMITS };
            render(&device, &scene, (&tracer, &limits, 30.0), Settings { strict: true }, &Control::new())
                .unwrap()
                .0
        };
        let (short, whole) = (picture(Prune::Exact), picture(Prune::Off));
        assert_eq!((short.rgb, short.normals), (whole.rgb, whole.normals), "{name}");
    }
}

/// Automatic pruning leaves small scenes alone, and takes large ones.
#[test]
fn auto_prunes_where_it_pays() {
    let Some(device) = common::device() else { return };
    let camera = camera(Kind::Pinhole { fov_deg: 50.0 }).resized(160, 120);
    let tracer = Tracer::Basic { guards: true };
    for (n, skip, prune) in
        [(1, false, "off"), (1, true, "off"), (2000, false, "exact"), (2000, true, "skip")]
    {
        let (_, summary) = trace(&device, &spheres(n), &camera, &tracer, (Prune::Auto { skip }, false));
        assert_eq!(summary.prune, prune, "{n}");
    }
    // Leaps are not the CPU's; strict mode keeps its steps.
    let (_, summary) = trace(&device, &spheres(2000), &camera, &tracer, (Prune::Auto { skip: true }, true));
    assert_eq!(summary.prune, "exact");
    // Listings take every sample; one sphere has nothing to drop.
    let letter = Tracer::Basic { guards: false };
    let (_, summary) = trace(&device, &spheres(2000), &camera, &letter, (Prune::Auto { skip: true }, false));
    assert_eq!(summary.prune, "exact");
    let (_, summary) = trace(&device, &spheres(1), &camera, &tracer, (Prune::Exact, false));
    assert_eq!(summary.prune, "off");
}

#[test]
fn cancelling_stops_the_plan() {
    let Some(device) = common::device() else { return };
    let (control, limits) = (Control::new(), Limits { prune: Prune::Exact, ..LIMITS });
    control.cancel();
    let walk = (&Tracer::Basic { guards: true }, &limits, 30.0);
    let camera = camera(Kind::Pinhole { fov_deg: 50.0 });
    let stopped = trace_camera(&device, &spheres(500), &camera, walk, Settings::default(), &control);
    assert_eq!(stopped.unwrap_err(), sdfrs_gpu::GpuError::Cancelled);
}

/// A long walk through a whole long scene, again and again: which rays share a dispatch must not matter.
#[test]
fn whole_scenes_are_the_same_every_time() {
    let Some(device) = common::device() else { return };
    let camera = camera(Kind::Pinhole { fov_deg: 50.0 }).resized(96, 64);
    let tracer = Tracer::Basic { guards: true };
    let mut random = Random(5);
    let mut ball = || {
        let [x, y, z] = random.point(1.4);
        moved(&build("sphere", &[("radius", num(0.02 + 0.06 * random.unit()))], &[]), x, y, z)
    };
    let shape = union(&(0..1000).map(|_| ball()).collect::<Vec<_>>(), 0.0);
    let cpu = on_cpu(&shape, &camera, &tracer);
    for i in 0..12 {
        let (gpu, _) = trace(&device, &shape, &camera, &tracer, (Prune::Off, true));
        assert_same(&format!("run {i}"), &gpu, &cpu);
    }
}
