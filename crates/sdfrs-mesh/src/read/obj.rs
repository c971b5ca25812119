//! Wavefront OBJ: `v` and `f` statements; everything else is colour and light. Indices count from 1, or backwards from
//! the last vertex so far where they are negative. All objects and groups of a file are one mesh.

use super::polygon::Polygons;
use super::text::{Text, shown};
use crate::{Mesh, MeshError, Pulse};

pub fn parse(bytes: &[u8], pulse: &mut Pulse) -> Result<Mesh, MeshError> {
    let mut text = Text::new(bytes, b'#');
    let mut found = Polygons::default();
    loop {
        pulse.beat()?;
        match text.word() {
            Some(b"v") => {
                let point = text.point(Text::word)?;
                found.vertices.push(point);
            }
            Some(b"f") => face(&mut text, &mut found)?,
            _ => {}
        }
        if !text.next_line() {
            break;
        }
    }
    if found.vertices.is_empty() {
        return Err(MeshError::bad("obj file", "has no vertex (a line that begins with v)"));
    }
    found.mesh(|line| format!("line {line}"), pulse)
}

fn face(text: &mut Text, found: &mut Polygons) -> Result<(), MeshError> {
    while let Some(word) = text.word() {
        let vertex = word.split(|&b| b == b'/').next().unwrap_or_default();
        let index = text.whole(Some(vertex), "a face's vertex")?;
        let count = found.vertices.len() as i64;
        let from_zero = match index {
            0 => {
                let message = format!("a face has vertex '{}', but OBJ counts from 1", shown(word));
                return Err(MeshError::bad(text.here(), message));
            }
            1.. => index - 1,
            _ => count.saturating_add(index),
        };
        let vertex = u32::try_from(from_zero).map_err(|_| {
            let message = format!("a face has vertex {index}, but there are {count} vertices so far");
            MeshError::bad(text.here(), message)
        })?;
        found.corner(vertex);
    }
    found.end(text.line());
    Ok(())
}
