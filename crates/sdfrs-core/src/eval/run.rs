//! The instruction loop, compiled once for each instruction set.

use super::{Lanes, slots::Slots};
use crate::{
    graph::INPUTS,
    isa::{Isa, best},
    lane::Dual,
    lane::opaque,
    op::{Ins, Op, Tables},
    real::Real,
    tape::Tape,
};

/// Most packs a slot: 256 f32 or 128 f64, so that an instruction's dispatch is spread over many points.
const CHUNK: usize = 16;
/// Bytes that all slots together should stay below: what the fastest cache holds beside points and constants.
const CACHE: usize = 24 << 10;

/// Packs of a dual: the value and three derivatives.
const DUAL: usize = 4;

/// Instructions of one op over so many packs.
type Step<R> = unsafe fn(&[Ins], *const *mut R, usize, &Tables<<R as Real>::S>);

/// Points of one call, coordinate by coordinate.
pub type Batch<'a, S> = [&'a [S]; 3];

/// Packs a slot, from half of CHUNK up; no more than `packs`. Fewer cost more calls than a nearer cache saves.
#[inline(always)]
fn chunk<R>(slots: usize, packs: usize) -> usize {
    if packs <= CHUNK / 2 {
        return packs;
    }
    (CACHE / (slots * size_of::<R>())).clamp(CHUNK / 2, CHUNK).min(packs)
}

/// The whole program.
///
/// # Safety
/// As for `step`; runs must not reach past the end.
#[inline(always)]
#[allow(unsafe_code)]
unsafe fn run<R: Real>(step: Step<R>, ins: &[Ins], slots: *const *mut R, width: usize, t: &Tables<R::S>) {
    let (mut at, end) = (0, ins.len());
    while at < end {
        // SAFETY: the caller's promise.
        unsafe {
            let run = usize::from(ins.get_unchecked(at).run);
            step(ins.get_unchecked(at..at + run), slots, width, t);
            at += run;
        }
    }
}

/// Values of a batch. Full packs are read from the caller's slices and written to them in place; a
/// chunk that ends inside a pack goes through slots of its own, the last point repeated.
#[inline(always)]
#[allow(unsafe_code)]
unsafe fn values<L: Lanes>(
    step: Step<L>,
    tape: &Tape<L::S>,
    memory: &mut Slots<L>,
    batch: &Batch<L::S>,
    out: &mut [L::S],
) {
    let t: Tables<L::S> = tape.tables();
    let (n, root) = (out.len(), tape.root());
    let most = chunk::<L>(tape.slots(), n.div_ceil(L::WIDTH));
    let mut at = 0;
    while at < n {
        let packs = (n - at).div_ceil(L::WIDTH).min(most);
        let count = (n - at).min(packs * L::WIDTH);
        let whole = count == packs * L::WIDTH;
        memory.reserve(tape.slots(), packs);
        let place = memory.at.as_mut_ptr();
        // SAFETY: the slices have one length and `at + count` does not exceed it. A slot's memory holds
        // `packs * WIDTH` scalars, as do the slices from `at` on where the chunk is `whole`. No
        // instruction writes an input's slot, so the caller's points are only read.
        unsafe {
            for axis in 0..INPUTS as usize {
                let from = batch[axis].as_ptr().add(at);
                if whole {
                    *place.add(axis) = from as *mut L;
                } else {
                    let own = memory.own(axis);
                    *place.add(axis) = own;
                    let to = own.cast::<L::S>();
                    std::ptr::copy_nonoverlapping(from, to, count);
                    for i in count..packs * L::WIDTH {
                        *to.add(i) = *from.add(count - 1);
                    }
                }
            }
            let target = out.as_mut_ptr().add(at);
            // A field that is a bare coordinate has an input for its root: nothing is written there.
            let inside = whole && root >= INPUTS as usize;
            if inside {
                *place.add(root) = target.cast::<L>();
            }
            run(step, tape.instructions(), place.cast_const(), packs, &t);
            if inside {
                // The caller's memory is out of reach from now on.
                *place.add(root) = memory.own(root);
            } else {
                std::ptr::copy_nonoverlapping((*place.add(root)).cast::<L::S>().cast_const(), target, count);
            }
        }
        at += count;
    }
}

/// Whether an instruction is a sphere about a fixed centre of the bare point: its gradient is the unit
/// vector from there, and nothing has to be multiplied by the coordinates' own gradients, 0 and 1.
#[inline(always)]
fn is_ball(ins: &Ins) -> bool {
    ins.op == Op::Sphere && ins.a[..3] == [0, 1, 2]
}

