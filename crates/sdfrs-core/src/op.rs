//! THE op table: one row an op, and everything else follows from it.
//!
//! A row gives the name, the operands, the constants, the Lipschitz rule of an op that formulas may
//! use, and one kernel written over [`Real`]: the same text runs on f32, f64, packs, intervals and
//! duals, and is named alike in WGSL. To add an op see CONTRIBUTING.md, recipe 1.

use std::any::TypeId;
use std::sync::Arc;

use crate::{
    crowd::Crowd,
    grid::{Grid, Step},
    lane::{Iv, opaque, root::EVERY},
    real::Real,
};

mod chain;
mod kernel;
mod spheres;

pub use chain::chain;
pub use spheres::unions;

/// An operand as the Lipschitz rules see it: its own bound and its certified range.
#[derive(Debug, Clone, Copy)]
pub struct Operand {
    pub lip: f64,
    pub range: Iv,
}

impl Operand {
    /// `bound * lip`, where an operand that doesn't move (lip 0) needs no bound.
    fn times(self, bound: f64) -> f64 {
        if self.lip == 0.0 { 0.0 } else { self.lip * bound }
    }
}

/// Largest magnitude of 1/v over a range.
fn inverse_mag(r: Iv) -> f64 {
    if r.contains(0.0) { f64::INFINITY } else { 1.0 / f64::min(r.lo.abs(), r.hi.abs()) }
}

/// What programs share that is no number.
#[derive(Debug, Default)]
pub struct Stock {
    pub grids: Vec<Arc<Grid>>,
    pub crowds: Vec<Arc<Crowd>>,
}

/// Everything a kernel may read besides its operands.
pub struct Tables<'a, S> {
    pub consts: &'a [S],
    pub stock: &'a Stock,
}

/// Where the values of a slot lie.
pub trait Memory<R>: Copy {
    /// # Safety
    /// The slot must exist.
    #[allow(unsafe_code)]
    unsafe fn find(self, slot: u32) -> *mut R;
}

/// One value a slot, side by side.
impl<R> Memory<R> for *mut R {
    #[inline(always)]
    #[allow(unsafe_code)]
    unsafe fn find(self, slot: u32) -> *mut R {
        // SAFETY: the caller's promise.
        unsafe { self.add(slot as usize) }
    }
}

/// A pointer for each slot.
impl<R> Memory<R> for *const *mut R {
    #[inline(always)]
    #[allow(unsafe_code)]
    unsafe fn find(self, slot: u32) -> *mut R {
        // SAFETY: the caller's promise.
        unsafe { *self.add(slot as usize) }
    }
}

/// One instruction: `d = op(a..; consts[k..k + n])`. Slots are indices into the evaluator's memory.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Ins {
    pub op: Op,
    /// How many instructions go together from here on, this one included; never past the end. They have
    /// one op, or each joins another operand to the result of the one before ([`Op::joins`]).
    pub run: u16,
    pub d: u32,
    pub a: [u32; 4],
    pub k: u32,
    pub n: u32,
}

