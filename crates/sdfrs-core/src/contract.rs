//! The words that fields, tracers, pictures and devices exchange: rays in, hits out, limits between.
//!
//! Twin: the GPU's contract mirrors these structs. Law: TRACERS' terms; a step is one evaluation.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::{error::SceneError, pages, real::Scalar};

/// What became of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    Miss = 0,
    Hit = 1,
    OutOfSteps = 2,
    /// The field was not a number.
    Invalid = 3,
}

/// The ray started inside the solid.
pub const FLAG_INSIDE: u8 = 1;
/// A safe step crossed the surface: the field is steeper than declared.
pub const FLAG_CROSSING: u8 = 2;
/// The floor of 4 ulp, not `eps`, decided this hit.
pub const FLAG_PRECISION: u8 = 4;

/// Whether programs are shortened place by place ([`crate::prune`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Prune {
    Off,
    /// Only operands that cannot win are dropped: values, steps and fallbacks keep their bits.
    Exact,
    /// Cells proven empty are stepped over as well, by whole patches of a picture, and elsewhere what no ray of a cell meets is
    /// left out: the same status, other steps.
    Skip,
    /// One of these, where it pays: exact, or `skip`.
    Auto {
        skip: bool,
    },
}

impl Prune {
    pub fn name(self) -> &'static str {
        match self {
            Prune::Off => "off",
            Prune::Exact => "exact",
            Prune::Skip => "skip",
            Prune::Auto { .. } => "auto",
        }
    }
}

/// When to stop: thresholds in world units, budget in evaluations; and how to get there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    pub eps: f64,
    /// Radius of the pixel at unit distance; the hit threshold at `t` is `max(eps, cone * t)`.
    pub cone: f64,
    pub max_steps: u32,
    pub prune: Prune,
}

impl Limits {
    pub fn check(&self) -> Result<(), SceneError> {
        let bad = |what: &str, got: f64, allowed: &str| {
            Err(SceneError::new(what, format!("got {got}, allowed: {allowed}")))
        };
        if !(self.eps > 0.0 && self.eps.is_finite()) {
            return bad("eps", self.eps, "a finite number above 0");
        }
        if !(self.cone >= 0.0 && self.cone.is_finite()) {
            return bad("cone", self.cone, "a finite number of at least 0");
        }
        if self.max_steps == 0 {
            return bad("max_steps", 0.0, "a whole number of at least 1");
        }
        Ok(())
    }
}

/// One value for all rays, or one for each.
#[derive(Debug, Clone, Copy)]
pub enum Span<'a, T> {
    All(T),
    Each(&'a [T]),
}

impl<T: Scalar> Span<'_, T> {
    #[inline]
    pub fn at(&self, i: usize) -> T {
        match self {
            Span::All(v) => *v,
            Span::Each(v) => v[i],
        }
    }
}

/// A batch of rays; directions have unit length.
#[derive(Debug, Clone, Copy)]
pub struct Rays<'a, T> {
    pub origins: &'a [[T; 3]],
    pub directions: &'a [[T; 3]],
    pub t_min: Span<'a, T>,
    pub t_max: Span<'a, T>,
}

/// Refuses rays that are not finite or not of unit length (within 1e-3), then normalises in place.
pub fn check_rays<T: Scalar>(origins: &[[T; 3]], directions: &mut [[T; 3]]) -> Result<(), SceneError> {
    if origins.len() != directions.len() {
        let message = format!(
            "got {} origins and {} directions, allowed: as many of each",
            origins.len(),
            directions.len()
        );
        return Err(SceneError::new("rays", message));
    }
    for (i, (o, d)) in origins.iter().zip(directions.iter_mut()).enumerate() {
        let len = T::len3(d[0], d[1], d[2]);
        if !o.iter().all(|v| v.is_finite()) {
            return Err(SceneError::new("rays", format!("origin {i} is {o:?}, allowed: finite numbers")));
        }
        if !((len - T::of(1.0)).abs() <= T::of(1e-3)) {
            let message =
                format!("direction {i} is {d:?} of length {len:?}, allowed: unit length within 1e-3");
            return Err(SceneError::new("rays", message));
        }
        *d = [d[0] / len, d[1] / len, d[2] / len];
    }
    Ok(())
}

