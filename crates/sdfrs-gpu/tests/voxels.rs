//! The walk from voxel to voxel against the CPU's: by bits in strict mode, by the promised figures in plain.
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;
mod rays;

use common::{
    grids::all,
    shapes::{build, moved, num, vec3},
};
use rays::{bits, different};
use sdfrs_core::{
    Control, Hits, Limits, Program, Prune, Rays, Shape, Span,
    contract::{Work, check_rays},
    grid::Stepping,
};
use sdfrs_gpu::{
    Device, GpuField,
    march::{self, Settings},
    render::{render, trace_camera},
};
use sdfrs_trace::{
    Tracer,
    camera::{Camera, Kind},
    render::Scene,
    shade::Surface,
    voxel,
};

const EPS: f64 = 1e-4;
const LIMITS: Limits = Limits { eps: EPS, cone: 0.0, max_steps: 400, prune: Prune::Off };
const BASIC: Tracer = Tracer::Basic { guards: true };

fn camera(kind: Kind) -> Camera {
    Camera { kind, ..rays::camera(75, 52) }
}

/// Every kind of storage, as it is and moved, turned and scaled.
fn textures() -> Vec<(String, Shape)> {
    let turned = |shape: &Shape| {
        let turned = build("rotate", &[("angle", num(0.7)), ("axis", vec3(1.0, 2.0, -0.5))], &[shape]);
        moved(&build("scale", &[("factors", vec3(1.3, 1.3, 1.3))], &[&turned]), 0.1, -0.2, 0.05)
    };
    let texture = |(name, grid): (&str, sdfrs_core::Grid)| {
        let shape = Shape::texture(grid.with_stepping(Stepping::Voxel)).unwrap();
        [(format!("{name}, turned"), turned(&shape)), (name.to_owned(), shape)]
    };
    all().into_iter().flat_map(texture).collect()
}

fn on_cpu(shape: &Shape, rays: &Rays<f32>, limits: &Limits) -> Hits<f32> {
    let program = Program::<f32>::for_tracing(shape).unwrap();
    voxel::trace(shape, &program, &BASIC, rays, limits, &Control::new()).unwrap()
}

fn on_gpu(device: &Device, shape: &Shape, camera: &Camera, strict: bool) -> Hits<f32> {
    let walk = (&BASIC, &LIMITS, 30.0);
    trace_camera(device, shape, camera, walk, Settings { strict }, &Control::new()).unwrap().0
}

fn camera_on_cpu(shape: &Shape, camera: &Camera) -> Hits<f32> {
    sdfrs_trace::render::trace_camera(shape, camera, &BASIC, &LIMITS, 30.0, &Control::new()).unwrap().0
}

#[test]
fn strict_mode_gives_the_bits_of_the_cpu() {
    let Some(device) = common::device() else { return };
    let perspective = Kind::Pinhole { fov_deg: 50.0 };
    for (name, shape) in textures() {
        for kind in [perspective, Kind::Orthographic { extent: 3.0 }] {
            let camera = camera(kind);
            let (gpu, cpu) = (on_gpu(&device, &shape, &camera, true), camera_on_cpu(&shape, &camera));
            let wrong = different(&cpu, &gpu);
            let first = wrong.first().map(|&i| (i, bits(&cpu, i), bits(&gpu, i), cpu.t[i], gpu.t[i]));
            assert_eq!(first, None, "{name}, {kind:?}: {} rays of {}", wrong.len(), cpu.t.len());
            // Only the CPU looks on its way whether any ray has something to tell.
            let work = Work { quiet: gpu.work.quiet, ..cpu.work };
            assert_eq!((cpu.threshold, work), (gpu.threshold, gpu.work), "{name}");
            assert!(
                cpu.status.contains(&0) && cpu.status.iter().filter(|s| **s == 1).count() > 100,
                "{name}"
            );
        }
    }
}

