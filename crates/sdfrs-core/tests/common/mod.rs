//! Shapes to test with: every op of the registry at least once, and random numbers that repeat.
#![allow(dead_code, clippy::unwrap_used, clippy::panic)]

use sdfrs_core::{Grid, GridValues, Program, Scratch, Shape, Value};

pub fn build(op: &str, args: &[(&str, Value)], children: &[&Shape]) -> Shape {
    let args = args.iter().map(|(n, v)| (n.to_string(), v.clone())).collect();
    Shape::build(op, args, children.iter().map(|s| (*s).clone()).collect()).unwrap()
}

pub fn num(v: f64) -> Value {
    Value::Num(v)
}

pub fn vec3(x: f64, y: f64, z: f64) -> Value {
    Value::Vec3([x, y, z])
}

pub fn moved(s: &Shape, x: f64, y: f64, z: f64) -> Shape {
    build("translate", &[("offset", vec3(x, y, z))], &[s])
}

/// A generator that gives the same numbers everywhere.
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    pub fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.unit()
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }
    pub fn vector(&mut self, lo: f64, hi: f64) -> Value {
        vec3(self.within(lo, hi), self.within(lo, hi), self.within(lo, hi))
    }
    pub fn point(&mut self, r: f64) -> [f64; 3] {
        [self.within(-r, r), self.within(-r, r), self.within(-r, r)]
    }
}

/// Field values in f64.
pub fn values(shape: &Shape, points: &[[f64; 3]]) -> Vec<f64> {
    let program = Program::<f64>::values(shape).unwrap();
    let p: [Vec<f64>; 3] = std::array::from_fn(|i| points.iter().map(|p| p[i]).collect());
    let mut out = vec![0.0; points.len()];
    program.evaluate(&mut Scratch::new(), [&p[0], &p[1], &p[2]], &mut out);
    out
}

/// A grid of samples of a distance to a sphere of radius 0.6.
pub fn grid(n: usize) -> Grid {
    let at = |i: usize| -1.0 + 2.0 * i as f64 / (n - 1) as f64;
    let mut v = Vec::new();
    for z in 0..n {
        for y in 0..n {
            for x in 0..n {
                v.push(((at(x).powi(2) + at(y).powi(2) + at(z).powi(2)).sqrt() - 0.6) as f32);
            }
        }
    }
    Grid::new(GridValues::F32(v.into()), [n; 3], [-1.0; 3], [1.0; 3]).unwrap()
}

pub fn primitives() -> Vec<(&'static str, Shape)> {
    let all: Vec<(&'static str, Vec<(&str, Value)>)> = vec![
        ("sphere", vec![("radius", num(0.9))]),
        ("box", vec![("size", vec3(1.0, 1.5, 0.7))]),
        ("rounded_box", vec![("size", vec3(1.0, 1.5, 0.7)), ("radius", num(0.2))]),
        ("torus", vec![("major", num(0.8)), ("minor", num(0.25))]),
        ("cylinder", vec![("radius", num(0.5)), ("height", num(1.4))]),
        ("capsule", vec![("a", vec3(-0.5, 0.1, 0.0)), ("b", vec3(0.4, 0.6, -0.3)), ("radius", num(0.3))]),
        ("cone", vec![("radius", num(0.8)), ("height", num(1.2)), ("top_radius", num(0.2))]),
        ("ellipsoid", vec![("radii", vec3(1.0, 0.5, 0.25))]),
        ("plane", vec![("normal", vec3(0.0, 2.0, 0.0)), ("point", vec3(0.0, -0.3, 0.0))]),
        ("gyroid", vec![("period", num(1.1)), ("thickness", num(0.1))]),
        ("mandelbulb", vec![("power", Value::Int(8)), ("iterations", Value::Int(6))]),
    ];
    let mut all: Vec<_> = all.into_iter().map(|(op, args)| (op, build(op, &args, &[]))).collect();
    all.push(("texture", Shape::texture(grid(9)).unwrap()));
    all
}

/// Every modifier and combinator over the given shapes.
pub fn combined(a: &Shape, b: &Shape) -> Vec<(&'static str, Shape)> {
    let x = build("x", &[], &[]);
    let wave = build("sin", &[], &[&build("mul", &[], &[&x, &build("const", &[("value", num(5.0))], &[])])]);
    let bump = build("mul", &[], &[&wave, &build("const", &[("value", num(0.05))], &[])]);
    let k = |k: f64| ("k", num(k));
    vec![
        ("union", build("union", &[k(0.0)], &[a, b])),
        ("union", build("union", &[k(0.3)], &[a, b, &moved(a, 0.4, 0.5, 0.1)])),
        ("intersection", build("intersection", &[k(0.0)], &[a, b])),
        ("intersection", build("intersection", &[k(0.2)], &[a, b])),
        ("difference", build("difference", &[k(0.0)], &[a, b])),
        ("difference", build("difference", &[k(0.2)], &[a, b])),
        ("negate", build("negate", &[], &[a])),
        ("dilate", build("dilate", &[("radius", num(0.15))], &[a])),
        ("dilate", build("dilate", &[("radius", num(-0.05))], &[a])),
        ("shell", build("shell", &[("thickness", num(0.1))], &[a])),
        ("displace", build("displace", &[], &[a, &bump])),
        ("with_lipschitz", build("with_lipschitz", &[("lipschitz", num(40.0))], &[a])),
        (
            "with_bounds",
            build("with_bounds", &[("lo", vec3(-9.0, -9.0, -9.0)), ("hi", vec3(9.0, 9.0, 9.0))], &[a]),
        ),
        ("translate", moved(a, 0.3, -0.2, 0.6)),
        ("rotate", build("rotate", &[("angle", num(0.7)), ("axis", vec3(1.0, 2.0, -0.5))], &[a])),
        ("scale", build("scale", &[("factors", vec3(1.7, 1.7, 1.7))], &[a])),
        ("scale", build("scale", &[("factors", vec3(1.5, 0.8, 1.1))], &[a])),
        ("mirror", build("mirror", &[("axis", Value::Text("x".into()))], &[&moved(a, 0.5, 0.0, 0.0)])),
        ("elongate", build("elongate", &[("amount", vec3(0.4, 0.0, 0.2))], &[a])),
        ("elongate", build("elongate", &[("amount", vec3(0.4, 0.1, 0.2))], &[a])),
        ("twist", build("twist", &[("rate", num(0.9))], &[a])),
        ("bend", build("bend", &[("rate", num(0.4))], &[a])),
    ]
}

/// Everything: primitives, and each combinator over bounded primitives of slope 1.
pub fn everything() -> Vec<(String, Shape)> {
    let mut all = Vec::new();
    let solids = primitives();
    for (name, s) in &solids {
        all.push((name.to_string(), s.clone()));
    }
    let exact = ["sphere", "box", "torus", "capsule", "cone", "texture", "ellipsoid"];
    let picked: Vec<_> = solids.iter().filter(|(n, _)| exact.contains(n)).collect();
    for (i, (name, a)) in picked.iter().enumerate() {
        let b = moved(&picked[(i + 1) % picked.len()].1, 0.3, 0.2, -0.1);
        for (op, s) in combined(a, &b) {
            all.push((format!("{op}({name})"), s));
        }
    }
    all
}
