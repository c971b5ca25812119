//! What is left of a union of spheres in a cell: those that may be the nearest somewhere there, or, where only
//! values up to a limit have to be kept, those that come so near.

use super::{FEW, Part, Probe, Pruner};
use crate::{
    crowd::Crowd,
    op::{Ins, Op},
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
    fn table(&self) -> &[f64] {
        &self.part.consts[self.one.k as usize..(self.one.k + self.one.n) as usize]
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
        near: &mut Vec<u32>,
        to: &mut Vec<f64>,
    ) -> Option<Spheres> {
        let before = to.len();
        let cut = match union.one.op {
            Op::SphereUnion => self.of_union(union, to),
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
        if !(touching.is_finite() && crowd.within(self.middle(union), touching, FEW, near)) {
            return None;
        }
        let cut = touching < winning;
        let plain = cut && union.is_plain();
        for sphere in near.iter().map(|id| crowd.sphere(*id)) {
            if !plain || self.cells[union.cell].touches(sphere, union.below) {
                to.extend(sphere);
            }
        }
        Some(cut)
    }

    fn of_union(&self, union: Union, to: &mut Vec<f64>) -> bool {
        let [x, y, z] = self.middle(union);
        let [winning, touching] = self.reach(union);
        let plain = touching < winning && union.is_plain();
        let mut cut = false;
        to.reserve(union.table().len());
        for s in union.table().chunks_exact(4) {
            let (dx, dy, dz) = (x - s[0] as f32, y - s[1] as f32, z - s[2] as f32);
            let distance = dx * dx + dy * dy + dz * dz;
            // Kept unless certainly farther; what is not a number is kept as well.
            let beyond = |near: f32| {
                let far = near + s[3] as f32;
                far >= 0.0 && distance > far * far
            };
            if beyond(winning) {
                continue;
            }
            if beyond(touching) || (plain && !self.cells[union.cell].touches(s, union.below)) {
                cut = true;
            } else {
                to.extend_from_slice(s);
            }
        }
        cut
    }
}
