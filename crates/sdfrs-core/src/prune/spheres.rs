//! What is left of a union of spheres in a cell: those that may be the nearest somewhere there, or, where only
//! values up to a limit have to be kept, those that come so near.

use std::ops::Range;

use super::{FEW, MARGIN, Part, Probe, Pruner, cell::Around};
use crate::{
    crowd::{Crowd, Sieve},
    op::{Ins, Op},
    vectorise::{Kernel, vectorise},
};

/// Whether spheres are left, and whether some were left out that may be the nearest.
pub(super) struct Spheres {
    pub any: bool,
    pub cut: bool,
}

/// A union in a cell, and up to where its values have to be kept.
#[derive(Clone, Copy)]
pub(super) struct Union<'a> {
    pub part: &'a Part,
    pub one: &'a Ins,
    pub cell: usize,
    pub below: f32,
}

impl Union<'_> {
    fn range(&self) -> Range<usize> {
        self.one.k as usize..(self.one.k + self.one.n) as usize
    }
    fn table(&self) -> &[f64] {
        &self.part.consts[self.range()]
    }
    /// The same as the probe has it.
    fn single(&self) -> &[[f32; 4]] {
        self.part.tape.tables().consts[self.range()].as_chunks().0
    }
    /// Whether it is asked for the point's own coordinates.
    fn is_plain(&self) -> bool {
        self.one.a[..3] == [0, 1, 2]
    }
}

impl Probe {
    /// Writes what is left of a union, or of a crowd if few are left; none where it stays as it is.
    pub(super) fn spheres(
        &self,
        pruner: &Pruner,
        union: Union,
        (near, sifted): (&mut Vec<u32>, &mut Vec<u8>),
        to: &mut Vec<f64>,
    ) -> Option<Spheres> {
        let before = to.len();
        let cut = match union.one.op {
            Op::SphereUnion => self.of_union(union, (near, sifted), to),
            Op::SphereCrowd => self.of_crowd(pruner.crowd(union.table()), union, near, to)?,
            _ => return None,
        };
        Some(Spheres { any: to.len() > before, cut })
    }

    /// Where the union is asked in the middle of the cell.
    fn middle(&self, union: Union) -> [f32; 3] {
        [0, 1, 2].map(|a| self.slot(union.part, union.one.a[a], union.cell))
    }

    /// How far from the cell's middle a sphere may be the nearest to something in the cell; and how far one may be
    /// that comes below a value there.
    fn reach(&self, Union { part, one, cell, below }: Union) -> [f32; 2] {
        let (value, around) = (self.slot(part, one.d, cell), self.deviation(part, one.d, cell, false));
        let winning = value + 2.0 * around;
        [winning, winning.min(below + around)]
    }

    fn of_crowd(&self, crowd: &Crowd, union: Union, near: &mut Vec<u32>, to: &mut Vec<f64>) -> Option<bool> {
        let [winning, touching] = self.reach(union);
        let around = self.around(union, touching < winning);
        if !(touching.is_finite() && crowd.within(self.middle(union), touching, &around, FEW, near)) {
            return None;
        }
        near.iter().for_each(|id| to.extend(crowd.sphere(*id)));
        Some(touching < winning)
    }

    /// Which spheres may be met, where some are cut at all.
    fn around(&self, union: Union, cut: bool) -> Around {
        if cut && union.is_plain() { self.cells[union.cell].around(union.below) } else { Around::all() }
    }

