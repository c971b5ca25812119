//! PLY, text and binary of either byte order, by `ply-rs-bw`.
//!
//! It reads a header's line whatever its length, and as many elements as the header claims: both are held against the
//! file's size first.

use super::polygon::Polygons;
use crate::{Mesh, MeshError, Pulse};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};
use std::io::Cursor;

/// No header is longer than this.
const MAX_HEADER: usize = 1 << 16;
/// Text numbers may be shorter than this crate's own, but a line has at least this.
const WORD: u64 = 2;

pub fn parse(bytes: &[u8], pulse: &mut Pulse) -> Result<Mesh, MeshError> {
    let begin = &bytes[..bytes.len().min(MAX_HEADER)];
    if !begin.starts_with(b"ply") {
        return Err(MeshError::bad("line 1", "is not 'ply'"));
    }
    if !begin.windows(10).any(|word| word == b"end_header") {
        let message = format!("no end_header within {} bytes", begin.len());
        return Err(MeshError::bad("header", message));
    }
    let parser = Parser::<Ignored>::new();
    let mut reader = Reader::new(Cursor::new(bytes));
    let header = parser.read_header(&mut reader).map_err(|e| failed("header", &e))?;
    check_claims(&header, bytes.len() as u64 - reader.get_ref().position().min(bytes.len() as u64))?;
    let mut found = Found(Polygons::default());
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => {
                check_vertex(element)?;
                each(&mut reader, &header, element, pulse, |i, vertex: &Vertex| found.vertex(i, vertex))?;
            }
            "face" => {
                check_face(element)?;
                each(&mut reader, &header, element, pulse, |i, face: &Face| found.face(i, face))?;
            }
            _ if element.properties.is_empty() && header.encoding != Encoding::Ascii => {}
            _ => each(&mut reader, &header, element, pulse, |_, _: &Ignored| Ok(()))?,
        }
    }
    found.0.mesh(|i| format!("face {i}"), pulse)
}

fn failed(element: &str, error: &ply_rs_bw::parser::ParseError) -> MeshError {
    // Its messages go on with the line as it stands, however long.
    let text = error.to_string();
    let short: String = text.lines().next().unwrap_or_default().chars().take(200).collect();
    MeshError::bad(element, short)
}

/// The file's rest has to have room for every element.
fn check_claims(header: &Header, rest: u64) -> Result<(), MeshError> {
    let mut need = 0_u64;
    for (name, element) in &header.elements {
        let each: u64 = if header.encoding == Encoding::Ascii {
            WORD * element.properties.len().max(1) as u64
        } else {
            element.properties.iter().map(|(_, p)| least(&p.data_type)).sum()
        };
        need = need.saturating_add(each.saturating_mul(element.count as u64));
        // The last line may lack its end.
        if need > rest + 1 {
            let message = format!(
                "claims {} of them, for which the file has no room: {rest} bytes in all",
                element.count
            );
            return Err(MeshError::bad(format!("header, element {name}"), message));
        }
    }
    Ok(())
}

fn least(kind: &PropertyType) -> u64 {
    match kind {
        PropertyType::Scalar(kind) | PropertyType::List(kind, _) => match kind {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        },
    }
}

fn check_vertex(element: &ElementDef) -> Result<(), MeshError> {
    for axis in ["x", "y", "z"] {
        let kind = element.properties.iter().find(|(name, _)| *name == axis).map(|(_, p)| &p.data_type);
        match kind {
            Some(PropertyType::Scalar(_)) => {}
            Some(_) => return Err(MeshError::bad("header, element vertex", format!("{axis} is a list"))),
            None => return Err(MeshError::bad("header, element vertex", format!("has no property {axis}"))),
        }
    }
    Ok(())
}

fn is_corners(name: &str) -> bool {
    matches!(name, "vertex_indices" | "vertex_index")
}

