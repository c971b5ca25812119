//! Arguments as they come from Python or a file, and their conversion into the fields of a kind.

use crate::error::SceneError;

/// One argument.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    Num(f64),
    Int(i64),
    Vec3([f64; 3]),
    Ints3([i64; 3]),
    Text(String),
    None,
}

pub type Args = Vec<(String, Value)>;

impl Value {
    pub(super) fn describe(&self) -> String {
        match self {
            Value::Num(v) => format!("{v:?}"),
            Value::Int(v) => format!("{v}"),
            Value::Vec3(v) => format!("{v:?}"),
            Value::Ints3(v) => format!("{v:?}"),
            Value::Text(v) => format!("{v:?}"),
            Value::None => "nothing".into(),
        }
    }
}

/// A type that an argument can have.
pub trait Param: Sized {
    /// What is allowed, for the message.
    const EXPECTS: &'static str;
    fn from_value(v: &Value) -> Option<Self>;
    fn to_value(&self) -> Value;
}

impl Param for f64 {
    const EXPECTS: &'static str = "a number";
    fn from_value(v: &Value) -> Option<Self> {
        match v {
            Value::Num(v) => Some(*v),
            Value::Int(v) => Some(*v as f64),
            _ => None,
        }
    }
    fn to_value(&self) -> Value {
        Value::Num(*self)
    }
}

impl Param for i64 {
    const EXPECTS: &'static str = "a whole number";
    fn from_value(v: &Value) -> Option<Self> {
        match v {
            Value::Int(v) => Some(*v),
            _ => None,
        }
    }
    fn to_value(&self) -> Value {
        Value::Int(*self)
    }
}

impl Param for [f64; 3] {
    const EXPECTS: &'static str = "three numbers";
    fn from_value(v: &Value) -> Option<Self> {
        match v {
            Value::Vec3(v) => Some(*v),
            Value::Ints3(v) => Some(v.map(|v| v as f64)),
            _ => None,
        }
    }
    fn to_value(&self) -> Value {
        Value::Vec3(*self)
    }
}

impl Param for [i64; 3] {
    const EXPECTS: &'static str = "three whole numbers";
    fn from_value(v: &Value) -> Option<Self> {
        match v {
            Value::Ints3(v) => Some(*v),
            _ => None,
        }
    }
    fn to_value(&self) -> Value {
        Value::Ints3(*self)
    }
}

impl<P: Param> Param for Option<P> {
    const EXPECTS: &'static str = P::EXPECTS;
    fn from_value(v: &Value) -> Option<Self> {
        match v {
            Value::None => Some(None),
            v => P::from_value(v).map(Some),
        }
    }
    fn to_value(&self) -> Value {
        self.as_ref().map_or(Value::None, P::to_value)
    }
}

/// One of x, y, z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    X = 0,
    Y = 1,
    Z = 2,
}

impl Param for Axis {
    const EXPECTS: &'static str = "\"x\", \"y\" or \"z\"";
    fn from_value(v: &Value) -> Option<Self> {
        match v {
            Value::Text(v) if v == "x" => Some(Axis::X),
            Value::Text(v) if v == "y" => Some(Axis::Y),
            Value::Text(v) if v == "z" => Some(Axis::Z),
            _ => None,
        }
    }
    fn to_value(&self) -> Value {
        Value::Text(["x", "y", "z"][*self as usize].into())
    }
}

/// Takes one argument out of the list.
pub fn take<P: Param>(op: &str, args: &mut Args, name: &str) -> Result<P, SceneError> {
    let Some(at) = args.iter().position(|(n, _)| n == name) else {
        return P::from_value(&Value::None)
            .ok_or_else(|| SceneError::new(op, format!("`{name}` is missing, allowed: {}", P::EXPECTS)));
    };
    let (_, value) = args.swap_remove(at);
    P::from_value(&value).ok_or_else(|| {
        SceneError::new(op, format!("`{name}` is {}, allowed: {}", value.describe(), P::EXPECTS))
    })
}

/// Refuses what nobody asked for.
pub fn no_more(op: &str, args: &Args) -> Result<(), SceneError> {
    match args.first() {
        Some((name, _)) => Err(SceneError::new(op, format!("`{name}` is not an argument of {op}"))),
        None => Ok(()),
    }
}