/// Rays along axes, from inside the solid, in ranges of their own, with budgets that end them.
#[test]
fn odd_rays_end_as_on_the_cpu() {
    let Some(device) = common::device() else { return };
    let mut random = common::shapes::Random(3);
    let mut origins: Vec<[f32; 3]> = (0..300).map(|_| random.point(1.2).map(|v| v as f32)).collect();
    let mut directions: Vec<[f32; 3]> = (0..300)
        .map(|_| random.point(1.0))
        .map(|d| {
            let length = d.iter().map(|v| v * v).sum::<f64>().sqrt();
            d.map(|v| (v / length) as f32)
        })
        .collect();
    for axis in 0..3 {
        for ahead in [1.0, -1.0] {
            let mut d = [0.0; 3];
            d[axis] = ahead;
            for o in [[0.6, 0.01, 0.0], [0.0; 3], [-1.0, 0.5, 1.1], [5.0, 0.0, 0.0]] {
                origins.push(o);
                directions.push(d);
            }
        }
    }
    check_rays(&origins, &mut directions).unwrap();
    let ends: Vec<f32> = (0..origins.len()).map(|i| [0.0, 0.3, 2.0, 30.0][i % 4]).collect();
    let rays =
        Rays { origins: &origins, directions: &directions, t_min: Span::All(0.0), t_max: Span::Each(&ends) };
    for (name, shape) in textures() {
        for max_steps in [1, 3, 400] {
            let limits = Limits { max_steps, ..LIMITS };
            let cpu = on_cpu(&shape, &rays, &limits);
            let (settings, control) = (Settings { strict: true }, Control::new());
            let (gpu, _) = march::trace(&device, &shape, &BASIC, &rays, &limits, settings, &control).unwrap();
            let wrong = different(&cpu, &gpu);
            let first = wrong.first().map(|&i| (i, bits(&cpu, i), bits(&gpu, i), origins[i], directions[i]));
            assert_eq!(first, None, "{name}, {max_steps} steps: {} rays", wrong.len());
            assert!(max_steps < 400 || cpu.flags.contains(&1), "{name}: no ray starts inside");
        }
    }
}

/// Shares of rays with the same status, and the same steps.
fn shares(a: &Hits<f32>, b: &Hits<f32>) -> (f64, f64) {
    let n = a.t.len();
    let share = |same: &dyn Fn(usize) -> bool| (0..n).filter(|&i| same(i)).count() as f64 / n as f64;
    (share(&|i| a.status[i] == b.status[i]), share(&|i| a.steps[i] == b.steps[i]))
}

#[test]
fn plain_mode_finds_what_the_cpu_finds() {
    let Some(device) = common::device() else { return };
    let camera = camera(Kind::Pinhole { fov_deg: 50.0 });
    for (name, shape) in textures() {
        let (gpu, cpu) = (on_gpu(&device, &shape, &camera, false), camera_on_cpu(&shape, &camera));
        let (status, steps) = shares(&cpu, &gpu);
        assert!(status >= 0.999 && steps >= 0.99, "{name}: {status} {steps}");
        let deep = (0..cpu.t.len())
            .filter(|&i| cpu.status[i] == 1 && gpu.status[i] == 1)
            .filter(|&i| f64::from((cpu.t[i] - gpu.t[i]).abs()) > 5.0 * EPS);
        assert!(deep.count() * 1000 <= cpu.t.len(), "{name}");
        // Another place is another trace.
        let other = camera_on_cpu(&moved(&shape, 0.01, 0.0, 0.0), &camera);
        assert!(shares(&other, &gpu).1 < 0.99, "{name}");
    }
}

/// Roots lie on the interpolant's surface, whatever `eps` is: a march ends within eps of it.
#[test]
fn hits_lie_on_the_surface() {
    let Some(device) = common::device() else { return };
    let camera = camera(Kind::Pinhole { fov_deg: 50.0 });
    let (rays_o, rays_d) = camera.rays::<f32>().unwrap();
    for (name, shape) in textures() {
        let hits = on_gpu(&device, &shape, &camera, false);
        let at: Vec<[f32; 3]> = (0..hits.t.len())
            .filter(|&i| hits.status[i] == 1)
            .map(|i| std::array::from_fn(|a| rays_o[i][a] + hits.t[i] * rays_d[i][a]))
            .collect();
        let values = GpuField::new(&device, &shape).unwrap().evaluate(&at).unwrap();
        let worst = values.iter().fold(0f32, |most, v| most.max(v.abs()));
        assert!(worst < 1e-5 && at.len() > 100, "{name}: {worst}");
    }
}

#[test]
fn pictures_of_voxels_have_the_same_colours() {
    let Some(device) = common::device() else { return };
    let camera = camera(Kind::Pinhole { fov_deg: 50.0 });
    let (_, shape) = textures().swap_remove(1);
    let scene = Scene { shape: &shape, camera: &camera, lights: &[], surface: Surface::default() };
    let control = Control::new();
    let cpu = sdfrs_trace::render::render::<f32>(&scene, &BASIC, &LIMITS, 30.0, &control).unwrap();
    for strict in [true, false] {
        let walk = (&BASIC, &LIMITS, 30.0);
        let gpu = render(&device, &scene, walk, Settings { strict }, &control).unwrap().0;
        let off = |i: &usize| (0..3).any(|c| cpu.rgb[*i][c].abs_diff(gpu.rgb[*i][c]) > 1);
        assert!((0..cpu.rgb.len()).filter(off).count() * 200 <= cpu.rgb.len(), "strict {strict}");
    }
}
