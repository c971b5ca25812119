//! Eight families of 1-Lipschitz fields along a ray, each with its exact first root.

use sdfrs_core::Scalar;

/// Every ray runs from 0 to here.
pub const T_MAX: f64 = 20.0;
pub const EPS: f64 = 1e-4;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    RandomSlopes,
    /// Dyadic knots and slopes of -1, 0 and 1: balls touch exactly, roots lie on dyadic points.
    Lattice,
    SpheresAndPlane,
    /// Nearly parallel planes, spheres barely hit or missed.
    Grazing,
    /// Zero at single points, positive on both sides.
    Sheets,
    /// Grows in front of the ray, then falls to a wall.
    Receding,
    /// Slabs of 0.02 to 10 eps.
    Slabs,
    /// Walls met at right angles, some behind a ledge that keeps the radius constant.
    HeadOn,
}

pub const FAMILIES: [Family; 8] = [
    Family::RandomSlopes,
    Family::Lattice,
    Family::SpheresAndPlane,
    Family::Grazing,
    Family::Sheets,
    Family::Receding,
    Family::Slabs,
    Family::HeadOn,
];

/// The field is the smallest of its parts.
#[derive(Debug, Clone)]
pub enum Part {
    /// (start, value at the start, slope) of each piece.
    Pieces(Vec<[f64; 3]>),
    Plane {
        height: f64,
        slope: f64,
    },
    Sphere {
        at: f64,
        beside: f64,
        radius: f64,
    },
    /// slope * (|z - at| - half); a sheet where half is 0.
    Slab {
        at: f64,
        half: f64,
        slope: f64,
    },
}

#[derive(Debug, Clone)]
pub struct Problem {
    pub family: Family,
    pub parts: Vec<Part>,
    /// Where the field first is 0 or less.
    pub root: Option<f64>,
    /// Where the solid that starts at the root ends.
    pub exit: f64,
}

impl Problem {
    fn new(family: Family, parts: Vec<Part>) -> Self {
        let (root, exit) = first_solid(&parts);
        Self { family, parts, root, exit }
    }

    pub fn value<T: Scalar>(&self, z: T) -> T {
        self.parts.iter().map(|part| part.value(z)).fold(T::INFINITY, |a, b| a.min(b))
    }
}

impl Part {
    fn value<T: Scalar>(&self, z: T) -> T {
        match self {
            Part::Pieces(pieces) => {
                let after = pieces.partition_point(|piece| T::of(piece[0]) <= z).max(1);
                let [start, value, slope] = pieces[after - 1].map(T::of);
                value + slope * (z - start)
            }
            Part::Plane { height, slope } => T::of(*height) + T::of(*slope) * z,
            // Rounded once: the law is about the tracer, not about a sphere's cancellation.
            Part::Sphere { at, beside, radius } => T::of((z.f64() - at).hypot(*beside) - radius),
            Part::Slab { at, half, slope } => T::of(*slope) * ((z - T::of(*at)).abs() - T::of(*half)),
        }
    }

    /// The intervals on which the part is 0 or less, in order.
    fn solids(&self) -> Vec<(f64, f64)> {
        match self {
            Part::Pieces(pieces) => pieces_solids(pieces),
            Part::Plane { height, slope } if *slope < 0.0 => vec![(-height / slope, f64::INFINITY)],
            Part::Plane { .. } => vec![],
            Part::Sphere { at, beside, radius } if beside <= radius => {
                let half = ((radius - beside) * (radius + beside)).sqrt();
                vec![(at - half, at + half)]
            }
            Part::Sphere { .. } => vec![],
            Part::Slab { at, half, .. } => vec![(at - half, at + half)],
        }
    }
}

fn pieces_solids(pieces: &[[f64; 3]]) -> Vec<(f64, f64)> {
    let mut solids = vec![];
    for (i, &[start, value, slope]) in pieces.iter().enumerate() {
        let end = pieces.get(i + 1).map_or(f64::INFINITY, |next| next[0]);
        let last = if end.is_finite() { value + slope * (end - start) } else { value };
        let crossing = start - value / slope;
        match (value <= 0.0, last <= 0.0) {
            (true, true) => solids.push((start, end)),
            (true, false) => solids.push((start, crossing.max(start))),
            (false, true) => solids.push((crossing.min(end), end)),
            (false, false) => {}
        }
    }
    solids
}

fn first_solid(parts: &[Part]) -> (Option<f64>, f64) {
    let mut solids: Vec<_> =
        parts.iter().flat_map(Part::solids).filter(|s| s.1 >= 0.0 && s.0 <= T_MAX).collect();
    solids.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(&(root, mut exit)) = solids.first() else {
        return (None, f64::INFINITY);
    };
    for &(from, to) in &solids {
        if from <= exit {
            exit = exit.max(to);
        }
    }
    (Some(root), exit)
}

