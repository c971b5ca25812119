//! A shape as a flat list of nodes, each after the nodes it is made of.
//!
//! `{"op": "translate", "offset": [0.0, 1.0, 0.0], "of": [16]}`: the op's arguments by name, and the
//! indices of earlier nodes. Flat, so that a scene nested 10^5 deep is no deeper a text; sharing is
//! kept; nothing can refer to itself. Arguments are checked by the registry that Python uses too.

use std::collections::HashMap;

use base64::{Engine, engine::general_purpose::STANDARD};

use super::json::{Fields, Json, cut};
use crate::{
    error::FormatError,
    grid::{Grid, GridValues},
    shape::{Args, Shape, Value},
};

/// Most nodes of one file.
pub const MAX_NODES: usize = 1 << 24;

/// The nodes of a shape, shared ones once; the root is the last.
pub fn nodes_to_json(root: &Shape) -> Vec<Json> {
    let mut index: HashMap<usize, usize> = HashMap::new();
    let mut nodes = Vec::new();
    // A node is visited twice: first to put its children in front of it, then to be written.
    let mut stack = vec![(root, false)];
    while let Some((shape, ready)) = stack.pop() {
        if index.contains_key(&shape.ptr_id()) {
            continue;
        }
        if ready {
            index.insert(shape.ptr_id(), nodes.len());
            nodes.push(node_to_json(shape, &index));
        } else {
            stack.push((shape, true));
            stack.extend(shape.children().iter().rev().map(|child| (child, false)));
        }
    }
    nodes
}

fn node_to_json(shape: &Shape, index: &HashMap<usize, usize>) -> Json {
    if let Some(grid) = shape.grid() {
        return grid_to_json(grid);
    }
    let mut fields = vec![("op".to_owned(), Json::text(shape.op()))];
    fields.extend(
        shape.args().into_iter().filter_map(|(name, value)| Some((name.to_owned(), value_to_json(value)?))),
    );
    if !shape.children().is_empty() {
        let of = shape.children().iter().filter_map(|c| index.get(&c.ptr_id()));
        fields.push(("of".to_owned(), Json::List(of.map(|&i| Json::Int(i as i64)).collect())));
    }
    Json::Object(fields)
}

/// None for an argument that is left out.
fn value_to_json(value: Value) -> Option<Json> {
    Some(match value {
        Value::Num(v) => Json::Num(v),
        Value::Int(v) => Json::Int(v),
        Value::Vec3(v) => Json::vec3(v),
        Value::Ints3(v) => Json::List(v.map(Json::Int).into()),
        Value::Text(v) => Json::Text(v),
        Value::None => return None,
    })
}

fn value_from_json(json: &Json, path: impl Fn() -> String) -> Result<Value, FormatError> {
    Ok(match json {
        Json::Num(v) => Value::Num(*v),
        Json::Int(v) => Value::Int(*v),
        Json::Text(v) => Value::Text(v.clone()),
        Json::Null => Value::None,
        Json::List(list) => match list.as_slice() {
            [Json::Int(x), Json::Int(y), Json::Int(z)] => Value::Ints3([*x, *y, *z]),
            _ => Value::Vec3(json.as_vec3(&path())?),
        },
        _ => {
            let message = format!("got {}, allowed: a number, three numbers or a text", json.describe());
            return Err(FormatError::new(path(), message));
        }
    })
}

/// Builds the shape that node `root` stands for.
pub fn shape_from_nodes(nodes: &[Json], root: usize) -> Result<Shape, FormatError> {
    if nodes.is_empty() || nodes.len() > MAX_NODES {
        return Err(FormatError::new(
            "nodes",
            format!("got {} nodes, allowed: 1 to {MAX_NODES}", nodes.len()),
        ));
    }
    if root >= nodes.len() {
        return Err(FormatError::new("root", format!("got {root}, allowed: 0 to {}", nodes.len() - 1)));
    }
    let mut shapes: Vec<Shape> = Vec::new();
    for json in nodes {
        let shape = node_from_json(json, &shapes)?;
        shapes.push(shape);
    }
    Ok(shapes.swap_remove(root))
}

/// Builds the node that comes after `earlier`.
fn node_from_json(json: &Json, earlier: &[Shape]) -> Result<Shape, FormatError> {
    let place = || format!("nodes[{}]", earlier.len());
    let Json::Object(fields) = json else {
        return Err(FormatError::new(place(), format!("got {}, allowed: an object", json.describe())));
    };
    let (mut op, mut args, mut children) = (None, Args::new(), Vec::new());
    for (key, value) in fields {
        match key.as_str() {
            "op" => op = Some(value.as_text(&format!("{}.op", place()))?),
            "of" => children = children_from_json(value, earlier)?,
            _ if op == Some("texture") => {}
            _ => args.push((key.clone(), value_from_json(value, || format!("{}.{}", place(), cut(key)))?)),
        }
    }
    let Some(op) = op else {
        return Err(FormatError::new(format!("{}.op", place()), "missing, and there is no default"));
    };
    if op == "texture" {
        return grid_from_json(json, &place());
    }
    Shape::build(op, args, children).map_err(|error| {
        // The registry names an argument in backquotes first; the file's path should lead there.
        let argument = error.message.strip_prefix('`').and_then(|m| m.split('`').next());
        let known = argument.filter(|a| fields.iter().any(|(k, _)| k == a) && a.len() <= 60);
        let path = known.map_or_else(place, |a| format!("{}.{a}", place()));
        FormatError::new(path, error.to_string())
    })
}

