//! Which grid is asked for, and what is wrong with the asking.

use crate::{
    MeshError,
    bake::{MAX_RESOLUTION, Resolution, Settings},
};

/// The grid that settings and mesh amount to.
pub struct Layout {
    pub dims: [u32; 3],
    pub lo: [f64; 3],
    pub hi: [f64; 3],
}

/// What can be refused without a look at the mesh; the grid, where `bounds` give it.
pub fn given(settings: &Settings) -> Result<Option<Layout>, MeshError> {
    let dims = match settings.resolution {
        Resolution::Cube(n) => [n; 3],
        Resolution::Each(n) => n,
    };
    if let Some(n) = dims.into_iter().find(|n| !(2..=MAX_RESOLUTION).contains(n)) {
        return Err(MeshError::bad(
            "resolution",
            format!("{n} nodes given; at least 2 and at most {MAX_RESOLUTION} are allowed along an axis"),
        ));
    }
    let bytes = dims.iter().map(|&n| u64::from(n)).product::<u64>().saturating_mul(4);
    if !settings.sparse && bytes > settings.budget_bytes {
        let message = format!(
            "{} x {} x {} nodes take {bytes} bytes; {} are allowed",
            dims[0], dims[1], dims[2], settings.budget_bytes
        );
        return Err(MeshError::bad("resolution", message));
    }
    if let Some(band) = settings.band.filter(|b| !(*b > 0.0 && b.is_finite())) {
        return Err(MeshError::bad("band", format!("{band} given; it has to be positive and finite")));
    }
    if settings.sparse && settings.confidence {
        return Err(MeshError::bad("confidence", "asked for with sparse; only a dense grid has it"));
    }
    if !(settings.padding >= 0.0 && settings.padding.is_finite()) {
        return Err(MeshError::bad(
            "padding",
            format!("{} given; it has to be 0 or more and finite", settings.padding),
        ));
    }
    let Some((lo, hi)) = settings.bounds else { return Ok(None) };
    extents("bounds", lo, hi)?;
    Ok(Some(Layout { dims, lo, hi }))
}

fn extents(what: &str, lo: [f64; 3], hi: [f64; 3]) -> Result<(), MeshError> {
    for k in 0..3 {
        if !(lo[k] < hi[k] && (hi[k] - lo[k]).is_finite()) {
            let axis = ["x", "y", "z"][k];
            let message =
                format!("{axis} runs from {} to {}; it has to grow, by a finite amount", lo[k], hi[k]);
            return Err(MeshError::bad(what, message));
        }
    }
    Ok(())
}

pub fn around(settings: &Settings, (lo, hi): ([f64; 3], [f64; 3])) -> Result<Layout, MeshError> {
    let side = (0..3).map(|k| hi[k] - lo[k]).fold(0.0, f64::max);
    let pad = settings.padding * side;
    let (dims, lo, hi) = match settings.resolution {
        Resolution::Each(dims) => (dims, lo.map(|x| x - pad), hi.map(|x| x + pad)),
        Resolution::Cube(n) => {
            let half = 0.5 * side + pad;
            let middle: [f64; 3] = std::array::from_fn(|k| 0.5 * lo[k] + 0.5 * hi[k]);
            ([n; 3], middle.map(|m| m - half), middle.map(|m| m + half))
        }
    };
    extents("box of the mesh and its padding", lo, hi)?;
    Ok(Layout { dims, lo, hi })
}