/// Such a sphere over points that lie `stride` packs apart.
///
/// # Safety
/// `p` must lead to `packs` packs of points each, `to` to as many duals; constants as for `step`.
#[inline(always)]
#[allow(unsafe_code)]
unsafe fn ball<L: Lanes>(
    ins: &Ins,
    (p, stride): ([*const L; 3], usize),
    to: *mut Dual<L>,
    packs: usize,
    t: &Tables<L::S>,
) {
    // SAFETY: the caller's promise.
    unsafe {
        let constant = |i: usize| L::splat(*t.consts.get_unchecked(ins.k as usize + i));
        let (cx, cy, cz, r) = (constant(0), constant(1), constant(2), constant(3));
        for g in 0..packs {
            let dx = p[0].add(g * stride).read_unaligned() - cx;
            let dy = p[1].add(g * stride).read_unaligned() - cy;
            let dz = p[2].add(g * stride).read_unaligned() - cz;
            let len = L::len3(dx, dy, dz);
            let inv = L::select_lt(L::c(0.0), len, L::c(1.0) / len, L::c(0.0));
            to.add(g).write(Dual(len - r, [dx * inv, dy * inv, dz * inv]));
            opaque();
        }
    }
}

/// Values and gradients of a batch. Duals start as the points with gradients of 0 and 1, unless spheres
/// are all that reads them.
#[inline(always)]
#[allow(unsafe_code)]
unsafe fn gradients<L: Lanes>(
    step: Step<Dual<L>>,
    tape: &Tape<L::S>,
    memory: &mut Slots<Dual<L>>,
    batch: &Batch<L::S>,
    out: &mut [&mut [L::S]; 4],
) {
    let t: Tables<L::S> = tape.tables();
    let (n, ins) = (out[0].len(), tape.instructions());
    let most = chunk::<Dual<L>>(tape.slots(), n.div_ceil(L::WIDTH));
    memory.reserve(tape.slots(), most);
    let place = memory.at.as_mut_ptr();
    let reads_points = |i: &Ins| i.a[..i.op.arity()].iter().any(|a| *a < INPUTS);
    let all_balls = tape.root() >= INPUTS as usize && ins.iter().all(|i| is_ball(i) || !reads_points(i));
    let mut fresh = true;
    let mut at = 0;
    while at < n {
        let packs = (n - at).div_ceil(L::WIDTH).min(most);
        let end = n.min(at + packs * L::WIDTH);
        let whole = end == at + packs * L::WIDTH;
        // SAFETY: each slot has `most` values; the slices hold `packs` packs from `at` on where the chunk is
        // `whole`.
        unsafe {
            if !(whole && all_balls) {
                for axis in 0..INPUTS as usize {
                    for g in 0..packs {
                        let v = L::load(&batch[axis][at + g * L::WIDTH..end]);
                        // No instruction writes an input's slot: the derivatives stay from chunk to chunk.
                        if fresh {
                            (*place.add(axis)).add(g).write(Dual::variable(v, axis));
                        } else {
                            (*(*place.add(axis)).add(g)).0 = v;
                        }
                    }
                }
                fresh = false;
            }
            // A dual begins with its value.
            let points: ([*const L; 3], usize) = if whole {
                (std::array::from_fn(|axis| batch[axis].as_ptr().wrapping_add(at).cast()), 1)
            } else {
                (std::array::from_fn(|axis| (*place.add(axis)).cast_const().cast()), DUAL)
            };
            let mut next = 0;
            while next < ins.len() {
                let first = ins.get_unchecked(next);
                if is_ball(first) {
                    ball(first, points, *place.add(first.d as usize), packs, &t);
                    next += 1;
                } else {
                    let count = if first.op == Op::Sphere { 1 } else { usize::from(first.run) };
                    step(ins.get_unchecked(next..next + count), place.cast_const(), packs, &t);
                    next += count;
                }
            }
            for g in 0..packs {
                let root = (*place.add(tape.root())).add(g);
                let to = at + g * L::WIDTH..end;
                (*root).0.store(&mut out[0][to.clone()]);
                (*root).1[0].store(&mut out[1][to.clone()]);
                (*root).1[1].store(&mut out[2][to.clone()]);
                (*root).1[2].store(&mut out[3][to]);
            }
        }
        at = end;
    }
}

