//! A camera as the shaders take it.
//!
//! Twin: `sdfrs_trace::camera`, which computes in f64; source/camera.wgsl makes rays an ulp or two apart. Law
//! (tests/march.rs): directions agree within 4 ulp at every corner of the picture.

use sdfrs_trace::camera::Frame;

use crate::contract::View;

/// Axes and scale in f32.
pub fn view(frame: &Frame, width: u32, height: u32) -> View {
    let f32s = |v: [f64; 3]| v.map(|c| c as f32);
    View {
        origin: f32s(frame.origin.into()),
        half_height: frame.half as f32,
        forward: f32s(frame.forward.into()),
        perspective: frame.perspective.into(),
        right: f32s(frame.right.into()),
        width,
        up: f32s(frame.up.into()),
        height,
    }
}
