//! The kernels too long for a row of the op table. Each must be `#[inline(always)]`: one that is not
//! costs a factor of 30. Formulas after iq's "distance functions" where no other source is named.

use std::sync::Arc;

use crate::{
    crowd::Crowd,
    grid::{Grid, Step},
    real::{Real, Scalar},
};

#[inline(always)]
pub fn sign<R: Real>(a: R) -> R {
    let zero = R::c(0.0);
    R::select_lt(zero, a, R::c(1.0), R::select_lt(a, zero, R::c(-1.0), zero))
}

/// `sqrt((1 - x)(1 + x))` keeps its digits near 1, where `1 - x*x` loses them.
#[inline(always)]
pub fn asin<R: Real>(x: R) -> R {
    x.atan2(((R::c(1.0) - x) * (R::c(1.0) + x)).sqrt())
}

#[inline(always)]
pub fn acos<R: Real>(x: R) -> R {
    ((R::c(1.0) - x) * (R::c(1.0) + x)).sqrt().atan2(x)
}

/// Quadratic smooth minimum: `min(a, b) - h^2 / 4k`, `h = max(k - |a - b|, 0)`; 1-Lipschitz in (a, b). `inv` = 1 / 4k.
#[inline(always)]
pub fn smin<R: Real>(a: R, b: R, k: R, inv: R) -> R {
    let h = (k - (a - b).abs()).max(R::c(0.0));
    // In this order nothing underflows: the first product is at most 1/4.
    a.min(b) - h * inv * h
}

/// Coordinate within the nearest cell (`off` = 0), or the next cell on the point's side (`off` = 1, 2, ..)
/// or behind it (-1, ..); cells run from `lo` to `hi`.
#[inline(always)]
pub fn repeat<R: Real>(x: R, period: R, lo: R, hi: R, off: R) -> R {
    let u = x / period;
    let cell = (u + R::c(0.5)).floor();
    let side = R::select_lt(u, cell, -off, off);
    x - period * (cell + side).clamp(lo, hi)
}

/// Box with half edges `h`, rounded by `r` (inside the given size).
#[inline(always)]
pub fn cuboid<R: Real>(x: R, y: R, z: R, h: [R; 3], r: R) -> R {
    let zero = R::c(0.0);
    let (qx, qy, qz) = (x.abs() - (h[0] - r), y.abs() - (h[1] - r), z.abs() - (h[2] - r));
    let outside = R::len3(qx.max(zero), qy.max(zero), qz.max(zero));
    outside + qx.max(qy.max(qz)).min(zero) - r
}

#[inline(always)]
pub fn cylinder<R: Real>(x: R, y: R, z: R, r: R, half: R) -> R {
    let zero = R::c(0.0);
    let (dx, dy) = (R::len2(x, z) - r, y.abs() - half);
    dx.max(dy).min(zero) + R::len2(dx.max(zero), dy.max(zero))
}

/// `p` relative to one end, `b` the other end relative to it, `inv` = 1 / |b|^2.
#[inline(always)]
pub fn capsule<R: Real>(p: [R; 3], b: [R; 3], inv: R, r: R) -> R {
    let h = ((p[0] * b[0] + p[1] * b[1] + p[2] * b[2]) * inv).clamp(R::c(0.0), R::c(1.0));
    R::len3(p[0] - b[0] * h, p[1] - b[1] * h, p[2] - b[2] * h) - r
}

/// Capped cone of radius `r0` at y = -half and `r1` at y = half; `inv` = 1 / |(r1 - r0, 2 half)|^2.
#[inline(always)]
pub fn cone<R: Real>(x: R, y: R, z: R, half: R, r0: R, r1: R, inv: R) -> R {
    let zero = R::c(0.0);
    let q = R::len2(x, z);
    let cap = q - q.min(R::select_lt(y, zero, r0, r1));
    let over = y.abs() - half;
    let (kx, ky) = (r1 - r0, half + half);
    let s = (((r1 - q) * kx + (half - y) * ky) * inv).clamp(zero, R::c(1.0));
    let (bx, by) = (q - r1 + kx * s, y - half + ky * s);
    let d = R::len2(cap, over).min(R::len2(bx, by));
    let inside = R::select_lt(bx, zero, R::select_lt(over, zero, R::c(1.0), zero), zero);
    R::select_lt(zero, inside, -d, d)
}

#[inline(always)]
pub fn gyroid<R: Real>(x: R, y: R, z: R) -> R {
    let (s, c) = R::sin_cos([x, y, z]);
    s[0] * c[1] + s[1] * c[2] + s[2] * c[0]
}

