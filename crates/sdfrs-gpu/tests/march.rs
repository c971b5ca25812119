//! Traces on whatever adapter there is, Mesa's lavapipe for one, against the CPU's.
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;
mod rays;

use std::time::Duration;

use common::shapes::{build, moved, num, vec3};
use rays::{Batch, LIMITS, bits, camera, different, tracers};
use sdfrs_core::{Control, Limits, Prune, Shape};
use sdfrs_gpu::{
    GpuError,
    march::{self, Settings},
};
use sdfrs_trace::Tracer;

/// Fields of + - * / sqrt min max: the strict mode's own ground.
fn fields() -> Vec<(&'static str, Shape)> {
    let ball = build("sphere", &[("radius", num(0.9))], &[]);
    let cube = build("box", &[("size", vec3(1.1, 1.3, 0.9))], &[]);
    let bore = build("cylinder", &[("radius", num(0.35)), ("height", num(3.0))], &[]);
    let ground = build("plane", &[("normal", vec3(0.0, 1.0, 0.0)), ("point", vec3(0.0, -0.8, 0.0))], &[]);
    let ring = build("torus", &[("major", num(0.9)), ("minor", num(0.2))], &[]);
    let csg = build("difference", &[("k", num(0.0))], &[&cube, &bore]);
    let csg = build("union", &[("k", num(0.0))], &[&csg, &moved(&ring, 0.2, -0.3, 0.1), &ground]);
    let soft =
        build("union", &[("k", num(0.25))], &[&moved(&ball, 0.5, 0.0, 0.0), &moved(&cube, -0.6, 0.2, 0.0)]);
    // Half as steep as it is: safe steps cross the surface.
    let steep = build("with_lipschitz", &[("lipschitz", num(0.5))], &[&ball]);
    vec![("csg", csg), ("soft", soft), ("steep", steep)]
}