fn check_face(element: &ElementDef) -> Result<(), MeshError> {
    let kind = element.properties.iter().find(|(name, _)| is_corners(name)).map(|(_, p)| &p.data_type);
    match kind {
        Some(PropertyType::List(count, index)) => {
            let whole = |kind: &ScalarType| !matches!(kind, ScalarType::Float | ScalarType::Double);
            if whole(count) && whole(index) {
                return Ok(());
            }
            Err(MeshError::bad("header, element face", "its vertex indices aren't whole numbers"))
        }
        _ => Err(MeshError::bad("header, element face", "has no list vertex_indices")),
    }
}

/// Gives each of an element's items to `take`. A part of them at a time: an item takes more memory than its bytes.
fn each<E: PropertyAccess>(
    reader: &mut Reader<Cursor<&[u8]>>,
    header: &Header,
    element: &ElementDef,
    pulse: &Pulse,
    mut take: impl FnMut(usize, &E) -> Result<(), MeshError>,
) -> Result<(), MeshError> {
    const PART: usize = 1 << 14;
    let mut part = element.clone();
    for first in (0..element.count).step_by(PART) {
        pulse.ask()?;
        part.count = PART.min(element.count - first);
        let items = Parser::<E>::new().read_payload_for_element(reader, &part, header);
        let items = items.map_err(|e| failed(&format!("{} {first} or later", element.name), &e))?;
        for (i, item) in items.iter().enumerate() {
            take(first + i, item)?;
        }
    }
    Ok(())
}

struct Found(Polygons);

impl Found {
    fn vertex(&mut self, i: usize, vertex: &Vertex) -> Result<(), MeshError> {
        if let Some(axis) = (0..3).find(|&axis| !vertex.0[axis].is_finite()) {
            let message = format!("{} is {}, but has to be finite", ["x", "y", "z"][axis], vertex.0[axis]);
            return Err(MeshError::bad(format!("vertex {i}"), message));
        }
        self.0.vertices.push(vertex.0);
        Ok(())
    }

    fn face(&mut self, i: usize, face: &Face) -> Result<(), MeshError> {
        let bad = |message: String| MeshError::bad(format!("face {i}"), message);
        for &vertex in &face.0 {
            let index = u32::try_from(vertex);
            self.0.corner(index.map_err(|_| bad(format!("has vertex {vertex}; indices count from 0")))?);
        }
        self.0.end(i as u64);
        Ok(())
    }
}

/// An element that is passed over.
struct Ignored;

impl PropertyAccess for Ignored {
    fn new() -> Self {
        Self
    }
}

struct Vertex([f64; 3]);

impl Vertex {
    fn set(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        match name {
            "x" => self.0[0] = value,
            "y" => self.0[1] = value,
            "z" => self.0[2] = value,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

macro_rules! setters {
    ($($setter:ident $kind:ty),*) => {$(
        fn $setter(&mut self, name: &str, value: $kind) -> PropertyAccessResult {
            self.set(name, f64::from(value))
        }
    )*};
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([f64::NAN; 3])
    }

    setters!(set_float f32, set_double f64, set_char i8, set_uchar u8, set_short i16, set_ushort u16, set_int i32, set_uint u32);
}

struct Face(Vec<i64>);

impl Face {
    fn set<T: Into<i64>>(&mut self, name: &str, value: Vec<T>) -> PropertyAccessResult {
        if !is_corners(name) {
            return PropertyAccessResult::Ignored;
        }
        self.0 = value.into_iter().map(Into::into).collect();
        PropertyAccessResult::Set
    }
}

macro_rules! lists {
    ($($setter:ident $kind:ty),*) => {$(
        fn $setter(&mut self, name: &str, value: Vec<$kind>) -> PropertyAccessResult {
            self.set(name, value)
        }
    )*};
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self(Vec::new())
    }

    lists!(set_list_char i8, set_list_uchar u8, set_list_short i16, set_list_ushort u16, set_list_int i32, set_list_uint u32);
}
