//! The end of the descent: blocks of 4 x 4 x 8 nodes, eight leaves each.

use crate::{
    MeshError,
    descent::{Arena, Descent, Known, Sink},
    grid::{Cell, Side, place},
    lanes::Row,
    sides::Block,
};

/// A leaf: its cell, where its list lies in the arena, and its distances.
struct Leaf {
    cell: Cell,
    list: [usize; 2],
    d: [f32; 16],
}

impl Descent<'_> {
    /// All leaves of a cell of 4 x 4 x 8 nodes.
    pub(crate) fn leaves<S: Sink>(
        &self,
        arena: &mut Arena,
        sink: &mut S,
        [from, end]: [usize; 2],
        mask: usize,
        cell: &Cell,
        known: &Known,
    ) -> Result<(), MeshError> {
        let count = end - from;
        arena.reserve(self.budget, end + 8 * count + 16, 0, 0)?;
        let unknown = cell.sides.contains(&Side::Unknown);
        let mut leaves: [Option<Leaf>; 8] = [const { None }; 8];
        let mut top = end;
        for pair in 0..8 {
            let Some(next) = self.next(sink, cell, known, pair) else { continue };
            let (above, below) = arena.ids.split_at_mut(top);
            let masks = &arena.masks[mask..mask + count];
            let n = self.kernels.pick(&above[from..end], masks, 3 << (2 * pair), below);
            let mut leaf = Leaf { cell: next, list: [top, top + n], d: [0.0; 16] };
            self.ask(&below[..n])?;
            let d2 = self.kernels.leaf(&self.tris, &below[..n], &self.grid.leaf(next.origin));
            for lane in 0..16 {
                leaf.d[lane] = d2.0[lane].sqrt();
            }
            if unknown {
                // Signs may ask for the list again.
                top += n;
                leaves[pair] = Some(leaf);
            } else {
                let sides = next.sides.map(|s| if s == Side::Inside { -1.0 } else { 1.0 });
                for lane in 0..16 {
                    leaf.d[lane] *= sides[lane >> 1 & 1];
                }
                sink.leaf(&next, &leaf.d);
            }
        }
        if unknown {
            if self.each {
                self.sign_each(arena, &mut leaves)?;
            } else {
                self.sign_linked(arena, &mut leaves)?;
            }
            for leaf in leaves.iter().flatten() {
                sink.leaf(&leaf.cell, &leaf.d);
            }
        }
        Ok(())
    }

    /// Signs for a block's nodes, one evaluation for all that are linked.
    fn sign_linked(&self, arena: &mut Arena, leaves: &mut [Option<Leaf>; 8]) -> Result<(), MeshError> {
        let mut block = Block::new();
        let mut real = 0u128;
        for (pair, leaf) in leaves.iter().enumerate() {
            let Some(leaf) = leaf else { continue };
            let nodes = bits(pair);
            for lane in 0..16 {
                block.d[nodes[lane]] = leaf.d[lane];
                real |= u128::from(leaf.cell.has(lane)) << nodes[lane];
            }
            for half in 0..2 {
                if leaf.cell.sides[half] != Side::Unknown {
                    for lane in (0..16).filter(|lane| lane >> 1 & 1 == half) {
                        block.known |= 1 << nodes[lane];
                        block.inside |= u128::from(leaf.cell.sides[half] == Side::Inside) << nodes[lane];
                    }
                }
            }
        }
        block.link(self.steps);
        block.spread();
        while let open = real & !block.known
            && open != 0
        {
            let node = open.trailing_zeros() as usize;
            let (pair, lane) = leaf_of(node);
            let Some(leaf) = &leaves[pair] else { break };
            let side = self.side_of(arena, leaf, &[lane])?[0];
            let together = block.grow(1 << node);
            block.known |= together;
            if side == Side::Inside {
                block.inside |= together;
            }
        }
        for (pair, leaf) in leaves.iter_mut().enumerate() {
            let Some(leaf) = leaf else { continue };
            let nodes = bits(pair);
            for lane in 0..16 {
                if block.inside >> nodes[lane] & 1 == 1 {
                    leaf.d[lane] = -leaf.d[lane];
                }
            }
        }
        Ok(())
    }

    /// Signs for a block's nodes, each by itself.
    fn sign_each(&self, arena: &mut Arena, leaves: &mut [Option<Leaf>; 8]) -> Result<(), MeshError> {
        for leaf in leaves.iter_mut().flatten() {
            let lanes: Vec<usize> = (0..16).filter(|&lane| leaf.cell.has(lane)).collect();
            for (&lane, side) in lanes.iter().zip(self.side_of(arena, leaf, &lanes)?) {
                if side == Side::Inside {
                    leaf.d[lane] = -leaf.d[lane];
                }
            }
        }
        Ok(())
    }

    /// Sides of some nodes of a leaf.
    fn side_of(&self, arena: &mut Arena, leaf: &Leaf, lanes: &[usize]) -> Result<Vec<Side>, MeshError> {
        let [from, end] = leaf.list;
        arena.reserve(self.budget, 0, 0, end - from)?;
        let list = &arena.ids[from..end];
        let rows: &mut [Row] = &mut arena.rows[..end - from];
        self.kernels.measure(&self.tris, list, &self.grid.leaf(leaf.cell.origin), rows);
        let side = |&lane: &usize| {
            let at = place(lane);
            let index = std::array::from_fn(|a| leaf.cell.origin[a] + at[a]);
            self.side(list, rows, lane, self.grid.node(index))
        };
        Ok(lanes.iter().map(side).collect())
    }
}

/// A leaf's nodes in its block.
fn bits(pair: usize) -> [usize; 16] {
    let base = 64 * (pair >> 2) + 16 * (pair >> 1 & 1) + 4 * (pair & 1);
    std::array::from_fn(|lane| base + 32 * (lane >> 3) + 8 * (lane >> 2 & 1) + (lane & 3))
}

/// And back.
fn leaf_of(node: usize) -> (usize, usize) {
    let (i, j, k) = (node >> 5, node >> 3 & 3, node & 7);
    ((i >> 1) * 4 + (j >> 1) * 2 + (k >> 2), (i & 1) * 8 + (j & 1) * 4 + (k & 3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sides::FIRST_HALF;

    #[test]
    fn nodes_of_a_block() {
        let mut seen = [false; 128];
        for pair in 0..8 {
            for (lane, node) in bits(pair).into_iter().enumerate() {
                assert_eq!(leaf_of(node), (pair, lane));
                assert!(!std::mem::replace(&mut seen[node], true));
            }
        }
    }

    /// A wall between two halves of a block: links run along it, never through it.
    #[test]
    fn links_stop_at_the_surface() {
        let mut block = Block::new();
        for node in 0..128usize {
            let k = (node & 7) as f32;
            block.d[node] = (k - 3.3).abs();
        }
        block.link([1.0 + 1e-5; 3]);
        let left = block.grow(1);
        assert_eq!(left, FIRST_HALF, "linked through the wall, or not along it");
    }
}
