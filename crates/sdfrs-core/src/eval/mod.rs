//! The evaluator: runs a tape over batches of points, 64 f32 or 32 f64 at a time.
//!
//! One text of every kernel, compiled for each instruction set and picked once; no fused multiply-add
//! in any of them, so all give the same bits (law: tests/laws, forced instruction sets).

mod run;

use crate::{
    error::SceneError,
    field::Field,
    graph::{Form, Graph},
    lane::{Dual, Iv, Pack},
    op::{Tables, execute},
    real::{Real, Scalar},
    shape::Shape,
    tape::Tape,
};

pub use run::{Isa, isa};

/// Packs a chunk of the slice evaluator.
const CHUNK: usize = 4;

/// A scalar with a pack of its own.
pub trait Native: Scalar {
    type Lanes: Lanes<Self>;
    /// The instruction loop over `width` packs a slot, and the one over duals: written out per type, so
    /// that the op table is compiled here once and not again in every dependent crate.
    #[doc(hidden)]
    fn run(tape: &Tape<Self>, slots: &mut [Self::Lanes], width: usize);
    #[doc(hidden)]
    fn run_duals(tape: &Tape<Self>, slots: &mut [Dual<Self::Lanes>]);
}

/// A pack that can be filled from a slice.
pub trait Lanes<T>: Real<S = T> {
    const WIDTH: usize;
    fn load(src: &[T]) -> Self;
    fn store(self, dst: &mut [T]);
}

macro_rules! native {
    ($t:ty, $w:literal) => {
        impl Native for $t {
            type Lanes = Pack<$t, $w>;
            #[inline(never)]
            fn run(tape: &Tape<Self>, slots: &mut [Self::Lanes], width: usize) {
                run::run::<Self::Lanes>(tape, slots, width);
            }
            #[inline(never)]
            fn run_duals(tape: &Tape<Self>, slots: &mut [Dual<Self::Lanes>]) {
                run::run::<Dual<Self::Lanes>>(tape, slots, 1);
            }
        }
        impl Lanes<$t> for Pack<$t, $w> {
            const WIDTH: usize = $w;
            #[inline(always)]
            fn load(src: &[$t]) -> Self {
                Pack::load(src)
            }
            #[inline(always)]
            fn store(self, dst: &mut [$t]) {
                Pack::store(self, dst)
            }
        }
    };
}
native!(f32, 16);
native!(f64, 8);

/// A worker's memory; grows to what the largest tape needs and is used again.
pub struct Scratch<T: Native> {
    lanes: Vec<T::Lanes>,
    duals: Vec<Dual<T::Lanes>>,
}

impl<T: Native> Scratch<T> {
    pub fn new() -> Self {
        Self { lanes: Vec::new(), duals: Vec::new() }
    }
}

impl<T: Native> Default for Scratch<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// A shape ready to be evaluated.
#[derive(Debug, Clone)]
pub struct Program<T: Native> {
    tape: Tape<T>,
}

impl<T: Native> Program<T> {
    /// The field's values.
    pub fn values(shape: &Shape) -> Result<Self, SceneError> {
        Ok(Self { tape: Tape::new(&Graph::new(shape, Form::Value)?) })
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
        Ok(Self { tape: Tape::new(&Graph::new(shape, Form::Walk)?) })
    }

    pub fn tape(&self) -> &Tape<T> {
        &self.tape
    }

    /// Values at points given coordinate by coordinate; all slices have one length.
    pub fn evaluate(&self, scratch: &mut Scratch<T>, p: [&[T]; 3], out: &mut [T]) {
        let width = T::Lanes::WIDTH;
        let n = out.len();
        for at in (0..n).step_by(CHUNK * width) {
            let end = (at + CHUNK * width).min(n);
            self.chunk(scratch, p.map(|p| &p[at..end]), &mut out[at..end]);
        }
    }

    fn chunk(&self, scratch: &mut Scratch<T>, p: [&[T]; 3], out: &mut [T]) {
        let width = T::Lanes::WIDTH;
        let packs = out.len().div_ceil(width);
        let slots = reserve(&mut scratch.lanes, self.tape.slots() * packs);
        for (axis, p) in p.iter().enumerate() {
            for (slot, p) in slots[axis * packs..].iter_mut().zip(p.chunks(width)) {
                *slot = T::Lanes::load(p);
            }
        }
        T::run(&self.tape, slots, packs);
        let root = self.tape.root() * packs;
        for (value, out) in slots[root..].iter().zip(out.chunks_mut(width)) {
            value.store(out);
        }
    }

    /// Values and gradients by dual numbers: `out` is value, d/dx, d/dy, d/dz.
    pub fn gradient(&self, scratch: &mut Scratch<T>, p: [&[T]; 3], out: [&mut [T]; 4]) {
        let width = T::Lanes::WIDTH;
        let [value, dx, dy, dz] = out;
        let slots = reserve(&mut scratch.duals, self.tape.slots());
        for at in (0..value.len()).step_by(width) {
            let end = (at + width).min(value.len());
            for axis in 0..3 {
                slots[axis] = Dual::variable(T::Lanes::load(&p[axis][at..end]), axis);
            }
            T::run_duals(&self.tape, slots);
            let Dual(v, g) = slots[self.tape.root()];
            v.store(&mut value[at..end]);
            g[0].store(&mut dx[at..end]);
            g[1].store(&mut dy[at..end]);
            g[2].store(&mut dz[at..end]);
        }
    }
}

impl<T: Native> Field<T> for Program<T> {
    fn eval(&self, scratch: &mut Scratch<T>, p: [&[T]; 3], out: &mut [T]) {
        self.evaluate(scratch, p, out);
    }
}

/// Certified range of a shape's values over a box.
#[allow(unsafe_code)]
pub fn interval(shape: &Shape, lo: [f64; 3], hi: [f64; 3]) -> Result<(f64, f64), SceneError> {
    let tape = Tape::<f64>::new(&Graph::new(shape, Form::Value)?);
    let mut slots = vec![Iv::ALL; tape.slots()];
    for i in 0..3 {
        slots[i] = Iv::new(lo[i], hi[i]);
    }
    let Tables { consts, grids } = tape.tables();
    for ins in tape.instructions() {
        // SAFETY: the tape is checked, and there is one value for each of its slots.
        unsafe { execute::<Iv>(ins, slots.as_mut_ptr(), 1, &Tables { consts, grids }) };
    }
    let Iv { lo, hi } = slots[tape.root()];
    Ok((lo, hi))
}

/// At least `n` values, made once.
fn reserve<R: Real>(memory: &mut Vec<R>, n: usize) -> &mut [R] {
    if memory.len() < n {
        memory.resize(n, R::c(0.0));
    }
    &mut memory[..n]
}
