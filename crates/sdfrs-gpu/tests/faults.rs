//! No fault panics, hangs or poisons the next call.

#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use std::{process::Command, thread};

use common::shapes::{build, moved, num, vec3};
use sdfrs_core::{Control, Shape, graph::Form};
use sdfrs_gpu::{Choice, Device, GpuError, GpuField, adapters, buffers};

fn ball() -> Shape {
    build("sphere", &[("radius", num(0.5))], &[])
}

/// Runs one ignored test of this file in a process of its own.
fn alone(name: &str, vars: &[(&str, &str)]) {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", name, "--ignored", "--nocapture", "--test-threads=1"])
        .envs(vars.iter().copied());
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && text.contains("1 passed"), "{name}: {text}");
}

#[test]
fn without_a_driver() {
    let nowhere = [("VK_DRIVER_FILES", "/nonexistent.json"), ("VK_ICD_FILENAMES", "/nonexistent.json")];
    if cfg!(target_os = "linux") {
        alone("without_a_driver_alone", &nowhere);
    }
}

#[test]
#[ignore = "run by without_a_driver, with no driver to be found"]
fn without_a_driver_alone() {
    assert_eq!(adapters().unwrap().len(), 0);
    for choice in [Choice::Auto, Choice::Any, Choice::Index(0)] {
        let error = Device::request(choice).unwrap_err();
        assert!(matches!(error, GpuError::NoAdapter { .. }));
        let text = error.to_string();
        assert!(text.contains("found none") && text.contains("driver"), "{text}");
    }
}

#[test]
fn an_index_too_large_lists_what_there_is() {
    if common::device().is_none() {
        return;
    }
    let error = Device::request(Choice::Index(99)).unwrap_err().to_string();
    assert!(error.contains("adapter 99") && error.contains("0: "), "{error}");
    if adapters().unwrap().iter().all(|a| a.kind == sdfrs_gpu::Kind::Software) {
        let error = Device::request(Choice::Auto).unwrap_err().to_string();
        assert!(error.contains("asked for a real GPU") && error.contains("software"), "{error}");
    }
}

#[test]
fn more_than_a_buffer_can_hold() {
    let Some(device) = common::device() else { return };
    // A grid of 4096^3 floats: refused by the limits, before anything is allocated.
    let bytes = 4 * 4096u64.pow(3);
    let error = buffers::make(&device, "grids", bytes, buffers::Use::Storage).unwrap_err();
    assert!(matches!(error, GpuError::Limits { asked, .. } if asked == bytes), "{error}");
    assert!(buffers::Reader::new(&device, bytes).is_err());
    works(&device);
}

#[test]
fn out_of_memory() {
    if common::device().is_some() {
        alone("out_of_memory_alone", &[]);
    }
}

/// Buffers until there is no more, in a process whose end gives everything back.
#[test]
#[ignore = "run by out_of_memory"]
fn out_of_memory_alone() {
    let device = Device::request(Choice::Any).unwrap();
    works(&device);
    allow_little_more();
    let most = device.limits().max_storage_buffer_binding_size.min(1 << 30);
    let mut kept = Vec::new();
    let error = loop {
        match buffers::make(&device, "a grid of 1024^3 numbers", most, buffers::Use::Storage) {
            Ok(buffer) => kept.push(buffer),
            Err(error) => break Some(error),
        }
        if kept.len() as u64 * most > 1 << 40 {
            break None;
        }
    };
    match error {
        Some(error) => assert!(matches!(error, GpuError::OutOfMemory { .. }), "{error}"),
        None => eprintln!("left out: this driver promises more than a TiB"),
    }
    drop(kept);
    works(&device);
}

/// A driver in software promises whatever the process may have: that is 3 GiB more than now.
#[allow(unsafe_code)]
fn allow_little_more() {
    #[cfg(target_os = "linux")]
    {
        let pages: u64 =
            std::fs::read_to_string("/proc/self/statm").unwrap().split(' ').next().unwrap().parse().unwrap();
        let bytes = pages * 4096 + (3 << 30);
        let limit = libc::rlimit { rlim_cur: bytes, rlim_max: bytes };
        // SAFETY: the call reads the struct it is given, which lives until it returns.
        assert_eq!(unsafe { libc::setrlimit(libc::RLIMIT_AS, &limit) }, 0);
    }
}

#[test]
fn a_lost_device_is_replaced() {
    if common::device().is_some() {
        alone("a_lost_device_is_replaced_alone", &[]);
    }
}

#[test]
#[ignore = "run by a_lost_device_is_replaced: other tests share the device"]
fn a_lost_device_is_replaced_alone() {
    let device = Device::request(Choice::Any).unwrap();
    let field = GpuField::new(&device, &ball()).unwrap();
    works(&device);
    device.raw().destroy();
    let error = field.evaluate(&[[0.0; 3]]).unwrap_err();
    assert!(matches!(error, GpuError::Lost { .. }), "{error}");
    assert!(matches!(GpuField::new(&device, &ball()), Err(GpuError::Lost { .. })));
    let again = Device::request(Choice::Any).unwrap();
    assert!(!std::sync::Arc::ptr_eq(&device, &again));
    works(&again);
}

