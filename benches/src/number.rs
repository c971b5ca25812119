//! What a formula by hand is written over: f32 for the scalar loop, fidget's trees, our formula steps.

use std::ops::{Add, Div, Mul, Neg, Sub};

use fidget::context::Tree;
use sdfrs_core::{Shape, Value};

pub trait Number:
    Clone + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    fn c(v: f64) -> Self;
    fn least(&self, o: &Self) -> Self;
    fn most(&self, o: &Self) -> Self;
    fn abs(&self) -> Self;
    fn sqrt(&self) -> Self;
    fn sin(&self) -> Self;
    fn cos(&self) -> Self;
    fn ln(&self) -> Self;
    /// `x` where `a < b`, else `y`.
    fn pick(a: &Self, b: &Self, x: &Self, y: &Self) -> Self;
    fn sq(&self) -> Self {
        self.clone() * self.clone()
    }
}

/// A scene written by hand.
pub trait Formula {
    fn at<N: Number>(&self, p: [N; 3]) -> N;
}

impl Number for f32 {
    #[inline(always)]
    fn c(v: f64) -> Self {
        v as f32
    }
    #[inline(always)]
    fn least(&self, o: &Self) -> Self {
        if self < o { *self } else { *o }
    }
    #[inline(always)]
    fn most(&self, o: &Self) -> Self {
        if self > o { *self } else { *o }
    }
    #[inline(always)]
    fn abs(&self) -> Self {
        f32::abs(*self)
    }
    #[inline(always)]
    fn sqrt(&self) -> Self {
        f32::sqrt(*self)
    }
    #[inline(always)]
    fn sin(&self) -> Self {
        f32::sin(*self)
    }
    #[inline(always)]
    fn cos(&self) -> Self {
        f32::cos(*self)
    }
    #[inline(always)]
    fn ln(&self) -> Self {
        f32::ln(*self)
    }
    #[inline(always)]
    fn pick(a: &Self, b: &Self, x: &Self, y: &Self) -> Self {
        if a < b { *x } else { *y }
    }
}

impl Number for Tree {
    fn c(v: f64) -> Self {
        // As the rivals see it: rounded to f32 once.
        Tree::constant(f64::from(v as f32))
    }
    fn least(&self, o: &Self) -> Self {
        self.min(o.clone())
    }
    fn most(&self, o: &Self) -> Self {
        self.max(o.clone())
    }
    fn abs(&self) -> Self {
        Tree::abs(self)
    }
    fn sqrt(&self) -> Self {
        Tree::sqrt(self)
    }
    fn sin(&self) -> Self {
        Tree::sin(self)
    }
    fn cos(&self) -> Self {
        Tree::cos(self)
    }
    fn ln(&self) -> Self {
        Tree::ln(self)
    }
    fn pick(a: &Self, b: &Self, x: &Self, y: &Self) -> Self {
        // fidget has no select: 1 where a < b, 0 elsewhere, and a blend that is exact for finite values.
        let on = (-a.compare(b.clone())).max(0.0);
        on.clone() * x.clone() + (1.0 - on) * y.clone()
    }
    fn sq(&self) -> Self {
        self.square()
    }
}

/// A step of one of our formulas.
#[derive(Clone)]
pub struct Expr(pub Shape);

impl Expr {
    fn step(op: &str, operands: &[&Expr]) -> Self {
        Self(Shape::build(op, Vec::new(), operands.iter().map(|e| e.0.clone()).collect()).unwrap())
    }
    pub fn coordinate(axis: &str) -> Self {
        Self::step(axis, &[])
    }
}

macro_rules! operators {
    ($($trait:ident $name:ident $op:literal),*) => {$(
        impl $trait for Expr {
            type Output = Self;
            fn $name(self, o: Self) -> Self {
                Expr::step($op, &[&self, &o])
            }
        }
    )*};
}
operators!(Add add "add", Sub sub "sub", Mul mul "mul", Div div "div");

impl Neg for Expr {
    type Output = Self;
    fn neg(self) -> Self {
        Expr::step("neg", &[&self])
    }
}

impl Number for Expr {
    fn c(v: f64) -> Self {
        Self(Shape::build("const", vec![("value".into(), Value::Num(v))], Vec::new()).unwrap())
    }
    fn least(&self, o: &Self) -> Self {
        Self::step("min", &[self, o])
    }
    fn most(&self, o: &Self) -> Self {
        Self::step("max", &[self, o])
    }
    fn abs(&self) -> Self {
        Self::step("abs", &[self])
    }
    fn sqrt(&self) -> Self {
        Self::step("sqrt", &[self])
    }
    fn sin(&self) -> Self {
        Self::step("sin", &[self])
    }
    fn cos(&self) -> Self {
        Self::step("cos", &[self])
    }
    fn ln(&self) -> Self {
        Self::step("log", &[self])
    }
    fn pick(a: &Self, b: &Self, x: &Self, y: &Self) -> Self {
        Self::step("select", &[a, b, x, y])
    }
    fn sq(&self) -> Self {
        Self::step("square", &[self])
    }
}
