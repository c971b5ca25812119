//! GLB: a JSON document over one binary chunk, every place of which is checked before it is read. Nodes move what hangs
//! below them. Strips and fans become triangles; points, lines, skins and morphs are passed over.

use crate::{Mesh, MeshError, Pulse};
use glam::{DMat4, DQuat, DVec3, DVec4};
use serde::Deserialize;
use std::collections::HashMap;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Document {
    scene: Option<usize>,
    #[serde(default)]
    scenes: Vec<Scene>,
    #[serde(default)]
    nodes: Vec<Node>,
    #[serde(default)]
    meshes: Vec<Primitives>,
    #[serde(default)]
    accessors: Vec<Accessor>,
    #[serde(default)]
    buffer_views: Vec<View>,
    #[serde(default)]
    buffers: Vec<Buffer>,
    #[serde(default)]
    extensions_required: Vec<String>,
}

#[derive(Deserialize)]
struct Scene {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Deserialize)]
struct Node {
    mesh: Option<usize>,
    #[serde(default)]
    children: Vec<usize>,
    matrix: Option<Box<[f64; 16]>>,
    translation: Option<Box<[f64; 3]>>,
    rotation: Option<Box<[f64; 4]>>,
    scale: Option<Box<[f64; 3]>>,
}

#[derive(Deserialize)]
struct Primitives {
    #[serde(default)]
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: HashMap<String, usize>,
    indices: Option<usize>,
    #[serde(default = "triangles")]
    mode: u64,
}

const TRIANGLES: u64 = 4;
const STRIP: u64 = 5;
const FAN: u64 = 6;

fn triangles() -> u64 {
    TRIANGLES
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: u64,
    component_type: u64,
    count: u64,
    #[serde(rename = "type")]
    kind: String,
    sparse: Option<serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: usize,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: Option<u64>,
}

#[derive(Deserialize)]
struct Buffer {
    uri: Option<serde::de::IgnoredAny>,
}

/// A node of three bytes becomes one of a hundred.
const MAX_DOCUMENT: usize = 1 << 26;

pub fn parse(bytes: &[u8], pulse: &mut Pulse) -> Result<Mesh, MeshError> {
    let (json, blob) = chunks(bytes)?;
    if json.len() > MAX_DOCUMENT {
        let message = format!("its document has {} bytes; at most {MAX_DOCUMENT} are read", json.len());
        return Err(MeshError::bad("glb file", message));
    }
    let document: Document =
        serde_json::from_slice(json).map_err(|e| MeshError::bad("the glb file's document", e.to_string()))?;
    if let Some(name) = document.extensions_required.first() {
        // Whatever is required changes how the rest is read.
        let name: String = name.chars().take(64).collect();
        return Err(MeshError::bad(
            "glb file",
            format!("needs the extension '{name}', which isn't known here"),
        ));
    }
    let mut found = Found { document: &document, blob, mesh: Mesh::default() };
    let Some(scene) = document.scenes.get(document.scene.unwrap_or(0)) else {
        for mesh in 0..document.meshes.len() {
            found.mesh(mesh, DMat4::IDENTITY, pulse)?;
        }
        return Ok(found.mesh);
    };
    let mut seen = vec![false; document.nodes.len()];
    let mut open: Vec<(usize, DMat4)> = scene.nodes.iter().map(|&node| (node, DMat4::IDENTITY)).collect();
    while let Some((name, above)) = open.pop() {
        let Some(node) = document.nodes.get(name) else {
            let message = format!("is named, but there are only {} nodes", document.nodes.len());
            return Err(MeshError::bad(format!("node {name}"), message));
        };
        if std::mem::replace(&mut seen[name], true) {
            return Err(MeshError::bad(format!("node {name}"), "hangs below two others, or below itself"));
        }
        let place = above * node.place();
        if let Some(mesh) = node.mesh {
            found.mesh(mesh, place, pulse)?;
        }
        open.extend(node.children.iter().map(|&child| (child, place)));
    }
    Ok(found.mesh)
}

