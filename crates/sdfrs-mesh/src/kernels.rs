//! The arithmetic of the descent, over sixteen points at once; compiled once for each instruction set.
//!
//! Law: the bits are the same on all of them (`tests/isa.rs`).

use sdfrs_core::eval::{Isa, best};

use crate::{
    frames::{Slab, Tri},
    lanes::{Lanes, Row},
};

/// Sixteen points, coordinate by coordinate.
pub type Points = [Row; 3];

/// The least of a list, lane by lane.
#[derive(Debug, Clone, Copy)]
pub struct Least {
    pub d2: Row,
    /// Numbers whose bits say which item of the table.
    id: Row,
}

impl Least {
    #[inline(always)]
    fn of<L: Lanes>(d2: L, id: L) -> Self {
        let mut least = Self { d2: Row::ZERO, id: Row::ZERO };
        d2.store(&mut least.d2);
        id.store(&mut least.id);
        least
    }

    /// Which item of the table.
    pub fn id(&self) -> [u32; 16] {
        self.id.0.map(f32::to_bits)
    }
}

/// What a list is held against: an item matters in a cell only if some point of the cell is nearer to it than to `q`.
///
/// Let p = c + x be a point of the cell, |x_i| <= e_i, and s a point of the item. Then |p-s|^2 - |p-q|^2 =
/// |c-s|^2 - |c-q|^2 + 2 x.(q-s), so an item can be dropped if its |c-s|^2 exceeds |c-q|^2 + 2 sum e_i |q_i - s_i| for
/// all its s. Weights w_i (an axis' spacing over the largest) take the e_i out of the sum: e_i <= e w_i.
#[derive(Debug, Clone, Copy)]
pub struct Bound {
    /// Cell centres.
    pub c: Points,
    /// A point of the mesh for each cell, each axis times its weight.
    pub q: Points,
    /// |c-q|^2, rounded up by what rounding can do to either side.
    pub base: Row,
    /// 2 e, rounded up.
    pub twice: Row,
    /// |e|^2: the tangent bound adds it.
    pub extent2: Row,
    pub weights: [f32; 3],
    /// Triangles that reach farther than this are held against the tangent bound too.
    pub large: f32,
}

#[inline(always)]
fn dot3<L: Lanes>(e: &[f32; 3], p: &[L; 3]) -> L {
    L::splat(e[0]).mul(p[0]).add(L::splat(e[1]).mul(p[1])).add(L::splat(e[2]).mul(p[2]))
}

#[inline(always)]
fn minus<L: Lanes>(p: &[L; 3], o: &[f32; 3]) -> [L; 3] {
    [p[0].sub(L::splat(o[0])), p[1].sub(L::splat(o[1])), p[2].sub(L::splat(o[2]))]
}

#[inline(always)]
fn length2<L: Lanes>(p: &[L; 3]) -> L {
    p[0].mul(p[0]).add(p[1].mul(p[1])).add(p[2].mul(p[2]))
}

#[inline(always)]
fn load3<L: Lanes>(p: &Points) -> [L; 3] {
    [L::load(&p[0]), L::load(&p[1]), L::load(&p[2])]
}

/// The squared distance of `p` from a triangle.
#[inline(always)]
fn triangle<L: Lanes>(t: &Tri, p: &[L; 3]) -> L {
    let d = minus(p, &t.origin);
    let (x, y, z) = (dot3(&t.e[0], &d), dot3(&t.e[1], &d), dot3(&t.e[2], &d));
    let zero = L::splat(0.0);
    let [w, nh, nw, length] = L::half(x, &t.halves);
    // k: past the end of the base; across and along: from the hypotenuse's lower end.
    let k = x.abs().sub(w);
    let across = nh.mul(k).add(nw.mul(y));
    let along = nh.mul(y).sub(nw.mul(k));
    let beyond = along.sub(along.max(zero).min(length));
    let u = L::by_sign(y, k, across).max(zero);
    let v = L::by_sign(y, y, beyond);
    z.mul(z).add(u.mul(u).add(v.mul(v)))
}