    fn of_union(
        &self,
        union: Union,
        (near, sifted): (&mut Vec<u32>, &mut Vec<u8>),
        to: &mut Vec<f64>,
    ) -> bool {
        let [winning, touching] = self.reach(union);
        let around = self.around(union, touching < winning);
        let mut cut = false;
        let spheres = union.single();
        sifted.clear();
        sifted.resize(spheres.len().next_multiple_of(WORD), AWAY);
        vectorise(Sift { spheres, middle: self.middle(union), winning, touching, around, to: sifted });
        near.clear();
        for (eight, first) in sifted.as_chunks::<WORD>().0.iter().zip((0..).step_by(WORD)) {
            // Most are away: eight at a look.
            let mut left = u64::from_le_bytes(*eight);
            while left != 0 {
                let bit = left.trailing_zeros();
                left &= !(0xff << (bit / 8 * 8));
                match eight[(bit / 8) as usize] {
                    FAR => cut = true,
                    _ => near.push(first + bit / 8),
                }
            }
        }
        let table = union.table().as_chunks::<4>().0;
        let hidden = Hidden::behind(self, union, near.iter().map(|i| &spheres[*i as usize]));
        for i in near.iter().map(|i| *i as usize).filter(|i| !hidden.holds(&spheres[*i])) {
            to.extend_from_slice(&table[i]);
        }
        cut
    }
}

/// Bytes of a word.
const WORD: usize = 8;
/// A sphere is the nearest nowhere in a cell; it comes down to the value nowhere there; it may do both.
const AWAY: u8 = 0;
const FAR: u8 = 1;
const NEAR: u8 = 2;

/// Where spheres are. Kept unless certainly farther; what is not a number is kept as well.
struct Sift<'a> {
    spheres: &'a [[f32; 4]],
    middle: [f32; 3],
    winning: f32,
    touching: f32,
    around: Around,
    to: &'a mut [u8],
}

impl Kernel for Sift<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { spheres, middle, winning, touching, around, to } = self;
        for (sphere, to) in spheres.iter().zip(to) {
            let (distance, r) = (squared(middle, sphere), sphere[3]);
            let (wins, touches) = (winning + r, touching + r);
            let away = (wins >= 0.0) & (distance > wins * wins);
            let far = (touches >= 0.0) & (distance > touches * touches) | !around.keeps(*sphere);
            *to = if away {
                AWAY
            } else if far {
                FAR
            } else {
                NEAR
            };
        }
    }
}

/// What the sphere nearest to a cell's middle hides: others no larger, if the cell lies on its side of the plane
/// between the two centres.
struct Hidden {
    middle: [f32; 3],
    /// How far the cell reaches, and what rounding may add to a distance.
    around: f32,
    noise: f32,
    nearest: [f32; 4],
    square: f32,
}

impl Hidden {
    fn behind<'a>(probe: &Probe, union: Union, spheres: impl Iterator<Item = &'a [f32; 4]>) -> Self {
        let Union { part, one, cell, .. } = union;
        let (around, middle) = (probe.deviation(part, one.d, cell, false), probe.middle(union));
        let noise = part.known_of(one.d).noise(probe.far[cell]);
        let nobody = Self { middle, around, noise, nearest: [0.0; 4], square: f32::INFINITY };
        spheres.fold(nobody, |best, sphere| {
            let square = squared(middle, sphere);
            if square < best.square { Self { nearest: *sphere, square, ..best } } else { best }
        })
    }

    fn holds(&self, sphere: &[f32; 4]) -> bool {
        let Self { middle, around, noise, nearest, square } = *self;
        let (far, [x, y, z, r]) = (squared(middle, sphere), *sphere);
        let apart = squared([x, y, z], &nearest).sqrt();
        // Twice the distance from the plane, times that of the centres, less what rounding makes of squares. What is not
        // a number is kept.
        let rounding = 8.0 * noise * (far.sqrt() + around) + 16.0 * f32::EPSILON * (far + square);
        r <= nearest[3] && far - square > 2.0 * around * (1.0 + MARGIN) * apart + rounding
    }
}

/// From a point to a sphere's centre.
#[inline(always)]
fn squared([x, y, z]: [f32; 3], [cx, cy, cz, _]: &[f32; 4]) -> f32 {
    let (x, y, z) = (x - cx, y - cy, z - cz);
    x * x + y * y + z * z
}
