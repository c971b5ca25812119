//! One sign where no surface can pass.
//!
//! Two points p and q of distances d(p) and d(q) lie on the same side of a closed surface if d(p) + d(q) > |p - q|: each
//! end of the way between them that the surface could cut is too short. Points that are linked like this share a sign,
//! so one evaluation does for all. Children are linked by their centres, nodes within a block of leaves by themselves.
//! Law: `tests/exact.rs` compares with winding numbers.

use crate::{
    MeshError,
    descent::{Arena, Descent, Kind, Known},
    exact::distance2,
    grid::{Cell, Side},
    lanes::Row,
    sign::Nearest,
};

/// Lanes that have a next one along each axis, and how far on it is; lane = 8 i + 4 j + k.
const NEXT: [(u16, u32); 3] = [(0x00ff, 8), (0x0f0f, 4), (0x7777, 1)];

impl Descent<'_> {
    /// Which children are farther than the band, and the sides of those that have one.
    pub(crate) fn decide(
        &self,
        arena: &mut Arena,
        list: &[u32],
        kind: Kind,
        mask: usize,
        cell: &Cell,
        known: &mut Known,
    ) -> Result<(), MeshError> {
        let mut open = 0u16;
        for lane in 0..16 {
            let (clear, radius) = (known.clear.0[lane], known.children.radius.0[lane]);
            known.sides[lane] = cell.sides[lane >> 1 & 1];
            let live = known.children.live & (1 << lane) != 0;
            let far = live && self.is_far(cell, clear, radius);
            known.far |= u16::from(far) << lane;
            // Leaves link their nodes themselves; clusters know no nearest triangle, and look for a sign only where the
            // descent ends.
            let wanted = far || (kind == Kind::Tris && cell.n > 4 && !self.each);
            if live && wanted && clear > radius && known.sides[lane] == Side::Unknown {
                open |= 1 << lane;
            }
        }
        if open == 0 {
            return Ok(());
        }
        if kind == Kind::Tris {
            self.spread(list, &arena.rows, open, known);
            return Ok(());
        }
        let masks = &arena.masks[mask..mask + list.len()];
        let kept: Vec<u32> =
            list.iter().zip(masks).filter(|(_, m)| **m & open != 0).map(|(s, _)| *s).collect();
        let all = self.expand(&kept);
        arena.reserve(self.budget, 0, 0, all.len())?;
        self.kernels.measure(&self.tris, &all, &known.children.centre, &mut arena.rows[..all.len()]);
        self.spread(&all, &arena.rows, open, known);
        Ok(())
    }

    /// Cells with bricks go on a little beyond what is needed: the bounds of far bricks are better in small cells.
    fn is_far(&self, cell: &Cell, clear: f32, radius: f32) -> bool {
        let Some(band) = self.band else { return false };
        clear > radius + band && (!self.bricks || cell.n <= 16 || clear > 2.0 * radius)
    }

    /// Sides for the `open` lanes, one evaluation for all that are linked.
    fn spread(&self, list: &[u32], rows: &[Row], open: u16, known: &mut Known) {
        let links = if self.each { [0; 3] } else { self.links(known) };
        let mut left = open;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            let together = grow(1 << lane, links);
            let of = |side: Side| (0..16).any(|l| together >> l & 1 == 1 && known.sides[l] == side);
            let side = if of(Side::Inside) {
                Side::Inside
            } else if of(Side::Outside) {
                Side::Outside
            } else {
                let p = [0, 1, 2].map(|a| f64::from(known.children.centre[a].0[lane]));
                self.side(list, rows, lane, self.grid.unit(p))
            };
            for l in 0..16 {
                if (left & together) >> l & 1 == 1 {
                    known.sides[l] = side;
                }
            }
            left &= !together;
        }
    }

    /// Which centres lie on the same side as the next one along each axis.
    fn links(&self, known: &Known) -> [u16; 3] {
        let (c, clear) = (&known.children.centre, &known.clear.0);
        std::array::from_fn(|a| {
            let (have, on) = NEXT[a];
            let mut bits = 0;
            for lane in (0..16usize).filter(|l| have >> l & 1 == 1) {
                let next = lane + on as usize;
                let way = (c[a].0[next] - c[a].0[lane]) * (1.0 + 1e-6) + 4.0 * self.slack;
                bits |= u16::from(clear[lane] + clear[next] > way) << lane;
            }
            bits
        })
    }

    /// Where a point lies (unit frame): f64 decides which of the triangles that f32 cannot tell apart is nearest.
    pub(crate) fn side(&self, list: &[u32], rows: &[Row], lane: usize, p: [f64; 3]) -> Side {
        let Some(signs) = self.signs else { return Side::Outside };
        let least = rows[..list.len()].iter().map(|r| r.0[lane]).fold(f32::INFINITY, f32::min);
        let most = least * (1.0 + 1e-5) + 4.0 * self.slack * (least.sqrt() + self.slack);
        let mut best = f64::INFINITY;
        let mut nearest = Nearest { face: 0, point: p };
        for (&t, row) in list.iter().zip(rows) {
            if row.0[lane] <= most {
                let face = self.faces[t as usize];
                let (d2, point) = distance2(self.mesh.corners(face as usize), p);
                if d2 < best {
                    best = d2;
                    nearest = Nearest { face, point };
                }
            }
        }
        if signs.inside(p, nearest) { Side::Inside } else { Side::Outside }
    }
}

