//! Tracers in every form, cameras and comparisons of whole traces.
#![allow(dead_code, clippy::unwrap_used, clippy::panic)]

use sdfrs_core::{Control, Hits, Limits, Program, Prune, Rays, Shape, Span, contract::check_rays};
use sdfrs_gpu::{
    Device,
    dispatch::Course,
    march::{self, Settings},
};
use sdfrs_trace::{
    Form, SearchForm, Tracer,
    camera::{Camera, Kind},
};

pub const LIMITS: Limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 400, prune: Prune::Off };

/// Every tracer in every form, with guards and to the letter.
pub fn tracers() -> Vec<Tracer> {
    let mut all = Vec::new();
    for guards in [true, false] {
        all.extend([Tracer::Basic { guards }, Tracer::AutoRelaxed { beta: 0.3, guards }]);
        for form in [Form::Y2023, Form::Y2018] {
            all.push(Tracer::Relaxed { omega: 1.5, form, guards });
            all.push(Tracer::Enhanced { omega: 0.88, form, guards });
        }
        for form in [SearchForm::Stackless, SearchForm::Stack, SearchForm::Split] {
            all.push(Tracer::BinarySearch { form, max_level: 18, guards });
        }
    }
    all.push(Tracer::CoverageSearch { guards: true });
    all
}

pub fn camera(width: u32, height: u32) -> Camera {
    Camera {
        kind: Kind::Pinhole { fov_deg: 50.0 },
        origin: [2.1, 1.3, 2.7],
        target: [0.05, -0.1, 0.0],
        up: [0.0, 1.0, 0.0],
        width,
        height,
    }
}

/// Rays of a camera as a batch.
pub struct Batch {
    origins: Vec<[f32; 3]>,
    directions: Vec<[f32; 3]>,
    t_min: f32,
    t_max: f32,
}

impl Batch {
    pub fn new(camera: &Camera, t_min: f32, t_max: f32) -> Self {
        let (origins, mut directions) = camera.rays::<f32>().unwrap();
        check_rays(&origins, &mut directions).unwrap();
        Self { origins, directions, t_min, t_max }
    }
    pub fn rays(&self) -> Rays<'_, f32> {
        let (t_min, t_max) = (Span::All(self.t_min), Span::All(self.t_max));
        Rays { origins: &self.origins, directions: &self.directions, t_min, t_max }
    }
    pub fn cpu(&self, shape: &Shape, tracer: &Tracer, limits: &Limits) -> Hits<f32> {
        let program = Program::<f32>::for_tracing(shape).unwrap();
        sdfrs_trace::trace(&program, tracer, &self.rays(), limits, &Control::new()).unwrap()
    }
    pub fn gpu(
        &self,
        device: &Device,
        shape: &Shape,
        tracer: &Tracer,
        limits: &Limits,
        strict: bool,
    ) -> (Hits<f32>, Course) {
        let settings = Settings { strict };
        march::trace(device, shape, tracer, &self.rays(), limits, settings, &Control::new()).unwrap()
    }
}

/// Everything a ray came to, as bits; NaNs are one number.
pub fn bits(hits: &Hits<f32>, i: usize) -> [u32; 8] {
    let f = |v: f32| if v.is_nan() { u32::MAX } else { v.to_bits() };
    [
        hits.status[i].into(),
        hits.steps[i],
        hits.fallbacks[i],
        hits.flags[i].into(),
        f(hits.t[i]),
        f(hits.distance[i]),
        f(hits.multiplier[i]),
        f(hits.witness[i]),
    ]
}

/// Rays on which two traces differ in any bit.
pub fn different(a: &Hits<f32>, b: &Hits<f32>) -> Vec<usize> {
    assert_eq!(a.t.len(), b.t.len());
    (0..a.t.len()).filter(|&i| bits(a, i) != bits(b, i)).collect()
}
