//! What is known of a node without evaluating it: Lipschitz bound, box, symmetry; by rule from its children.
//!
//! Law: `Shape::check` finds no violated bound, and no solid point outside the box (tests/laws).

mod aabb;
mod expr;
mod repeat;
mod swing;

pub use aabb::Aabb;
pub use expr::op_for;
pub use repeat::copies;

use super::{Kind, Shape, value::Axis};
use crate::{error::SceneError, lane::Iv};

/// What is known of a node.
#[derive(Debug, Clone)]
pub struct Meta {
    /// Bound of the slope of the values.
    pub lip: f64,
    /// Box that holds the solid.
    pub bounds: Aabb,
    /// The field is at least `reach` times the distance to the box: tells how far an offset can grow it.
    pub reach: f64,
    /// Bound of the slope against a turn about x, y, z (per radian), everywhere: what twisting costs.
    pub swing: [f64; 3],
    /// The field is even along an axis.
    pub even: [bool; 3],
    /// Values beyond this may be less than the field's, in jumps (sparse textures); infinite elsewhere.
    pub band: f64,
    /// Whether the value changes from point to point.
    pub moves: bool,
    /// Certified range of a formula's values.
    pub range: Iv,
    /// Coefficients of x, y, z and 1 where a formula is affine.
    pub affine: Option<[f64; 4]>,
}

impl Meta {
    fn solid(half: [f64; 3]) -> Self {
        Self { bounds: Aabb::centred(half), even: [true; 3], ..Self::unbounded() }
    }
    fn unbounded() -> Self {
        Self {
            lip: 1.0,
            bounds: Aabb::ALL,
            reach: 1.0,
            swing: [f64::INFINITY; 3],
            even: [false; 3],
            band: f64::INFINITY,
            moves: true,
            range: Iv::ALL,
            affine: None,
        }
    }
    fn steeper(mut self, factor: f64) -> Self {
        self.lip *= factor;
        self
    }
    /// The zero set becomes that of values up to `by`: there must be such.
    fn reaching(mut self, kind: &Kind, by: f64) -> Result<Self, SceneError> {
        if by > self.band {
            let message = format!(
                "reaches {by} from the surface, allowed: up to {}, beyond which a sparse texture in it keeps no \
                 values; bake it with a wider band",
                self.band
            );
            return Err(SceneError::new(kind.op(), message));
        }
        self.band -= by;
        Ok(self)
    }
    /// The zero set moves outwards by `by`, or the field falls by as much.
    fn grown(mut self, by: f64) -> Self {
        if by > 0.0 {
            self.bounds = self.bounds.grown(by / self.reach);
        }
        self
    }
}

pub fn meta(kind: &Kind, children: &[Shape]) -> Result<Meta, SceneError> {
    if kind.is_expr() {
        return Ok(expr::meta(kind, children));
    }
    let meta = match children {
        [] => primitive(kind),
        [child] => modifier(kind, child.meta().clone())?,
        _ => combinator(kind, children)?,
    };
    Ok(Meta { swing: swing::swing(kind, children, &meta.bounds), ..meta })
}

fn primitive(kind: &Kind) -> Meta {
    match kind {
        Kind::Sphere { radius } => Meta::solid([*radius; 3]),
        Kind::Box { size } | Kind::RoundedBox { size, .. } => Meta::solid(size.map(|v| v / 2.0)),
        Kind::Torus { major, minor } => Meta::solid([major + minor, *minor, major + minor]),
        Kind::Cylinder { radius, height } => Meta::solid([*radius, height / 2.0, *radius]),
        Kind::Cone { radius, height, top_radius } => {
            let r = radius.max(*top_radius);
            Meta { even: [true, radius == top_radius, true], ..Meta::solid([r, height / 2.0, r]) }
        }
        Kind::Ellipsoid { radii } => {
            let (least, most) = extremes(radii);
            Meta { reach: least / most, ..Meta::solid(*radii) }
        }
        Kind::Capsule { a, b, radius } => Meta {
            bounds: Aabb::of_points(&[*a, *b]).grown(*radius),
            even: std::array::from_fn(|i| {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                a[i] == -b[i] && (a[i] == 0.0 || (a[j] == b[j] && a[k] == b[k]))
            }),
            ..Meta::unbounded()
        },
        Kind::Plane { normal, point } => Meta {
            bounds: Aabb::below_plane(normal, point),
            even: normal.map(|n| n == 0.0),
            ..Meta::unbounded()
        },
        // The estimate is no certified distance; 0.2 is what it was seen to keep outside the box.
        Kind::Mandelbulb { power, .. } => {
            let r = mandelbulb_radius(*power);
            Meta { reach: 0.2, even: [false; 3], ..Meta::solid([r; 3]) }
        }
        Kind::Texture { grid } => {
            let (lo, hi) = grid.bounds();
            Meta { lip: grid.lipschitz(), bounds: Aabb { lo, hi }, band: grid.band(), ..Meta::unbounded() }
        }
        _ => Meta::unbounded(),
    }
}

/// Points farther out escape at once.
pub fn mandelbulb_radius(power: i64) -> f64 {
    2f64.powf(1.0 / (power as f64 - 1.0))
}

