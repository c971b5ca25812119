//! Unions, intersections, differences and blends of one value after the other as one instruction.
//!
//! Law: the bits of the instructions one by one (crates/sdfrs-core/tests/fuse.rs).

use super::{Ins, Memory, Op, Tables, kernel};
use crate::{lane::opaque, real::Real};

/// A chain of joins: only the last one's value is stored, the others live in registers.
///
/// The ops are told apart by comparisons, not by a jump through a table: those are guessed better. Packs
/// go by twos, written out, because an array of them would live in memory.
///
/// # Safety
/// As for the functions of [`super::arm`]; all ops must join.
#[inline(always)]
#[allow(unsafe_code)]
pub unsafe fn chain<R: Real>(run: &[Ins], slots: impl Memory<R>, width: usize, t: &Tables<R::S>) {
    let mut g = 0;
    // SAFETY: passed on; `g` and `g + 1` are below `width`.
    unsafe {
        let (from, to) =
            (slots.find(run.get_unchecked(0).a[0]), slots.find(run.get_unchecked(run.len() - 1).d));
        while g < width {
            let two = g + 1 < width;
            let next = if two { g + 1 } else { g };
            let (mut d, mut e) = (from.add(g).read_unaligned(), from.add(next).read_unaligned());
            for ins in run {
                let b = slots.find(ins.a[1]);
                let (a, b) = (b.add(g).read_unaligned(), b.add(next).read_unaligned());
                if ins.op == Op::Min {
                    (d, e) = (d.min(a), e.min(b));
                    opaque();
                } else if ins.op == Op::Cut {
                    (d, e) = (d.max(-a), e.max(-b));
                    opaque();
                } else if ins.op == Op::Max {
                    (d, e) = (d.max(a), e.max(b));
                    opaque();
                } else {
                    let k = R::splat(*t.consts.get_unchecked(ins.k as usize));
                    let inv = R::splat(*t.consts.get_unchecked(ins.k as usize + 1));
                    if ins.op == Op::Smin {
                        (d, e) = (kernel::smin(d, a, k, inv), kernel::smin(e, b, k, inv));
                        opaque();
                    } else {
                        (d, e) = (-kernel::smin(-d, -a, k, inv), -kernel::smin(-e, -b, k, inv));
                        opaque();
                    }
                }
            }
            to.add(next).write_unaligned(e);
            to.add(g).write_unaligned(d);
            g = next + 1;
        }
    }
}
