//! Mesh files.
//!
//! OBJ, OFF and STL are read here: of each only a statement or two counts, in f64, and an error has to name its line,
//! which no crate for them does. PLY goes through `ply-rs-bw`; what that would believe or allocate is looked at first.
//! Of GLB, `serde_json` reads the document (`gltf` 1.4.1 panics on an accessor that isn't there, and refuses files
//! without the boxes that nobody needs here).
//!
//! Polygons are cut into triangles. STL and GLB hold f32 when binary; whatever else a file holds arrives as f64.
//!
//! Law: a malformed file is an error that names the element, within milliseconds, and never takes more memory than a few
//! times the file's size (`tests/read.rs`).

mod glb;
mod obj;
mod off;
mod ply;
pub mod polygon;
mod stl;
mod text;

use crate::{Mesh, MeshError, Pulse, Watch};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The kinds of files that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Obj,
    Stl,
    Ply,
    Off,
    Glb,
}

impl Format {
    pub const ALL: [Self; 5] = [Self::Obj, Self::Stl, Self::Ply, Self::Off, Self::Glb];

    /// Also the file's extension.
    pub fn name(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Stl => "stl",
            Self::Ply => "ply",
            Self::Off => "off",
            Self::Glb => "glb",
        }
    }

    /// By the extension.
    pub fn of(path: &Path) -> Result<Self, MeshError> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if let Some(format) = Self::ALL.into_iter().find(|format| format.name() == extension) {
            return Ok(format);
        }
        let message = match extension.as_str() {
            "gltf" => "keeps its data in other files, which aren't read; save it as one .glb".to_owned(),
            other => format!("its extension is '{other}'; known are obj, stl, ply, off and glb"),
        };
        Err(MeshError::bad(path.display().to_string(), message))
    }
}

/// Files larger than this aren't meshes that anyone bakes.
const MAX_BYTES: u64 = 1 << 34;

/// Reads a file; its name is in every error.
pub fn read(path: impl AsRef<Path>) -> Result<Mesh, MeshError> {
    read_until(path, &())
}

/// The same, given up when the watch says so.
pub fn read_until(path: impl AsRef<Path>, watch: &dyn Watch) -> Result<Mesh, MeshError> {
    let path = path.as_ref();
    let format = Format::of(path)?;
    let named = |message: String| MeshError::bad(path.display().to_string(), message);
    let mut pulse = Pulse::new(watch);
    let bytes = bytes(path, &pulse).map_err(named)?;
    // Where it ended early because nobody wants it any more.
    pulse.ask()?;
    parse_until(format, &bytes, &mut pulse).map_err(|error| match error {
        MeshError::Bad { element, message } => named(format!("{element}: {message}")),
        other => other,
    })
}

/// A file's contents, or their beginning once nobody wants them any more.
fn bytes(path: &Path, pulse: &Pulse) -> Result<Vec<u8>, String> {
    const PORTION: u64 = 1 << 24;
    let mut file = File::open(path).map_err(|e| format!("cannot be opened: {e}"))?;
    let about = file.metadata().map_err(|e| format!("cannot be looked at: {e}"))?;
    if !about.is_file() {
        return Err("is not a file".to_owned());
    }
    if about.len() > MAX_BYTES {
        return Err(format!("has {} bytes; at most {MAX_BYTES} are read", about.len()));
    }
    let mut bytes = Vec::new();
    let room = bytes.try_reserve_exact(about.len() as usize + 1);
    room.map_err(|_| format!("has {} bytes, for which there is no memory", about.len()))?;
    // A file that grows meanwhile is not followed.
    for first in (0..about.len()).step_by(PORTION as usize) {
        let portion = PORTION.min(about.len() - first);
        file.by_ref().take(portion).read_to_end(&mut bytes).map_err(|e| format!("cannot be read: {e}"))?;
        if pulse.ask().is_err() {
            break;
        }
    }
    Ok(bytes)
}

/// Reads the contents of a file.
pub fn parse(format: Format, bytes: &[u8]) -> Result<Mesh, MeshError> {
    parse_until(format, bytes, &mut Pulse::new(&()))
}

fn parse_until(format: Format, bytes: &[u8], pulse: &mut Pulse) -> Result<Mesh, MeshError> {
    let mesh = match format {
        Format::Obj => obj::parse(bytes, pulse),
        Format::Stl => stl::parse(bytes, pulse),
        Format::Ply => ply::parse(bytes, pulse),
        Format::Off => off::parse(bytes, pulse),
        Format::Glb => glb::parse(bytes, pulse),
    }?;
    if mesh.faces.is_empty() {
        let message = format!("{} vertices, but no faces: not a mesh", mesh.vertices.len());
        return Err(MeshError::bad(format!("{} file", format.name()), message));
    }
    Ok(mesh)
}
