//! Stand-in for the readers.

use std::path::Path;

use crate::{Mesh, MeshError};

pub fn read(path: &Path) -> Result<Mesh, MeshError> {
    Err(MeshError::bad(path.display().to_string(), "no reader yet"))
}
