//! The scenes of the speed table.

use sdfrs_core::{Shape, Value};

use crate::{
    Scene,
    number::{Formula, Number},
};

/// A generator that gives the same numbers everywhere.
pub struct Random(pub u64);

impl Random {
    pub fn within(&mut self, lo: f64, hi: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        lo + (hi - lo) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
    }
}

pub fn all() -> Vec<Scene> {
    vec![sphere(), csg(), spheres(1000), gyroid(), mandelbulb(), raw()]
}

fn build(op: &str, args: &[(&str, Value)], children: Vec<Shape>) -> Shape {
    let args = args.iter().map(|(n, v)| (n.to_string(), v.clone())).collect();
    Shape::build(op, args, children).unwrap()
}
fn num(name: &str, v: f64) -> (&str, Value) {
    (name, Value::Num(v))
}
fn moved(s: Shape, by: [f64; 3]) -> Shape {
    build("translate", &[("offset", Value::Vec3(by))], vec![s])
}

#[inline(always)]
fn length<N: Number, const K: usize>(v: [N; K]) -> N {
    let mut sum = v[0].sq();
    for a in &v[1..] {
        sum = sum + a.sq();
    }
    sum.sqrt()
}
#[inline(always)]
fn shift<N: Number>([x, y, z]: &[N; 3], c: [f64; 3]) -> [N; 3] {
    [x.clone() - N::c(c[0]), y.clone() - N::c(c[1]), z.clone() - N::c(c[2])]
}

struct Ball;
impl Formula for Ball {
    #[inline(always)]
    fn at<N: Number>(&self, p: [N; 3]) -> N {
        length(p) - N::c(1.0)
    }
}

pub fn sphere() -> Scene {
    Scene::new("sphere", build("sphere", &[num("radius", 1.0)], vec![]), Ball)
}

/// Where the `i`-th of twelve primitives lies.
pub fn place(i: usize) -> [f64; 3] {
    let a = i as f64;
    [0.9 * (1.7 * a).sin(), 0.8 * (2.3 * a + 0.5).sin(), 0.9 * (1.1 * a + 1.0).cos()]
}

/// Three each of ball, box, torus and cylinder, joined, blended and cut in turn.
struct Csg([[f64; 3]; 12]);
impl Formula for Csg {
    #[inline(always)]
    fn at<N: Number>(&self, p: [N; 3]) -> N {
        let of = |i: usize| primitive(i, shift(&p, self.0[i]));
        let mut d = of(0);
        for i in [0, 4, 8] {
            d = if i > 0 { union(d, of(i)) } else { d };
            d = union(d, of(i + 1));
            d = blend(d, of(i + 2));
            d = cut(d, of(i + 3));
        }
        d
    }
}

#[inline(always)]
fn primitive<N: Number>(i: usize, [x, y, z]: [N; 3]) -> N {
    let zero = N::c(0.0);
    match i % 4 {
        0 => length([x, y, z]) - N::c(0.6),
        1 => {
            let [x, y, z] = [x.abs() - N::c(0.4), y.abs() - N::c(0.3), z.abs() - N::c(0.35)];
            let outside = length([x.most(&zero), y.most(&zero), z.most(&zero)]);
            outside + x.most(&y.most(&z)).least(&zero)
        }
        2 => length([length([x, z]) - N::c(0.5), y]) - N::c(0.15),
        _ => {
            let (dx, dy) = (length([x, z]) - N::c(0.25), y.abs() - N::c(0.7));
            dx.most(&dy).least(&zero) + length([dx.most(&zero), dy.most(&zero)])
        }
    }
}

#[inline(always)]
fn union<N: Number>(d: N, e: N) -> N {
    d.least(&e)
}
#[inline(always)]
fn blend<N: Number>(d: N, e: N) -> N {
    let h = (N::c(0.1) - (d.clone() - e.clone()).abs()).most(&N::c(0.0)) / N::c(0.1);
    d.least(&e) - h.sq() * N::c(0.1) * N::c(0.25)
}
#[inline(always)]
fn cut<N: Number>(d: N, e: N) -> N {
    d.most(&-e)
}

pub fn csg() -> Scene {
    let primitive = |i: usize| {
        let shape = match i % 4 {
            0 => build("sphere", &[num("radius", 0.6)], vec![]),
            1 => build("box", &[("size", Value::Vec3([0.8, 0.6, 0.7]))], vec![]),
            2 => build("torus", &[num("major", 0.5), num("minor", 0.15)], vec![]),
            _ => build("cylinder", &[num("radius", 0.25), num("height", 1.4)], vec![]),
        };
        moved(shape, place(i))
    };
    let mut shape = primitive(0);
    for i in 1..12 {
        let (op, k) = [("union", 0.0), ("union", 0.0), ("union", 0.1), ("difference", 0.0)][i % 4];
        shape = build(op, &[num("k", k)], vec![shape, primitive(i)]);
    }
    Scene::new("csg", shape, Csg(std::array::from_fn(place)))
}

