//! What a node's arguments may be; every refusal says what was got and what is allowed.

use super::{Kind, Shape, value::Value};
use crate::error::SceneError;

/// Least whole power of a Mandelbulb: below it the set reaches the radius where the estimate ends.
pub const MIN_POWER: i64 = 3;
/// Largest whole power of a Mandelbulb.
pub const MAX_POWER: i64 = 16;
/// Most iterations of a Mandelbulb.
pub const MAX_ITERATIONS: i64 = 64;
/// Sizes beyond this lose all their digits when squared in f32.
const HUGE: f64 = 1e15;

pub fn check(kind: &Kind, children: &[Shape]) -> Result<(), SceneError> {
    let op = kind.op();
    finite(op, &kind.args())?;
    children_fit(kind, children)?;
    let c = Check { op };
    match kind {
        Kind::Sphere { radius } => c.positive("radius", *radius),
        Kind::Box { size } => c.all_positive("size", size),
        Kind::RoundedBox { size, radius } => {
            c.all_positive("size", size)?;
            let most = size.iter().fold(f64::INFINITY, |a, b| a.min(*b)) / 2.0;
            c.need(
                *radius >= 0.0 && *radius <= most,
                "radius",
                *radius,
                &format!("0 to half the least edge, {most}"),
            )
        }
        Kind::Torus { major, minor } => c.positive("major", *major).and(c.positive("minor", *minor)),
        Kind::Cylinder { radius, height } => c.positive("radius", *radius).and(c.positive("height", *height)),
        Kind::Capsule { radius, .. } => c.positive("radius", *radius),
        Kind::Cone { radius, height, top_radius } => {
            c.not_negative("radius", *radius).and(c.not_negative("top_radius", *top_radius))?;
            c.need(radius + top_radius > 0.0, "radius", *radius, "above 0 at one end at least")?;
            c.positive("height", *height)
        }
        Kind::Ellipsoid { radii } => c.all_positive("radii", radii),
        Kind::Plane { normal, .. } => c.direction("normal", normal),
        Kind::Gyroid { period, thickness } => {
            c.positive("period", *period).and(c.not_negative("thickness", *thickness))
        }
        Kind::Mandelbulb { power, iterations } => {
            c.between("power", *power, MIN_POWER, MAX_POWER)?;
            c.between("iterations", *iterations, 1, MAX_ITERATIONS)
        }
        Kind::Union { k } | Kind::Intersection { k } | Kind::Difference { k } => c.not_negative("k", *k),
        Kind::Shell { thickness } => c.positive("thickness", *thickness),
        Kind::WithLipschitz { lipschitz } => c.positive("lipschitz", *lipschitz),
        Kind::WithBounds { lo, hi } => c.bounds(lo, hi),
        Kind::Rotate { axis, .. } => c.direction("axis", axis),
        Kind::Scale { factors } => c.all_positive("factors", factors),
        Kind::Repeat { period, count } => c.repeat(period, count),
        Kind::Elongate { amount } => amount.iter().try_for_each(|v| c.not_negative("amount", *v)),
        Kind::Formula { lipschitz, lo, hi } => c.formula(children, lipschitz, lo, hi),
        _ => Ok(()),
    }
}

