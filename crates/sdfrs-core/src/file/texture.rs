//! A grid as an object of a scene file: sizes in numbers, samples as base64 of little-endian bytes.
//!
//! A sparse grid also has a `table` and `far` values; `lipschitz`, `max_error` and `stepping` are left out
//! where they say nothing. Each text's length is compared with what the sizes ask for before it is decoded.

use std::sync::Arc;

use base64::{Engine, engine::general_purpose::STANDARD};

use super::json::{Fields, Json};
use crate::{
    error::FormatError,
    grid::{BrickValues, Bricks, Claim, Grid, GridValues, Stepping, Store, bricks_along, f16, slope::BLOCK},
    shape::Shape,
};

/// The names of the keys, for the message about any other.
const KEYS: &str = "op, dims, dtype, lo, hi, data, table, far, scale, lipschitz, max_error, stepping";

fn text(bytes: impl Iterator<Item = u8>) -> Json {
    Json::Text(STANDARD.encode(bytes.collect::<Vec<u8>>()))
}

pub fn grid_to_json(grid: &Grid) -> Json {
    let (dtype, data, sparse) = match grid.store() {
        Store::Dense(values) => {
            let data = match values {
                GridValues::F16(v) => text(v.iter().flat_map(|v| v.to_le_bytes())),
                GridValues::F32(v) => text(v.iter().flat_map(|v| v.to_le_bytes())),
                GridValues::F64(v) => text(v.iter().flat_map(|v| v.to_le_bytes())),
            };
            (values.dtype(), data, None)
        }
        Store::Sparse(bricks) => {
            let data = match bricks.nodes() {
                BrickValues::F16(v) => text(v.iter().flat_map(|v| v.to_le_bytes())),
                BrickValues::F32(v) => text(v.iter().flat_map(|v| v.to_le_bytes())),
                BrickValues::U8 { codes, .. } => text(codes.iter().copied()),
            };
            (bricks.nodes().dtype(), data, Some(bricks))
        }
    };
    let (lo, hi) = grid.bounds();
    let mut fields = vec![
        ("op", Json::text("texture")),
        ("dims", Json::List(grid.dims().map(|n| Json::Int(n as i64)).into())),
        ("dtype", Json::text(dtype)),
        ("lo", Json::vec3(lo)),
        ("hi", Json::vec3(hi)),
        ("data", data),
    ];
    if let Some(bricks) = sparse {
        fields.push(("table", text(bricks.words().iter().flat_map(|w| w.entry().to_le_bytes()))));
        fields.push(("far", text(bricks.words().iter().flat_map(|w| w.value().to_le_bytes()))));
        if let BrickValues::U8 { scale, .. } = bricks.nodes() {
            fields.push(("scale", text(scale.iter().flat_map(|v| v.to_le_bytes()))));
        }
    }
    let claim = grid.claim();
    fields.extend(claim.lipschitz.map(|l| ("lipschitz", Json::Num(l))));
    if claim.max_error != 0.0 {
        fields.push(("max_error", Json::Num(claim.max_error)));
    }
    if grid.stepping() != Stepping::Safe {
        fields.push(("stepping", Json::text(grid.stepping().name())));
    }
    Json::object(fields)
}

pub fn grid_from_json(json: &Json, path: &str) -> Result<Shape, FormatError> {
    let mut fields = Fields::of(json, path)?;
    fields.required("op")?;
    let dims = sizes(&mut fields)?;
    let (dtype, at) = fields.required("dtype")?;
    let dtype = (dtype.as_text(&at)?, at);
    let [lo, hi] = ["lo", "hi"].map(|name| {
        let (json, at) = fields.required(name)?;
        json.as_vec3(&at)
    });
    let (lo, hi) = (lo?, hi?);
    let store = match fields.optional("table") {
        Some((table, at)) => Store::Sparse(bricks(&mut fields, dims, dtype, table.as_text(&at)?, &at)?),
        None => Store::Dense(values(&mut fields, dims, dtype)?),
    };
    let number = |field: Option<(&Json, String)>| field.map(|(json, at)| json.as_number(&at)).transpose();
    let claim = Claim {
        lipschitz: number(fields.optional("lipschitz"))?,
        max_error: number(fields.optional("max_error"))?.unwrap_or(0.0),
    };
    let stepping = match fields.optional("stepping") {
        None => Stepping::Safe,
        Some((json, at)) => Stepping::from_name(json.as_text(&at)?).ok_or_else(|| {
            let message = format!("got {}, allowed: {}", json.describe(), Stepping::NAMES.join(", "));
            FormatError::new(at, message)
        })?,
    };
    fields.finish(KEYS)?;
    let grid = Grid::with_claim(store, dims, lo, hi, claim).map(|grid| grid.with_stepping(stepping));
    grid.and_then(Shape::texture).map_err(|error| FormatError::new(path, error.to_string()))
}

