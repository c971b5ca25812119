//! Slopes and ranges of formulas, step by step, by the op table's rules.

use super::{Aabb, Meta};
use crate::{
    error::SceneError,
    lane::Iv,
    op::{Ins, Op, Operand, Stock, Tables, execute},
    shape::{Kind, Shape},
};

pub fn meta(kind: &Kind, children: &[Shape]) -> Meta {
    let base = Meta { reach: 0.0, ..Meta::unbounded() };
    match kind {
        Kind::Coordinate(axis) => {
            let mut affine = [0.0; 4];
            affine[*axis as usize] = 1.0;
            Meta { affine: Some(affine), ..base }
        }
        Kind::Const { value } => {
            let affine = Some([0.0, 0.0, 0.0, *value]);
            Meta { lip: 0.0, moves: false, range: Iv::new(*value, *value), affine, ..base }
        }
        Kind::Expr(op) => step(op_for(*op, children.len()), children, base),
        _ => base,
    }
}

/// `length` is one name for two ops.
pub fn op_for(op: Op, operands: usize) -> Op {
    match (op, operands) {
        (Op::Length2 | Op::Length3, 2) => Op::Length2,
        _ => op,
    }
}

fn step(op: Op, children: &[Shape], base: Meta) -> Meta {
    let metas: Vec<&Meta> = children.iter().map(Shape::meta).collect();
    let operands: Vec<_> = metas.iter().map(|m| Operand { lip: m.lip, range: m.range }).collect();
    let range = range(op, &operands);
    let moves = metas.iter().any(|m| m.moves);
    let affine = affine(op, &metas);
    let lip = match affine {
        _ if !moves => 0.0,
        Some([x, y, z, _]) => (x * x + y * y + z * z).sqrt(),
        None => length_slope(op, &metas).unwrap_or_else(|| op.lipschitz(&operands)),
    };
    Meta { lip, moves, range, affine, ..base }
}

/// Runs the op's own kernel on intervals.
#[allow(unsafe_code)]
fn range(op: Op, operands: &[Operand]) -> Iv {
    let mut slots = [Iv::ALL; 5];
    for (slot, operand) in slots.iter_mut().zip(operands) {
        *slot = operand.range;
    }
    let ins = Ins { op, run: 1, d: 4, a: [0, 1, 2, 3], k: 0, n: 0 };
    // SAFETY: scalar ops have at most four operands, all five slots exist, and none reads a constant
    // (`const` is a kind of its own).
    unsafe { execute::<Iv>(&ins, slots.as_mut_ptr(), 1, &Tables { consts: &[], stock: &Stock::default() }) };
    slots[4]
}

fn affine(op: Op, m: &[&Meta]) -> Option<[f64; 4]> {
    let at = |i: usize| m.get(i).and_then(|m| m.affine);
    let constant = |i: usize| at(i).filter(|_| !m[i].moves).map(|a| a[3]);
    let zip = |f: fn(f64, f64) -> f64| {
        let (a, b) = (at(0)?, at(1)?);
        Some(std::array::from_fn(|i| f(a[i], b[i])))
    };
    match op {
        Op::Add => zip(|a, b| a + b),
        Op::Sub => zip(|a, b| a - b),
        Op::Neg => at(0).map(|a| a.map(|v| -v)),
        Op::Mul => match (constant(0), constant(1)) {
            (Some(c), _) => at(1).map(|a| a.map(|v| v * c)),
            (_, Some(c)) => at(0).map(|a| a.map(|v| v * c)),
            _ => None,
        },
        Op::Div => constant(1).filter(|c| *c != 0.0).and_then(|c| at(0).map(|a| a.map(|v| v / c))),
        _ => None,
    }
}

/// Slope of the length of affine terms: the norm of their matrix, bounded by sqrt(|A|_1 |A|_inf).
fn length_slope(op: Op, m: &[&Meta]) -> Option<f64> {
    if !matches!(op, Op::Length2 | Op::Length3) {
        return None;
    }
    let rows: Option<Vec<[f64; 4]>> = m.iter().map(|m| m.affine).collect();
    let rows = rows?;
    let row = rows.iter().map(|r| r[..3].iter().map(|v| v.abs()).sum::<f64>()).fold(0.0, f64::max);
    let column = (0..3).map(|j| rows.iter().map(|r| r[j].abs()).sum::<f64>()).fold(0.0, f64::max);
    let frobenius = rows.iter().flat_map(|r| r[..3].iter()).map(|v| v * v).sum::<f64>().sqrt();
    Some((row * column).sqrt().min(frobenius))
}

pub fn formula(
    expr: Meta,
    lipschitz: &Option<f64>,
    lo: &Option<[f64; 3]>,
    hi: &Option<[f64; 3]>,
) -> Result<Meta, SceneError> {
    let lip = lipschitz.unwrap_or(expr.lip);
    if !lip.is_finite() {
        let message = "no Lipschitz bound follows from this formula (a product, root or jump without limits), \
                       allowed: formulas of bounded slope, or a declared bound: lipschitz=...";
        return Err(SceneError::new("formula", message));
    }
    let bounds = match (lo, hi) {
        (Some(lo), Some(hi)) => Aabb { lo: *lo, hi: *hi },
        _ => Aabb::ALL,
    };
    Ok(Meta { lip, bounds, affine: None, ..expr })
}