/// Every number finite and of a size that can be squared.
fn finite(op: &str, args: &[(&'static str, Value)]) -> Result<(), SceneError> {
    let fits = |v: &f64| v.abs() <= HUGE;
    for (name, value) in args {
        let ok = match value {
            Value::Num(v) => fits(v),
            Value::Vec3(v) => v.iter().all(fits),
            _ => true,
        };
        if !ok {
            return Err(SceneError::new(
                op,
                format!("`{name}` is {}, allowed: finite numbers up to {HUGE:e}", value.describe()),
            ));
        }
    }
    Ok(())
}

fn children_fit(kind: &Kind, children: &[Shape]) -> Result<(), SceneError> {
    let op = kind.op();
    let (least, most) = kind.arity();
    if children.len() < least || children.len() > most {
        let allowed = if least == most { format!("{least}") } else { format!("{least} or more") };
        return Err(SceneError::new(op, format!("got {} operands, allowed: {allowed}", children.len())));
    }
    for (i, child) in children.iter().enumerate() {
        let wants_expr = kind.is_expr() || matches!(kind, Kind::Formula { .. });
        let either = matches!(kind, Kind::Displace {}) && i == 1;
        if !either && child.is_expr() != wants_expr {
            let (got, allowed) = if wants_expr { ("shape", "expressions") } else { ("expression", "shapes") };
            return Err(SceneError::new(
                op,
                format!("operand {i} is a {got} (`{}`), allowed: {allowed}", child.op()),
            ));
        }
    }
    Ok(())
}

struct Check<'a> {
    op: &'a str,
}

impl Check<'_> {
    fn need(
        &self,
        ok: bool,
        name: &str,
        got: impl std::fmt::Display,
        allowed: &str,
    ) -> Result<(), SceneError> {
        if ok {
            Ok(())
        } else {
            Err(SceneError::new(self.op, format!("`{name}` is {got}, allowed: {allowed}")))
        }
    }
    fn positive(&self, name: &str, v: f64) -> Result<(), SceneError> {
        self.need(v > 0.0, name, v, "a finite number above 0")
    }
    fn not_negative(&self, name: &str, v: f64) -> Result<(), SceneError> {
        self.need(v >= 0.0, name, v, "a finite number of at least 0")
    }
    fn all_positive(&self, name: &str, v: &[f64; 3]) -> Result<(), SceneError> {
        self.need(v.iter().all(|v| *v > 0.0), name, format!("{v:?}"), "three finite numbers above 0")
    }
    fn direction(&self, name: &str, v: &[f64; 3]) -> Result<(), SceneError> {
        let len = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        self.need(len > 1e-150, name, format!("{v:?}"), "a vector that is not zero")
    }
    fn between(&self, name: &str, v: i64, lo: i64, hi: i64) -> Result<(), SceneError> {
        self.need((lo..=hi).contains(&v), name, v, &format!("a whole number from {lo} to {hi}"))
    }
    fn bounds(&self, lo: &[f64; 3], hi: &[f64; 3]) -> Result<(), SceneError> {
        self.need(
            (0..3).all(|i| lo[i] < hi[i]),
            "bounds",
            format!("{lo:?} to {hi:?}"),
            "lo below hi along each axis",
        )
    }
    fn repeat(&self, period: &[f64; 3], count: &Option<[i64; 3]>) -> Result<(), SceneError> {
        let ok = period.iter().all(|v| *v >= 0.0) && period.iter().any(|v| *v > 0.0);
        self.need(
            ok,
            "period",
            format!("{period:?}"),
            "numbers above 0, or 0 for an axis that is not repeated",
        )?;
        let ok = count.is_none_or(|c| c.iter().all(|v| (0..=1 << 20).contains(v)));
        self.need(ok, "count", format!("{count:?}"), "copies to each side: whole numbers from 0 to 1048576")
    }
    fn formula(
        &self,
        children: &[Shape],
        lipschitz: &Option<f64>,
        lo: &Option<[f64; 3]>,
        hi: &Option<[f64; 3]>,
    ) -> Result<(), SceneError> {
        if let Some(l) = lipschitz {
            self.positive("lipschitz", *l)?;
        }
        if !children[0].depends_on_point() {
            let message = "the formula is a constant, allowed: an expression of p.x, p.y or p.z";
            return Err(SceneError::new(self.op, message));
        }
        match (lo, hi) {
            (Some(lo), Some(hi)) => self.bounds(lo, hi),
            (None, None) => Ok(()),
            _ => Err(SceneError::new(self.op, "`bounds` needs both ends, got one")),
        }
    }
}