fn extremes(v: &[f64; 3]) -> (f64, f64) {
    (v.iter().fold(f64::INFINITY, |a, b| a.min(*b)), v.iter().fold(0.0, |a: f64, b| a.max(*b)))
}

fn modifier(kind: &Kind, mut m: Meta) -> Result<Meta, SceneError> {
    Ok(match kind {
        Kind::Negate {} => Meta { bounds: Aabb::ALL, ..m },
        Kind::Dilate { radius } => m.reaching(kind, radius.abs())?.grown(*radius),
        Kind::Shell { thickness } => m.reaching(kind, thickness / 2.0)?.grown(thickness / 2.0),
        Kind::WithLipschitz { lipschitz } => Meta { lip: *lipschitz, ..m },
        Kind::WithBounds { lo, hi } => Meta { bounds: Aabb { lo: *lo, hi: *hi }, reach: 0.0, ..m },
        Kind::Translate { offset } => {
            for i in 0..3 {
                m.even[i] &= offset[i] == 0.0;
            }
            Meta { bounds: m.bounds.shifted(offset), ..m }
        }
        Kind::Rotate { angle, axis } => {
            let along: [bool; 3] =
                std::array::from_fn(|i| axis[(i + 1) % 3] == 0.0 && axis[(i + 2) % 3] == 0.0);
            for i in 0..3 {
                m.even[i] &= along[i] || *angle == 0.0;
            }
            Meta { bounds: m.bounds.rotated(&crate::math::rotation(*angle, axis)), ..m }
        }
        Kind::Scale { factors } => {
            let (least, most) = extremes(factors);
            Meta {
                bounds: m.bounds.scaled(factors),
                reach: m.reach * least / most,
                band: m.band * least,
                ..m
            }
        }
        Kind::Mirror { axis } => {
            let i = *axis as usize;
            m.bounds.hi[i] = m.bounds.hi[i].max(0.0);
            m.bounds.lo[i] = -m.bounds.hi[i];
            m.even[i] = true;
            m
        }
        Kind::Elongate { amount } => {
            m.bounds = Aabb {
                lo: std::array::from_fn(|i| m.bounds.lo[i] - amount[i]),
                hi: std::array::from_fn(|i| m.bounds.hi[i] + amount[i]),
            };
            m.lip = m.lip.max(1.0);
            m
        }
        Kind::Repeat { period, count } => repeat::meta(m, period, count)?,
        Kind::Twist { rate } => {
            let h = turned(*rate, m.swing[1], m.lip) / 2.0;
            m.bounds = m.bounds.round(Axis::X, Axis::Z);
            m.even = [false; 3];
            m.steeper(h + (1.0 + h * h).sqrt())
        }
        Kind::Bend { rate } => {
            let h = turned(*rate, m.swing[2], m.lip);
            m.bounds = m.bounds.round(Axis::X, Axis::Y);
            m.even = [false, false, m.even[2]];
            m.steeper(1.0 + h)
        }
        Kind::Formula { lipschitz, lo, hi } => expr::formula(m, lipschitz, lo, hi)?,
        _ => m,
    })
}

/// Slope added by turning at `rate` radians a unit, relative to the field's own.
fn turned(rate: f64, swing: f64, lip: f64) -> f64 {
    if rate == 0.0 || swing == 0.0 {
        0.0
    } else if swing.is_finite() {
        rate.abs() * swing / lip
    } else {
        f64::INFINITY
    }
}

fn combinator(kind: &Kind, children: &[Shape]) -> Result<Meta, SceneError> {
    let all = || children.iter().map(Shape::meta);
    let most = |f: fn(&Meta) -> f64| all().map(f).fold(0.0, f64::max);
    let first = children[0].meta();
    let base = Meta {
        lip: most(|m| m.lip),
        reach: all().map(|m| m.reach).fold(1.0, f64::min),
        even: std::array::from_fn(|i| all().all(|m| m.even[i])),
        band: all().map(|m| m.band).fold(f64::INFINITY, f64::min),
        ..Meta::unbounded()
    };
    let base = match kind {
        Kind::Union { k } | Kind::Intersection { k } | Kind::Difference { k } => base.reaching(kind, *k)?,
        _ => base,
    };
    Ok(match kind {
        Kind::Union { k } => {
            let bounds = all().fold(first.bounds, |a, m| a.hull(&m.bounds));
            Meta { bounds, ..base }.grown((children.len() - 1) as f64 * k / 4.0)
        }
        Kind::Intersection { .. } => {
            let bounds = all().fold(first.bounds, |a, m| a.overlap(&m.bounds));
            // The distance to an overlap of boxes is at most sqrt(3) times the largest to any of them.
            let reach = all().find(|m| m.bounds == bounds).map_or(base.reach / 3f64.sqrt(), |m| m.reach);
            Meta { bounds, reach, ..base }
        }
        Kind::Difference { .. } => Meta { bounds: first.bounds, reach: first.reach, ..base },
        // Displacement: both slopes add up, and the solid grows by what the formula can take away.
        _ => {
            let by = children[1].meta();
            Meta { lip: first.lip + by.lip, even: [false; 3], ..first.clone() }.grown((-by.range.lo).max(0.0))
        }
    })
}
