//! How large cells are: found by timing unions of 100 to 100,000 spheres and a scene of 12 solids, by 128x128 to
//! 1024x1024 rays.

use sdfrs_core::prune::Pruner;

/// Sizes of cells: rays along a group's side, lengths of slabs over the beam's width, for blocks and for
/// groups.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    pub block: usize,
    pub group: usize,
    pub coarse: f64,
    pub fine: f64,
    /// Whether patches go before rays.
    pub patches: bool,
}

impl Default for Sizes {
    fn default() -> Self {
        Self { block: 64, group: 16, coarse: 1.0, fine: 1.5, patches: false }
    }
}

impl Sizes {
    /// Where every ray is walked. Smaller groups where few rays share much of a scene: there each has a part of its own.
    pub fn exact(pruner: &Pruner, rays: usize) -> Self {
        let group = match (pruner.has_crowds(), share(pruner, rays)) {
            (true, ..2) => 8,
            (true, _) | (false, ..200) => 16,
            (false, _) => 32,
        };
        let (coarse, fine) = if pruner.has_crowds() { (2.0, 0.75) } else { (1.0, 1.0) };
        Self { group, coarse, fine, ..Self::default() }
    }

    /// Where cells are stepped over: thinner where long programs make empty ones worth more.
    pub fn skip(pruner: &Pruner) -> Self {
        Self { coarse: 3.0, fine: if pruner.size() < LONG { 1.5 } else { 0.75 }, ..Self::default() }
    }

    /// The same where patches of a picture go first. They find by themselves what is empty, and larger groups have more
    /// packs to step together; unless too much is in each: then larger blocks share what is found of them.
    pub fn patches(pruner: &Pruner, pixels: usize) -> Self {
        let share = share(pruner, pixels);
        let crowded = share < SPARSE;
        let block = if crowded && pixels >= LARGE { 128 } else { 64 };
        let group = match share {
            0..2 => 8,
            2..SPARSE => 16,
            _ if pixels < SMALL => 16,
            _ => 32,
        };
        let (coarse, fine) = (if crowded { 6.0 } else { 3.0 }, if share < THIN { 0.75 } else { 1.25 });
        Self { block, group, coarse, fine, patches: true }
    }
}

/// Rays for each operation of a scene.
fn share(pruner: &Pruner, rays: usize) -> u64 {
    rays as u64 / pruner.size().max(1)
}

/// Pixels of a small picture, of a large one, and for each operation of a scene that leaves most of a group empty, or
/// whose cells are better thin.
const SMALL: usize = 1 << 16;
const LARGE: usize = 1 << 18;
const SPARSE: u64 = 10;
const THIN: u64 = 100;
/// Operations of a long program.
const LONG: u64 = 512;