macro_rules! ops {
    (
        scalar { $($sn:ident $st:literal ($($sa:ident),*) [$($sk:ident),*] lip($lip:expr) => $sb:expr;)* }
        solid { $($pn:ident $pt:literal ($($pa:ident),*) [$($pk:ident),*] => $pb:expr;)* }
        table { $($tn:ident $tt:literal ($($ta:ident),*) |$tk:ident, $tg:ident| => $tb:expr;)* }
    ) => {
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u16)]
        pub enum Op { $($sn,)* $($pn,)* $($tn,)* }

        impl Op {
            pub const ALL: &'static [Op] = &[$(Op::$sn,)* $(Op::$pn,)* $(Op::$tn,)*];

            pub const fn name(self) -> &'static str {
                match self { $(Op::$sn => $st,)* $(Op::$pn => $pt,)* $(Op::$tn => $tt,)* }
            }
            /// Number of operands. Pruning asks at every instruction: a table, not a jump.
            #[inline]
            pub const fn arity(self) -> usize {
                const ALL: &[u8] = &[
                    $(<[&str]>::len(&[$(stringify!($sa)),*]) as u8,)*
                    $(<[&str]>::len(&[$(stringify!($pa)),*]) as u8,)*
                    $(<[&str]>::len(&[$(stringify!($ta)),*]) as u8,)*
                ];
                ALL[self as usize] as usize
            }
            /// Number of constants; none for the ops that read a table of any length.
            #[inline]
            pub const fn constants(self) -> Option<usize> {
                const ALL: &[Option<usize>] = &[
                    $(Some(<[&str]>::len(&[$(stringify!($sk)),*])),)*
                    $(Some(<[&str]>::len(&[$(stringify!($pk)),*])),)*
                    $({ let _ = Op::$tn; None },)*
                ];
                ALL[self as usize]
            }
            /// Lipschitz bound of a scalar op from its operands'; infinite where there is none.
            #[allow(unused_variables, unused_assignments, unused_mut)]
            pub fn lipschitz(self, operands: &[Operand]) -> f64 {
                match self {
                    $(Op::$sn => {
                        let mut at = 0;
                        $(let $sa = operands[at]; at += 1;)*
                        $lip
                    })*
                    _ => f64::INFINITY,
                }
            }
        }

        /// A function a row: runs instructions of that op, one after the other, over `width` values a slot.
        ///
        /// The width is no constant: unrolled loops would multiply the code for nothing. Slots are found
        /// before the loop: a store could otherwise change where they lie.
        ///
        /// # Safety
        /// For every `ins` of `run`: `slots` must find `width` values, aligned or not, for every slot it names, and
        /// `ins.k .. ins.k + ins.n` must lie inside `t.consts` with the row's number of constants
        /// ([`crate::tape::Tape`] checks both). `Q` must have the bytes of `R`, and all that it needs of the processor
        /// must be there: where the two differ, every fourth pack of an op that waits for roots goes by `Q`
        /// ([`crate::eval::Lanes::Twin`]).
        #[allow(unsafe_code, unused_variables, unused_assignments, unused_mut, non_snake_case, clippy::missing_safety_doc)]
        pub mod arm {
            // SAFETY (every access): the caller's promise.
            use super::{EVERY, Ins, Memory, Op, Real, Step, Tables, TypeId, kernel, opaque};

            $(#[inline(always)]
            pub unsafe fn $sn<R: Real, Q: Real<S = R::S>>(run: &[Ins], slots: impl Memory<R>, width: usize, t: &Tables<R::S>) {
                #[inline(always)]
                fn value<R: Real>($($sa: R,)* $($sk: R,)*) -> R {
                    $sb
                }
                let twins = Op::$sn.waits_for_roots() && TypeId::of::<R>() != TypeId::of::<Q>();
                for ins in run {
                    let mut ki = 0;
                    $(let $sk = unsafe { *t.consts.get_unchecked(ins.k as usize + ki) }; ki += 1;)*
                    let to = unsafe { slots.find(ins.d) };
                    let mut ai = 0;
                    $(let $sa = unsafe { slots.find(ins.a[ai]) }; ai += 1;)*
                    for g in 0..width {
                        if twins && g % EVERY == 1 {
                            let value = value::<Q>($(unsafe { $sa.cast::<Q>().add(g).read_unaligned() },)* $(Q::splat($sk),)*);
                            unsafe { to.cast::<Q>().add(g).write_unaligned(value) };
                            opaque();
                            continue;
                        }
                        $(let $sa = unsafe { $sa.add(g).read_unaligned() };)*
                        let value = value::<R>($($sa,)* $(R::splat($sk),)*);
                        unsafe { to.add(g).write_unaligned(value) };
                        opaque();
                    }
                }
            })*
            $(#[inline(always)]
            pub unsafe fn $pn<R: Real, Q: Real<S = R::S>>(run: &[Ins], slots: impl Memory<R>, width: usize, t: &Tables<R::S>) {
                #[inline(always)]
                #[allow(clippy::too_many_arguments)]
                fn value<R: Real>($($pa: R,)* $($pk: R,)*) -> R {
                    $pb
                }
                let twins = Op::$pn.waits_for_roots() && TypeId::of::<R>() != TypeId::of::<Q>();
                for ins in run {
                    let mut ki = 0;
                    $(let $pk = unsafe { *t.consts.get_unchecked(ins.k as usize + ki) }; ki += 1;)*
                    let to = unsafe { slots.find(ins.d) };
                    let mut ai = 0;
                    $(let $pa = unsafe { slots.find(ins.a[ai]) }; ai += 1;)*
                    for g in 0..width {
                        if twins && g % EVERY == 1 {
                            let value = value::<Q>($(unsafe { $pa.cast::<Q>().add(g).read_unaligned() },)* $(Q::splat($pk),)*);
                            unsafe { to.cast::<Q>().add(g).write_unaligned(value) };
                            opaque();
                            continue;
                        }
                        $(let $pa = unsafe { $pa.add(g).read_unaligned() };)*
                        let value = value::<R>($($pa,)* $(R::splat($pk),)*);
                        unsafe { to.add(g).write_unaligned(value) };
                        opaque();
                    }
                }
            })*
            $(#[inline(always)]
            pub unsafe fn $tn<R: Real, Q: Real<S = R::S>>(run: &[Ins], slots: impl Memory<R>, width: usize, t: &Tables<R::S>) {
                for ins in run {
                    let $tk = &t.consts[ins.k as usize..(ins.k + ins.n) as usize];
                    let $tg = t.stock;
                    let to = unsafe { slots.find(ins.d) };
                    let mut ai = 0;
                    $(let $ta = unsafe { slots.find(ins.a[ai]) }; ai += 1;)*
                    for g in 0..width {
                        $(let $ta = unsafe { $ta.add(g).read_unaligned() };)*
                        let value = $tb;
                        unsafe { to.add(g).write_unaligned(value) };
                        opaque();
                    }
                }
            })*
        }

        /// Any one instruction; see [`arm`].
        ///
        /// # Safety
        /// As for each of them.
        #[inline(always)]
        #[allow(unsafe_code)]
        pub unsafe fn execute<R: Real>(ins: &Ins, slots: impl Memory<R>, width: usize, t: &Tables<R::S>) {
            let run = std::slice::from_ref(ins);
            // SAFETY: passed on.
            unsafe {
                match ins.op {
                    $(Op::$sn => arm::$sn::<R, R>(run, slots, width, t),)*
                    $(Op::$pn => arm::$pn::<R, R>(run, slots, width, t),)*
                    $(Op::$tn => arm::$tn::<R, R>(run, slots, width, t),)*
                }
            }
        }

        /// Hands the names of all ops to a macro, behind what is given.
        macro_rules! each_op {
            ($then:ident, $first:tt) => { $then! { $first $($sn)* $($pn)* $($tn)* } };
        }
        pub(crate) use each_op;
    };
}

