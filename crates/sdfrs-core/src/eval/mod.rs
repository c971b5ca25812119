//! The evaluator: runs a tape over batches of points, 128 to 256 f32 or 64 to 128 f64 at a time.
//!
//! One text of every kernel, compiled for each instruction set and picked once; no fused multiply-add
//! in any of them (but inside the correctly rounded root of `lane/root.rs`), so all give the same bits
//! (law: tests/laws, forced instruction sets).

mod run;
mod slots;

use std::sync::Arc;

use crate::{
    error::SceneError,
    field::Field,
    graph::{Form, Graph},
    lane::{Dual, Iv, Mask, Pack, Truth},
    op::{Ins, Stock, execute},
    prune::Pruner,
    real::{Real, Scalar},
    shape::Shape,
    tape::Tape,
};

pub use crate::{
    isa::{Isa, best, isa},
    vectorise::{Kernel, vectorise},
};
use run::Batch;
use slots::Slots;

/// A scalar with a pack of its own.
pub trait Native: Scalar {
    type Lanes: Lanes<S = Self>;
    /// The loop over a batch of points and the one with gradients: written out per type, so that the op
    /// table is compiled here once and not again in every dependent crate.
    #[doc(hidden)]
    fn values(
        isa: Isa,
        tape: &Tape<Self>,
        scratch: &mut Scratch<Self>,
        batch: &Batch<Self>,
        out: &mut [Self],
    );
    #[doc(hidden)]
    fn gradients(
        isa: Isa,
        tape: &Tape<Self>,
        scratch: &mut Scratch<Self>,
        batch: &Batch<Self>,
        out: &mut [&mut [Self]; 4],
    );
}

/// A pack of `WIDTH` scalars side by side, nothing else: a slice of them may be read as packs.
///
/// # Safety
/// The type must have the size of `WIDTH` scalars, and any scalars must be a valid pack; so must its twin.
#[allow(unsafe_code)]
pub unsafe trait Lanes: Real + Send + Sync {
    const WIDTH: usize;
    /// The same bytes, whose roots AVX-512 finds without the divider: packs of both kinds in turn take less time than
    /// packs of either. Itself where there is no such thing. Only for where AVX-512 is.
    type Twin: Real<S = Self::S>;
    /// The first `WIDTH` values; the last one again where there are fewer.
    fn load(src: &[Self::S]) -> Self;
    fn store(self, dst: &mut [Self::S]);
    type Mask: Truth;
    /// Where `a < b`.
    fn lt(a: Self, b: Self) -> Self::Mask;
    /// `x` where the truth value holds, else `y`.
    fn pick(truth: Self::Mask, x: Self, y: Self) -> Self;
    /// Small whole numbers as bytes.
    fn bytes(self, to: &mut [u8]);
    /// The number of a cell a lane ([`Scalar::cell`]).
    fn cells(self, to: &mut [u32]);
    /// The least lane.
    fn least(self) -> Self::S;
    fn lane(&self, i: usize) -> Self::S;
    fn set(&mut self, i: usize, v: Self::S);
}

macro_rules! native {
    ($t:ty, $w:literal, $twin:ty) => {
        impl Native for $t {
            type Lanes = Pack<$t, $w>;
            #[inline(never)]
            fn values(
                isa: Isa,
                tape: &Tape<Self>,
                scratch: &mut Scratch<Self>,
                batch: &Batch<Self>,
                out: &mut [Self],
            ) {
                run::run_values::<Self::Lanes>(isa, tape, &mut scratch.lanes, batch, out);
            }
            #[inline(never)]
            fn gradients(
                isa: Isa,
                tape: &Tape<Self>,
                scratch: &mut Scratch<Self>,
                batch: &Batch<Self>,
                out: &mut [&mut [Self]; 4],
            ) {
                run::run_gradients::<Self::Lanes>(isa, tape, &mut scratch.duals, batch, out);
            }
        }
        // SAFETY: a pack is an array of scalars, aligned to its own size of 64 bytes; its twin a register of so many.
        #[allow(unsafe_code)]
        unsafe impl Lanes for Pack<$t, $w> {
            const WIDTH: usize = $w;
            type Twin = $twin;
            #[inline(always)]
            fn load(src: &[$t]) -> Self {
                Pack::load(src)
            }
            #[inline(always)]
            fn store(self, dst: &mut [$t]) {
                Pack::store(self, dst)
            }
            type Mask = Mask<$w>;
            #[inline(always)]
            fn lt(a: Self, b: Self) -> Mask<$w> {
                Pack::below(a, b)
            }
            #[inline(always)]
            fn pick(truth: Mask<$w>, x: Self, y: Self) -> Self {
                Pack::pick(truth, x, y)
            }
            #[inline(always)]
            fn bytes(self, to: &mut [u8]) {
                Pack::bytes(self, to)
            }
            #[inline(always)]
            fn cells(self, to: &mut [u32]) {
                Pack::cells(self, to)
            }
            #[inline(always)]
            fn least(self) -> $t {
                Pack::least(self)
            }
            #[inline(always)]
            fn lane(&self, i: usize) -> $t {
                self.0[i]
            }
            #[inline(always)]
            fn set(&mut self, i: usize, v: $t) {
                self.0[i] = v;
            }
        }
    };
}
native!(f32, 16, Pack<f32, 16>);
#[cfg(target_arch = "x86_64")]
native!(f64, 8, crate::lane::Wide);
#[cfg(not(target_arch = "x86_64"))]
native!(f64, 8, Pack<f64, 8>);