fn sizes(fields: &mut Fields) -> Result<[usize; 3], FormatError> {
    let (dims, at) = fields.required("dims")?;
    let (list, mut sizes) = (dims.as_list(&at)?, [0usize; 3]);
    if list.len() != 3 {
        return Err(FormatError::new(at, format!("got {} sizes, allowed: three", list.len())));
    }
    for (i, (size, item)) in sizes.iter_mut().zip(list).enumerate() {
        *size = item.as_count(&format!("{at}[{i}]"), 1 << 20)? as usize;
        if *size < 2 {
            return Err(FormatError::new(at, format!("got {size} nodes along an axis, allowed: at least 2")));
        }
    }
    Ok(sizes)
}

/// The numbers of a text that must hold exactly as many.
fn numbers<const N: usize, T>(
    text: &str,
    at: &str,
    n: u64,
    of: fn([u8; N]) -> T,
) -> Result<Vec<T>, FormatError> {
    let bytes = decode(text, n, N as u64).map_err(|message| FormatError::new(at, message))?;
    Ok(bytes.as_chunks::<N>().0.iter().map(|b| of(*b)).collect())
}

/// Nodes of all axes, or of what else comes in threes; at most 2^60.
fn product(dims: [usize; 3]) -> u64 {
    dims.iter().map(|&n| n as u64).product()
}

fn unknown<T>((dtype, at): (&str, String), allowed: &str) -> Result<T, FormatError> {
    Err(FormatError::new(at, format!("got {}, allowed: {allowed}", Json::text(dtype).describe())))
}

fn values(fields: &mut Fields, dims: [usize; 3], dtype: (&str, String)) -> Result<GridValues, FormatError> {
    let (data, at) = fields.required("data")?;
    let (data, n) = (data.as_text(&at)?, product(dims));
    Ok(match dtype.0 {
        "f16" => GridValues::F16(Arc::new(numbers(data, &at, n, f16::from_le_bytes)?)),
        "f32" => GridValues::F32(Arc::new(numbers(data, &at, n, f32::from_le_bytes)?)),
        "f64" => GridValues::F64(Arc::new(numbers(data, &at, n, f64::from_le_bytes)?)),
        _ => return unknown(dtype, "\"f16\", \"f32\" or \"f64\""),
    })
}

fn bricks(
    fields: &mut Fields,
    dims: [usize; 3],
    dtype: (&str, String),
    table: &str,
    table_at: &str,
) -> Result<Bricks, FormatError> {
    let count = product(bricks_along(dims));
    let table = numbers(table, table_at, count, u32::from_le_bytes)?;
    let (far, at) = fields.required("far")?;
    let far = numbers(far.as_text(&at)?, &at, count, f32::from_le_bytes)?;
    let kept = table.iter().filter(|slot| **slot != crate::grid::bricks::FAR).count() as u64;
    let (data, at) = fields.required("data")?;
    let (data, n) = (data.as_text(&at)?, kept * BLOCK as u64);
    let nodes = match dtype.0 {
        "f16" => BrickValues::F16(Arc::new(numbers(data, &at, n, f16::from_le_bytes)?)),
        "f32" => BrickValues::F32(Arc::new(numbers(data, &at, n, f32::from_le_bytes)?)),
        "u8" => {
            let codes = Arc::new(numbers(data, &at, n, |[b]: [u8; 1]| b)?);
            let (scale, at) = fields.required("scale")?;
            let scale = Arc::new(numbers(scale.as_text(&at)?, &at, kept, f32::from_le_bytes)?);
            BrickValues::U8 { codes, scale }
        }
        _ => return unknown(dtype, "\"f16\", \"f32\" or \"u8\" for bricks"),
    };
    Bricks::of_table(&table, &far, nodes).map_err(|error| FormatError::new(table_at, error.to_string()))
}

/// Bytes of a text; its length is compared with what is needed before it is decoded.
fn decode(text: &str, n: u64, width: u64) -> Result<Vec<u8>, String> {
    let wrong = |got: String| Err(format!("got {got}, allowed: {n} values of {width} bytes in base64"));
    let Some(bytes) = n.checked_mul(width) else { return wrong(format!("{} characters", text.len())) };
    if text.len() as u64 != bytes.div_ceil(3).saturating_mul(4) {
        let needed = bytes.div_ceil(3).saturating_mul(4);
        return wrong(format!("{} characters of base64, not {needed}", text.len()));
    }
    let data = STANDARD.decode(text).map_err(|e| format!("not base64: {e}"))?;
    if data.len() as u64 != bytes { wrong(format!("{} bytes", data.len())) } else { Ok(data) }
}
