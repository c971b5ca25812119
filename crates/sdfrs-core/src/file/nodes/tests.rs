use base64::{Engine, engine::general_purpose::STANDARD};

use super::*;
use crate::grid::{Grid, GridValues};
use crate::shape::Kind;

fn sphere() -> Shape {
    Shape::build("sphere", vec![("radius".into(), Value::Num(0.1 + 0.2))], vec![]).unwrap()
}

/// A value for an argument that the registry says is missing.
fn plausible(name: &str, message: &str) -> Value {
    match (name, message) {
        ("lo", _) => Value::Vec3([-1.0 / 3.0, -2.0, -0.7]),
        ("hi", _) => Value::Vec3([1.0 / 3.0, 2e3, 0.1 + 0.2]),
        (_, m) if m.contains("whole number") => Value::Int(3),
        (_, m) if m.contains("three numbers") => Value::Vec3([1.0 / 3.0, 0.1 + 0.2, 7e-1]),
        (_, m) if m.contains("a number") => Value::Num(0.1),
        (_, m) if m.contains("\"x\"") => Value::Text("z".into()),
        (_, m) => panic!("no value for `{name}`: {m}"),
    }
}

/// An example of every op, found by asking the registry what is missing.
fn sample(op: &str) -> Shape {
    let expr = |op: &str, args: Args| Shape::build(op, args, vec![]).unwrap();
    let x = expr("x", vec![]);
    let pool: [Vec<Shape>; 3] = [vec![sphere(); 4], vec![x.clone(); 4], vec![sphere(), x]];
    let mut args = Args::new();
    for _ in 0..8 {
        let mut missing = None;
        for (children, n) in pool.iter().flat_map(|p| (0..=p.len()).map(move |n| (p, n))) {
            match Shape::build(op, args.clone(), children[..n].to_vec()) {
                Ok(shape) => return shape,
                Err(e) if e.message.contains("is missing") => missing = Some(e.message),
                Err(_) => {}
            }
        }
        let message = missing.unwrap_or_else(|| panic!("{op} can't be built from {args:?}"));
        let name = message.split('`').nth(1).unwrap().to_owned();
        args.push((name.clone(), plausible(&name, &message)));
    }
    panic!("{op} asks for too much: {args:?}");
}

fn texture(values: GridValues) -> Shape {
    Shape::texture(Grid::new(values, [2, 3, 2], [-1.0, 0.0, 0.1], [1.0 / 3.0, 2.0, 0.2]).unwrap()).unwrap()
}

fn lines(shape: &Shape) -> Vec<String> {
    nodes_to_json(shape).iter().map(Json::to_line).collect()
}

/// Through the text and back.
fn reread(shape: &Shape) -> Shape {
    let nodes = parse(&format!("[{}]", lines(shape).join(",\n")));
    shape_from_nodes(&nodes, nodes.len() - 1).unwrap()
}

fn parse(text: &str) -> Vec<Json> {
    Json::parse(text).unwrap().as_list("nodes").unwrap().to_vec()
}

#[test]
fn every_op_reads_back_bit_for_bit() {
    let names = Kind::SHAPES.iter().copied().filter(|n| *n != "texture").chain(Kind::formula_ops());
    let mut count = 0;
    for op in names {
        let shape = sample(op);
        assert_eq!(shape.op(), op);
        let back = reread(&shape);
        assert_eq!(lines(&shape), lines(&back), "{op}");
        assert_eq!(shape.args(), back.args(), "{op}");
        assert_eq!(shape.lipschitz().to_bits(), back.lipschitz().to_bits(), "{op}");
        count += 1;
    }
    assert!(count > 50, "the registry has {count} ops only");
}

#[test]
fn optional_arguments_read_back() {
    let count = ("count".into(), Value::Ints3([1, 0, 4]));
    let period = ("period".into(), Value::Vec3([3.0, 0.0, -0.0]));
    let repeat = Shape::build("repeat", vec![period, count], vec![sphere()]).unwrap();
    let y = Shape::build("y", vec![], vec![]).unwrap();
    let ends = |v: f64| Value::Vec3([v; 3]);
    let args =
        vec![("lipschitz".into(), Value::Num(1.5)), ("lo".into(), ends(-1.0)), ("hi".into(), ends(1e-3))];
    for shape in [repeat, Shape::build("formula", args, vec![y]).unwrap()] {
        let back = reread(&shape);
        assert_eq!((shape.args(), lines(&shape)), (back.args(), lines(&back)));
    }
}

#[test]
fn textures_read_back_bit_for_bit() {
    let f32s: Vec<f32> = (0..12).map(|i| (i as f32 - 5.5) / 3.0).chain([]).collect();
    let mut f64s: Vec<f64> = (0..12).map(|i| (f64::from(i) - 5.5) / 3.0).collect();
    f64s[3] = -0.0;
    for values in [GridValues::F32(f32s.into()), GridValues::F64(f64s.into())] {
        let shape = texture(values.clone());
        let back = reread(&shape);
        let grid = back.grid().unwrap();
        assert_eq!((grid.dense().unwrap(), grid.dims()), (&values, [2, 3, 2]));
        assert_eq!(lines(&shape), lines(&back));
    }
}

