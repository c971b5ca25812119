//! The GPU's fields against the CPU's: every kind of shape, every op, values and gradients.

mod common;

use common::shapes::{Random, build, everything, moved, num, vec3};
use sdfrs_core::{Shape, graph::Form};
use sdfrs_gpu::GpuField;

/// Where two lists of numbers differ in bits; NaNs are one number, and so are zeros.
fn differences(a: &[f32], b: &[f32]) -> Vec<usize> {
    let bits = |v: f32| if v.is_nan() { u32::MAX } else { (v + 0.0).to_bits() };
    (0..a.len()).filter(|&i| bits(a[i]) != bits(b[i])).collect()
}

#[test]
fn bits() {
    let Some(device) = common::device() else { return };
    let points = common::points(500, 2.0);
    let mut bad = 0;
    for (name, shape) in everything() {
        let field = GpuField::with(&device, &shape, Form::Value, true).unwrap();
        let (gpu, cpu) = (field.evaluate(&points).unwrap(), common::values(&shape, &points));
        let wrong = differences(&gpu, &cpu);
        if let Some(&i) = wrong.first() {
            bad += 1;
            println!("{name}: {} differ, at {:?}: gpu {}, cpu {}", wrong.len(), points[i], gpu[i], cpu[i]);
        }
    }
    assert_eq!(bad, 0);
}
