//! A camera as the shaders take it.
//!
//! Twin: `sdfrs_trace::camera`, which computes in f64; source/camera.wgsl
//! computes with sums of two f32. Law
//! (tests/python/test_gpu.py): both find the same surfaces, at depths within 5 eps.

use sdfrs_trace::camera::Frame;

use crate::contract::View;

/// Axes and scale, each as the sum of two f32.
pub fn view(frame: &Frame, width: u32, height: u32) -> View {
    let [origin, forward, right, up] =
        [frame.origin, frame.forward, frame.right, frame.up].map(<[f64; 3]>::from);
    let scale = frame.half / f64::from(height);
    View {
        origin: origin.map(high),
        scale: high(scale),
        forward: forward.map(high),
        scale_low: low(scale),
        right: right.map(high),
        width,
        up: up.map(high),
        height,
        origin_low: origin.map(low),
        perspective: frame.perspective.into(),
        forward_low: forward.map(low),
        right_low: right.map(low),
        up_low: up.map(low),
        ..View::default()
    }
}

fn high(v: f64) -> f32 {
    v as f32
}

/// What `high` left over.
fn low(v: f64) -> f32 {
    (v - f64::from(v as f32)) as f32
}