/// The document and the binary chunk.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), MeshError> {
    if bytes.trim_ascii_start().starts_with(b"{") {
        return Err(MeshError::bad(
            "glb file",
            "is a text .gltf, whose data is elsewhere; save it as one .glb",
        ));
    }
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    if bytes.get(..4) != Some(b"glTF") {
        return Err(MeshError::bad("byte 0", "is not 'glTF'"));
    }
    match word(4) {
        Some(2) => {}
        Some(version) => return Err(MeshError::bad("byte 4", format!("version {version}; only 2 is read"))),
        None => return Err(MeshError::bad("byte 4", "the file ends in its head")),
    }
    let (mut at, mut document, mut blob) = (12, None, None);
    while let (Some(length), Some(kind)) = (word(at), bytes.get(at + 4..at + 8)) {
        let Some(data) = bytes[at + 8..].get(..length as usize) else {
            let message = format!("a chunk of {length} bytes; the file has {} more", bytes.len() - at - 8);
            return Err(MeshError::bad(format!("byte {at}"), message));
        };
        match kind {
            b"JSON" if document.is_none() => document = Some(data),
            b"BIN\0" if blob.is_none() => blob = Some(data),
            _ => {}
        }
        at += 8 + length as usize;
    }
    let document = document.ok_or_else(|| MeshError::bad("glb file", "has no document"))?;
    Ok((document, blob.unwrap_or_default()))
}

impl Node {
    fn place(&self) -> DMat4 {
        if let Some(matrix) = &self.matrix {
            return DMat4::from_cols_array(matrix);
        }
        let scale = self.scale.as_ref().map_or(DVec3::ONE, |s| DVec3::from(**s));
        let turn = self.rotation.as_ref().map_or(DQuat::IDENTITY, |q| {
            // Files round; and what is no rotation at all turns nothing.
            let length = DVec4::from(**q).length();
            if length > 0.0 { DQuat::from_vec4(DVec4::from(**q) / length) } else { DQuat::IDENTITY }
        });
        let by = self.translation.as_ref().map_or(DVec3::ZERO, |t| DVec3::from(**t));
        DMat4::from_translation(by) * DMat4::from_quat(turn) * DMat4::from_scale(scale)
    }
}

struct Found<'b> {
    document: &'b Document,
    blob: &'b [u8],
    mesh: Mesh,
}

impl<'b> Found<'b> {
    fn mesh(&mut self, name: usize, place: DMat4, pulse: &mut Pulse) -> Result<(), MeshError> {
        let Some(mesh) = self.document.meshes.get(name) else {
            let message = format!("is named, but there are only {} meshes", self.document.meshes.len());
            return Err(MeshError::bad(format!("mesh {name}"), message));
        };
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let element = format!("mesh {name}, primitive {i}");
            pulse.ask()?;
            self.primitive(primitive, place).map_err(|message| MeshError::bad(element, message))?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, place: DMat4) -> Result<(), String> {
        if ![TRIANGLES, STRIP, FAN].contains(&primitive.mode) {
            return Ok(());
        }
        let first = self.mesh.vertices.len();
        let positions = *primitive.attributes.get("POSITION").ok_or("has no positions")?;
        self.positions(positions, place)?;
        let count = self.mesh.vertices.len() - first;
        if self.mesh.vertices.len() as u64 > crate::check::MAX_VERTICES {
            return Err(format!("more than {} vertices", crate::check::MAX_VERTICES));
        }
        let corners = match primitive.indices {
            Some(indices) => self.indices(indices)?,
            None => (0..count as u32).collect(),
        };
        if let Some(&v) = corners.iter().find(|&&v| v as usize >= count) {
            return Err(format!("has vertex {v}, but only {count} positions"));
        }
        let corner = |i: usize| first as u32 + corners[i];
        // What is turned inside out by its node is turned back.
        let mirrored = place.determinant() < 0.0;
        let mut add = |a: usize, b: usize, c: usize| {
            let (b, c) = if mirrored { (c, b) } else { (b, c) };
            self.mesh.faces.push([corner(a), corner(b), corner(c)]);
        };
        match primitive.mode {
            STRIP => (2..corners.len()).for_each(|i| add(i - 2, i - 1 + i % 2, i - i % 2)),
            FAN => (2..corners.len()).for_each(|i| add(0, i - 1, i)),
            _ => (2..corners.len()).step_by(3).for_each(|i| add(i - 2, i - 1, i)),
        }
        Ok(())
    }

