//! Unions of spheres over many packs, by twos: the end of a table is a branch that nobody can guess, and what is
//! read of a sphere serves both.
//!
//! Law: the bits of a pack alone (tests of the evaluator and of pruning, where packs come in any number).

use super::{Ins, Memory, Tables, kernel};
use crate::{
    lane::opaque,
    real::{Real, Scalar},
};

/// Unions, one after the other. Packs are written out, because an array of them would live in memory.
///
/// # Safety
/// As for the functions of [`super::arm`]; all must be unions of spheres.
#[inline(always)]
#[allow(unsafe_code)]
pub unsafe fn unions<R: Real, const FUSED: bool>(
    run: &[Ins],
    slots: impl Memory<R>,
    width: usize,
    t: &Tables<R::S>,
) {
    // Nothing that LLVM could know.
    let one = R::splat(std::hint::black_box(R::S::of(1.0)));
    for ins in run {
        let table = &t.consts[ins.k as usize..(ins.k + ins.n) as usize];
        let mut g = 0;
        // SAFETY: passed on; `g` and `g + 1` are below `width` where they are read.
        unsafe {
            let (x, y, z) = (slots.find(ins.a[0]), slots.find(ins.a[1]), slots.find(ins.a[2]));
            let to = slots.find(ins.d);
            while R::ONLY_VALUES && g + 1 < width {
                let (d, e) = two::<R, FUSED>(
                    [x.add(g).read_unaligned(), y.add(g).read_unaligned(), z.add(g).read_unaligned()],
                    [
                        x.add(g + 1).read_unaligned(),
                        y.add(g + 1).read_unaligned(),
                        z.add(g + 1).read_unaligned(),
                    ],
                    table,
                    one,
                );
                to.add(g).write_unaligned(d);
                to.add(g + 1).write_unaligned(e);
                g += 2;
                opaque();
            }
            while g < width {
                let (x, y, z) =
                    (x.add(g).read_unaligned(), y.add(g).read_unaligned(), z.add(g).read_unaligned());
                to.add(g).write_unaligned(kernel::sphere_union(x, y, z, table));
                g += 1;
                opaque();
            }
        }
    }
}

/// [`kernel::sphere_union`] of two packs.
#[inline(always)]
fn two<R: Real, const FUSED: bool>([x, y, z]: [R; 3], [u, v, w]: [R; 3], table: &[R::S], one: R) -> (R, R) {
    let (slack, tiny) = (R::splat(kernel::slack::<R>()), R::splat(R::S::TINY));
    let (mut d, mut e) = (R::splat(R::S::INFINITY), R::splat(R::S::INFINITY));
    let (mut rest, _) = table.as_chunks::<4>();
    while let [s, others @ ..] = rest {
        let (a, b, c, r) = (R::splat(s[0]), R::splat(s[1]), R::splat(s[2]), R::splat(s[3]));
        let mut p = (x - a).sq() + (y - b).sq() + (z - c).sq();
        let mut q = (u - a).sq() + (v - b).sq() + (w - c).sq();
        let radius = s[3];
        rest = others;
        while let [s, others @ ..] = rest
            && s[3] == radius
        {
            let (a, b, c) = (R::splat(s[0]), R::splat(s[1]), R::splat(s[2]));
            p = (x.less::<FUSED>(a, one).sq() + (y - b).sq() + (z - c).sq()).min(p);
            q = (u.less::<FUSED>(a, one).sq() + (v - b).sq() + (w - c).sq()).min(q);
            rest = others;
        }
        if R::any_lt(p, (d + r).sq() * slack + tiny) {
            d = (p.sqrt() - r).min(d);
        }
        if R::any_lt(q, (e + r).sq() * slack + tiny) {
            e = (q.sqrt() - r).min(e);
        }
    }
    (d, e)
}
