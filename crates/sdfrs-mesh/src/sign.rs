//! Inside or outside.
//!
//! A closed mesh whose faces agree has one answer, and several ways to it; a damaged mesh has none, and the generalised
//! winding number (Jacobson, Kavan, Sorkine-Hornung, Robust inside-outside segmentation using generalized winding
//! numbers, 2013) is the best guess there: inside is where it exceeds 1/2.
//!
//! Law: on closed and on damaged meshes every rule that `Auto` picks agrees with the exact winding number
//! (`tests/signs.rs`). A mesh turned inside out, closed, is the one exception: its sign is that of its normals, so that
//! the space around it is solid, and `why` says so.

mod fast;
mod pseudo;
mod solid;
mod tree;
mod winding;

use crate::MeshError;
use crate::check::{Checked, Findings};
use pseudo::Pseudo;
use std::sync::OnceLock;
use winding::Winding;

/// How a node's sign is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SignRule {
    /// Pseudonormals for closed, oriented, manifold meshes, else winding numbers.
    #[default]
    Auto,
    Winding,
    Pseudonormal,
    Parity,
    /// Distances without a sign.
    Unsigned,
}

/// What the rule came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    Pseudonormal,
    Winding,
    Parity,
    Unsigned,
}

impl Method {
    pub fn name(self) -> &'static str {
        match self {
            Self::Pseudonormal => "pseudonormal",
            Self::Winding => "winding",
            Self::Parity => "parity",
            Self::Unsigned => "unsigned",
        }
    }
}

/// The face nearest to a point, and its point there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    pub face: u32,
    pub point: [f64; 3],
}

/// Tells inside from outside, in the unit frame. Ask from as many threads as you like.
pub struct Signs<'m> {
    mesh: &'m Checked,
    method: Method,
    why: String,
    pseudo: Option<Pseudo>,
    /// Made when it is first asked for.
    winding: OnceLock<Winding>,
}

impl<'m> Signs<'m> {
    pub fn new(mesh: &'m Checked, findings: &Findings, rule: SignRule) -> Result<Self, MeshError> {
        let (method, why) = choose(findings, rule);
        let pseudo = (method == Method::Pseudonormal).then(|| Pseudo::new(mesh));
        Ok(Self { mesh, method, why, pseudo, winding: OnceLock::new() })
    }

    pub fn method(&self) -> Method {
        self.method
    }

    /// What decided, in words for the report.
    pub fn why(&self) -> String {
        self.why.clone()
    }

    /// Whether `p` is inside; `nearest` is the face nearest to it.
    pub fn inside(&self, p: [f64; 3], nearest: Nearest) -> bool {
        match (&self.pseudo, self.method) {
            (Some(pseudo), _) => pseudo.inside(self.mesh, p, nearest.face),
            (None, Method::Unsigned) => false,
            (None, _) => {
                let mut out = [false];
                self.inside_many(&[p], &mut out);
                out[0]
            }
        }
    }

    /// Whether each of `points` is inside, for those who know no nearest face.
    pub fn inside_many(&self, points: &[[f64; 3]], out: &mut [bool]) {
        match self.method {
            Method::Unsigned => out.fill(false),
            _ => self.fast().inside_many(self.mesh, points, out),
        }
    }

    /// The exact generalised winding number, by all faces.
    pub fn winding(&self, p: [f64; 3]) -> f64 {
        solid::winding(self.mesh, p)
    }

    /// How sure the winding number is: 1 where it is at most 0 or at least 1, 0 where it is 1/2.
    pub fn confidence(&self, p: [f64; 3]) -> f64 {
        let mut out = [0.0];
        self.confidence_many(&[p], &mut out);
        out[0]
    }

    /// `confidence` of each of `points`.
    pub fn confidence_many(&self, points: &[[f64; 3]], out: &mut [f64]) {
        self.fast().confidence_many(self.mesh, points, out);
    }

    fn fast(&self) -> &Winding {
        self.winding.get_or_init(|| Winding::new(self.mesh))
    }
}

fn choose(findings: &Findings, rule: SignRule) -> (Method, String) {
    let named = |method: Method| (method, "asked for by name".to_owned());
    match rule {
        SignRule::Winding => named(Method::Winding),
        SignRule::Pseudonormal => named(Method::Pseudonormal),
        SignRule::Parity => named(Method::Parity),
        SignRule::Unsigned => named(Method::Unsigned),
        SignRule::Auto => match defects(findings) {
            None => (Method::Pseudonormal, "closed, oriented and manifold".to_owned()),
            Some(defects) => (Method::Winding, defects),
        },
    }
}

/// What forbids pseudonormals.
fn defects(f: &Findings) -> Option<String> {
    let all = [
        (f.boundary_edges, "open edges"),
        (f.nonmanifold_edges, "edges of more than two faces"),
        (f.nonmanifold_vertices, "vertices of more than one fan"),
        (f.misoriented_edges, "edges with faces that disagree"),
        (f.needle_faces, "faces without area dropped"),
    ];
    let found: Vec<String> =
        all.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
    (!found.is_empty()).then(|| found.join(", "))
}