#[test]
fn sharing_is_kept() {
    let a = sphere();
    let pair = |k: f64, children| Shape::build("union", vec![("k".into(), Value::Num(k))], children).unwrap();
    let b = pair(0.0, vec![a.clone(), a.clone()]);
    let c = pair(0.5, vec![b.clone(), a, b]);
    assert_eq!(nodes_to_json(&c).len(), 3);
    let back = reread(&c);
    assert_eq!(back.children()[0].ptr_id(), back.children()[2].ptr_id());
    assert_eq!(lines(&back), lines(&c));
}

#[test]
fn a_chain_of_a_hundred_thousand() {
    let mut shape = sphere();
    for _ in 0..100_000 {
        shape = Shape::build("negate", vec![], vec![shape]).unwrap();
    }
    let back = reread(&shape);
    assert_eq!(nodes_to_json(&back).len(), 100_001);
}

fn fails(node: &str, path: &str, word: &str) {
    let text = format!("[{{\"op\": \"sphere\", \"radius\": 1}}, {node}]");
    let error = shape_from_nodes(&parse(&text), 1).expect_err(node);
    assert!(error.path == path && error.message.contains(word), "{node} gave {error}");
}

#[test]
fn refusals_name_the_place() {
    fails("7", "nodes[1]", "object");
    fails("{}", "nodes[1].op", "missing");
    fails(r#"{"op": 3}"#, "nodes[1].op", "text");
    fails(r#"{"op": "spere", "radius": 1}"#, "nodes[1]", "sphere");
    fails(r#"{"op": "sphere"}"#, "nodes[1]", "radius");
    fails(r#"{"op": "sphere", "radius": -1}"#, "nodes[1].radius", "-1");
    fails(r#"{"op": "sphere", "radius": "1"}"#, "nodes[1].radius", "number");
    fails(r#"{"op": "sphere", "radius": null}"#, "nodes[1].radius", "number");
    fails(r#"{"op": "sphere", "radius": {}}"#, "nodes[1].radius", "object");
    fails(r#"{"op": "sphere", "radius": true}"#, "nodes[1].radius", "true");
    fails(r#"{"op": "sphere", "radius": 1, "colour": 2}"#, "nodes[1].colour", "colour");
    fails(r#"{"op": "sphere", "radius": 1e300}"#, "nodes[1].radius", "1e300");
    fails(r#"{"op": "box", "size": [1, 2]}"#, "nodes[1].size", "three numbers");
    fails(r#"{"op": "box", "size": [1, 2, "3"]}"#, "nodes[1].size[2]", "number");
    fails(r#"{"op": "mandelbulb", "power": 8.5, "iterations": 8}"#, "nodes[1].power", "whole number");
    fails(
        r#"{"op": "mandelbulb", "power": 1000000000000, "iterations": 8}"#,
        "nodes[1].power",
        "whole number",
    );
    fails(r#"{"op": "negate", "of": [1]}"#, "nodes[1].of[0]", "earlier");
    fails(r#"{"op": "negate", "of": [-1]}"#, "nodes[1].of[0]", "-1");
    fails(r#"{"op": "negate", "of": [0.0]}"#, "nodes[1].of[0]", "0.0");
    fails(r#"{"op": "negate", "of": 0}"#, "nodes[1].of", "list");
    fails(r#"{"op": "negate", "of": [0, 0]}"#, "nodes[1]", "operands");
    fails(r#"{"op": "sin", "of": [0]}"#, "nodes[1]", "shape");
    fails(r#"{"op": "sphere_union", "of": []}"#, "nodes[1]", "sphere_union");
    let sphere = parse(r#"[{"op": "sphere", "radius": 1}]"#);
    assert_eq!(shape_from_nodes(&sphere, 1).expect_err("no such root").path, "root");
    assert_eq!(shape_from_nodes(&[], 0).expect_err("empty").path, "nodes");
}

#[test]
fn textures_are_measured_before_they_are_decoded() {
    let grid = |dims: &str, dtype: &str, data: &str, more: &str| {
        format!(
            r#"{{"op": "texture", "dims": {dims}, "dtype": "{dtype}", "lo": [0,0,0], "hi": [1,1,1], "data": "{data}"{more}}}"#
        )
    };
    let eight = STANDARD.encode([0u8; 32]);
    let nan = STANDARD.encode([255u8; 32]);
    fails(&grid("[2,2,2]", "f32", "AAAA", ""), "nodes[1].data", "44");
    fails(&grid("[1048576,1048576,1048576]", "f64", "AAAA", ""), "nodes[1].data", "base64");
    fails(&grid("[1048577,2,2]", "f32", "AAAA", ""), "nodes[1].dims[0]", "1048577");
    fails(&grid("[2,2,-2]", "f32", &eight, ""), "nodes[1].dims[2]", "-2");
    fails(&grid("[2,2]", "f32", &eight, ""), "nodes[1].dims", "three");
    fails(&grid("[8,1,1]", "f32", &eight, ""), "nodes[1].dims", "at least 2");
    fails(&grid("[2,2,2]", "u8", &eight, ""), "nodes[1].dtype", "f64");
    fails(&grid("[2,2,2]", "f32", &eight.replace('A', "*"), ""), "nodes[1].data", "base64");
    fails(&grid("[2,2,2]", "f32", &nan, ""), "nodes[1]", "not finite");
    fails(&grid("[2,2,2]", "f32", &eight, r#", "colour": 1"#), "nodes[1].colour", "unknown");
    fails(&grid("[2,2,2]", "f32", &eight, r#", "of": [0]"#), "nodes[1].of", "unknown");
}