/// The closest point of a triangle.
#[inline(always)]
fn closest<L: Lanes>(t: &Tri, p: &[L; 3]) -> [L; 3] {
    let d = minus(p, &t.origin);
    let (x, y) = (dot3(&t.e[0], &d), dot3(&t.e[1], &d));
    let zero = L::splat(0.0);
    let [w, nh, nw, length] = L::half(x, &t.halves);
    let u = x.abs();
    let k = u.sub(w);
    let across = nh.mul(k).add(nw.mul(y));
    let along = nh.mul(y).sub(nw.mul(k)).max(zero).min(length);
    // On the hypotenuse where `across` is positive, else the point itself; on the base for y < 0.
    let (hx, hy) = (w.sub(along.mul(nw)), along.mul(nh));
    let outside = zero.less(across);
    let qx = L::by_sign(y, u.min(w), L::select(outside, hx, u));
    let qy = L::by_sign(y, zero, L::select(outside, hy, y));
    let qx = L::by_sign(x, zero.sub(qx), qx);
    [back(t, 0, qx, qy), back(t, 1, qx, qy), back(t, 2, qx, qy)]
}

/// Axis `k` of a point of the triangle's plane.
#[inline(always)]
fn back<L: Lanes>(t: &Tri, k: usize, x: L, y: L) -> L {
    L::splat(t.origin[k]).add(x.mul(L::splat(t.e[0][k])).add(y.mul(L::splat(t.e[1][k]))))
}

/// A lower bound of the squared distance of anything in a slab; may be negative.
#[inline(always)]
fn slab<L: Lanes>(s: &Slab, p: &[L; 3]) -> L {
    let d = minus(p, &s.middle);
    let inside = dot3(&s.axes[0], &d).abs().add(dot3(&s.axes[1], &d).abs()).add(dot3(&s.axes[2], &d).abs());
    length2(&d).mul(L::splat(1.0 - 1e-5)).sub(inside.add(inside))
}

/// Squared distances to a list of triangles, all of them in `rows`, and the least.
#[inline(always)]
fn measure<L: Lanes>(tris: &[Tri], list: &[u32], points: &Points, rows: &mut [Row]) -> Least {
    let p = load3::<L>(points);
    let mut best = L::splat(f32::INFINITY);
    let mut id = L::splat(0.0);
    for (&t, row) in list.iter().zip(rows) {
        let d2 = triangle(&tris[t as usize], &p);
        d2.store(row);
        let nearer = d2.less(best);
        best = L::select(nearer, d2, best);
        id = L::select(nearer, L::splat(f32::from_bits(t)), id);
    }
    Least::of(best, id)
}

/// The least squared distance to a list of triangles.
#[inline(always)]
fn leaf<L: Lanes>(tris: &[Tri], list: &[u32], points: &Points) -> Row {
    let p = load3::<L>(points);
    let mut best = L::splat(f32::INFINITY);
    for &t in list {
        best = triangle(&tris[t as usize], &p).min(best);
    }
    let mut out = Row::ZERO;
    best.store(&mut out);
    out
}

/// Closest points, of a triangle for each lane.
#[inline(always)]
fn nearest<L: Lanes>(tris: &[Tri], ids: &[u32; 16], points: &Points) -> Points {
    let p = load3::<L>(points);
    let mut q = p;
    let wanted = L::load(&Row(ids.map(|id| id as f32)));
    let mut left = u16::MAX;
    while left != 0 {
        // All lanes with the same triangle at once; numbers beyond 2^24 may share a float, which costs nothing but
        // a second look.
        let id = ids[left.trailing_zeros() as usize];
        let found = closest(&tris[id as usize], &p);
        let number = L::splat(id as f32);
        let mut same = 0;
        for k in 0..16 {
            same |= u16::from(ids[k] == id) << k;
        }
        let differs = wanted.less(number);
        let above = number.less(wanted);
        for k in 0..3 {
            let kept = L::select(differs, q[k], found[k]);
            q[k] = L::select(above, q[k], kept);
        }
        left &= !same;
    }
    let mut out = [Row::ZERO; 3];
    for k in 0..3 {
        q[k].store(&mut out[k]);
    }
    out
}

/// Items held against a bound before the tangent bound takes its turn with some of them.
const TURN: usize = 256;

/// Which items of a list can matter, one bit a cell, by how far they reach. Those that the tangent bound may still drop go
/// to `large`, by their places in the list; how many these are.
#[inline(always)]
fn by_reach<L: Lanes>(
    tris: &[Tri],
    list: &[u32],
    rows: &[Row],
    bound: &Bound,
    masks: &mut [u16],
    large: &mut [u8; TURN],
) -> usize {
    let q = load3::<L>(&bound.q);
    let (base, twice) = (L::load(&bound.base), L::load(&bound.twice));
    let mut count = 0;
    for (i, ((&t, row), mask)) in list.iter().zip(rows).zip(masks).enumerate() {
        let t = &tris[t as usize];
        let most = base.add(twice.mul(apart(&q, &t.mid).add(L::splat(t.reach))));
        *mask = !L::bits(most.less(L::load(row)));
        // Without a branch: which triangles are large cannot be guessed.
        if let Some(place) = large.get_mut(count) {
            *place = i as u8;
        }
        count += usize::from((t.reach > bound.large) & (*mask != 0));
    }
    count
}

