//! OFF, as Geomview and CGAL write it: counts, vertices, faces, with colours, normals and texture coordinates passed
//! over.

use super::polygon::Polygons;
use super::text::{Text, shown};
use crate::{Mesh, MeshError, Pulse};

pub fn parse(bytes: &[u8], pulse: &mut Pulse) -> Result<Mesh, MeshError> {
    let mut text = Text::new(bytes, b'#');
    let head = text.any_word().unwrap_or_default();
    let (extras, first) = match head {
        b"OFF" => (false, None),
        b"COFF" | b"NOFF" | b"CNOFF" | b"NCOFF" | b"STOFF" | b"STCOFF" | b"STNOFF" | b"STCNOFF" => {
            (true, None)
        }
        _ if head.first().is_some_and(u8::is_ascii_digit) && !head.ends_with(b"OFF") => (false, Some(head)),
        _ => {
            let message = format!("begins with '{}' instead of OFF", shown(head));
            return Err(MeshError::bad(text.here(), message));
        }
    };
    let first = if first.is_some() { first } else { text.any_word() };
    if first == Some(b"BINARY") {
        return Err(MeshError::bad(text.here(), "binary OFF isn't read; save it as text"));
    }
    let vertices = text.count(first, "the number of vertices")?;
    let word = text.any_word();
    let faces = text.count(word, "the number of faces")?;
    // "0 0 0\n" and "3 0 1 2\n": what the counts need at the least. The number of edges may be missing.
    text.next_line();
    let least = vertices.saturating_mul(6).saturating_add(faces.saturating_mul(8));
    if least > bytes.len() as u64 + 1 {
        let message =
            format!("claims {vertices} vertices and {faces} faces, but the file has {} bytes", bytes.len());
        return Err(MeshError::bad(text.here(), message));
    }
    let mut found = Polygons::default();
    for i in 0..vertices {
        pulse.beat()?;
        let point = text.point(Text::any_word).map_err(|e| within(e, "vertex", i))?;
        found.vertices.push(point);
        if extras {
            text.next_line();
        }
    }
    for i in 0..faces {
        pulse.beat()?;
        face(&mut text, &mut found).map_err(|e| within(e, "face", i))?;
    }
    found.mesh(|line| format!("line {line}"), pulse)
}

fn within(error: MeshError, kind: &str, i: u64) -> MeshError {
    match error {
        MeshError::Bad { element, message } => {
            MeshError::Bad { element: format!("{element}, {kind} {i}"), message }
        }
        other => other,
    }
}

fn face(text: &mut Text, found: &mut Polygons) -> Result<(), MeshError> {
    let word = text.any_word();
    let corners = text.count(word, "its number of corners")?;
    let line = text.line();
    for _ in 0..corners {
        let word = text.any_word();
        let vertex = text.count(word, "a corner")?;
        if vertex >= found.vertices.len() as u64 {
            let message = format!("has vertex {vertex}, but there are only {}", found.vertices.len());
            return Err(MeshError::bad(text.here(), message));
        }
        found.corner(vertex as u32);
    }
    found.end(line);
    // A colour may follow.
    text.next_line();
    Ok(())
}