/// A worker's memory; grows to what the largest tape needs and is used again.
pub struct Scratch<T: Native> {
    lanes: Slots<T::Lanes>,
    duals: Slots<Dual<T::Lanes>>,
}

impl<T: Native> Scratch<T> {
    pub fn new() -> Self {
        Self { lanes: Slots::new(), duals: Slots::new() }
    }
}

impl<T: Native> Default for Scratch<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Native> Scratch<T> {
    /// A slot's values after a program has been run over a single pack.
    pub(crate) fn slot(&self, slot: usize) -> &T::Lanes {
        self.lanes.only(slot)
    }
}

impl<T: Native> Tape<T> {
    /// Values at points given coordinate by coordinate; all slices have one length.
    pub fn run(&self, scratch: &mut Scratch<T>, p: [&[T]; 3], out: &mut [T]) {
        T::values(isa(), self, scratch, &p, out);
    }
}

/// A shape ready to be evaluated.
#[derive(Debug, Clone)]
pub struct Program<T: Native> {
    tape: Tape<T>,
    /// Shortens the program place by place, for walks.
    pruner: Option<Arc<Pruner>>,
}

impl<T: Native> Program<T> {
    /// The field's values.
    pub fn values(shape: &Shape) -> Result<Self, SceneError> {
        let graph = Graph::new(shape, Form::Value)?;
        Ok(Self { tape: Tape::new(graph.crowded().as_ref().unwrap_or(&graph)), pruner: None })
    }

    /// The field that tracers walk: each part divided by its Lipschitz bound, textures by their safe step.
    pub fn for_tracing(shape: &Shape) -> Result<Self, SceneError> {
        let lip = shape.lipschitz();
        if shape.is_expr() {
            return Err(SceneError::new(shape.op(), "is an expression, allowed: shapes"));
        }
        if !(lip.is_finite() && lip > 0.0) {
            let message = "no finite Lipschitz bound is known, allowed: shapes with one; declare it by with_lipschitz(L)";
            return Err(SceneError::new(shape.op(), message));
        }
        let graph = Graph::new(shape, Form::Walk)?;
        let pruner = Pruner::new(graph.crowded().as_ref().unwrap_or(&graph)).map(Arc::new);
        Ok(Self { tape: Tape::new(&graph), pruner })
    }

    /// A program to be written over.
    pub fn blank() -> Self {
        Self { tape: Tape::blank(), pruner: None }
    }

    pub(crate) fn rewrite(
        &mut self,
        stock: &Arc<Stock>,
        fill: impl FnOnce(&mut Vec<Ins>, &mut Vec<T>) -> (u32, u32),
    ) {
        self.tape.rewrite(stock, fill);
    }

    pub fn tape(&self) -> &Tape<T> {
        &self.tape
    }

    /// Values at points given coordinate by coordinate; all slices have one length.
    pub fn evaluate(&self, scratch: &mut Scratch<T>, p: [&[T]; 3], out: &mut [T]) {
        self.evaluate_on(isa(), scratch, p, out);
    }

    /// The same on an instruction set of one's choice; the bits don't depend on it.
    pub fn evaluate_on(&self, isa: Isa, scratch: &mut Scratch<T>, p: [&[T]; 3], out: &mut [T]) {
        T::values(isa, &self.tape, scratch, &p, out);
    }

    /// Values and gradients by dual numbers: `out` is value, d/dx, d/dy, d/dz.
    pub fn gradient(&self, scratch: &mut Scratch<T>, p: [&[T]; 3], out: [&mut [T]; 4]) {
        self.gradient_on(isa(), scratch, p, out);
    }

    /// The same on an instruction set of one's choice; the bits don't depend on it.
    pub fn gradient_on(&self, isa: Isa, scratch: &mut Scratch<T>, p: [&[T]; 3], mut out: [&mut [T]; 4]) {
        T::gradients(isa, &self.tape, scratch, &p, &mut out);
    }
}

impl<T: Native> Field<T> for Program<T> {
    fn eval(&self, scratch: &mut Scratch<T>, p: [&[T]; 3], out: &mut [T]) {
        self.evaluate(scratch, p, out);
    }
    fn ops(&self) -> u64 {
        self.tape.ops()
    }
    fn pruner(&self) -> Option<&Pruner> {
        self.pruner.as_deref()
    }
}

/// Certified range of a shape's values over a box.
#[allow(unsafe_code)]
pub fn interval(shape: &Shape, lo: [f64; 3], hi: [f64; 3]) -> Result<(f64, f64), SceneError> {
    let tape = Tape::<f64>::plain(&Graph::new(shape, Form::Value)?);
    let mut slots = vec![Iv::ALL; tape.slots()];
    for i in 0..3 {
        slots[i] = Iv::new(lo[i], hi[i]);
    }
    for ins in tape.instructions() {
        // SAFETY: the tape is checked, and there is one value for each of its slots.
        unsafe { execute::<Iv>(ins, slots.as_mut_ptr(), 1, &tape.tables()) };
    }
    let Iv { lo, hi } = slots[tape.root()];
    Ok((lo, hi))
}