#[test]
fn strict_mode_gives_the_bits_of_the_cpu() {
    let Some(device) = common::device() else { return };
    let batch = Batch::new(&camera(64, 48), 0.0, 30.0);
    let mut failed = Vec::new();
    for (name, shape) in fields() {
        for tracer in tracers() {
            let cpu = batch.cpu(&shape, &tracer, &LIMITS);
            let (gpu, _) = batch.gpu(&device, &shape, &tracer, &LIMITS, true);
            let wrong = different(&cpu, &gpu);
            if let Some(&i) = wrong.first() {
                failed.push(format!(
                    "{name} {tracer:?}: {} rays, first {i}: cpu {:?} ({}), gpu {:?} ({})",
                    wrong.len(),
                    bits(&cpu, i),
                    cpu.t[i],
                    bits(&gpu, i),
                    gpu.t[i]
                ));
            }
            if cpu.threshold.to_bits() != gpu.threshold.to_bits() {
                failed.push(format!("{name} {tracer:?}: thresholds {} {}", cpu.threshold, gpu.threshold));
            }
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// The comparison can fail: a ball that is a little larger gives other bits.
#[test]
fn a_grown_scene_differs() {
    let Some(device) = common::device() else { return };
    let batch = Batch::new(&camera(64, 48), 0.0, 30.0);
    let grown = build("sphere", &[("radius", num(0.9001))], &[]);
    let ball = build("sphere", &[("radius", num(0.9))], &[]);
    let tracer = Tracer::Basic { guards: true };
    let (gpu, _) = batch.gpu(&device, &grown, &tracer, &LIMITS, true);
    assert!(different(&batch.cpu(&ball, &tracer, &LIMITS), &gpu).len() > 200);
    assert!(different(&batch.cpu(&grown, &tracer, &LIMITS), &gpu).is_empty());
}

/// Cones, budgets, ranges away from 0 and far away, thresholds below an ulp.
#[test]
fn limits_end_rays_as_on_the_cpu() {
    let Some(device) = common::device() else { return };
    let fields = fields();
    let (_, csg) = &fields[0];
    let cases = [
        (Limits { eps: 1e-3, cone: 2e-3, max_steps: 400, prune: Prune::Off }, 0.0, 30.0),
        (Limits { eps: 1e-4, cone: 0.0, max_steps: 7, prune: Prune::Off }, 0.0, 30.0),
        (Limits { eps: 1e-4, cone: 0.0, max_steps: 1, prune: Prune::Off }, 0.0, 30.0),
        (Limits { eps: 1e-9, cone: 0.0, max_steps: 200, prune: Prune::Off }, 0.0, 30.0),
        (Limits { eps: 1e-4, cone: 0.0, max_steps: 300, prune: Prune::Off }, 2.9, 3.2),
        (Limits { eps: 1e-4, cone: 0.0, max_steps: 300, prune: Prune::Off }, 1.0, 1.0),
        (Limits { eps: 1e-4, cone: 0.0, max_steps: 300, prune: Prune::Off }, -4.0, 9e5),
    ];
    for (limits, t_min, t_max) in cases {
        let batch = Batch::new(&camera(24, 16), t_min, t_max);
        for tracer in tracers() {
            let cpu = batch.cpu(csg, &tracer, &limits);
            let (gpu, _) = batch.gpu(&device, csg, &tracer, &limits, true);
            let wrong = different(&cpu, &gpu);
            let first = wrong.first().map(|&i| (i, bits(&cpu, i), bits(&gpu, i)));
            assert_eq!(first, None, "{tracer:?} {limits:?} {t_min} {t_max}: {} rays", wrong.len());
        }
    }
}

#[test]
fn no_rays_and_one_ray_are_fine() {
    let Some(device) = common::device() else { return };
    let (_, csg) = fields().swap_remove(0);
    let batch = Batch::new(&camera(1, 1), 0.0, 30.0);
    let (hits, course) = batch.gpu(&device, &csg, &Tracer::Basic { guards: true }, &LIMITS, false);
    assert!(hits.t.len() == 1 && course.dispatches >= 2, "{course:?}");
}

#[test]
fn dispatches_are_short() {
    let Some(device) = common::device() else { return };
    let (_, csg) = fields().swap_remove(0);
    let batch = Batch::new(&camera(320, 240), 0.0, 30.0);
    let tracer = Tracer::AutoRelaxed { beta: 0.3, guards: true };
    // 100 ms is the aim; a loaded machine may stall anything for longer, but hardly three times.
    let courses = [(); 3].map(|()| batch.gpu(&device, &csg, &tracer, &LIMITS, false).1);
    let longest = courses.iter().map(|course| course.longest).min().unwrap();
    assert!(longest < Duration::from_millis(400) && courses[0].passes > 1, "{courses:?}");
}

#[test]
fn a_cancelled_march_stops() {
    let Some(device) = common::device() else { return };
    let (_, csg) = fields().swap_remove(0);
    let batch = Batch::new(&camera(64, 48), 0.0, 30.0);
    let control = Control::new();
    control.cancel();
    let tracer = Tracer::Basic { guards: true };
    let stopped = march::trace(&device, &csg, &tracer, &batch.rays(), &LIMITS, Settings::default(), &control);
    assert_eq!(stopped.unwrap_err(), GpuError::Cancelled);
    let (hits, _) = batch.gpu(&device, &csg, &tracer, &LIMITS, true);
    assert!(different(&batch.cpu(&csg, &tracer, &LIMITS), &hits).is_empty());
}

#[test]
fn moving_an_object_compiles_nothing() {
    let Some(device) = common::device() else { return };
    let batch = Batch::new(&camera(16, 16), 0.0, 30.0);
    let at = |x: f64| moved(&build("sphere", &[("radius", num(0.41))], &[]), x, 0.0, 0.3);
    let tracer = Tracer::Enhanced { omega: 0.81, form: sdfrs_trace::Form::Y2023, guards: true };
    let (first, _) = batch.gpu(&device, &at(0.1), &tracer, &LIMITS, true);
    let compiled = device.pipelines().compiled();
    let (second, _) = batch.gpu(&device, &at(0.2), &tracer, &LIMITS, true);
    // Other tests share the device: their pipelines may come in between, but not one for every call.
    assert!(!different(&first, &second).is_empty());
    let again = batch.gpu(&device, &at(0.3), &tracer, &LIMITS, true).0;
    assert!(!different(&first, &again).is_empty() && device.pipelines().compiled() >= compiled);
}
