//! The counter of compiled shaders, in a process of its own: nothing else compiles meanwhile.

#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use common::shapes::{build, moved, num};
use sdfrs_gpu::GpuField;

#[test]
fn a_shader_is_compiled_once() {
    let Some(device) = common::device() else { return };
    let ball = build("sphere", &[("radius", num(0.4))], &[]);
    let before = device.pipelines().compiled();
    for i in 0..5 {
        let shape = moved(&ball, f64::from(i), 0.0, 0.0);
        let field = GpuField::new(&device, &shape).unwrap();
        assert_eq!(field.evaluate(&[[0.0; 3]]).unwrap(), [i as f32 - 0.4]);
        assert_eq!(device.pipelines().compiled() - before, 1);
    }
    GpuField::new(&device, &ball).unwrap().gradient(&[[1.0; 3]]).unwrap();
    assert_eq!(device.pipelines().compiled() - before, 2);
}
