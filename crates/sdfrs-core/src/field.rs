//! What a tracer sees: a function of points whose values are already divided by its Lipschitz bound.

use crate::{
    eval::{Native, Scratch},
    prune::Pruner,
};

/// A 1-Lipschitz field, evaluated in batches.
pub trait Field<T: Native>: Sync {
    /// `out[i] = f(p[0][i], p[1][i], p[2][i])`; all slices have one length.
    fn eval(&self, scratch: &mut Scratch<T>, p: [&[T]; 3], out: &mut [T]);
    /// Operations run for a point.
    fn ops(&self) -> u64 {
        1
    }
    /// What can shorten the field place by place, where something can.
    fn pruner(&self) -> Option<&Pruner> {
        None
    }
}