/// Least of `|p - c| - r` over a table of `cx, cy, cz, r`.
///
/// Only a sphere with `|p - c|^2 < (d + r)^2` can lower the minimum `d`: the others need no root. The
/// slack covers every rounding, so that no bit depends on which points share a pack.
#[inline(always)]
pub fn sphere_union<R: Real>(x: R, y: R, z: R, table: &[R::S]) -> R {
    let (slack, tiny) = (R::splat(slack::<R>()), R::splat(R::S::TINY));
    let mut d = R::splat(R::S::INFINITY);
    let (mut rest, _) = table.as_chunks::<4>();
    while let [s, others @ ..] = rest {
        let (dx, dy, dz, r) = (x - R::splat(s[0]), y - R::splat(s[1]), z - R::splat(s[2]), R::splat(s[3]));
        rest = others;
        if R::ONLY_VALUES {
            let square = nearest_alike([x, y, z], s[3], dx.sq() + dy.sq() + dz.sq(), &mut rest);
            if R::any_lt(square, (d + r).sq() * slack + tiny) {
                let v = square.sqrt() - r;
                d = v.min(d);
            }
        } else if R::reaches(dx, dy, dz, d + r, slack, tiny) {
            let v = R::len3(dx, dy, dz) - r;
            d = v.min(d);
        }
    }
    d
}

/// Least squared distance to spheres of one radius that stand first in a table; leaves the others. Roots keep the
/// order of squares, rounded or not, so that one root is enough for all; a derivative would tell apart what rounds
/// to one value.
#[inline(always)]
fn nearest_alike<R: Real>([x, y, z]: [R; 3], r: R::S, mut square: R, rest: &mut &[[R::S; 4]]) -> R {
    while let [s, others @ ..] = *rest
        && s[3] == r
    {
        let (dx, dy, dz) = (x - R::splat(s[0]), y - R::splat(s[1]), z - R::splat(s[2]));
        square = (dx.sq() + dy.sq() + dz.sq()).min(square);
        *rest = others;
    }
    square
}

/// What a square may lose by rounding.
#[inline(always)]
pub fn slack<R: Real>() -> R::S {
    R::S::of(1.0 + 16.0 * R::S::EPS.f64())
}

/// The same of a crowd; table: its number.
#[inline(always)]
pub fn sphere_crowd<R: Real>(x: R, y: R, z: R, k: &[R::S], crowds: &[Arc<Crowd>]) -> R {
    let [cx, cy, cz, r] = R::nearest(&crowds[k[0].f64() as usize], [x, y, z]);
    (R::len3(x - cx, y - cy, z - cz) - r).min(R::splat(R::S::INFINITY))
}

/// Distance estimate of the Mandelbulb, `log(r) r / (2 |dr|)`; table: power, iterations, start of the
/// outer field. Beyond radius 2 the estimate outgrows the distance, so `|p| - start` takes over.
///
/// Angles are multiplied by complex powers instead of arc functions ([`Real::triplex_power`]), so any
/// whole power needs only the four operations and sqrt. The pole is z here; the op table passes y, as iq does. Lanes that
/// have escaped keep their state.
#[inline(always)]
pub fn mandelbulb<R: Real>(x: R, y: R, z: R, table: &[R::S]) -> R {
    let (n, iterations) = (table[0].f64() as u32, table[1].f64() as u32);
    let (one, bail) = (R::c(1.0), R::c(2.0));
    let (cx, cy, cz) = (x, y, z);
    let (mut x, mut y, mut z, mut dr) = (x, y, z, one);
    let first = R::len3(x, y, z);
    let mut r = first;
    for _ in 0..iterations {
        if !R::any_lt(r, bail) {
            break;
        }
        let [px, py, pz] = R::triplex_power(x, y, z, n);
        let grown = r.power(n - 1).by(f64::from(n)) * dr + one;
        let (nx, ny, nz) = (px + cx, py + cy, pz + cz);
        x = R::select_lt(r, bail, nx, x);
        y = R::select_lt(r, bail, ny, y);
        z = R::select_lt(r, bail, nz, z);
        dr = R::select_lt(r, bail, grown, dr);
        r = R::len3(x, y, z);
    }
    let inside = R::select_lt(r, R::c(1e-30), R::c(1e-30), r);
    R::select_lt(first, bail, inside.ln().by(0.5) * r / dr, first - R::splat(table[2]))
}

#[inline(always)]
pub fn texture<R: Real>(x: R, y: R, z: R, k: &[R::S], grids: &[Arc<Grid>], step: Step) -> R {
    R::sample(&grids[k[0].f64() as usize], step, [x, y, z])
}
