//! JSON without its loose ends: no duplicate keys, no NaN, bounded size and depth, and a path in
//! every error. Numbers keep their bits: the shortest text that reads back the same is written.

use std::cell::{Cell, RefCell};
use std::fmt::Write;

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};

use crate::error::FormatError;

/// Longest text accepted.
pub const MAX_BYTES: usize = 1 << 30;
/// Most values of all kinds in one text; a short text can't ask for a hundred times its size.
const MAX_VALUES: u64 = 1 << 27;
/// Most keys of one object; duplicates are looked for one by one.
const MAX_KEYS: usize = 64;

/// A JSON value; objects keep the order of their keys.
#[derive(Debug, Clone, PartialEq)]
pub enum Json {
    Null,
    Bool(bool),
    Int(i64),
    Num(f64),
    Text(String),
    List(Vec<Json>),
    Object(Vec<(String, Json)>),
}

impl Json {
    /// Reads a whole text; the error's path leads to the value that could not be read.
    pub fn parse(text: &str) -> Result<Json, FormatError> {
        if text.len() > MAX_BYTES {
            let message = format!("the file has {} bytes, allowed: up to {MAX_BYTES}", text.len());
            return Err(FormatError::new("file", message));
        }
        let reader = Reader { trail: RefCell::default(), values: Cell::new(0) };
        let mut source = serde_json::Deserializer::from_str(text);
        let value = Tree(&reader).deserialize(&mut source);
        value
            .and_then(|v| source.end().map(|()| v))
            .map_err(|e| FormatError::new(reader.path(), e.to_string()))
    }

    /// Three numbers as a list.
    pub fn vec3(v: [f64; 3]) -> Json {
        Json::List(v.map(Json::Num).into())
    }

    pub fn text(v: impl Into<String>) -> Json {
        Json::Text(v.into())
    }

    /// An object from its keys, in their order.
    pub fn object(fields: impl IntoIterator<Item = (&'static str, Json)>) -> Json {
        Json::Object(fields.into_iter().map(|(k, v)| (k.to_owned(), v)).collect())
    }

    /// The value on one line.
    pub fn to_line(&self) -> String {
        let mut out = String::new();
        self.write(&mut out);
        out
    }

    fn write(&self, out: &mut String) {
        match self {
            Json::Null => out.push_str("null"),
            Json::Bool(v) => out.push_str(if *v { "true" } else { "false" }),
            // Writing to a String can't fail. `{:?}` is the shortest text that reads back the same.
            Json::Int(v) => _ = write!(out, "{v}"),
            Json::Num(v) if v.is_finite() => _ = write!(out, "{v:?}"),
            Json::Num(_) => out.push_str("null"),
            Json::Text(v) => quote(v, out),
            Json::List(v) => {
                out.push('[');
                for (i, item) in v.iter().enumerate() {
                    out.push_str(if i == 0 { "" } else { ", " });
                    item.write(out);
                }
                out.push(']');
            }
            Json::Object(v) => {
                out.push('{');
                for (i, (key, item)) in v.iter().enumerate() {
                    out.push_str(if i == 0 { "" } else { ", " });
                    quote(key, out);
                    out.push_str(": ");
                    item.write(out);
                }
                out.push('}');
            }
        }
    }

    /// What it is, for a message; long values are cut.
    pub fn describe(&self) -> String {
        let whole = match self {
            Json::List(v) => return format!("a list of {}", v.len()),
            Json::Object(_) => return "an object".into(),
            Json::Text(v) if v.len() > 100 => return format!("a text of {} bytes", v.len()),
            other => other.to_line(),
        };
        if matches!(self, Json::Text(_)) { format!("the text {whole}") } else { whole }
    }

    fn wrong<T>(&self, path: &str, allowed: &str) -> Result<T, FormatError> {
        Err(FormatError::new(path, format!("got {}, allowed: {allowed}", self.describe())))
    }

    pub fn as_number(&self, path: &str) -> Result<f64, FormatError> {
        match self {
            Json::Num(v) => Ok(*v),
            Json::Int(v) => Ok(*v as f64),
            _ => self.wrong(path, "a number"),
        }
    }

    /// A whole number from 0 to `most`.
    pub fn as_count(&self, path: &str, most: u64) -> Result<u64, FormatError> {
        match self {
            Json::Int(v) if u64::try_from(*v).is_ok_and(|v| v <= most) => Ok(*v as u64),
            _ => self.wrong(path, &format!("a whole number from 0 to {most}")),
        }
    }

    pub fn as_text(&self, path: &str) -> Result<&str, FormatError> {
        match self {
            Json::Text(v) => Ok(v),
            _ => self.wrong(path, "a text"),
        }
    }

    pub fn as_list(&self, path: &str) -> Result<&[Json], FormatError> {
        match self {
            Json::List(v) => Ok(v),
            _ => self.wrong(path, "a list"),
        }
    }

    pub fn as_vec3(&self, path: &str) -> Result<[f64; 3], FormatError> {
        let Json::List(list) = self else { return self.wrong(path, "a list of three numbers") };
        let [x, y, z] = list.as_slice() else { return self.wrong(path, "a list of three numbers") };
        Ok([
            x.as_number(&format!("{path}[0]"))?,
            y.as_number(&format!("{path}[1]"))?,
            z.as_number(&format!("{path}[2]"))?,
        ])
    }
}

/// The keys of an object, taken one by one; what is left over is refused.
pub struct Fields<'a> {
    path: String,
    rest: Vec<(&'a str, &'a Json)>,
}

