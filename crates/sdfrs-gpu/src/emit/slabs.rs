//! The table of slabs that a shader finds its programs by: shaders/field/patches.wgsl.

use std::collections::BTreeSet;

use super::{beam::Rect, tape::Row};

/// Instead of a program's first row: nothing is here.
pub const EMPTY: usize = u32::MAX as usize;
/// Counters of points by the length of the program they ran; shaders/field/counted.wgsl has as many.
pub const LENGTHS: usize = 1024;

/// Pixels and a range of depth.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    pub rect: Rect,
    pub lo: f32,
    pub hi: f32,
}

/// A cell that is not cut, and its program's first row or [`EMPTY`]; without one it runs its parent's.
pub struct Leaf {
    pub cell: Cell,
    pub row: Option<usize>,
}

/// Numbers the programs' lengths in their first rows; beyond [`LENGTHS`] of them neighbours share a number,
/// and count as the longest.
pub fn number(rows: &mut [Row], programs: &[usize]) -> Vec<u64> {
    let all: BTreeSet<u64> = programs.iter().map(|&row| rows[row][2] as u64).collect();
    let all: Vec<u64> = all.into_iter().collect();
    let group = all.len().div_ceil(LENGTHS);
    for &row in programs {
        let place = all.partition_point(|ops| *ops < rows[row][2] as u64);
        rows[row][3] = (place / group) as f32;
    }
    all.chunks(group).map(|group| group[group.len() - 1]).collect()
}

/// The table of a picture's patches.
pub fn table(leaves: &[Leaf], (width, height): (u32, u32), side: u32) -> Vec<u32> {
    let (across, down) = (width.div_ceil(side), height.div_ceil(side));
    let mut slabs: Vec<Vec<(f32, f32, u32)>> = vec![Vec::new(); (across * down) as usize];
    for Leaf { cell, row } in leaves {
        let (x, y) = (cell.rect.x / side, cell.rect.y / side);
        let (right, bottom) =
            ((cell.rect.x + cell.rect.width).div_ceil(side), (cell.rect.y + cell.rect.height).div_ceil(side));
        for patch in (y..bottom).flat_map(|y| (x..right).map(move |x| y * across + x)) {
            // Below 2^24: checked with the rows.
            slabs[patch as usize].push((cell.lo, cell.hi, row.unwrap_or(0) as u32));
        }
    }
    let mut table = vec![across, side];
    let first = table.len() + slabs.len() + 1;
    let mut words: Vec<u32> = Vec::new();
    for of_patch in &mut slabs {
        table.push((first + words.len()) as u32);
        of_patch.sort_by(|a, b| a.0.total_cmp(&b.0));
        let begin = words.len();
        for &(_, hi, row) in of_patch.iter() {
            if words.len() > begin && words[words.len() - 1] == row {
                words.truncate(words.len() - 2);
            }
            words.extend([hi.to_bits(), row]);
        }
    }
    table.push((first + words.len()) as u32);
    table.extend(words);
    table
}
