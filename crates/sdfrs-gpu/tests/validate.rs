//! Every text passes naga, with no GPU at all; every op of the table is there, with its gradient.

#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use common::shapes::{build, everything, num};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use sdfrs_core::{
    graph::{Form, Graph},
    op::Op,
};
use sdfrs_gpu::emit::{emit, emit_interpreted};

fn check(text: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    if let Err(error) = validator.validate(&module) {
        panic!("{}", error.emit_to_string(text));
    }
    module
}

#[test]
fn the_whole_library_has_every_op_and_its_gradient() {
    for strict in [false, true] {
        let own = "struct Params { zero: u32 }\n@group(0) @binding(0) var<uniform> u: Params;\n\
            @group(1) @binding(0) var<uniform> consts: array<vec4<f32>, 16>;";
        let text = sdfrs_shaders::ops(strict).join("\n") + own;
        let module = check(&text);
        let there = |prefix: &str, op: &Op| {
            let name = format!("{prefix}_{}", op.name());
            module.functions.iter().any(|(_, f)| f.name.as_deref() == Some(&name))
        };
        for prefix in ["op", "d"] {
            let missing: Vec<_> = Op::shared().filter(|op| !there(prefix, op)).map(|op| op.name()).collect();
            assert!(missing.is_empty(), "shaders/ops has no {prefix}_ for {missing:?}");
        }
    }
}

#[test]
fn every_scene_is_valid_and_flat() {
    for (name, shape) in everything() {
        for (form, strict) in [(Form::Value, true), (Form::Walk, false)] {
            let emitted = emit(&Graph::new(&shape, form).unwrap(), strict).unwrap();
            for entry in ["evaluate", "evaluate_gradient"] {
                check(&emitted.link(&[sdfrs_shaders::EVALUATE.text], entry).unwrap());
            }
            let interpreted = emit_interpreted(&Graph::new(&shape, form).unwrap(), strict).unwrap();
            check(&interpreted.link(&[sdfrs_shaders::EVALUATE.text], "evaluate_gradient").unwrap());
            let deepest = emitted.text.lines().map(|l| l.matches('(').count()).max().unwrap_or(0);
            assert!(deepest <= 2, "{name} nests calls");
            let odd = emitted.consts.iter().find(|v| !v.is_finite());
            assert_eq!(odd, None, "{name} has a constant that is not finite");
        }
    }
}

/// Too long for one function by hundreds of times: the parser's stack must not care.
#[test]
fn the_longest_scene_is_valid() {
    let mut shape = build("sphere", &[("radius", num(0.5))], &[]);
    for _ in 0..4990 {
        shape = build("dilate", &[("radius", num(1e-6))], &[&shape]);
    }
    let emitted = emit(&Graph::new(&shape, Form::Value).unwrap(), true).unwrap();
    assert_eq!(emitted.ops, 4991);
    check(&emitted.link(&[sdfrs_shaders::EVALUATE.text], "evaluate_gradient").unwrap());
}
