//! Every tracer in every form, at its usual setting.

use sdfrs_trace::tracer::{Form, SearchForm, Tracer};

fn all(guards: bool) -> Vec<Tracer> {
    use Tracer::{AutoRelaxed, Basic, BinarySearch, CoverageSearch, Enhanced, Relaxed};
    let mut tracers = vec![
        Basic { guards },
        Relaxed { omega: 1.5, form: Form::Y2023, guards },
        Relaxed { omega: 1.5, form: Form::Y2018, guards },
        Enhanced { omega: 0.88, form: Form::Y2023, guards },
        Enhanced { omega: 0.88, form: Form::Y2018, guards },
        AutoRelaxed { beta: 0.3, guards },
        BinarySearch { form: SearchForm::Stackless, max_level: 18, guards },
        BinarySearch { form: SearchForm::Stack, max_level: 18, guards },
        BinarySearch { form: SearchForm::Split, max_level: 18, guards },
    ];
    if guards {
        tracers.push(CoverageSearch { guards });
    }
    tracers
}

pub fn guarded() -> Vec<Tracer> {
    all(true)
}

/// As printed; coverage search has no such form.
pub fn letter() -> Vec<Tracer> {
    all(false)
}

pub fn is_search(tracer: &Tracer) -> bool {
    matches!(tracer, Tracer::BinarySearch { .. } | Tracer::CoverageSearch { .. })
}

/// How many thresholds above the surface a hit of this tracer may lie.
pub fn reach(tracer: &Tracer) -> f64 {
    if is_search(tracer) { 1.5 } else { 1.0 }
}

pub fn name(tracer: &Tracer) -> String {
    format!("{tracer:?}").replace("guards: ", "")
}