/// Refuses spans that are not finite where they must be, or turned around.
pub fn check_spans<T: Scalar>(
    n: usize,
    t_min: &Span<T>,
    t_max: &Span<T>,
    finite_end: bool,
) -> Result<(), SceneError> {
    for (name, span) in [("t_min", t_min), ("t_max", t_max)] {
        if let Span::Each(v) = span
            && v.len() != n
        {
            return Err(SceneError::new(
                name,
                format!("got {} values, allowed: one, or one for each of {n} rays", v.len()),
            ));
        }
    }
    let rows = match (t_min, t_max) {
        (Span::All(_), Span::All(_)) => n.min(1),
        _ => n,
    };
    for i in 0..rows {
        let (a, b) = (t_min.at(i), t_max.at(i));
        if !a.is_finite() || b.is_nan() || (finite_end && !b.is_finite()) {
            let allowed = if finite_end {
                "finite numbers (this tracer halves the range)"
            } else {
                "a finite t_min, t_max not NaN"
            };
            return Err(SceneError::new(
                "t_min, t_max",
                format!("ray {i} has {a:?}, {b:?}, allowed: {allowed}"),
            ));
        }
        if !(a <= b) {
            return Err(SceneError::new(
                "t_min, t_max",
                format!("ray {i} has {a:?} > {b:?}, allowed: t_min <= t_max"),
            ));
        }
    }
    Ok(())
}

/// What tracing found, ray by ray. A picture has no `distance` and no `witness`: it shows neither.
#[derive(Debug, Clone, Default)]
pub struct Hits<T> {
    /// World units along the ray; infinite on a miss.
    pub t: Vec<T>,
    pub status: Vec<u8>,
    /// Evaluations of the field.
    pub steps: Vec<u32>,
    pub fallbacks: Vec<u32>,
    /// Mean over the accepted steps of length / radius; 1 where there was none.
    pub multiplier: Vec<T>,
    /// Field value at the last accepted sample.
    pub distance: Vec<T>,
    /// Largest observed slope |R - r| / dz: a free witness of the Lipschitz bound.
    pub witness: Vec<T>,
    pub flags: Vec<u8>,
    /// Largest threshold that decided a hit: above `eps` where a cone or the floor of 4 ulp did.
    pub threshold: T,
    /// Largest of all witnesses.
    pub steepest: T,
    pub work: Work,
}

impl<T: Scalar> Hits<T> {
    /// Room for so many rays.
    pub fn blank(n: usize) -> Self {
        Self { distance: pages::zeros(n), witness: pages::zeros(n), ..Self::picture(n) }
    }

    /// Room for the rays of a picture.
    pub fn picture(n: usize) -> Self {
        Self {
            t: pages::zeros(n),
            status: pages::zeros(n),
            steps: pages::zeros(n),
            fallbacks: pages::zeros(n),
            multiplier: pages::zeros(n),
            distance: Vec::new(),
            witness: Vec::new(),
            flags: pages::zeros(n),
            threshold: T::of(0.0),
            steepest: T::of(0.0),
            work: Work::default(),
        }
    }
}

/// What was run to find the hits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Work {
    /// What pruning was in use; never `Auto`.
    pub prune: Prune,
    /// Operations times points, of programs and of the probes that shortened them.
    pub node_evaluations: u64,
    /// Evaluations by the length of the program they ran.
    pub lengths: BTreeMap<u64, u64>,
    /// What the pruner kept in memory, all workers together.
    pub arena_bytes: u64,
    /// Whether it is known that no ray fell back or raised a flag: pages that nobody wrote need not be read.
    pub quiet: bool,
}

impl Default for Work {
    fn default() -> Self {
        Self {
            prune: Prune::Off,
            node_evaluations: 0,
            lengths: BTreeMap::new(),
            arena_bytes: 0,
            quiet: false,
        }
    }
}

impl Work {
    /// Points run through a program of that length.
    pub fn add(&mut self, ops: u64, points: u64) {
        self.node_evaluations += ops * points;
        *self.lengths.entry(ops).or_insert(0) += points;
    }
    pub fn join(&mut self, other: &Self) {
        self.node_evaluations += other.node_evaluations;
        for (ops, n) in &other.lengths {
            *self.lengths.entry(*ops).or_insert(0) += n;
        }
        self.arena_bytes += other.arena_bytes;
    }
}

/// Stop and progress, shared between the caller and the workers.
#[derive(Debug, Default)]
pub struct Control {
    cancel: AtomicBool,
    done: AtomicU64,
}

impl Control {
    pub fn new() -> Self {
        Self::default()
    }
    pub fn cancel(&self) {
        self.cancel.store(true, Ordering::Relaxed);
    }
    pub fn is_cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }
    pub fn advance(&self, n: u64) {
        self.done.fetch_add(n, Ordering::Relaxed);
    }
    pub fn done(&self) -> u64 {
        self.done.load(Ordering::Relaxed)
    }
}
