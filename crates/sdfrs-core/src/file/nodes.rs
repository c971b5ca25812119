//! A shape as a flat list of nodes, each after the nodes it is made of.
//!
//! `{"op": "translate", "offset": [0.0, 1.0, 0.0], "of": [16]}`: the op's arguments by name, and the
//! indices of earlier nodes. Flat, so that a scene nested 10^5 deep is no deeper a text; sharing is
//! kept; nothing can refer to itself. Arguments are checked by the registry that Python uses too.

use std::collections::HashMap;

use super::{
    json::{Json, cut},
    texture::{grid_from_json, grid_to_json},
};
use crate::{
    error::FormatError,
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

#[cfg(test)]
mod tests;
