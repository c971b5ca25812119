//! Inside or outside.
//!
//! A closed mesh whose faces agree has one answer, and several ways to it; a damaged mesh has none, and the generalised
//! winding number (Jacobson, Kavan, Sorkine-Hornung, Robust inside-outside segmentation using generalized winding
//! numbers, 2013) is the best guess there: inside is where it exceeds 1/2.
//!
//! Law: on closed and on damaged meshes every rule that `Auto` picks agrees with the exact winding number
//! (`tests/signs.rs`). A mesh turned inside out, closed, is the one exception: its sign is that of its normals, so that
//! the space around it is solid, and `why` says so.

mod columns;
mod cross;
mod fast;
mod lines;
mod moments;
mod pseudo;
mod solid;
mod tree;
mod winding;

use crate::check::{Checked, Findings};
use crate::{MeshError, Pulse, Watch};
pub use columns::Columns;
use columns::Rule;
use lines::Lines;
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
    closed: bool,
    /// Closed, and turned inside out.
    inverted: bool,
    pseudo: Option<Pseudo>,
    // Made when they are first asked for.
    winding: OnceLock<Winding>,
    lines: OnceLock<Lines>,
}

impl<'m> Signs<'m> {
    pub fn new(mesh: &'m Checked, findings: &Findings, rule: SignRule) -> Result<Self, MeshError> {
        Self::until(mesh, findings, rule, &())
    }

    /// The same, given up when the watch says so; with all that the rule needs, which `new` makes when it is asked for.
    pub fn until(
        mesh: &'m Checked,
        findings: &Findings,
        rule: SignRule,
        watch: &dyn Watch,
    ) -> Result<Self, MeshError> {
        let closed = findings.closed() && findings.needle_faces == 0;
        let (method, why) = choose(mesh, findings, rule, watch)?;
        let mut pulse = Pulse::new(watch);
        let pseudo = match method {
            Method::Pseudonormal => Some(Pseudo::new(mesh, &mut pulse)?),
            _ => None,
        };
        Ok(Self {
            mesh,
            method,
            why,
            closed,
            inverted: closed && findings.signed_volume < 0.0 && method == Method::Pseudonormal,
            pseudo,
            winding: OnceLock::new(),
            lines: OnceLock::new(),
        })
    }

    /// Makes what takes a while now rather than when it is first asked for, given up when the watch says so.
    pub fn prepare(&self, watch: &dyn Watch) -> Result<(), MeshError> {
        // Another thread may have been faster.
        match self.method {
            Method::Winding if self.winding.get().is_none() => {
                let _ = self.winding.set(Winding::new(self.mesh, watch)?);
            }
            Method::Parity if self.lines.get().is_none() => {
                let _ = self.lines.set(Lines::new(self.mesh, watch)?);
            }
            _ => {}
        }
        Ok(())
    }

    /// The same for `confidence_many`.
    pub fn prepare_confidence(&self, watch: &dyn Watch) -> Result<(), MeshError> {
        if !self.closed && self.winding.get().is_none() {
            let _ = self.winding.set(Winding::new(self.mesh, watch)?);
        }
        Ok(())
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
        if let Some(pseudo) = &self.pseudo {
            return pseudo.inside(self.mesh, p, nearest.face);
        }
        let mut out = [false];
        self.inside_many(&[p], &mut out);
        out[0]
    }

    /// Whether each of `points` is inside, for those who know no nearest face.
    pub fn inside_many(&self, points: &[[f64; 3]], out: &mut [bool]) {
        match (self.method, &self.pseudo) {
            (Method::Unsigned, _) => out.fill(false),
            (Method::Parity, _) => {
                let lines = self.lines.get_or_init(|| Lines::new(self.mesh, &()).unwrap_or_default());
                for (p, out) in points.iter().zip(out) {
                    *out = lines.inside(self.mesh, *p);
                }
            }
            (_, Some(pseudo)) => {
                for (p, out) in points.iter().zip(out) {
                    *out = pseudo.inside(self.mesh, *p, self.nearest(*p).face);
                }
            }
            _ => self.fast().inside_many(self.mesh, points, out),
        }
    }