struct Balls(Vec<[f64; 3]>, f64);
impl Formula for Balls {
    #[inline(always)]
    fn at<N: Number>(&self, p: [N; 3]) -> N {
        let r = N::c(self.1);
        let mut d = length(shift(&p, self.0[0])) - r.clone();
        for c in &self.0[1..] {
            d = d.least(&(length(shift(&p, *c)) - r.clone()));
        }
        d
    }
}

/// `n` balls in a cube; their volume stays the same whatever `n`.
pub fn spheres(n: usize) -> Scene {
    let mut random = Random(7);
    let r = 0.5 / (n as f64).cbrt();
    let at: Vec<[f64; 3]> = (0..n).map(|_| std::array::from_fn(|_| random.within(-1.5, 1.5))).collect();
    let ball = build("sphere", &[num("radius", r)], vec![]);
    let shape = build("union", &[num("k", 0.0)], at.iter().map(|c| moved(ball.clone(), *c)).collect());
    Scene::new(if n == 1000 { "spheres1000" } else { "spheres" }, shape, Balls(at, r))
}

struct Gyroid;
impl Formula for Gyroid {
    #[inline(always)]
    fn at<N: Number>(&self, p: [N; 3]) -> N {
        let freq = std::f64::consts::TAU;
        let [x, y, z] = p.map(|v| v * N::c(freq));
        let g = x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos();
        g.abs() * N::c(1.0 / (3f64.sqrt() * freq)) - N::c(0.05)
    }
}

pub fn gyroid() -> Scene {
    Scene::new("gyroid", build("gyroid", &[num("period", 1.0), num("thickness", 0.1)], vec![]), Gyroid)
}

#[inline(always)]
fn product<N: Number>(a: &(N, N), b: &(N, N)) -> (N, N) {
    let (ax, ay, bx, by) = (a.0.clone(), a.1.clone(), b.0.clone(), b.1.clone());
    (ax.clone() * bx.clone() - ay.clone() * by.clone(), ax * by + ay * bx)
}
#[inline(always)]
fn eighth<N: Number>(v: (N, N)) -> (N, N) {
    let mut v = v;
    for _ in 0..3 {
        v = product(&v, &v);
    }
    v
}

const ITERATIONS: usize = 4;

/// The Mandelbulb of power 8 without arc functions; `stop` freezes what has escaped, as the macro-op
/// does, else radii are clamped, so that nothing overflows.
struct Bulb {
    stop: bool,
}
impl Formula for Bulb {
    #[inline(always)]
    fn at<N: Number>(&self, [px, py, pz]: [N; 3]) -> N {
        let (one, two) = (N::c(1.0), N::c(2.0));
        // The pole is y.
        let (cx, cy, cz) = (pz, px, py);
        let (mut x, mut y, mut z, mut dr) = (cx.clone(), cy.clone(), cz.clone(), one.clone());
        let first = length([x.clone(), y.clone(), z.clone()]);
        let mut r = first.clone();
        for _ in 0..ITERATIONS {
            let rho = length([x.clone(), y.clone()]);
            let (pz, prho) = eighth((z.clone(), rho.clone()));
            let (pc, ps) = eighth((x.clone() / rho.clone(), y.clone() / rho));
            let r2 = r.sq();
            let r4 = r2.sq();
            let grown = r4 * r2 * r.clone() * N::c(8.0) * dr.clone() + one.clone();
            let (nx, ny, nz) = (prho.clone() * pc + cx.clone(), prho * ps + cy.clone(), pz + cz.clone());
            if self.stop {
                x = N::pick(&r, &two, &nx, &x);
                y = N::pick(&r, &two, &ny, &y);
                z = N::pick(&r, &two, &nz, &z);
                dr = N::pick(&r, &two, &grown, &dr);
                r = length([x.clone(), y.clone(), z.clone()]);
            } else {
                r = length([nx.clone(), ny.clone(), nz.clone()]);
                let s = (two.clone() / r.clone()).least(&one);
                (x, y, z, dr) = (nx * s.clone(), ny * s.clone(), nz * s.clone(), grown * s.clone());
                r = r * s;
            }
        }
        let inside = r.most(&N::c(1e-30));
        let estimate = N::c(0.5) * inside.ln() * r / dr;
        if self.stop {
            // The product's outer field, from radius 2 on.
            N::pick(&first, &two, &estimate, &(first.clone() - N::c(2.0 - std::f64::consts::LN_2)))
        } else {
            estimate
        }
    }
}

pub fn mandelbulb() -> Scene {
    let args = [("power", Value::Int(8)), ("iterations", Value::Int(ITERATIONS as i64))];
    Scene::new("mandelbulb", build("mandelbulb", &args, vec![]), Bulb { stop: true })
}

/// The same without the macro-op, as a user's formula.
pub fn raw() -> Scene {
    Scene::raw("raw maths", Bulb { stop: false })
}
