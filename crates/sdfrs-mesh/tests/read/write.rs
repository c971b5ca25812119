//! The same mesh in every format.

use sdfrs_mesh::Mesh;
use std::fmt::Write;

pub fn obj(mesh: &Mesh) -> Vec<u8> {
    let mut text = String::from("# made here\nmtllib none.mtl\no thing\n");
    for [x, y, z] in &mesh.vertices {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    text += "vn 0 0 1\ns off\n";
    for [a, b, c] in mesh.faces.iter().map(|f| f.map(|v| v + 1)) {
        writeln!(text, "f {a}//1 {b}//1 {c}//1").unwrap();
    }
    text.into_bytes()
}

pub fn off(mesh: &Mesh) -> Vec<u8> {
    let mut text = format!("OFF\n# made here\n{} {} 0\n", mesh.vertices.len(), mesh.faces.len());
    for [x, y, z] in &mesh.vertices {
        writeln!(text, "{x} {y} {z}").unwrap();
    }
    for [a, b, c] in &mesh.faces {
        writeln!(text, "3 {a} {b} {c} 255 0 0").unwrap();
    }
    text.into_bytes()
}

pub fn stl_text(mesh: &Mesh) -> Vec<u8> {
    let mut text = String::from("solid thing\n");
    for f in &mesh.faces {
        text += " facet normal 0 0 0\n  outer loop\n";
        for &v in f {
            let [x, y, z] = mesh.vertices[v as usize];
            writeln!(text, "   vertex {x} {y} {z}").unwrap();
        }
        text += "  endloop\n endfacet\n";
    }
    (text + "endsolid thing\n").into_bytes()
}

pub fn stl_binary(mesh: &Mesh) -> Vec<u8> {
    // As some programs do: a binary file that begins like a text.
    let mut bytes = b"solid but binary".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((mesh.faces.len() as u32).to_le_bytes());
    for f in &mesh.faces {
        bytes.extend([0; 12]);
        for x in f.iter().flat_map(|&v| mesh.vertices[v as usize]) {
            bytes.extend((x as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn ply_head(mesh: &Mesh, encoding: &str) -> String {
    let (vertices, faces) = (mesh.vertices.len(), mesh.faces.len());
    format!(
        "ply\nformat {encoding} 1.0\ncomment made here\nelement vertex {vertices}\nproperty double x\nproperty double y\n\
         property double z\nproperty uchar red\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
}

pub fn ply_text(mesh: &Mesh) -> Vec<u8> {
    let mut text = ply_head(mesh, "ascii");
    for [x, y, z] in &mesh.vertices {
        writeln!(text, "{x} {y} {z} 7").unwrap();
    }
    for [a, b, c] in &mesh.faces {
        writeln!(text, "3 {a} {b} {c}").unwrap();
    }
    text.into_bytes()
}

pub fn ply_binary(mesh: &Mesh, little: bool) -> Vec<u8> {
    let mut bytes =
        ply_head(mesh, if little { "binary_little_endian" } else { "binary_big_endian" }).into_bytes();
    for p in &mesh.vertices {
        for x in p {
            bytes.extend(if little { x.to_le_bytes() } else { x.to_be_bytes() });
        }
        bytes.push(7);
    }
    for f in &mesh.faces {
        bytes.push(3);
        for &v in f {
            bytes.extend(if little { v.to_le_bytes() } else { v.to_be_bytes() });
        }
    }
    bytes
}

/// A document over a binary chunk.
pub fn glb_of(json: &str, chunk: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut chunk = chunk.to_vec();
    chunk.resize(chunk.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF".to_vec();
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend((28 + json.len() as u32 + chunk.len() as u32).to_le_bytes());
    bytes.extend((json.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((chunk.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(chunk);
    bytes
}

/// The chunk with all positions, then all indices, and the document, which has `nodes`.
pub fn glb_parts(mesh: &Mesh, nodes: &str) -> (String, Vec<u8>) {
    let mut chunk = Vec::new();
    for x in mesh.vertices.iter().flatten() {
        chunk.extend((*x as f32).to_le_bytes());
    }
    let split = chunk.len();
    for v in mesh.faces.iter().flatten() {
        chunk.extend(v.to_le_bytes());
    }
    let (length, rest, vertices, corners) =
        (chunk.len(), chunk.len() - split, mesh.vertices.len(), 3 * mesh.faces.len());
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{vertices},"type":"VEC3","min":[-1,-1,-1],"max":[1,1,1]}},
        {{"bufferView":1,"componentType":5125,"count":{corners},"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":{split}}},
        {{"buffer":0,"byteOffset":{split},"byteLength":{rest}}}],"buffers":[{{"byteLength":{length}}}]}}"#
    );
    (json, chunk)
}

pub fn glb(mesh: &Mesh) -> Vec<u8> {
    let (json, chunk) = glb_parts(mesh, r#"{"mesh":0}"#);
    glb_of(&json, &chunk)
}
