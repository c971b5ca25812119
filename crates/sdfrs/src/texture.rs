//! Textures from meshes and from shapes: the one place that knows both bakers and the grid.
//!
//! A mesh's baker gives f32 nodes, dense or in bricks; here they become a grid with its claim (a distance
//! has slope 1), rounded further where asked. Law: `tests/texture.rs`.

use std::sync::Arc;

use sdfrs_core::{
    Control, Grid, SceneError, Shape, bake as shapes,
    grid::{BrickValues, Bricks, Claim, GridValues, Store, slope},
    pool,
};
use sdfrs_mesh::{
    Mesh, MeshError, Watch,
    bake::{Baked, Settings, Values, bake},
    sign::SignRule,
};

/// What samples are stored as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stored {
    F16,
    F32,
    F64,
    /// Bytes over a narrow band; sparse textures only.
    U8,
}

impl Stored {
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "float16" => Stored::F16,
            "float32" => Stored::F32,
            "float64" => Stored::F64,
            "uint8" => Stored::U8,
            _ => return None,
        })
    }
}

/// What ended a bake.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TextureError {
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// A control, listened to by readers and bakers of meshes.
pub struct Ear<'a>(pub &'a Control);

impl Watch for Ear<'_> {
    fn cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
    fn advance(&self, done: u64) {
        self.0.advance(done);
    }
}

/// Bakes a mesh; what the baker found stands beside the grid (its values are gone from there).
pub fn from_mesh(
    mesh: &Mesh,
    settings: &Settings,
    stored: Stored,
    control: &Control,
) -> Result<(Grid, Baked), TextureError> {
    if mesh.faces.len() == 1 && settings.sign != SignRule::Unsigned {
        let message = "one triangle given, which has no inside; sign \"unsigned\" is allowed";
        return Err(MeshError::bad("faces", message).into());
    }
    let mut baked = pool::install(|| bake(mesh, settings, &Ear(control)))?;
    // A cell that the surface passes must not be cut, or its interpolant would be another.
    if let Some(band) = settings.band {
        let least = slope::diagonal(std::array::from_fn(|a| {
            (baked.hi[a] - baked.lo[a]) / (baked.dims[a] - 1) as f64
        }));
        if band < least {
            return Err(MeshError::bad(
                "band",
                format!("{band} given; at least {least}, a cell's diagonal, is allowed"),
            )
            .into());
        }
    }
    let dims = baked.dims.map(|n| n as usize);
    let values = std::mem::replace(&mut baked.values, Values::Dense(Vec::new()));
    let store = match values {
        Values::Dense(v) => Store::Dense(GridValues::F32(Arc::new(v))),
        Values::Sparse(s) => Store::Sparse(Bricks::new(s.words, BrickValues::F32(Arc::new(s.nodes)))),
    };
    let claim = Claim { lipschitz: Some(1.0), max_error: baked.max_error };
    let grid = Grid::until(store, dims, baked.lo, baked.hi, claim, &|| control.is_cancelled())?;
    let band = settings.band.unwrap_or(4.0 * widest(&grid));
    Ok((restored(grid, stored, band, control)?, baked))
}

/// Samples a shape.
pub fn from_shape(
    shape: &Shape,
    plan: &shapes::Plan,
    stored: Stored,
    most_bytes: u64,
    control: &Control,
) -> Result<Grid, SceneError> {
    let plan = shapes::Plan { wide: stored == Stored::F64, ..*plan };
    let grid = shapes::bake(shape, &plan, most_bytes, control)?;
    let band = plan.band.filter(|b| *b > 0.0);
    let band = band.unwrap_or(4.0 * grid.claim().lipschitz.unwrap_or(1.0) * widest(&grid));
    restored(grid, stored, band, control)
}

fn widest(grid: &Grid) -> f64 {
    grid.spacing().into_iter().fold(0.0, f64::max)
}

fn restored(grid: Grid, stored: Stored, band: f64, control: &Control) -> Result<Grid, SceneError> {
    match stored {
        Stored::F32 => Ok(grid),
        Stored::F16 => grid.into_f16(&|| control.is_cancelled()),
        Stored::U8 => grid.into_u8(band, &|| control.is_cancelled()),
        Stored::F64 if grid.bricks().is_none() => Ok(grid),
        Stored::F64 => Err(SceneError::new("texture", "float64 bricks, allowed: float32, float16, uint8")),
    }
}
