//! STL, text and binary. A binary file may begin with the text file's first word, so its length decides.

use super::text::{Text, shown};
use crate::{Mesh, MeshError, Pulse};

const HEAD: u64 = 84;
const FACE: u64 = 50;

pub fn parse(bytes: &[u8], pulse: &mut Pulse) -> Result<Mesh, MeshError> {
    let claimed = bytes.get(80..84).map(|n| u64::from(u32::from_le_bytes([n[0], n[1], n[2], n[3]])));
    let exact = claimed.is_some_and(|faces| bytes.len() as u64 == HEAD + FACE * faces);
    if exact || !looks_like_text(bytes) { binary(bytes, claimed, pulse) } else { text(bytes, pulse) }
}

/// The word "solid", and nothing in the beginning that no text has.
fn looks_like_text(bytes: &[u8]) -> bool {
    let begin = bytes.trim_ascii_start();
    let begin = begin.strip_prefix(b"\xef\xbb\xbf").unwrap_or(begin);
    begin.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
        && !begin[..begin.len().min(512)].contains(&0)
}

fn binary(bytes: &[u8], claimed: Option<u64>, pulse: &mut Pulse) -> Result<Mesh, MeshError> {
    let Some(faces) = claimed else {
        let message =
            format!("neither a text (it doesn't begin with 'solid') nor a binary one: {} bytes", bytes.len());
        return Err(MeshError::bad("stl file", message));
    };
    let need = HEAD + FACE * faces;
    if need > bytes.len() as u64 {
        let message = format!("claims {faces} faces, which take {need} bytes; the file has {}", bytes.len());
        return Err(MeshError::bad("byte 80", message));
    }
    if faces > crate::check::MAX_FACES {
        let message = format!("claims {faces} faces; at most {} are allowed", crate::check::MAX_FACES);
        return Err(MeshError::bad("byte 80", message));
    }
    let mut mesh =
        Mesh { vertices: Vec::with_capacity(3 * faces as usize), faces: Vec::with_capacity(faces as usize) };
    for (i, face) in bytes[HEAD as usize..need as usize].chunks_exact(FACE as usize).enumerate() {
        pulse.beat()?;
        // The normal comes first, and nobody needs it.
        for corner in face[12..48].chunks_exact(12) {
            let coordinate =
                |k: usize| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|b| corner[4 * k + b])));
            let point = [0, 1, 2].map(coordinate);
            if let Some(bad) = point.iter().find(|x| !x.is_finite()) {
                let message = format!("a coordinate is {bad}, but has to be finite");
                let byte = HEAD + FACE * i as u64;
                return Err(MeshError::bad(format!("byte {byte}, face {i}"), message));
            }
            mesh.vertices.push(point);
        }
        mesh.faces.push([0, 1, 2].map(|k| (3 * i + k) as u32));
    }
    Ok(mesh)
}

fn text(bytes: &[u8], pulse: &mut Pulse) -> Result<Mesh, MeshError> {
    let mut text = Text::new(bytes, 0);
    let mut mesh = Mesh::default();
    // Corners of the facet that is open.
    let mut corners = None;
    loop {
        pulse.beat()?;
        match text.word().map(<[u8]>::to_ascii_lowercase).as_deref() {
            None | Some(b"solid" | b"endsolid" | b"outer" | b"endloop") => {}
            Some(b"facet") if corners.is_none() => corners = Some(0_u32),
            Some(b"vertex") if corners.is_some_and(|n| n < 3) => {
                mesh.vertices.push(text.point(Text::word)?);
                corners = corners.map(|n| n + 1);
            }
            Some(b"endfacet") if corners == Some(3) => {
                let last = mesh.vertices.len() as u64;
                if last > crate::check::MAX_VERTICES {
                    return Err(MeshError::bad(text.here(), "too many faces"));
                }
                mesh.faces.push([3, 2, 1].map(|back| (last - back) as u32));
                corners = None;
            }
            Some(word) => {
                let open = match corners {
                    None => "outside of a facet".to_owned(),
                    Some(n) => format!("in a facet with {n} of 3 vertices"),
                };
                return Err(MeshError::bad(text.here(), format!("'{}' {open}", shown(word))));
            }
        }
        if !text.next_line() {
            break;
        }
    }
    match corners {
        None => Ok(mesh),
        Some(n) => {
            Err(MeshError::bad(text.here(), format!("the file ends in a facet with {n} of 3 vertices")))
        }
    }
}
