//! The winding number at three prices: a guess in lanes, a careful one where that is near 1/2 or not sure, the exact one
//! where the careful one is as near to 1/2 as its own error.

use super::Nearest;
use super::fast::{self, Guess};
use super::solid::{self, Rim};
use super::tree::Tree;
use crate::check::Checked;
use crate::{MeshError, Pulse, Watch};

/// Guesses this near to 1/2 are looked at again; their largest error is a fifth of that.
const NEAR: f64 = 0.05;
/// The same for careful ones, whose error is at most a tenth.
const NEARER: f64 = 0.005;

#[derive(Default)]
pub struct Winding {
    tree: Tree,
    rim: Rim,
}

impl Winding {
    pub fn new(mesh: &Checked, watch: &dyn Watch) -> Result<Self, MeshError> {
        let rim = || Rim::new(mesh, &mut Pulse::new(watch));
        let (tree, rim) = rayon::join(|| Tree::new(mesh, watch), rim);
        Ok(Self { tree: tree?, rim: rim? })
    }

    pub fn inside_many(&self, mesh: &Checked, points: &[[f64; 3]], out: &mut [bool]) {
        fast::guess(&self.tree, points, &mut |i, Guess { winding, sure }| {
            out[i] = if sure && (winding - 0.5).abs() >= NEAR {
                winding > 0.5
            } else {
                self.slow(mesh, points[i])
            };
        });
    }

    /// How far from 1/2, on a scale of 0 to 1.
    pub fn confidence_many(&self, mesh: &Checked, points: &[[f64; 3]], out: &mut [f64]) {
        fast::guess(&self.tree, points, &mut |i, Guess { winding, sure }| {
            let winding = if sure {
                winding
            } else {
                // On a face itself both sides are as good.
                fast::careful(&self.tree, mesh, points[i]).unwrap_or(0.5)
            };
            out[i] = (2.0 * winding - 1.0).abs().min(1.0);
        });
    }

    pub fn nearest(&self, mesh: &Checked, p: [f64; 3]) -> Nearest {
        self.tree.nearest(mesh, p)
    }

    #[cold]
    fn slow(&self, mesh: &Checked, p: [f64; 3]) -> bool {
        // A point on a face is as little inside as outside.
        let Some(careful) = fast::careful(&self.tree, mesh, p) else { return false };
        if (careful - 0.5).abs() >= NEARER {
            return careful > 0.5;
        }
        let by_rim = (self.rim.len() < mesh.faces.len()).then(|| self.rim.exact(p, careful)).flatten();
        by_rim.unwrap_or_else(|| solid::winding(mesh, p)) > 0.5
    }
}