    /// The signs of a whole grid at once: nodes by their coordinates in the unit frame, rising along each axis. Nothing
    /// where the method has no whole numbers (an open mesh), or where it would take more than `budget` bytes.
    pub fn columns(&self, axes: [&[f64]; 3], budget: u64) -> Option<Columns> {
        self.columns_until(axes, budget, &()).ok().flatten()
    }

    /// The same, given up when the watch says so.
    pub fn columns_until(
        &self,
        axes: [&[f64]; 3],
        budget: u64,
        watch: &dyn Watch,
    ) -> Result<Option<Columns>, MeshError> {
        let rule = match self.method {
            Method::Unsigned => return Ok(None),
            Method::Parity => Rule::Odd,
            _ if !self.closed => return Ok(None),
            // Around a mesh turned inside out, 0 is inside.
            _ => Rule::AtLeast(i32::from(!self.inverted)),
        };
        Columns::new(self.mesh, axes, rule, budget, watch)
    }

    /// The face nearest to `p`, in f64.
    pub fn nearest(&self, p: [f64; 3]) -> Nearest {
        self.fast().nearest(self.mesh, p)
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
        if self.closed {
            // A whole number is never near 1/2.
            out.fill(1.0);
        } else {
            self.fast().confidence_many(self.mesh, points, out);
        }
    }

    fn fast(&self) -> &Winding {
        // Whom nobody watches, nobody stops.
        self.winding.get_or_init(|| Winding::new(self.mesh, &()).unwrap_or_default())
    }
}

fn choose(
    mesh: &Checked,
    findings: &Findings,
    rule: SignRule,
    watch: &dyn Watch,
) -> Result<(Method, String), MeshError> {
    let named = |method: Method| Ok((method, "asked for by name".to_owned()));
    match rule {
        SignRule::Winding => named(Method::Winding),
        SignRule::Pseudonormal => named(Method::Pseudonormal),
        SignRule::Parity => named(Method::Parity),
        SignRule::Unsigned => named(Method::Unsigned),
        SignRule::Auto => match defects(findings) {
            Some(defects) => Ok((Method::Winding, defects)),
            None => whole(mesh, findings, watch),
        },
    }
}

/// Closed, oriented and manifold: are pseudonormals right? Not where parts overlap, or lie in one another with the same
/// orientation. The winding numbers along a grid's columns tell; an overlap that slips between them all is too small to
/// matter more than a few nodes.
fn whole(mesh: &Checked, findings: &Findings, watch: &dyn Watch) -> Result<(Method, String), MeshError> {
    const FORM: &str = "closed, oriented and manifold";
    let fine = (2.0 * mesh.faces.len() as f64).sqrt().clamp(64.0, 256.0) as usize;
    // Off the middle, and not by the same share: nodes mustn't lie on the edges of symmetrical meshes.
    let axis = |n: usize, off: f64| -> Vec<f64> {
        (0..n).map(|i| 2.0 * (i as f64 + off) / n as f64 - 1.0).collect()
    };
    let axes = [axis(fine, 0.4871), axis(fine, 0.5213), axis(512, 0.5)];
    let inverted = findings.signed_volume < 0.0;
    Ok(match columns::extremes(mesh, [&axes[0], &axes[1], &axes[2]], 1 << 28, watch)? {
        Some((0, 0 | 1)) if !inverted => (Method::Pseudonormal, FORM.to_owned()),
        Some((-1 | 0, 0)) if inverted => {
            let note = "its faces point inwards, so all around it is inside; turn the faces round if that isn't meant";
            (Method::Pseudonormal, format!("{FORM}, but {note}"))
        }
        Some((least, most)) => {
            let note = format!("its parts overlap or disagree (winding numbers from {least} to {most})");
            (Method::Winding, format!("{FORM}, but {note}"))
        }
        None => (Method::Winding, format!("{FORM}, but too tangled to look for overlaps")),
    })
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
