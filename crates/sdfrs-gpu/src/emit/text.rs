//! The lines of a scene, in parts that hand values on through private variables.

use std::{
    collections::{HashMap, HashSet},
    fmt::Write,
};

use sdfrs_core::graph::{Graph, INPUTS, Node};

/// What a value is: a number, or a number with its gradient.
#[derive(Clone, Copy)]
struct Flavour {
    ty: &'static str,
    op: &'static str,
    function: &'static str,
    inputs: [&'static str; 3],
}

const VALUE: Flavour = Flavour { ty: "f32", op: "op", function: "field", inputs: ["p.x", "p.y", "p.z"] };
const GRADIENT: Flavour = Flavour {
    ty: "vec4<f32>",
    op: "d",
    function: "field_gradient",
    inputs: [
        "vec4<f32>(1.0, 0.0, 0.0, p.x)",
        "vec4<f32>(0.0, 1.0, 0.0, p.y)",
        "vec4<f32>(0.0, 0.0, 1.0, p.z)",
    ],
};

/// What a flavour of a scene is written from.
struct Source<'a> {
    graph: &'a Graph,
    parts: &'a [&'a [u32]],
    shared: &'a HashMap<u32, u32>,
    /// The constants of each op, as arguments.
    arguments: &'a HashMap<u32, String>,
}

/// `field` and `field_gradient`.
pub fn scene(out: &mut String, graph: &Graph, order: &[u32], arguments: &HashMap<u32, String>, part: usize) {
    let parts: Vec<&[u32]> = order.chunks(part).collect();
    let shared = shared(graph, &parts);
    let source = Source { graph, parts: &parts, shared: &shared, arguments };
    for flavour in [VALUE, GRADIENT] {
        write_scene(out, &source, flavour);
    }
}

/// Values that a later part reads, with the variable that carries them.
///
/// A variable is given away again once the last part that reads it is through.
fn shared(graph: &Graph, parts: &[&[u32]]) -> HashMap<u32, u32> {
    let order = || parts.iter().copied().flatten();
    let part_of: HashMap<u32, usize> =
        parts.iter().enumerate().flat_map(|(i, part)| part.iter().map(move |id| (*id, i))).collect();
    let mut last_read: HashMap<u32, usize> = HashMap::new();
    for id in order() {
        for operand in operands(graph, *id).iter().filter(|operand| **operand >= INPUTS) {
            last_read.insert(*operand, part_of[id]);
        }
    }
    let (mut slots, mut next) = (HashMap::new(), 0);
    // Variables by the part after which they are free.
    let mut busy: Vec<(usize, u32)> = Vec::new();
    for id in order() {
        let (made, read) = (part_of[id], last_read.get(id).copied().unwrap_or(0));
        if read <= made {
            continue;
        }
        let slot = match busy.iter().position(|(until, _)| *until < made) {
            Some(free) => busy.swap_remove(free).1,
            None => {
                next += 1;
                next - 1
            }
        };
        busy.push((read, slot));
        slots.insert(*id, slot);
    }
    slots
}

fn operands(graph: &Graph, id: u32) -> &[u32] {
    graph.node(id).map_or(&[], |n| &n.a[..n.op.arity()])
}

// Writing to a string cannot fail.
fn write_scene(out: &mut String, source: &Source, flavour: Flavour) {
    let Flavour { ty, function, .. } = flavour;
    let Source { graph, parts, shared, .. } = source;
    let variables = shared.values().max().map_or(0, |most| most + 1);
    for slot in 0..variables {
        let _ = writeln!(out, "var<private> {function}_s{slot}: {ty};");
    }
    for (i, part) in parts.iter().enumerate() {
        let last = i + 1 == parts.len();
        let _ = if last {
            writeln!(out, "fn {function}(p: vec3<f32>) -> {ty} {{")
        } else {
            writeln!(out, "fn {function}_part{i}(p: vec3<f32>) {{")
        };
        if last {
            for earlier in 0..i {
                let _ = writeln!(out, "    {function}_part{earlier}(p);");
            }
        }
        write_part(out, source, part, flavour);
        if last {
            let _ = writeln!(out, "    return v{};", graph.root);
        }
        out.push_str("}\n");
    }
    if parts.is_empty() {
        // A bare coordinate.
        let input = flavour.inputs[graph.root.min(2) as usize];
        let _ = writeln!(out, "fn {function}(p: vec3<f32>) -> {ty} {{\n    return {input};\n}}");
    }
}

fn write_part(out: &mut String, source: &Source, part: &[u32], flavour: Flavour) {
    let Source { graph, shared, arguments, .. } = source;
    let function = flavour.function;
    for (i, input) in flavour.inputs.iter().enumerate() {
        let _ = writeln!(out, "    let v{i} = {input};");
    }
    let mut here: HashSet<u32> = (0..INPUTS).collect();
    for &id in part {
        let Some(node) = graph.node(id) else { continue };
        for &operand in operands(graph, id) {
            if here.insert(operand)
                && let Some(slot) = shared.get(&operand)
            {
                let _ = writeln!(out, "    let v{operand} = {function}_s{slot};");
            }
        }
        let _ = writeln!(out, "    let v{id} = {};", call(node, flavour.op, arguments.get(&id)));
        here.insert(id);
        if let Some(slot) = shared.get(&id) {
            let _ = writeln!(out, "    {function}_s{slot} = v{id};");
        }
    }
}

/// `op_sphere(v0, v1, v2, consts[7])`: operands, then constants.
fn call(node: &Node, prefix: &str, constants: Option<&String>) -> String {
    let operands = node.a[..node.op.arity()].iter().map(|a| format!("v{a}"));
    let args: Vec<String> = operands.chain(constants.filter(|c| !c.is_empty()).cloned()).collect();
    format!("{prefix}_{}({})", node.op.name(), args.join(", "))
}