#[test]
fn a_shader_that_is_wrong_is_refused() {
    let Some(device) = common::device() else { return };
    let error = device.pipelines().get(&device, "fn main( {", "main", &[]).unwrap_err();
    assert!(matches!(error, GpuError::Shader { .. }), "{error}");
    works(&device);
}

#[test]
fn a_cancelled_call_ends() {
    let Some(device) = common::device() else { return };
    let field = GpuField::new(&device, &ball()).unwrap();
    let control = Control::new();
    control.cancel();
    let (points, mut out) = (vec![[0.0f32; 3]; 100_000], vec![0.0; 100_000]);
    assert_eq!(field.run("evaluate", &points, &mut out, 1, &control), Err(GpuError::Cancelled));
    works(&device);
}

#[test]
fn nothing_to_do() {
    let Some(device) = common::device() else { return };
    assert_eq!(GpuField::new(&device, &ball()).unwrap().evaluate(&[]), Ok(vec![]));
}

/// Threads share one device; each asks for its own scene, some for the same.
#[test]
fn threads_do_not_disturb_each_other() {
    let Some(device) = common::device() else { return };
    let points = common::points(20_000, 2.0);
    let scene = |i: usize| {
        let cube = build("box", &[("size", vec3(0.5, 0.3, 0.4))], &[]);
        let both = [moved(&ball(), 0.1 * i as f64, 0.0, 0.0), cube];
        build("union", &[("k", num(if i.is_multiple_of(2) { 0.0 } else { 0.2 }))], &[&both[0], &both[1]])
    };
    thread::scope(|scope| {
        for i in 0..6 {
            let (points, scene) = (&points, &scene);
            scope.spawn(move || {
                let device = Device::request(Choice::Any).unwrap();
                let field = GpuField::with(&device, &scene(i), Form::Value, true).unwrap();
                let expected = common::values(&scene(i), points);
                for _ in 0..3 {
                    assert_eq!(field.evaluate(points).unwrap(), expected);
                }
            });
        }
    });
    works(&device);
}

/// After a fork the parent's driver is no use to the child: an error at once, never a hang.
#[cfg(unix)]
#[test]
#[allow(unsafe_code)]
fn a_forked_process_is_told() {
    let Some(device) = common::device() else { return };
    // SAFETY: the child calls nothing that takes a lock or allocates by the driver before it leaves.
    unsafe {
        let child = libc::fork();
        if child == 0 {
            let told = matches!(device.check(), Err(GpuError::Forked { .. }))
                && matches!(Device::request(Choice::Any), Err(GpuError::Forked { .. }))
                && matches!(adapters(), Err(GpuError::Forked { .. }));
            libc::_exit(if told { 0 } else { 1 });
        }
        let mut status = 0;
        libc::waitpid(child, &mut status, 0);
        assert!(libc::WIFEXITED(status) && libc::WEXITSTATUS(status) == 0, "status {status}");
    }
    works(&device);
}

fn works(device: &std::sync::Arc<Device>) {
    let field = GpuField::new(device, &ball()).unwrap();
    assert_eq!(field.evaluate(&[[2.0, 0.0, 0.0]]), Ok(vec![1.5]));
}

/// Mesa's drivers in software leave all loops after 65,535 rounds: long walks through long unions must not get there,
/// and a union that is too long by itself is refused.
#[test]
fn loops_that_go_around_too_often() {
    let Some(device) = common::device() else { return };
    let row = |n: usize| {
        let balls: Vec<Shape> = (0..n).map(|i| common::shapes::moved(&ball(), i as f64, 0.0, 0.0)).collect();
        build("union", &[("k", num(0.0))], &balls.iter().collect::<Vec<_>>())
    };
    // Past a thousand balls, at a hand's breadth.
    let shape = row(1000);
    let origins: Vec<[f32; 3]> = (0..40).map(|i| [-1.0, 0.505 + 0.001 * i as f32, 0.0]).collect();
    let directions = vec![[1.0, 0.0, 0.0]; origins.len()];
    let rays = sdfrs_core::Rays {
        origins: &origins,
        directions: &directions,
        t_min: sdfrs_core::Span::All(0.0),
        t_max: sdfrs_core::Span::All(200.0),
    };
    let limits = sdfrs_core::Limits { eps: 1e-4, cone: 0.0, max_steps: 1500, prune: sdfrs_core::Prune::Off };
    let (tracer, control) = (sdfrs_trace::Tracer::Basic { guards: true }, Control::new());
    let settings = sdfrs_gpu::march::Settings { strict: true };
    let (gpu, _) =
        sdfrs_gpu::march::trace(&device, &shape, &tracer, &rays, &limits, settings, &control).unwrap();
    let program = sdfrs_core::Program::<f32>::for_tracing(&shape).unwrap();
    let cpu = sdfrs_trace::trace(&program, &tracer, &rays, &limits, &control).unwrap();
    assert!(cpu.steps.iter().any(|n| *n > 400), "{:?}", cpu.steps);
    assert_eq!((gpu.steps, gpu.status, gpu.t), (cpu.steps, cpu.status, cpu.t));
    if device.is_software() {
        let long = row(70_000);
        let refused = GpuField::new(&device, &long).err();
        assert!(matches!(refused, Some(GpuError::Limits { asked: 70_000, .. })), "{refused:?}");
        works(&device);
    }
}
