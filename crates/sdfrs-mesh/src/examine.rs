//! Holds a cell's list against its sixteen children: who needs what, and how far everything is.

use crate::{
    MeshError,
    descent::{Arena, Descent, Kind, Known},
    grid::{Cell, Children, Side},
    kernels::{Bound, Points},
    lanes::Row,
};

/// Triangles that reach so many half sides of a cell are held against the tangent bound too.
const LARGE: f32 = 2.0;

/// Lists that take more than a tenth of a millisecond.
const LONG: usize = 1 << 13;

impl Descent<'_> {
    /// Holds a list against the children: masks of who needs what go to the arena, from `mask` on.
    pub(crate) fn examine(
        &self,
        arena: &mut Arena,
        list: &[u32],
        kind: Kind,
        mask: usize,
        cell: &Cell,
    ) -> Result<Known, MeshError> {
        self.ask(list)?;
        let closed = self.bricks && cell.n >= 16;
        let children = self.grid.children(cell, closed);
        let rows = &mut arena.rows[..list.len()];
        let masks = &mut arena.masks[mask..mask + list.len()];
        let c = &children.centre;
        let low = match kind {
            Kind::Tris => {
                let least = self.kernels.measure(&self.tris, list, c, rows);
                let q = self.kernels.nearest(&self.tris, &least.id(), c);
                self.ask(list)?;
                self.kernels.keep(&self.tris, list, rows, &self.bound(&children, &q), masks);
                least.d2
            }
            Kind::Slabs => {
                let (least, low) = self.kernels.survey(&self.slabs, list, c, rows);
                let (id, mut q) = (least.id(), [Row::ZERO; 3]);
                for lane in 0..16 {
                    let corner = self.slabs[id[lane] as usize].corner;
                    for a in 0..3 {
                        q[a].0[lane] = corner[a];
                    }
                }
                self.kernels.retain(&self.slabs, list, rows, &self.bound(&children, &q), masks);
                low
            }
        };
        let mut known = Known { children, clear: Row::ZERO, sides: [Side::Unknown; 16], far: 0 };
        for lane in 0..16 {
            let d = low.0[lane].max(0.0).sqrt();
            known.clear.0[lane] = (d * (1.0 - 4e-6) - self.slack).max(0.0);
        }
        self.decide(arena, list, kind, mask, cell, &mut known)?;
        Ok(known)
    }

    /// Whether anyone still waits, before something is done with a list that takes a while.
    pub(crate) fn ask(&self, list: &[u32]) -> Result<(), MeshError> {
        if list.len() > LONG && self.watch.cancelled() { Err(MeshError::Cancelled) } else { Ok(()) }
    }

    fn bound(&self, children: &Children, q: &Points) -> Bound {
        let c = &children.centre;
        let w = self.grid.weights;
        let mut bound = Bound {
            c: *c,
            q: *q,
            base: Row::ZERO,
            twice: Row::ZERO,
            extent2: Row::ZERO,
            weights: w,
            large: 0.0,
        };
        let mut widest = 0.0f32;
        for lane in 0..16 {
            let d: [f32; 3] = [0, 1, 2].map(|a| c[a].0[lane] - q[a].0[lane]);
            let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            let (radius, extent) = (children.radius.0[lane], children.extent.0[lane]);
            // Both sides of the test round: by parts of the squares, and by the coordinates' own digits.
            bound.base.0[lane] = d2 * (1.0 + 8e-6) + 4.0 * self.slack * (d2.sqrt() + radius + self.slack);
            bound.twice.0[lane] = 2.0 * extent * (1.0 + 8e-6);
            bound.extent2.0[lane] = radius * radius;
            widest = widest.max(extent);
        }
        for a in 0..3 {
            for lane in 0..16 {
                bound.q[a].0[lane] *= w[a];
            }
        }
        bound.large = LARGE * widest;
        bound
    }
}
