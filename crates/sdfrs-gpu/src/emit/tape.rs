//! Scenes too long to compile: a text that interprets any of them, and programs as rows of constants.
//!
//! The text knows only which ops occur and how many slots there may be, so scenes of one kind share it
//! and nothing is compiled when a scene changes. A program's rows: (instructions, root, operations, its
//! length's number), then for each instruction (op, target, first row of constants, number of rows) and
//! (operands), then the constants; places count from its first row. All are whole numbers below 2^24, which
//! f32 holds exactly. Which program runs, the variable `program` says: the whole scene's stands at row 0,
//! those of [`super::patches`] behind it. Twin of the CPU's evaluator; law: the same bits as compiled
//! (tests/parity.rs).

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write,
    sync::Arc,
};

use sdfrs_core::{
    Grid,
    graph::Graph,
    op::{Ins, Op},
    tape::Tape,
};

use super::{consts::tame, cost};
use crate::{error::GpuError, grids};

/// Most slots: an invocation keeps them in memory of its own.
const SLOTS: usize = 512;
/// Rows before a program's instructions.
const HEAD: usize = 1;

/// Instructions, and most rounds of loops in an evaluation.
pub type Length = (usize, u64);
/// A row of the shader's constants.
pub type Row = [f32; 4];

/// What the text has to know of the programs that it will run.
#[derive(Debug, Clone, Default)]
pub struct Needs {
    used: BTreeSet<Op>,
    slots: usize,
}

impl Needs {
    pub fn learn(&mut self, tape: &Tape<f32>) {
        // No more cases than these: a driver in software runs through every one for every instruction.
        self.used.extend(tape.instructions().iter().map(|ins| ins.op));
        self.slots = self.slots.max(tape.slots());
    }

    pub fn join(&mut self, other: Self) {
        self.used.extend(other.used);
        self.slots = self.slots.max(other.slots);
    }

    /// The interpreter.
    pub fn text(&self) -> Result<String, GpuError> {
        if self.slots > SLOTS {
            let what = "values alive at a time in an interpreted scene".into();
            return Err(GpuError::Limits { what, asked: self.slots as u64, allowed: SLOTS as u64 });
        }
        // Few sizes, so that few texts.
        let slots = self.slots.next_power_of_two().max(16);
        let mut text = String::from(
            "@group(1) @binding(0) var<storage, read> consts: array<vec4<f32>>;\n\
             var<private> program: u32;\n",
        );
        for flavour in [VALUE, GRADIENT] {
            function(&mut text, &self.used, slots, flavour);
        }
        Ok(text)
    }
}

/// Writes programs as rows.
pub struct Writer {
    /// The rows of each grid.
    headers: Vec<[Row; grids::ROWS]>,
}

impl Writer {
    pub fn new(all: &[Arc<Grid>]) -> Result<Self, GpuError> {
        let (parts, _) = grids::layout(all)?;
        let header = |(grid, parts): (&Arc<Grid>, _)| grids::rows(grid, parts).map(|row| row.map(tame));
        Ok(Self { headers: all.iter().zip(&parts).map(header).collect() })
    }

    /// Adds a program behind `rows`; it begins where they end.
    pub fn add(&self, tape: &Tape<f32>, rows: &mut Vec<Row>) {
        let instructions = tape.instructions();
        rows.push([instructions.len() as f32, tape.root() as f32, tape.ops() as f32, 0.0]);
        let first = HEAD + 2 * instructions.len();
        let mut constants: Vec<Row> = Vec::new();
        let mut placed = BTreeMap::new();
        for ins in instructions {
            let values = &tape.tables().consts[ins.k as usize..(ins.k + ins.n) as usize];
            let at = constants.len();
            let place = if is_texture(ins.op) {
                let index = values.first().map_or(0, |v| *v as usize);
                *placed.entry(index).or_insert_with(|| {
                    constants.extend(self.headers[index]);
                    at
                })
            } else {
                let four = |c: &[f32]| std::array::from_fn(|i| c.get(i).map_or(0.0, |v| tame(*v)));
                constants.extend(values.chunks(4).map(four));
                at
            };
            rows.extend(words(ins, first + place));
        }
        rows.extend(constants);
    }
}

/// Most rounds of the interpreter's loop and of those inside it.
pub fn loops(tape: &Tape<f32>) -> u64 {
    let rounds = |ins: &Ins| {
        let consts = &tape.tables().consts[ins.k as usize..(ins.k + ins.n) as usize];
        let few: Vec<f64> = consts.iter().take(2).map(|v| f64::from(*v)).collect();
        1 + if ins.op == Op::SphereUnion { u64::from(ins.n / 4) } else { cost::loops(ins.op, &few) }
    };
    tape.instructions().iter().map(rounds).sum()
}

