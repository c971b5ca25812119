//! The lines of a scene, in parts that hand values on through private variables.

use std::{collections::HashMap, fmt::Write};

use sdfrs_core::{
    graph::{Graph, INPUTS, Node},
    op::Op,
};

use crate::scene::HEADER;

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

/// `field` and `field_gradient`.
pub fn scene(graph: &Graph, order: &[u32], part: usize) -> String {
    let parts: Vec<&[u32]> = order.chunks(part).collect();
    let shared = shared(graph, &parts);
    let mut out = String::new();
    for flavour in [VALUE, GRADIENT] {
        write_scene(&mut out, graph, &parts, &shared, flavour);
    }
    out
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
fn write_scene(
    out: &mut String,
    graph: &Graph,
    parts: &[&[u32]],
    shared: &HashMap<u32, u32>,
    flavour: Flavour,
) {
    let Flavour { ty, function, .. } = flavour;
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
        write_part(out, graph, part, shared, flavour);
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

fn write_part(out: &mut String, graph: &Graph, part: &[u32], shared: &HashMap<u32, u32>, flavour: Flavour) {
    let function = flavour.function;
    for (i, input) in flavour.inputs.iter().enumerate() {
        let _ = writeln!(out, "    let v{i} = {input};");
    }
    let mut here: std::collections::HashSet<u32> = (0..INPUTS).collect();
    for &id in part {
        let Some(node) = graph.node(id) else { continue };
        for &operand in operands(graph, id) {
            if here.insert(operand)
                && let Some(slot) = shared.get(&operand)
            {
                let _ = writeln!(out, "    let v{operand} = {function}_s{slot};");
            }
        }
        let _ = writeln!(out, "    let v{id} = {};", call(node, flavour.op, &graph.consts));
        here.insert(id);
        if let Some(slot) = shared.get(&id) {
            let _ = writeln!(out, "    {function}_s{slot} = v{id};");
        }
    }
}

/// `op_sphere(v0, v1, v2, 7u)`: operands, then where the constants start.
fn call(node: &Node, prefix: &str, consts: &[f64]) -> String {
    let mut args: Vec<String> = node.a[..node.op.arity()].iter().map(|a| format!("v{a}")).collect();
    match node.op {
        Op::SphereUnion => args.extend([format!("{}u", node.k), format!("{}u", node.n / 4)]),
        // The one constant is the number of the grid, whose header has its place.
        Op::Texture | Op::TextureSafe | Op::TextureSafeNegated => {
            args.push(format!("{}u", consts[node.k as usize] as u32 * HEADER))
        }
        _ if node.n > 0 => args.push(format!("{}u", node.k)),
        _ => {}
    }
    format!("{prefix}_{}({})", node.op.name(), args.join(", "))
}