/// The plane through a triangle's closest point, at right angles to the way there, has the whole triangle behind it. The
/// others' bits are taken from the masks.
#[inline(always)]
fn by_tangent<L: Lanes>(
    tris: &[Tri],
    list: &[u32],
    rows: &[Row],
    bound: &Bound,
    masks: &mut [u16],
    large: &[u8],
) {
    let (c, q) = (load3::<L>(&bound.c), load3::<L>(&bound.q));
    let (base, twice) = (L::load(&bound.base), L::load(&bound.twice));
    let extent2 = L::load(&bound.extent2);
    for &i in large {
        let i = usize::from(i);
        let foot = closest(&tris[list[i] as usize], &c);
        let mut off = foot[0].mul(L::splat(bound.weights[0])).sub(q[0]).abs();
        for k in 1..3 {
            off = off.add(foot[k].mul(L::splat(bound.weights[k])).sub(q[k]).abs());
        }
        let most = base.add(twice.mul(off)).add(extent2);
        masks[i] &= !L::bits(most.less(L::load(&rows[i])));
    }
}

#[inline(always)]
fn apart<L: Lanes>(q: &[L; 3], mid: &[f32; 3]) -> L {
    let d = minus(q, mid);
    d[0].abs().add(d[1].abs()).add(d[2].abs())
}

/// Lower bounds for a list of slabs in `rows`; the least squared distance of a corner in them, and the least bound.
#[inline(always)]
fn survey<L: Lanes>(slabs: &[Slab], list: &[u32], points: &Points, rows: &mut [Row]) -> (Least, Row) {
    let p = load3::<L>(points);
    let mut best = L::splat(f32::INFINITY);
    let mut low = best;
    let mut id = L::splat(0.0);
    for (&s, row) in list.iter().zip(rows) {
        let item = &slabs[s as usize];
        let bound = slab(item, &p);
        bound.store(row);
        low = bound.min(low);
        let d2 = length2(&minus(&p, &item.corner));
        let nearer = d2.less(best);
        best = L::select(nearer, d2, best);
        id = L::select(nearer, L::splat(f32::from_bits(s)), id);
    }
    let mut out = Row::ZERO;
    low.store(&mut out);
    (Least::of(best, id), out)
}

/// Which slabs of a list can matter, one bit a cell.
#[inline(always)]
fn retain<L: Lanes>(slabs: &[Slab], list: &[u32], rows: &[Row], bound: &Bound, masks: &mut [u16]) {
    let q = load3::<L>(&bound.q);
    let (base, twice) = (L::load(&bound.base), L::load(&bound.twice));
    for ((&s, row), mask) in list.iter().zip(rows).zip(masks) {
        let s = &slabs[s as usize];
        let most = base.add(twice.mul(apart(&q, &s.mid).add(L::splat(s.reach))));
        *mask = !L::bits(most.less(L::load(row)));
    }
}

type Measure = unsafe fn(&[Tri], &[u32], &Points, &mut [Row]) -> Least;
type Leaf = unsafe fn(&[Tri], &[u32], &Points) -> Row;
type Feet = unsafe fn(&[Tri], &[u32; 16], &Points) -> Points;
type Keep<Item> = unsafe fn(&[Item], &[u32], &[Row], &Bound, &mut [u16]);
type Survey = unsafe fn(&[Slab], &[u32], &Points, &mut [Row]) -> (Least, Row);
type Pick = unsafe fn(&[u32], &[u16], u16, &mut [u32]) -> usize;

/// The functions of one instruction set.
#[derive(Clone, Copy)]
pub struct Kernels {
    measure: Measure,
    leaf: Leaf,
    nearest: Feet,
    keep: Keep<Tri>,
    survey: Survey,
    retain: Keep<Slab>,
    pick: Pick,
}

