//! The harness of the laws: one-dimensional fields whose first root is known, packed so that each ray
//! has a field of its own, and a judge that compares what a tracer reports with that root.

pub mod families;
pub mod field;
pub mod judge;
pub mod tracers;

pub use families::{Family, Problem, problems};
pub use field::Pack;
pub use judge::{Verdict, judge};
pub use tracers::{guarded, letter, name};
