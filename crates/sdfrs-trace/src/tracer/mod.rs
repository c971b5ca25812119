//! The tracers: given what the field said at a sample, where is the next one?
//!
//! Each is a step machine ([`walk::Walk`]); the loop, the counters and the budget exist once, in
//! `march`. Guarded forms follow TRACERS.md and share [`guarded`]; the forms without guards follow
//! the listings to the letter and keep their faults. Twin: shaders/tracer. Laws: tests/laws, for
//! every tracer, form and precision.

pub mod auto_relaxed;
pub mod basic;
pub mod binary_search;
pub mod coverage_search;
pub mod enhanced;
pub mod guarded;
pub mod relaxed;
pub mod retry;
pub mod split;
pub mod walk;

use sdfrs_core::SceneError;

/// Which listing of a sphere tracing stepper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Form {
    /// Ban and Valasek 2023: one evaluation an iteration.
    #[default]
    Y2023,
    /// Balint and Valasek 2018: a rejected step is tried again inside the iteration. With guards both
    /// forms are the same walk.
    Y2018,
}

/// Which listing of the binary search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SearchForm {
    #[default]
    Stackless,
    Stack,
    Split,
}

/// A tracer with its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tracer {
    Basic { guards: bool },
    Relaxed { omega: f64, form: Form, guards: bool },
    Enhanced { omega: f64, form: Form, guards: bool },
    AutoRelaxed { beta: f64, guards: bool },
    BinarySearch { form: SearchForm, max_level: u32, guards: bool },
    CoverageSearch { guards: bool },
}

/// Deepest level of a stackless search: segment numbers stay exact in f64.
pub const MAX_LEVEL: u32 = 48;

impl Tracer {
    /// Names, as in Python and on the command line.
    pub const NAMES: [&'static str; 6] =
        ["basic", "relaxed", "enhanced", "auto_relaxed", "binary_search", "coverage_search"];

    pub fn name(&self) -> &'static str {
        Self::NAMES[match self {
            Tracer::Basic { .. } => 0,
            Tracer::Relaxed { .. } => 1,
            Tracer::Enhanced { .. } => 2,
            Tracer::AutoRelaxed { .. } => 3,
            Tracer::BinarySearch { .. } => 4,
            Tracer::CoverageSearch { .. } => 5,
        }]
    }

    /// A tracer from its name and the parameters that were given; others keep their defaults.
    pub fn from_parts(
        name: &str,
        omega: Option<f64>,
        beta: Option<f64>,
        form: Option<&str>,
        max_level: Option<u32>,
        guards: bool,
    ) -> Result<Self, SceneError> {
        let year = || match form.unwrap_or("2023") {
            "2023" => Ok(Form::Y2023),
            "2018" => Ok(Form::Y2018),
            other => Err(refuse("form", other, "\"2023\" or \"2018\"")),
        };
        let tracer = match name {
            "basic" => Tracer::Basic { guards },
            "relaxed" => Tracer::Relaxed { omega: omega.unwrap_or(1.5), form: year()?, guards },
            "enhanced" => Tracer::Enhanced { omega: omega.unwrap_or(0.88), form: year()?, guards },
            "auto_relaxed" => Tracer::AutoRelaxed { beta: beta.unwrap_or(0.3), guards },
            "binary_search" => {
                let form = match form.unwrap_or("stackless") {
                    "stackless" => SearchForm::Stackless,
                    "stack" => SearchForm::Stack,
                    "split" => SearchForm::Split,
                    other => return Err(refuse("form", other, "\"stackless\", \"stack\" or \"split\"")),
                };
                Tracer::BinarySearch { form, max_level: max_level.unwrap_or(18), guards }
            }
            "coverage_search" => Tracer::CoverageSearch { guards },
            other => return Err(refuse("tracer", other, &Self::NAMES.join(", "))),
        };
        tracer.check()?;
        Ok(tracer)
    }

    /// Refuses parameters outside their range.
    pub fn check(&self) -> Result<(), SceneError> {
        match *self {
            Tracer::Relaxed { omega, .. } if !(1.0..2.0).contains(&omega) => {
                Err(refuse("omega", omega, "1 <= omega < 2"))
            }
            Tracer::Enhanced { omega, .. } if !(omega > 0.0 && omega <= 1.0) => {
                Err(refuse("omega", omega, "0 < omega <= 1"))
            }
            Tracer::AutoRelaxed { beta, .. } if !(beta > 0.0 && beta < 1.0) => {
                Err(refuse("beta", beta, "0 < beta < 1"))
            }
            Tracer::BinarySearch { max_level, .. } if !(1..=MAX_LEVEL).contains(&max_level) => {
                Err(refuse("max_level", max_level, &format!("1 to {MAX_LEVEL}")))
            }
            Tracer::CoverageSearch { guards: false } => Err(SceneError::new(
                "coverage_search",
                "guards=False is not offered: as printed the search reports no hit at all, because its end marker \
                 has sign 0 and the last test is never true; allowed: guards=True",
            )),
            _ => Ok(()),
        }
    }

    /// Whether the tracer halves the range, which must then be finite.
    pub fn needs_finite_range(&self) -> bool {
        matches!(self, Tracer::BinarySearch { .. } | Tracer::CoverageSearch { .. })
    }

    /// Whether the threshold has its floor of 4 ulp.
    pub fn guards(&self) -> bool {
        match *self {
            Tracer::Basic { guards }
            | Tracer::Relaxed { guards, .. }
            | Tracer::Enhanced { guards, .. }
            | Tracer::AutoRelaxed { guards, .. }
            | Tracer::BinarySearch { guards, .. }
            | Tracer::CoverageSearch { guards } => guards,
        }
    }
}

fn refuse(what: &str, got: impl std::fmt::Display, allowed: &str) -> SceneError {
    SceneError::new(what, format!("got {got}, allowed: {allowed}"))
}
