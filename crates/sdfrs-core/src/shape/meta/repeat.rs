//! Repetition: which copies must be evaluated so that the field is the distance to the nearest one.
//!
//! A point at `u` (in cells from the nearest cell's centre) is nearest to the copy `round(u - x)` of a
//! child's point `x`: over the child's extent that is a few copies, listed here. An even child inside
//! its cell needs its own copy only (the wall between two copies is their mirror).

use super::Meta;
use crate::error::SceneError;

/// Most copies evaluated for one point.
const MOST: usize = 64;

/// Copies along one axis, as offsets towards the point's side.
fn offsets(m: &Meta, axis: usize, period: f64) -> Result<(i64, i64), SceneError> {
    let (lo, hi) = (m.bounds.lo[axis] / period, m.bounds.hi[axis] / period);
    if !(lo.is_finite() && hi.is_finite()) {
        let name = ["x", "y", "z"][axis];
        let message =
            format!("the shape is unbounded along {name}, allowed: bounded shapes (or with_bounds) there");
        return Err(SceneError::new("repeat", message));
    }
    if m.even[axis] && lo >= -0.5 && hi <= 0.5 {
        return Ok((0, 0));
    }
    if (hi - lo) > MOST as f64 {
        return Err(too_many((hi - lo).ceil()));
    }
    let range = |lo: f64, hi: f64| ((-hi - 0.5).floor() as i64 + 1, (1.0 - lo).ceil() as i64 - 1);
    let (a, b) = (range(lo, hi), range(-hi, -lo));
    Ok((a.0.min(b.0), a.1.max(b.1)))
}

fn too_many(n: f64) -> SceneError {
    let message =
        format!("the shape spans so many cells that {n} copies overlap, allowed: {MOST}; enlarge the period");
    SceneError::new("repeat", message)
}

/// All combinations of copies to evaluate.
pub fn copies(child: &Meta, period: &[f64; 3]) -> Result<Vec<[i64; 3]>, SceneError> {
    let mut all = vec![[0; 3]];
    for axis in (0..3).filter(|&i| period[i] > 0.0) {
        let (first, last) = offsets(child, axis, period[axis])?;
        all = all
            .into_iter()
            .flat_map(|at| {
                (first..=last).map(move |i| {
                    let mut at: [i64; 3] = at;
                    at[axis] = i;
                    at
                })
            })
            .collect();
        if all.len() > MOST {
            return Err(too_many(all.len() as f64));
        }
    }
    Ok(all)
}

pub fn meta(mut m: Meta, period: &[f64; 3], count: &Option<[i64; 3]>) -> Result<Meta, SceneError> {
    copies(&m, period)?;
    for i in (0..3).filter(|&i| period[i] > 0.0) {
        let far = count.map_or(f64::INFINITY, |c| c[i] as f64 * period[i]);
        (m.bounds.lo[i], m.bounds.hi[i]) = (m.bounds.lo[i] - far, m.bounds.hi[i] + far);
    }
    Ok(m)
}