    fn positions(&mut self, accessor: usize, place: DMat4) -> Result<(), String> {
        let (items, kind) = self.items(accessor)?;
        if kind != (FLOAT, 3) {
            return Err("its positions aren't three f32".to_owned());
        }
        for (i, bytes) in items.enumerate() {
            let p: [f64; 3] =
                [0, 4, 8].map(|k| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|b| bytes[k + b]))));
            let p = place.transform_point3(DVec3::from(p));
            if !p.is_finite() {
                return Err(format!("position {i} is {p}, but has to be finite"));
            }
            self.mesh.vertices.push(p.to_array());
        }
        Ok(())
    }

    fn indices(&self, accessor: usize) -> Result<Vec<u32>, String> {
        let (items, kind) = self.items(accessor)?;
        if ![(BYTE, 1), (SHORT, 1), (INT, 1)].contains(&kind) {
            return Err("its indices aren't whole numbers of 8, 16 or 32 bits".to_owned());
        }
        Ok(items.map(|bytes| bytes.iter().rev().fold(0, |n, &byte| n << 8 | u32::from(byte))).collect())
    }

    /// The bytes of each of an accessor's items, their component type and how many of those an item has.
    fn items(&self, name: usize) -> Result<(impl Iterator<Item = &'b [u8]> + use<'b>, (u64, u64)), String> {
        let document = self.document;
        let accessor = document.accessors.get(name).ok_or(format!("accessor {name} isn't there"))?;
        let view =
            accessor.buffer_view.ok_or(format!("accessor {name} has no buffer view, or is compressed"))?;
        if accessor.sparse.is_some() {
            return Err(format!("accessor {name} is sparse, which isn't read"));
        }
        let (name_of_view, view) = (view, document.buffer_views.get(view));
        let view = view.ok_or(format!("buffer view {name_of_view} isn't there"))?;
        let buffer =
            document.buffers.get(view.buffer).ok_or(format!("buffer {} isn't there", view.buffer))?;
        if view.buffer > 0 || buffer.uri.is_some() {
            return Err(format!("buffer {} is in another file; save it as one .glb", view.buffer));
        }
        let end = view.byte_offset.checked_add(view.byte_length).filter(|&end| end <= self.blob.len() as u64);
        let Some(end) = end else {
            let (from, length, all) = (view.byte_offset, view.byte_length, self.blob.len());
            return Err(format!(
                "buffer view {name_of_view} has {length} bytes from {from} of a chunk of {all}"
            ));
        };
        let blob: &'b [u8] = self.blob;
        let data = &blob[view.byte_offset as usize..end as usize];
        let parts = match accessor.kind.as_str() {
            "SCALAR" => 1,
            "VEC3" => 3,
            _ => 0,
        };
        let size = parts
            * [(BYTE, 1), (SHORT, 2), (INT, 4), (FLOAT, 4)]
                .iter()
                .find(|(kind, _)| *kind == accessor.component_type)
                .map_or(0, |(_, size)| *size);
        if size == 0 {
            return Err(format!("accessor {name} is of no kind that positions and indices have"));
        }
        let (start, count, stride) =
            (accessor.byte_offset, accessor.count, view.byte_stride.unwrap_or(size).max(size));
        let last = count.saturating_sub(1).checked_mul(stride).and_then(|last| last.checked_add(start));
        let fits = last.and_then(|last| last.checked_add(size)).is_some_and(|need| need <= data.len() as u64);
        if count == 0 || !fits {
            let has = data.len();
            return Err(format!(
                "accessor {name} claims {count} items of {stride} bytes; its view has {has}"
            ));
        }
        let (start, stride, size) = (start as usize, stride as usize, size as usize);
        let items = (0..count as usize).map(move |i| &data[start + i * stride..start + i * stride + size]);
        Ok((items, (accessor.component_type, parts)))
    }
}

const BYTE: u64 = 5121;
const SHORT: u64 = 5123;
const INT: u64 = 5125;
const FLOAT: u64 = 5126;
