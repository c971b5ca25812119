//! Signs that need no nearest triangle, given to distances once these are there: winding numbers and parity.

use rayon::prelude::*;

use crate::{MeshError, Watch, bricks::Bricks, grid::Grid, sign::Signs};

/// Nodes asked about at once: many enough for the winding numbers' lanes, few enough to stop soon.
const BATCH: usize = 2048;

/// Signs for a dense grid, x fastest.
pub fn dense(
    values: &mut [f32],
    dims: [u32; 3],
    grid: &Grid,
    signs: &Signs,
    watch: &dyn Watch,
) -> Result<(), MeshError> {
    let [nx, ny, _] = dims.map(|n| n as usize);
    let node = |at: usize| {
        let world = [at % nx, at / nx % ny, at / nx / ny].map(|i| i as u32);
        grid.node(grid.axes.map(|k| world[k]))
    };
    values.par_chunks_mut(BATCH).enumerate().try_for_each(|(chunk, values)| {
        let points: Vec<[f64; 3]> = (0..values.len()).map(|i| node(chunk * BATCH + i)).collect();
        negate(signs, &points, values.iter_mut(), watch)
    })
}

/// Signs for one task's bricks; a part without bricks has the sign of its middle.
pub fn bricks(part: &mut Bricks, grid: &Grid, signs: &Signs, watch: &dyn Watch) -> Result<(), MeshError> {
    let middles: Vec<[f64; 3]> = part.far.iter().map(|(_, far)| grid.unit(far.centre.map(f64::from))).collect();
    let mut inside = vec![false; middles.len()];
    signs.inside_many(&middles, &mut inside);
    for ((_, far), inside) in part.far.iter_mut().zip(inside) {
        far.inside = inside;
    }
    for brick in 0..part.keys.len() {
        let (points, places): (Vec<[f64; 3]>, Vec<usize>) =
            part.own_nodes(brick).map(|(index, place)| (grid.node(index), place)).unzip();
        let mut inside = vec![false; points.len()];
        ask(signs, &points, &mut inside, watch)?;
        for (place, _) in places.into_iter().zip(inside).filter(|(_, inside)| *inside) {
            part.nodes[place] = -part.nodes[place];
        }
    }
    Ok(())
}

fn negate<'v>(
    signs: &Signs,
    points: &[[f64; 3]],
    values: impl Iterator<Item = &'v mut f32>,
    watch: &dyn Watch,
) -> Result<(), MeshError> {
    let mut inside = vec![false; points.len()];
    ask(signs, points, &mut inside, watch)?;
    for (value, _) in values.zip(inside).filter(|(_, inside)| *inside) {
        *value = -*value;
    }
    Ok(())
}

fn ask(signs: &Signs, points: &[[f64; 3]], inside: &mut [bool], watch: &dyn Watch) -> Result<(), MeshError> {
    if watch.cancelled() {
        return Err(MeshError::Cancelled);
    }
    signs.inside_many(points, inside);
    Ok(())
}