/// A function for each row of the op table: small ones compile in a third of the time of one loop with
/// all kernels inside, and none spills another's registers.
macro_rules! steps {
    ($features:tt $($op:ident)*) => {
        mod arm {
            use super::{Ins, Real, Tables};

            $(
                #[inline(never)]
                #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
                #[allow(unsafe_code, non_snake_case)]
                pub unsafe fn $op<R: Real, Q: Real<S = R::S>>(run: &[Ins], slots: *const *mut R, width: usize, t: &Tables<R::S>) {
                    // SAFETY: passed on.
                    unsafe { crate::op::arm::$op::<R, Q>(run, slots, width, t) }
                }
            )*
        }

        #[inline(never)]
        #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
        #[allow(unsafe_code)]
        unsafe fn chain<R: Real>(run: &[Ins], slots: *const *mut R, width: usize, t: &Tables<R::S>) {
            // SAFETY: passed on.
            unsafe { crate::op::chain::<R>(run, slots, width, t) }
        }

        #[inline(never)]
        #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
        #[allow(unsafe_code)]
        unsafe fn unions<R: Real>(run: &[Ins], slots: *const *mut R, width: usize, t: &Tables<R::S>) {
            // SAFETY: passed on.
            unsafe { crate::op::unions::<R, FUSED>(run, slots, width, t) }
        }

        struct Table<R, Q>(std::marker::PhantomData<(R, Q)>);
        impl<R: Real, Q: Real<S = R::S>> Table<R, Q> {
            /// A function for each op; those that join share one.
            const STEPS: &'static [super::Step<R>] = &[$(match Op::$op {
                Op::SphereUnion => unions::<R>,
                op if op.joins() => chain::<R>,
                _ => arm::$op::<R, Q>,
            }),*];
        }

        #[inline(always)]
        #[allow(unsafe_code)]
        pub unsafe fn step<R: Real, Q: Real<S = R::S>>(run: &[Ins], slots: *const *mut R, width: usize, t: &Tables<R::S>) {
            // SAFETY: passed on; the table has a row for every op, in their order.
            unsafe { Table::<R, Q>::STEPS.get_unchecked(run.get_unchecked(0).op as usize)(run, slots, width, t) }
        }
    };
}

/// A module for each instruction set, so that they compile side by side; what goes beside `L`, and whether products and
/// sums are fused where that changes no bit.
macro_rules! versions {
    ($($(#[$on:meta])? $name:ident $features:literal $twin:ty, $fused:literal)*) => {$(
        $(#[$on])?
        mod $name {
            use super::{Batch, Dual, Ins, Lanes, Op, Real, Slots, Tables, Tape};
            const FUSED: bool = $fused;
            use crate::op::each_op;

            each_op!(steps, $features);

            #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
            #[allow(unsafe_code)]
            pub unsafe fn values<L: Lanes>(tape: &Tape<L::S>, memory: &mut Slots<L>, batch: &Batch<L::S>, out: &mut [L::S]) {
                // SAFETY: passed on.
                unsafe { super::values::<L>(step::<L, $twin>, tape, memory, batch, out) }
            }

            #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
            #[allow(unsafe_code)]
            pub unsafe fn gradients<L: Lanes>(
                tape: &Tape<L::S>,
                memory: &mut Slots<Dual<L>>,
                batch: &Batch<L::S>,
                out: &mut [&mut [L::S]; 4],
            ) {
                // SAFETY: passed on.
                unsafe { super::gradients::<L>(step::<Dual<L>, Dual<$twin>>, tape, memory, batch, out) }
            }
        }
    )*};
}
versions! {
    #[cfg(target_arch = "x86_64")] avx512 "avx512f,avx512vl,avx512dq,avx512bw" L::Twin, true
    #[cfg(target_arch = "x86_64")] avx2 "avx2" L, false
    #[cfg(target_arch = "x86_64")] sse41 "sse4.1" L, false
    baseline "sse2" L, false
}

macro_rules! dispatch {
    ($name:ident, $isa:expr, $($arg:expr),*) => {
        // SAFETY: the processor has the features of every `Isa` up to `best`; lengths are checked by the caller.
        unsafe {
            match $isa {
                #[cfg(target_arch = "x86_64")]
                Isa::Avx512 => avx512::$name::<L>($($arg),*),
                #[cfg(target_arch = "x86_64")]
                Isa::Avx2 => avx2::$name::<L>($($arg),*),
                #[cfg(target_arch = "x86_64")]
                Isa::Sse41 => sse41::$name::<L>($($arg),*),
                _ => baseline::$name::<L>($($arg),*),
            }
        }
    };
}

/// Values of a batch on an instruction set (or the best one here, where that is less).
#[allow(unsafe_code)]
pub fn run_values<L: Lanes>(
    isa: Isa,
    tape: &Tape<L::S>,
    memory: &mut Slots<L>,
    batch: &Batch<L::S>,
    out: &mut [L::S],
) {
    assert!(batch.iter().all(|p| p.len() == out.len()), "points and values differ in number");
    dispatch!(values, isa.min(best()), tape, memory, batch, out)
}

/// Values and gradients of a batch on an instruction set.
#[allow(unsafe_code)]
pub fn run_gradients<L: Lanes>(
    isa: Isa,
    tape: &Tape<L::S>,
    memory: &mut Slots<Dual<L>>,
    batch: &Batch<L::S>,
    out: &mut [&mut [L::S]; 4],
) {
    let n = out[0].len();
    assert!(
        batch.iter().all(|p| p.len() == n) && out.iter().all(|o| o.len() == n),
        "points and values differ in number"
    );
    dispatch!(gradients, isa.min(best()), tape, memory, batch, out)
}