ops! {
    // What formulas are made of. lip(..): `a.lip` is the operand's bound, `a.range` where it lies.
    scalar {
        Const "const" () [v] lip(0.0) => v;
        Add "add" (a, b) [] lip(a.lip + b.lip) => a + b;
        Sub "sub" (a, b) [] lip(a.lip + b.lip) => a - b;
        Mul "mul" (a, b) [] lip(a.times(b.range.mag()) + b.times(a.range.mag())) => a * b;
        Div "div" (a, b) [] lip(a.times(inverse_mag(b.range)) + b.times(a.range.mag() * inverse_mag(b.range).powi(2))) => a / b;
        Min "min" (a, b) [] lip(a.lip.max(b.lip)) => a.min(b);
        Max "max" (a, b) [] lip(a.lip.max(b.lip)) => a.max(b);
        Neg "neg" (a) [] lip(a.lip) => -a;
        Abs "abs" (a) [] lip(a.lip) => a.abs();
        Sqrt "sqrt" (a) [] lip(a.times(0.5 / a.range.lo.max(0.0).sqrt())) => a.sqrt();
        Square "square" (a) [] lip(a.times(2.0 * a.range.mag())) => a.sq();
        Floor "floor" (a) [] lip(a.times(f64::INFINITY)) => a.floor();
        Sign "sign" (a) [] lip(a.times(f64::INFINITY)) => kernel::sign(a);
        Sin "sin" (a) [] lip(a.lip) => a.sin();
        Cos "cos" (a) [] lip(a.lip) => a.cos();
        Tan "tan" (a) [] lip(a.times(f64::INFINITY)) => a.sin() / a.cos();
        Exp "exp" (a) [] lip(a.times(a.range.hi.exp())) => a.exp();
        Log "log" (a) [] lip(a.times(if a.range.lo > 0.0 { 1.0 / a.range.lo } else { f64::INFINITY })) => a.ln();
        Asin "asin" (a) [] lip(a.times(f64::INFINITY)) => kernel::asin(a);
        Acos "acos" (a) [] lip(a.times(f64::INFINITY)) => kernel::acos(a);
        Atan "atan" (a) [] lip(a.lip) => a.atan2(R::c(1.0));
        Atan2 "atan2" (y, x) [] lip(y.times(f64::INFINITY) + x.times(f64::INFINITY)) => y.atan2(x);
        Mod "mod" (a, b) [] lip(a.times(f64::INFINITY) + b.times(f64::INFINITY)) => a - b * (a / b).floor();
        Length2 "length2" (a, b) [] lip(a.lip.hypot(b.lip)) => R::len2(a, b);
        Length3 "length3" (a, b, c) [] lip(a.lip.hypot(b.lip).hypot(c.lip)) => R::len3(a, b, c);
        Select "select" (a, b, x, y) [] lip(f64::INFINITY) => R::select_lt(a, b, x, y);
    }
    // Whole primitives, combinators and steps of transforms: why an interpreter is fast.
    solid {
        AddC "add_const" (a) [c] => a + c;
        SubC "sub_const" (a) [c] => a - c;
        MulC "mul_const" (a) [c] => a * c;
        DivC "div_const" (a) [c] => a / c;
        Dot "dot" (x, y, z) [a, b, c, d] => x * a + y * b + z * c + d;
        Smin "smooth_min" (a, b) [k, inv] => kernel::smin(a, b, k, inv);
        Smax "smooth_max" (a, b) [k, inv] => -kernel::smin(-a, -b, k, inv);
        Shell "shell" (a) [half] => a.abs() - half;
        Elongate "elongate" (x) [h] => x - x.clamp(-h, h);
        ElongateInside "elongate_inside" (x, y, z) [hx, hy, hz] => (x.abs() - hx).max((y.abs() - hy).max(z.abs() - hz)).min(R::c(0.0));
        Repeat "repeat" (x) [period, lo, hi, off] => kernel::repeat(x, period, lo, hi, off);
        RotX "rotate_x" (c, s, x, y) [] => c * x - s * y;
        RotY "rotate_y" (c, s, x, y) [] => s * x + c * y;
        Sphere "sphere" (x, y, z) [cx, cy, cz, r] => R::len3(x - cx, y - cy, z - cz) - r;
        Box "box" (x, y, z) [cx, cy, cz, hx, hy, hz, r] => kernel::cuboid(x - cx, y - cy, z - cz, [hx, hy, hz], r);
        Torus "torus" (x, y, z) [cx, cy, cz, major, minor] => R::len2(R::len2(x - cx, z - cz) - major, y - cy) - minor;
        Cylinder "cylinder" (x, y, z) [cx, cy, cz, r, half] => kernel::cylinder(x - cx, y - cy, z - cz, r, half);
        Capsule "capsule" (x, y, z) [ax, ay, az, bx, by, bz, inv, r] => kernel::capsule([x - ax, y - ay, z - az], [bx, by, bz], inv, r);
        Cone "cone" (x, y, z) [cx, cy, cz, half, r0, r1, inv] => kernel::cone(x - cx, y - cy, z - cz, half, r0, r1, inv);
        Ellipsoid "ellipsoid" (x, y, z) [cx, cy, cz, rx, ry, rz, least] => (R::len3((x - cx) / rx, (y - cy) / ry, (z - cz) / rz) - R::c(1.0)) * least;
        Gyroid "gyroid" (x, y, z) [freq, inv, half] => kernel::gyroid(x * freq, y * freq, z * freq).abs() * inv - half;
        // What the tape makes of pairs (fuse.rs); scenes never name these.
        MulAdd "mul_add" (a, b, c) [] => a * b + c;
        MulSub "mul_sub" (a, b, c) [] => a * b - c;
        SubMul "sub_mul" (a, b, c) [] => a - b * c;
        MulMulAdd "mul_mul_add" (a, b, c, d) [] => a * b + c * d;
        MulMulSub "mul_mul_sub" (a, b, c, d) [] => a * b - c * d;
        MulAddC "mul_add_const" (a) [m, c] => a * m + c;
        Mul3 "mul3" (a, b, c) [] => a * b * c;
        Cut "cut" (a, b) [] => a.max(-b);
    }
    // Ops over a table of constants of any length, over a grid or a crowd.
    table {
        SphereUnion "sphere_union" (x, y, z) |k, _stock| => kernel::sphere_union(x, y, z, k);
        Mandelbulb "mandelbulb" (x, y, z) |k, _stock| => kernel::mandelbulb(z, x, y, k);
        Texture "texture" (x, y, z) |k, stock| => kernel::texture(x, y, z, k, &stock.grids, Step::Raw);
        TextureSafe "texture_safe" (x, y, z) |k, stock| => kernel::texture(x, y, z, k, &stock.grids, Step::Safe);
        TextureSafeNegated "texture_safe_negated" (x, y, z) |k, stock| => kernel::texture(x, y, z, k, &stock.grids, Step::SafeNegated);
        // What the CPU's programs make of a large union of spheres; scenes never name it.
        SphereCrowd "sphere_crowd" (x, y, z) |k, stock| => kernel::sphere_crowd(x, y, z, k, &stock.crowds);
    }
}

impl Op {
    /// What no scene names: the tape makes these of others.
    pub const FUSED: &'static [Op] =
        &[Op::MulAdd, Op::MulSub, Op::SubMul, Op::MulMulAdd, Op::MulMulSub, Op::MulAddC, Op::Mul3, Op::Cut];

    /// What both the CPU and the GPU have: all but what the CPU alone makes of others.
    pub fn shared() -> impl Iterator<Item = Op> {
        Self::ALL.iter().copied().filter(|op| *op != Op::SphereCrowd)
    }

    /// Whether most of an op's time goes into roots: what is worth being compiled for twins, too. Boxes, capsules and cones
    /// multiply, add and compare so much that their roots wait for nobody.
    const fn waits_for_roots(self) -> bool {
        matches!(
            self,
            Op::Sqrt | Op::Length2 | Op::Length3 | Op::Sphere | Op::Torus | Op::Cylinder | Op::Ellipsoid
        )
    }

    /// Whether the op joins its second operand to the first: such instructions form chains.
    pub const fn joins(self) -> bool {
        matches!(self, Op::Min | Op::Max | Op::Smin | Op::Smax | Op::Cut)
    }
}
