//! The registry of everything a scene can contain: name, children, arguments.

use std::sync::Arc;

use super::value::{Args, Axis, Param, Value, no_more, take};
use crate::{error::SceneError, grid::Grid, op::Op};

/// Any number of children.
const MANY: usize = usize::MAX;

macro_rules! kinds {
    ($($variant:ident $name:literal [$least:expr, $most:expr] { $($field:ident: $type:ty),* })*) => {
        /// What a node is; children are listed beside it.
        #[derive(Debug, Clone)]
        pub enum Kind {
            $($variant { $($field: $type),* },)*
            Texture { grid: Arc<Grid> },
            /// A step of a formula: an op of the op table over its children.
            Expr(Op),
            /// The `axis`-th coordinate of the point.
            Coordinate(Axis),
        }

        impl Kind {
            /// Names of all shapes and transforms, formulas' steps left out.
            pub const SHAPES: &'static [&'static str] = &[$($name,)* "texture"];

            pub fn op(&self) -> &'static str {
                match self {
                    $(Kind::$variant { .. } => $name,)*
                    Kind::Texture { .. } => "texture",
                    Kind::Expr(op) => expr_name(*op),
                    Kind::Coordinate(axis) => ["x", "y", "z"][*axis as usize],
                }
            }
            pub fn args(&self) -> Vec<(&'static str, Value)> {
                match self {
                    $(Kind::$variant { $($field),* } => vec![$((stringify!($field), $field.to_value())),*],)*
                    _ => Vec::new(),
                }
            }
            /// Least and most children.
            pub fn arity(&self) -> (usize, usize) {
                match self {
                    $(Kind::$variant { .. } => ($least, $most),)*
                    Kind::Expr(Op::Length2 | Op::Length3) => (2, 3),
                    Kind::Expr(op) => (op.arity(), op.arity()),
                    _ => (0, 0),
                }
            }
            pub(super) fn from_args(op: &str, mut args: Args) -> Result<Kind, SceneError> {
                let kind = match op {
                    $($name => Kind::$variant { $($field: take(op, &mut args, stringify!($field))?),* },)*
                    "x" => Kind::Coordinate(Axis::X),
                    "y" => Kind::Coordinate(Axis::Y),
                    "z" => Kind::Coordinate(Axis::Z),
                    "length" => Kind::Expr(Op::Length3),
                    _ => match Op::ALL.iter().find(|o| is_formula(**o) && o.name() == op) {
                        Some(op) => Kind::Expr(*op),
                        None => return Err(unknown(op)),
                    },
                };
                no_more(op, &args)?;
                Ok(kind)
            }
        }
    };
}

kinds! {
    Sphere "sphere" [0, 0] { radius: f64 }
    Box "box" [0, 0] { size: [f64; 3] }
    RoundedBox "rounded_box" [0, 0] { size: [f64; 3], radius: f64 }
    Torus "torus" [0, 0] { major: f64, minor: f64 }
    Cylinder "cylinder" [0, 0] { radius: f64, height: f64 }
    Capsule "capsule" [0, 0] { a: [f64; 3], b: [f64; 3], radius: f64 }
    Cone "cone" [0, 0] { radius: f64, height: f64, top_radius: f64 }
    Ellipsoid "ellipsoid" [0, 0] { radii: [f64; 3] }
    Plane "plane" [0, 0] { normal: [f64; 3], point: [f64; 3] }
    Gyroid "gyroid" [0, 0] { period: f64, thickness: f64 }
    Mandelbulb "mandelbulb" [0, 0] { power: i64, iterations: i64 }
    Union "union" [1, MANY] { k: f64 }
    Intersection "intersection" [1, MANY] { k: f64 }
    Difference "difference" [2, 2] { k: f64 }
    Negate "negate" [1, 1] {}
    Dilate "dilate" [1, 1] { radius: f64 }
    Shell "shell" [1, 1] { thickness: f64 }
    Displace "displace" [2, 2] {}
    WithLipschitz "with_lipschitz" [1, 1] { lipschitz: f64 }
    WithBounds "with_bounds" [1, 1] { lo: [f64; 3], hi: [f64; 3] }
    Translate "translate" [1, 1] { offset: [f64; 3] }
    Rotate "rotate" [1, 1] { angle: f64, axis: [f64; 3] }
    Scale "scale" [1, 1] { factors: [f64; 3] }
    Mirror "mirror" [1, 1] { axis: Axis }
    Repeat "repeat" [1, 1] { period: [f64; 3], count: Option<[i64; 3]> }
    Elongate "elongate" [1, 1] { amount: [f64; 3] }
    Twist "twist" [1, 1] { rate: f64 }
    Bend "bend" [1, 1] { rate: f64 }
    Formula "formula" [1, 1] { lipschitz: Option<f64>, lo: Option<[f64; 3]>, hi: Option<[f64; 3]> }
    Const "const" [0, 0] { value: f64 }
}

impl Kind {
    pub fn is_expr(&self) -> bool {
        matches!(self, Kind::Expr(_) | Kind::Coordinate(_) | Kind::Const { .. })
    }
    /// Names of the steps a formula can be made of.
    pub fn formula_ops() -> Vec<&'static str> {
        let mut names = vec!["x", "y", "z", "const", "length"];
        names.extend(Op::ALL.iter().filter(|op| is_formula(**op)).map(|op| op.name()));
        names
    }
}

fn expr_name(op: Op) -> &'static str {
    if matches!(op, Op::Length2 | Op::Length3) { "length" } else { op.name() }
}

/// The scalar rows of the op table, `const` and `length` apart: those have a kind or a name of their own.
fn is_formula(op: Op) -> bool {
    op > Op::Const && op <= Op::Select && !matches!(op, Op::Length2 | Op::Length3)
}

fn unknown(op: &str) -> SceneError {
    let all = Kind::SHAPES.iter().copied().chain(Kind::formula_ops());
    let mut near: Vec<_> = all.map(|name| (distance(op, name), name)).filter(|(d, _)| *d <= 3).collect();
    near.sort_unstable();
    near.dedup();
    let hint = match near.first() {
        Some((_, name)) => format!("; did you mean `{name}`?"),
        None => format!(", allowed: {}", Kind::SHAPES.join(", ")),
    };
    let shown: String = op.chars().take(40).collect();
    SceneError::new(shown.clone(), format!("no such operation `{shown}`{hint}"))
}

/// Edit distance, on the first characters of a name only.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().take(40).collect(), b.chars().take(40).collect());
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let change = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = change.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