/// All that is linked with `set`.
fn grow(mut set: u16, links: [u16; 3]) -> u16 {
    loop {
        let before = set;
        for (link, (_, on)) in links.into_iter().zip(NEXT) {
            set |= (set & link) << on | (set >> on) & link;
        }
        if set == before {
            return set;
        }
    }
}

/// Bits of a block of 4 x 4 x 8 nodes: 32 i + 8 j + k; how far on the next node along each axis is.
const ON: [u32; 3] = [32, 8, 1];
/// Those that have a next one.
const HAVE: [u128; 3] = [u128::MAX >> 32, 0x00ff_ffff_00ff_ffff_00ff_ffff_00ff_ffff, u128::MAX / 255 * 127];
/// The nodes of the first half along the last axis.
#[cfg(test)]
pub const FIRST_HALF: u128 = u128::MAX / 255 * 15;

/// The distances of a block's nodes, and what is known of their sides.
pub struct Block {
    /// Minus infinity where there is none.
    pub d: [f32; 128],
    pub known: u128,
    pub inside: u128,
    links: [u128; 3],
}

impl Block {
    pub fn new() -> Self {
        Self { d: [f32::NEG_INFINITY; 128], known: 0, inside: 0, links: [0; 3] }
    }

    /// Links all pairs of neighbours that are farther from the surface than from each other; `step` is a little more
    /// than the spacing.
    pub fn link(&mut self, step: [f32; 3]) {
        for a in 0..3 {
            let on = ON[a] as usize;
            let mut bits = 0u128;
            for part in 0..4 {
                let mut word = 0u32;
                for b in 0..32 {
                    let at = 32 * part + b;
                    // Past the end: masked away below.
                    let next = self.d[(at + on) & 127];
                    word |= u32::from(self.d[at] + next > step[a]) << b;
                }
                bits |= u128::from(word) << (32 * part);
            }
            self.links[a] = bits & HAVE[a];
        }
    }

    /// All that is linked with `set`.
    pub fn grow(&self, mut set: u128) -> u128 {
        loop {
            let before = set;
            for a in 0..3 {
                let (link, on) = (self.links[a], ON[a]);
                set |= (set & link) << on | (set >> on) & link;
            }
            if set == before {
                return set;
            }
        }
    }

    /// Spreads what is known.
    pub fn spread(&mut self) {
        let inside = self.grow(self.known & self.inside);
        let outside = self.grow(self.known & !self.inside) & !inside;
        self.known |= inside | outside;
        self.inside |= inside;
    }
}
