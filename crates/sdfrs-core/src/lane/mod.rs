//! Numbers wider than a scalar: packs of lanes, intervals, dual numbers.
//!
//! All of them give, lane by lane, the bits of the scalar (packs, values of duals).

mod array;
mod dual;
mod interval;
mod mask;

pub use array::Pack;
pub use dual::Dual;
pub use interval::Iv;
pub use mask::{Mask, Truth};