/// Refuses more rows than f32 can count.
pub fn check(rows: &[Row]) -> Result<(), GpuError> {
    if rows.len() >= 1 << 24 {
        let what = "rows of an interpreted scene".into();
        return Err(GpuError::Limits { what, asked: rows.len() as u64, allowed: 1 << 24 });
    }
    Ok(())
}

/// The whole of a scene as rows, and a text that runs them.
pub fn interpreted(graph: &Graph) -> Result<(String, Vec<Row>, Length), GpuError> {
    let tape = Tape::<f32>::new(graph);
    let (mut needs, mut rows) = (Needs::default(), Vec::new());
    needs.learn(&tape);
    Writer::new(&graph.grids)?.add(&tape, &mut rows);
    check(&rows)?;
    Ok((needs.text()?, rows, (tape.instructions().len(), loops(&tape))))
}

fn words(ins: &Ins, constants: usize) -> [[f32; 4]; 2] {
    // A texture names its grid by one constant, and has that grid's rows.
    let n = if is_texture(ins.op) { grids::ROWS as u32 } else { ins.n.div_ceil(4) };
    [[ins.op as u16 as f32, ins.d as f32, constants as f32, n as f32], ins.a.map(|a| a as f32)]
}

fn is_texture(op: Op) -> bool {
    matches!(op, Op::Texture | Op::TextureSafe | Op::TextureSafeNegated)
}

/// Values, or values with their gradients.
struct Flavour {
    signature: &'static str,
    ty: &'static str,
    prefix: &'static str,
    inputs: [&'static str; 3],
}

const VALUE: Flavour = Flavour {
    signature: "fn field(p: vec3<f32>) -> f32 {",
    ty: "f32",
    prefix: "op",
    inputs: ["p.x", "p.y", "p.z"],
};
const GRADIENT: Flavour = Flavour {
    signature: "fn field_gradient(p: vec3<f32>) -> vec4<f32> {",
    ty: "vec4<f32>",
    prefix: "d",
    inputs: [
        "vec4<f32>(1.0, 0.0, 0.0, p.x)",
        "vec4<f32>(0.0, 1.0, 0.0, p.y)",
        "vec4<f32>(0.0, 0.0, 1.0, p.z)",
    ],
};

// Writing to a string cannot fail.
fn function(out: &mut String, used: &BTreeSet<Op>, slots: usize, flavour: Flavour) {
    let Flavour { signature, ty, prefix, inputs } = flavour;
    let _ = writeln!(out, "{signature}\n    var s: array<{ty}, {slots}>;");
    for (i, input) in inputs.iter().enumerate() {
        let _ = writeln!(out, "    s[{i}] = {input};");
    }
    out.push_str(
        "    let first = consts[program];\n    let n = u32(first.x);\n    for (var i = 0u; i < n; i++) {\n        \
         let at = program + 1u + 2u * i;\n        let head = consts[at];\n        \
         let places = vec4<u32>(consts[at + 1u]);\n",
    );
    for (i, lane) in ["x", "y", "z", "w"].iter().enumerate() {
        let _ = writeln!(out, "        let a{i} = s[places.{lane}];");
    }
    // Read once here: a driver in software compiles every place that reads for seconds.
    out.push_str(
        "        let k = program + u32(head.z);\n        let c = consts[k];\n        let d = consts[k + 1u];\n",
    );
    let _ = writeln!(out, "        var v = {ty}();\n        switch u32(head.x) {{");
    for op in used {
        let _ = writeln!(out, "            case {}u: {{ v = {}; }}", *op as u16, call(*op, prefix));
    }
    out.push_str("            default: {}\n        }\n        s[u32(head.y)] = v;\n    }\n");
    out.push_str("    return s[u32(first.y)];\n}\n");
}

/// The call of an op whose operands are `a0` on and whose constants start at row `k`.
fn call(op: Op, prefix: &str) -> String {
    let operands = (0..op.arity()).map(|i| format!("a{i}"));
    let constants: Vec<String> = match (op, op.constants()) {
        (Op::SphereUnion, _) => vec!["k".into(), "u32(head.w)".into()],
        (Op::Mandelbulb, _) => vec!["c".into()],
        (_, None) => vec!["k".into(), "u32(c.w)".into(), "u32(d.w)".into()],
        (_, Some(0)) => vec![],
        (_, Some(1)) => vec!["c.x".into()],
        (_, Some(n)) => ["c", "d"].iter().take(n.div_ceil(4)).map(|row| (*row).to_owned()).collect(),
    };
    format!("{prefix}_{}({})", op.name(), operands.chain(constants).collect::<Vec<_>>().join(", "))
}
