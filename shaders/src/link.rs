//! The linker: declarations of several texts, those alone that the entry points reach.
//!
//! Drivers compile what they are given; a scene of ten ops needs a tenth of the library. WGSL allows
//! declarations in any order, so reachable ones are kept where they stand.

use std::{
    collections::{HashMap, HashSet},
    fmt,
};

/// A fault in the texts themselves.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinkError {
    /// Two declarations of one name.
    Twice(String),
    Missing(String),
    /// A bracket is left open.
    Unfinished(String),
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinkError::Twice(name) => write!(f, "`{name}` is declared twice"),
            LinkError::Missing(name) => write!(f, "there is no entry point `{name}`"),
            LinkError::Unfinished(text) => write!(f, "a declaration does not end: {text}"),
        }
    }
}

impl std::error::Error for LinkError {}

/// One text with everything that the entry points need.
pub fn link(parts: &[&str], entries: &[&str]) -> Result<String, LinkError> {
    let mut items = Vec::new();
    for part in parts {
        split(&without_comments(part), &mut items)?;
    }
    let mut by_name = HashMap::new();
    for (i, item) in items.iter().enumerate() {
        if by_name.insert(item.name.as_str(), i).is_some() {
            return Err(LinkError::Twice(item.name.clone()));
        }
    }
    let mut stack = Vec::new();
    for entry in entries {
        stack.push(*by_name.get(entry).ok_or_else(|| LinkError::Missing((*entry).to_owned()))?);
    }
    let mut kept: HashSet<usize> = stack.iter().copied().collect();
    while let Some(i) = stack.pop() {
        for word in words(&items[i].text) {
            if let Some(&j) = by_name.get(word)
                && kept.insert(j)
            {
                stack.push(j);
            }
        }
    }
    let mut out = String::new();
    for (i, item) in items.iter().enumerate() {
        if kept.contains(&i) {
            out.push_str(item.text.trim());
            out.push('\n');
        }
    }
    Ok(out)
}

/// A declaration.
struct Item {
    name: String,
    text: String,
}

fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for line in text.lines() {
        out.push_str(line.split("//").next().unwrap_or_default().trim_end());
        out.push('\n');
    }
    out
}

/// Cuts a text behind each `}` or `;` that no bracket encloses.
fn split(text: &str, items: &mut Vec<Item>) -> Result<(), LinkError> {
    let (mut depth, mut start) = (0usize, 0);
    for (i, c) in text.char_indices() {
        match c {
            '{' | '(' => depth += 1,
            '}' | ')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth == 0 && (c == '}' || c == ';') {
            let item = text[start..=i].trim();
            if let Some(name) = name(item) {
                items.push(Item { name, text: item.to_owned() });
            }
            start = i + 1;
        }
    }
    let rest = text[start..].trim();
    if rest.is_empty() { Ok(()) } else { Err(LinkError::Unfinished(rest.chars().take(60).collect())) }
}

/// The name that a declaration declares.
fn name(item: &str) -> Option<String> {
    let mut all = words(item);
    let keyword = all.find(|w| matches!(*w, "fn" | "struct" | "const" | "alias" | "override" | "var"))?;
    if keyword == "var" {
        // `var<storage, read> name: ..`: the name is the last word before the type or the value.
        let at = item.find("var")?;
        let head = item[at + 3..].split([':', '=']).next()?;
        return words(head.rsplit('>').next()?).next().map(str::to_owned);
    }
    all.next().map(str::to_owned)
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).filter(|w| !w.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: &str =
        "fn a() -> f32 { return b(1.0); } // calls b\nfn b(v: f32) -> f32 { return v; }\nfn c() {}\n";

    #[test]
    fn what_is_not_reached_is_left_out() {
        let text =
            link(&[A, "@group(0) @binding(1)\nvar<storage, read> data: array<f32>;\n"], &["a"]).unwrap();
        assert_eq!(text, "fn a() -> f32 { return b(1.0); }\nfn b(v: f32) -> f32 { return v; }\n");
        let uses = "fn d() -> f32 { return data[0]; }";
        let data = "@group(0) @binding(1)\nvar<storage, read> data: array<f32>;";
        assert!(link(&[uses, data], &["d"]).unwrap().contains(data));
        let private = "var<private> kept: f32 = 1.0;";
        assert!(link(&["fn e() { kept = 2.0; }", private], &["e"]).unwrap().contains(private));
    }

    #[test]
    fn faults_have_names() {
        assert_eq!(link(&[A, "struct b { x: f32 }"], &["a"]), Err(LinkError::Twice("b".into())));
        assert_eq!(link(&[A], &["z"]), Err(LinkError::Missing("z".into())));
        assert_eq!(link(&["fn q() { "], &["q"]), Err(LinkError::Unfinished("fn q() {".into())));
    }
}
