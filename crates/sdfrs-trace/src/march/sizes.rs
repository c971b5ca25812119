//! How large cells are: found by timing unions of 100 to 100,000 spheres and a scene of 12 solids, by 128x128 to
//! 2048x2048 rays (docs/performance.md). Sizes depend on nothing but the scene and the rays: what is counted under
//! `Prune::Skip` depends on cells.

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
    /// Rays that are no picture's lie less close together.
    pub fn exact(pruner: &Pruner, rays: usize, picture: bool) -> Self {
        let share = share(pruner, rays) / if picture { 1 } else { 4 };
        let group = match share {
            0..2 if pruner.has_crowds() => 8,
            0..90 => 16,
            90..400 => 32,
            400..2500 => 48,
            _ => 64,
        };
        let (coarse, fine) = if pruner.has_crowds() { (2.0, 0.75) } else { (1.0, 1.0) };
        Self { coarse, fine, ..Self::of(group, rays) }
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
        let group = match share {
            0..2 => 8,
            2..5 => 16,
            5..SPARSE if pixels < LARGER => 16,
            5..40 => 32,
            40..400 => 48,
            _ => 64,
        };
        let sizes = Self::of(if pixels < SMALL { group.min(16) } else { group }, pixels);
        let block = if crowded && pixels >= LARGE { 128 } else { sizes.block };
        let (coarse, fine) = (if crowded { 6.0 } else { 3.0 }, if share < THIN { 0.75 } else { 1.25 });
        Self { block, coarse, fine, patches: true, ..sizes }
    }

    /// Groups of that size, or of the largest that leaves so many rays enough blocks to keep all threads busy.
    fn of(group: usize, rays: usize) -> Self {
        let (most, block) = match rays {
            ..LARGE => (32, 64),
            LARGE..LARGER => (48, 48),
            LARGER..LARGEST => (48, 96),
            _ => (64, 128),
        };
        match group {
            ..=32 => Self { group, ..Self::default() },
            _ => Self { group: group.min(most), block, ..Self::default() },
        }
    }
}

/// Rays for each operation of a scene.
fn share(pruner: &Pruner, rays: usize) -> u64 {
    rays as u64 / pruner.size().max(1)
}

/// Pixels of a small picture, of large ones, and for each operation of a scene that leaves most of a group empty, or
/// whose cells are better thin.
const SMALL: usize = 1 << 16;
const LARGE: usize = 1 << 18;
const LARGER: usize = 1 << 19;
const LARGEST: usize = 2_000_000;
const SPARSE: u64 = 10;
const THIN: u64 = 100;
/// Operations of a long program.
const LONG: u64 = 512;