impl<'a> Fields<'a> {
    pub fn of(json: &'a Json, path: &str) -> Result<Self, FormatError> {
        let Json::Object(fields) = json else {
            return json.wrong(if path.is_empty() { "file" } else { path }, "an object");
        };
        Ok(Self { path: path.to_owned(), rest: fields.iter().map(|(k, v)| (k.as_str(), v)).collect() })
    }

    /// Where a key of this object is.
    pub fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    pub fn optional(&mut self, key: &str) -> Option<(&'a Json, String)> {
        let at = self.rest.iter().position(|(k, _)| *k == key)?;
        Some((self.rest.swap_remove(at).1, self.path_of(key)))
    }

    pub fn required(&mut self, key: &str) -> Result<(&'a Json, String), FormatError> {
        self.optional(key)
            .ok_or_else(|| FormatError::new(self.path_of(key), "missing, and there is no default"))
    }

    /// Refuses what has not been taken.
    pub fn finish(self, allowed: &str) -> Result<(), FormatError> {
        match self.rest.first() {
            Some((key, _)) => {
                Err(FormatError::new(self.path_of(&cut(key)), format!("unknown key, allowed: {allowed}")))
            }
            None => Ok(()),
        }
    }
}

/// A key from a file, short enough for a message.
pub(super) fn cut(key: &str) -> String {
    key.chars().take(60).collect()
}

fn quote(text: &str, out: &mut String) {
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c < ' ' => _ = write!(out, "\\u{:04x}", u32::from(c)),
            c => out.push(c),
        }
    }
    out.push('"');
}

/// Shared by the whole parse: how to name the place of an error, and how much has been read.
struct Reader {
    /// From the innermost step outwards; filled only while an error travels up.
    trail: RefCell<Vec<String>>,
    values: Cell<u64>,
}

impl Reader {
    fn note<E>(&self, step: impl FnOnce() -> String) -> impl FnOnce(E) -> E {
        move |error| {
            self.trail.borrow_mut().push(step());
            error
        }
    }

    fn path(&self) -> String {
        let trail = self.trail.borrow();
        let mut path = String::new();
        for (depth, step) in trail.iter().rev().enumerate() {
            if depth == 8 {
                path.push_str("...");
                break;
            }
            path.push_str(if path.is_empty() { step.trim_start_matches('.') } else { step });
        }
        if path.is_empty() { "file".into() } else { path }
    }
}

struct Tree<'r>(&'r Reader);

impl<'de> DeserializeSeed<'de> for Tree<'_> {
    type Value = Json;
    fn deserialize<D: Deserializer<'de>>(self, source: D) -> Result<Json, D::Error> {
        source.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Tree<'_> {
    type Value = Json;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("a JSON value")
    }
    fn visit_unit<E: Error>(self) -> Result<Json, E> {
        self.0.counted(Json::Null)
    }
    fn visit_bool<E: Error>(self, v: bool) -> Result<Json, E> {
        self.0.counted(Json::Bool(v))
    }
    fn visit_i64<E: Error>(self, v: i64) -> Result<Json, E> {
        self.0.counted(Json::Int(v))
    }
    fn visit_u64<E: Error>(self, v: u64) -> Result<Json, E> {
        self.0.counted(i64::try_from(v).map_or(Json::Num(v as f64), Json::Int))
    }
    fn visit_f64<E: Error>(self, v: f64) -> Result<Json, E> {
        if v.is_finite() { self.0.counted(Json::Num(v)) } else { Err(E::custom("number out of range")) }
    }
    fn visit_str<E: Error>(self, v: &str) -> Result<Json, E> {
        self.0.counted(Json::Text(v.to_owned()))
    }
    fn visit_string<E: Error>(self, v: String) -> Result<Json, E> {
        self.0.counted(Json::Text(v))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Json, A::Error> {
        let mut list = Vec::new();
        loop {
            let next =
                items.next_element_seed(Tree(self.0)).map_err(self.0.note(|| format!("[{}]", list.len())))?;
            match next {
                Some(value) => list.push(value),
                None => return self.0.counted(Json::List(list)),
            }
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, mut items: A) -> Result<Json, A::Error> {
        let mut object: Vec<(String, Json)> = Vec::new();
        while let Some(key) = items.next_key::<String>()? {
            if object.iter().any(|(k, _)| *k == key) {
                return Err(self.0.note(|| format!(".{}", cut(&key)))(A::Error::custom(
                    "this key occurs twice",
                )));
            }
            if object.len() == MAX_KEYS {
                return Err(A::Error::custom(format!("an object of more keys than allowed: {MAX_KEYS}")));
            }
            let value =
                items.next_value_seed(Tree(self.0)).map_err(self.0.note(|| format!(".{}", cut(&key))))?;
            object.push((key, value));
        }
        self.0.counted(Json::Object(object))
    }
}

impl Reader {
    fn counted<E: Error>(&self, value: Json) -> Result<Json, E> {
        self.values.set(self.values.get() + 1);
        if self.values.get() > MAX_VALUES {
            return Err(E::custom(format!("more values than allowed: {MAX_VALUES}")));
        }
        Ok(value)
    }
}

#[cfg(test)]
mod tests;