/// SplitMix64: small, and the same rays on every machine.
pub struct Dice(pub u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Evenly spread exponents of ten.
    pub fn decades(&mut self, lo: f64, hi: f64) -> f64 {
        10f64.powf(self.between(lo, hi))
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    pub fn pick(&mut self, from: &[f64]) -> f64 {
        from[self.below(from.len())]
    }
}

/// As many problems of a family as asked for, each of them starting outside.
pub fn problems(family: Family, count: usize, seed: u64) -> Vec<Problem> {
    let mut dice = Dice(seed ^ ((family as u64) << 32));
    let mut found = Vec::with_capacity(count);
    while found.len() < count {
        let problem = Problem::new(family, parts(family, &mut dice));
        let settled = problem.root.is_none_or(|root| root < T_MAX - 1e-4);
        if problem.value(0.0) > 0.0 && settled {
            found.push(problem);
        }
    }
    found
}

fn parts(family: Family, dice: &mut Dice) -> Vec<Part> {
    match family {
        Family::RandomSlopes => vec![pieces(dice, |d| d.between(0.05, 2.0), |d| d.between(-1.0, 1.0))],
        Family::Lattice => {
            let start = dice.pick(&[0.25, 0.5, 1.0, 1.5, 2.0]);
            vec![walk(
                dice,
                start,
                |d| d.pick(&[0.25, 0.5, 1.0]),
                |d| d.pick(&[-1.0, -1.0, -0.5, 0.0, 0.5, 1.0]),
            )]
        }
        Family::SpheresAndPlane => spheres_and_plane(dice),
        Family::Grazing => vec![grazing(dice)],
        Family::Sheets => sheets(dice),
        Family::Receding => receding(dice),
        Family::Slabs => (0..1 + dice.below(3)).map(|_| slab(dice)).collect(),
        Family::HeadOn => head_on(dice),
    }
}

fn pieces(dice: &mut Dice, gap: impl Fn(&mut Dice) -> f64, slope: impl Fn(&mut Dice) -> f64) -> Part {
    let start = dice.between(0.05, 3.0);
    walk(dice, start, gap, slope)
}

fn walk(
    dice: &mut Dice,
    start: f64,
    gap: impl Fn(&mut Dice) -> f64,
    slope: impl Fn(&mut Dice) -> f64,
) -> Part {
    let (mut z, mut value) = (0.0, start);
    let mut pieces = vec![];
    while z <= T_MAX {
        let (width, s) = (gap(dice), slope(dice));
        pieces.push([z, value, s]);
        z += width;
        value += width * s;
    }
    pieces.push([z, value, 0.0]);
    Part::Pieces(pieces)
}

fn spheres_and_plane(dice: &mut Dice) -> Vec<Part> {
    let mut parts = vec![Part::Plane { height: dice.between(0.3, 3.0), slope: dice.between(-0.5, 0.1) }];
    for _ in 0..1 + dice.below(6) {
        let radius = dice.between(0.1, 1.5);
        parts.push(Part::Sphere { at: dice.between(1.0, 19.0), beside: dice.between(0.0, 3.0), radius });
    }
    parts
}

fn grazing(dice: &mut Dice) -> Part {
    if dice.below(2) == 0 {
        let radius = dice.between(0.5, 8.0);
        let beside = radius + dice.pick(&[-1.0, 1.0]) * dice.decades(-5.0, -1.0);
        return Part::Sphere { at: dice.between(9.0, 11.0), beside, radius };
    }
    let slope = dice.pick(&[-1.0, 0.0, 1.0]) * dice.decades(-3.0, -0.5);
    Part::Plane { height: dice.decades(-2.4, 0.5), slope }
}

/// Some rays start between two sheets, so that they first recede from one.
fn sheets(dice: &mut Dice) -> Vec<Part> {
    let (dyadic, between) = (dice.below(2) == 0, dice.below(2) == 0);
    let count = 1 + dice.below(4);
    (0..count + usize::from(between))
        .map(|i| {
            let (at, any) = (dice.between(0.1, 19.5), dice.between(0.2, 1.0));
            let at = if i == count { -0.1 * at } else { at };
            if dyadic {
                return Part::Slab { at: (at * 8.0).ceil() / 8.0, half: 0.0, slope: dice.pick(&[0.5, 1.0]) };
            }
            Part::Slab { at, half: 0.0, slope: dice.pick(&[1.0, any]) }
        })
        .collect()
}

fn receding(dice: &mut Dice) -> Vec<Part> {
    let (any, steep) = (dice.between(0.0, 1.0), dice.between(0.9, 1.0));
    let slope = dice.pick(&[0.0, 0.5, 1.0, any, steep]);
    let wall = dice.between(2.0, 18.0);
    vec![Part::Plane { height: dice.decades(-1.5, 0.3), slope }, Part::Plane { height: wall, slope: -1.0 }]
}

fn slab(dice: &mut Dice) -> Part {
    let half = 0.5 * EPS * dice.decades(0.02f64.log10(), 1.0);
    let tilted = dice.between(0.3, 1.0);
    let slope = dice.pick(&[1.0, tilted]);
    Part::Slab { at: dice.between(0.1, 19.5), half, slope }
}

fn head_on(dice: &mut Dice) -> Vec<Part> {
    let at = dice.between(0.5, 19.5);
    let at = if dice.below(2) == 0 { (at * 4.0).ceil() / 4.0 } else { at };
    let mut parts = vec![Part::Plane { height: at, slope: -1.0 }];
    if dice.below(2) == 0 {
        let any = dice.between(0.1, 2.0);
        parts.push(Part::Plane { height: dice.pick(&[0.125, 0.5, 1.0, any]), slope: 0.0 });
    }
    parts
}
