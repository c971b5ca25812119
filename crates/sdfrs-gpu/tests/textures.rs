//! Grids of every kind of storage and every rule of stepping against the CPU, by bits.

#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use std::sync::Arc;

use common::{
    grids::{all, baked},
    shapes::build,
};
use sdfrs_core::{Grid, GridValues, Shape, graph::Form, grid::Stepping};
use sdfrs_gpu::{GpuField, grids};

fn assert_bits(name: &str, points: &[[f32; 3]], gpu: &[f32], cpu: &[f32]) {
    for (i, (a, b)) in gpu.iter().zip(cpu).enumerate() {
        assert_eq!(
            (a + 0.0).to_bits(),
            (b + 0.0).to_bits(),
            "{name} at {:?}: GPU {a:?}, CPU {b:?}",
            points[i]
        );
    }
}

#[test]
fn every_kind_and_rule() {
    let Some(device) = common::device() else { return };
    // Inside, where most are, and outside of the box.
    let points: Vec<_> = common::points(300, 1.1).into_iter().chain(common::points(60, 3.0)).collect();
    for (name, grid) in all() {
        for stepping in [Stepping::Safe, Stepping::Bricks] {
            let shape = Shape::texture(grid.with_stepping(stepping)).unwrap();
            let hole = build("negate", &[], &[&shape]);
            for (shape, form) in [(&shape, Form::Value), (&shape, Form::Walk), (&hole, Form::Walk)] {
                let name = format!("{name}, {}, {form:?} of {}", stepping.name(), shape.op());
                let field = GpuField::with(&device, shape, form, true).unwrap();
                let cpu = match form {
                    Form::Value => common::values(shape, &points),
                    _ => common::walk(shape, &points),
                };
                assert_bits(&name, &points, &field.evaluate(&points).unwrap(), &cpu);
            }
        }
    }
}

#[test]
fn gradients() {
    let Some(device) = common::device() else { return };
    let points: Vec<_> = common::points(150, 1.0)[..150].to_vec();
    for (name, grid) in all() {
        let shape = Shape::texture(grid.with_stepping(Stepping::Bricks)).unwrap();
        for form in [Form::Value, Form::Walk] {
            let field = GpuField::with(&device, &shape, form, true).unwrap();
            let (gpu, cpu) = (field.gradient(&points).unwrap(), common::gradients_of(&shape, form, &points));
            for (i, (a, b)) in gpu.iter().zip(&cpu).enumerate() {
                let same = (0..3).all(|k| (a[k] - b[k]).abs() <= 1e-3) && a[3] == b[3];
                assert!(same, "{name}, {form:?} at {:?}: GPU {a:?}, CPU {b:?}", points[i]);
            }
        }
    }
}

/// A small half float is a denormal, which shaders may flush: the conversion must not go through one.
#[test]
fn halves_keep_their_small_values() {
    let Some(device) = common::device() else { return };
    let values: Vec<f64> = (0..8).map(|i| 6e-8 * f64::from(i) - 2e-7).collect();
    let half =
        Grid::new(GridValues::F64(Arc::new(values)), [2; 3], [0.0; 3], [1.0; 3]).unwrap().to_f16().unwrap();
    let shape = Shape::texture(half).unwrap();
    let points: Vec<[f32; 3]> = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|v| v as f32)).collect();
    let gpu = GpuField::with(&device, &shape, Form::Value, true).unwrap().evaluate(&points).unwrap();
    assert_bits("halves", &points, &gpu, &common::values(&shape, &points));
    assert!(gpu.iter().any(|v| *v != 0.0));
}

/// Uploaded once, however often it is placed.
#[test]
fn a_grid_is_laid_out_once() {
    let grid = Arc::new(baked(Some(0.1), false).to_u8(0.15).unwrap());
    let (parts, words) = grids::layout(&[grid.clone(), grid]).unwrap();
    assert_eq!(parts.len(), 2);
    assert_eq!(words % 2, 0);
}