fn children_from_json(json: &Json, earlier: &[Shape]) -> Result<Vec<Shape>, FormatError> {
    let place = || format!("nodes[{}].of", earlier.len());
    let list = json.as_list(&place())?;
    let mut children = Vec::with_capacity(list.len());
    for (i, item) in list.iter().enumerate() {
        let found = match item {
            Json::Int(v) => usize::try_from(*v).ok().and_then(|v| earlier.get(v)),
            _ => None,
        };
        let Some(child) = found else {
            let allowed = match earlier.len() {
                0 => "none, this is the first node".to_owned(),
                n => format!("0 to {} (earlier nodes)", n - 1),
            };
            let message = format!("got {}, allowed: {allowed}", item.describe());
            return Err(FormatError::new(format!("{}[{i}]", place()), message));
        };
        children.push(child.clone());
    }
    Ok(children)
}

fn grid_to_json(grid: &Grid) -> Json {
    let (dtype, bytes): (_, Vec<u8>) = match grid.values() {
        GridValues::F32(v) => ("f32", v.iter().flat_map(|v| v.to_le_bytes()).collect()),
        GridValues::F64(v) => ("f64", v.iter().flat_map(|v| v.to_le_bytes()).collect()),
    };
    let (lo, hi) = grid.bounds();
    Json::object([
        ("op", Json::text("texture")),
        ("dims", Json::List(grid.dims().map(|n| Json::Int(n as i64)).into())),
        ("dtype", Json::text(dtype)),
        ("lo", Json::vec3(lo)),
        ("hi", Json::vec3(hi)),
        ("data", Json::Text(STANDARD.encode(bytes))),
    ])
}

fn grid_from_json(json: &Json, path: &str) -> Result<Shape, FormatError> {
    let mut fields = Fields::of(json, path)?;
    fields.required("op")?;
    let (dims, at) = fields.required("dims")?;
    let (list, mut sizes) = (dims.as_list(&at)?, [0usize; 3]);
    if list.len() != 3 {
        return Err(FormatError::new(at, format!("got {} sizes, allowed: three", list.len())));
    }
    for (i, (size, item)) in sizes.iter_mut().zip(list).enumerate() {
        *size = item.as_count(&format!("{at}[{i}]"), 1 << 20)? as usize;
    }
    let (dtype, at) = fields.required("dtype")?;
    let width = match dtype.as_text(&at)? {
        "f32" => 4,
        "f64" => 8,
        _ => {
            return Err(FormatError::new(
                at,
                format!("got {}, allowed: \"f32\" or \"f64\"", dtype.describe()),
            ));
        }
    };
    let (lo, at) = fields.required("lo")?;
    let lo = lo.as_vec3(&at)?;
    let (hi, at) = fields.required("hi")?;
    let hi = hi.as_vec3(&at)?;
    let (data, at) = fields.required("data")?;
    let bytes = decode(data.as_text(&at)?, sizes, width).map_err(|message| FormatError::new(at, message))?;
    fields.finish("op, dims, dtype, lo, hi, data")?;
    let values = match width {
        4 => GridValues::F32(bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()),
        _ => GridValues::F64(bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect()),
    };
    let grid = Grid::new(values, sizes, lo, hi).and_then(Shape::texture);
    grid.map_err(|error| FormatError::new(path, error.to_string()))
}

/// Bytes of a grid; the text's length is compared with the sizes before it is decoded.
fn decode(text: &str, dims: [usize; 3], width: u64) -> Result<Vec<u8>, String> {
    // At most 2^20 each: the product with 8 fits.
    let bytes = dims.iter().map(|&n| n as u64).product::<u64>() * width;
    let needed = bytes.div_ceil(3) * 4;
    if text.len() as u64 != needed {
        return Err(format!(
            "got {} characters of base64, allowed: {needed} for {dims:?} values of {width} bytes",
            text.len()
        ));
    }
    let data = STANDARD.decode(text).map_err(|e| format!("not base64: {e}"))?;
    if data.len() as u64 != bytes {
        return Err(format!(
            "got {} bytes, allowed: {bytes} for {dims:?} values of {width} bytes",
            data.len()
        ));
    }
    Ok(data)
}

#[cfg(test)]
mod tests;