macro_rules! versions {
    ($($(#[$on:meta])? $module:ident $lanes:ident $features:tt)*) => {$(
        $(#[$on])?
        #[allow(unsafe_code)]
        mod $module {
            use super::{Bound, Kernels, Least, Points, Row, Slab, TURN, Tri};
            use crate::lanes::$lanes as L;

            #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
            unsafe fn measure(tris: &[Tri], list: &[u32], points: &Points, rows: &mut [Row]) -> Least {
                super::measure::<L>(tris, list, points, rows)
            }
            #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
            unsafe fn leaf(tris: &[Tri], list: &[u32], points: &Points) -> Row {
                super::leaf::<L>(tris, list, points)
            }
            #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
            unsafe fn nearest(tris: &[Tri], ids: &[u32; 16], points: &Points) -> Points {
                super::nearest::<L>(tris, ids, points)
            }
            #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
            unsafe fn keep(tris: &[Tri], list: &[u32], rows: &[Row], bound: &Bound, masks: &mut [u16]) {
                let turns = list.chunks(TURN).zip(rows.chunks(TURN)).zip(masks.chunks_mut(TURN));
                for ((list, rows), masks) in turns {
                    let mut large = [0; TURN];
                    let count = super::by_reach::<L>(tris, list, rows, bound, masks, &mut large);
                    super::by_tangent::<L>(tris, list, rows, bound, masks, &large[..count]);
                }
            }
            #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
            unsafe fn survey(slabs: &[Slab], list: &[u32], points: &Points, rows: &mut [Row]) -> (Least, Row) {
                super::survey::<L>(slabs, list, points, rows)
            }
            #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
            unsafe fn retain(slabs: &[Slab], list: &[u32], rows: &[Row], bound: &Bound, masks: &mut [u16]) {
                super::retain::<L>(slabs, list, rows, bound, masks)
            }
            #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
            unsafe fn pick(list: &[u32], masks: &[u16], bits: u16, out: &mut [u32]) -> usize {
                // SAFETY: passed on.
                unsafe { crate::pick::$module(list, masks, bits, out) }
            }
            pub const KERNELS: Kernels = Kernels { measure, leaf, nearest, keep, survey, retain, pick };
        }
    )*};
}
versions! {
    #[cfg(target_arch = "x86_64")] avx512 Avx512 "avx512f,avx512vl,avx512dq,avx512bw"
    #[cfg(target_arch = "x86_64")] avx2 Avx2 "avx2"
    #[cfg(target_arch = "x86_64")] sse41 Sse41 "sse4.1"
    baseline Portable "sse2"
}

// SAFETY, for all blocks: `of` is the only maker, and never gives an instruction set that the processor lacks.
#[allow(unsafe_code)]
impl Kernels {
    /// Those of `isa`, or of the best instruction set here where that is less.
    pub fn of(isa: Isa) -> Self {
        match isa.min(best()) {
            #[cfg(target_arch = "x86_64")]
            Isa::Avx512 => avx512::KERNELS,
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 => avx2::KERNELS,
            #[cfg(target_arch = "x86_64")]
            Isa::Sse41 => sse41::KERNELS,
            _ => baseline::KERNELS,
        }
    }

    pub fn measure(&self, tris: &[Tri], list: &[u32], points: &Points, rows: &mut [Row]) -> Least {
        unsafe { (self.measure)(tris, list, points, rows) }
    }
    pub fn leaf(&self, tris: &[Tri], list: &[u32], points: &Points) -> Row {
        unsafe { (self.leaf)(tris, list, points) }
    }
    pub fn nearest(&self, tris: &[Tri], ids: &[u32; 16], points: &Points) -> Points {
        unsafe { (self.nearest)(tris, ids, points) }
    }
    pub fn keep(&self, tris: &[Tri], list: &[u32], rows: &[Row], bound: &Bound, masks: &mut [u16]) {
        unsafe { (self.keep)(tris, list, rows, bound, masks) }
    }
    pub fn survey(&self, slabs: &[Slab], list: &[u32], points: &Points, rows: &mut [Row]) -> (Least, Row) {
        unsafe { (self.survey)(slabs, list, points, rows) }
    }
    pub fn retain(&self, slabs: &[Slab], list: &[u32], rows: &[Row], bound: &Bound, masks: &mut [u16]) {
        unsafe { (self.retain)(slabs, list, rows, bound, masks) }
    }
    pub fn pick(&self, list: &[u32], masks: &[u16], bits: u16, out: &mut [u32]) -> usize {
        unsafe { (self.pick)(list, masks, bits, out) }
    }
}
