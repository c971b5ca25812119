//! Bounds of the field over a box, from the nodes of all cells that the box touches.

use super::{
    BRICK, Grid, Step, Stepping, Store, bricks_along,
    slope::{NODES, Rule},
};

impl Grid {
    /// Bounds of the field over a box given as `[lo, hi]` along each axis.
    pub fn range(&self, p: [[f64; 2]; 3], step: Step) -> (f64, f64) {
        let mut first = [0usize; 3];
        let mut last = [0usize; 3];
        let (mut near, mut far) = (0.0, 0.0);
        for a in 0..3 {
            let node = |v: f64| (v.clamp(self.lo[a], self.hi[a]) - self.lo[a]) / self.spacing[a];
            if p[a][0].is_nan() || p[a][1].is_nan() {
                return (f64::NEG_INFINITY, f64::INFINITY);
            }
            // One node more at both ends: the division rounds.
            first[a] = (node(p[a][0]).floor() as usize).saturating_sub(1);
            last[a] = (node(p[a][1]).ceil() as usize + 1).min(self.dims[a] - 1);
            let out = |v: f64| (self.lo[a] - v).max(v - self.hi[a]).max(0.0);
            let gap = (self.lo[a] - p[a][1]).max(p[a][0] - self.hi[a]).max(0.0);
            near += gap * gap;
            far += out(p[a][0]).max(out(p[a][1])).powi(2);
        }
        let (lo, hi) = self.nodes_range(first, last);
        let (lo, hi) = self.steps_range(lo, hi, step);
        let (near, far) = (near.sqrt(), far.sqrt());
        if far == 0.0 {
            return (lo, hi);
        }
        let outer = (near.max(lo - far), far.max(hi - near));
        if near > 0.0 { outer } else { (lo.min(outer.0), hi.max(outer.1)) }
    }

    /// Least and largest value of the nodes in a block; of sparse grids those of all bricks that it touches,
    /// whose values may differ on the walls they share.
    fn nodes_range(&self, first: [usize; 3], last: [usize; 3]) -> (f64, f64) {
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut see = |v: f64| (lo, hi) = (lo.min(v), hi.max(v));
        match &self.store {
            Store::Dense(values) => each(first, last, |[x, y, z]| {
                see(values.at(x + self.dims[0] * (y + self.dims[1] * z)));
            }),
            Store::Sparse(bricks) => {
                let count = bricks_along(self.dims);
                let low = [0, 1, 2].map(|a| (first[a].saturating_sub(1) / BRICK).min(count[a] - 1));
                let high = [0, 1, 2].map(|a| (last[a] / BRICK).min(count[a] - 1));
                each(low, high, |at| {
                    let i = at[0] + count[0] * (at[1] + count[1] * at[2]);
                    let Some(slot) = bricks.slot(i) else { return see(bricks.words()[i].value().into()) };
                    let from = [0, 1, 2].map(|a| first[a].max(at[a] * BRICK) - at[a] * BRICK);
                    let to = [0, 1, 2].map(|a| last[a].min(at[a] * BRICK + BRICK) - at[a] * BRICK);
                    each(from, to, |[x, y, z]| see(bricks.node(slot, x + NODES * (y + NODES * z))));
                });
            }
        }
        (lo, hi)
    }

    /// What the steps from values between `lo` and `hi` lie between.
    fn steps_range(&self, lo: f64, hi: f64, step: Step) -> (f64, f64) {
        let rule = Rule::<f64>::new(&self.slopes);
        let sign = match step {
            Step::Raw => return (lo, hi),
            Step::Safe => 1.0,
            Step::SafeNegated => -1.0,
        };
        let (a, b) = (rule.safe(lo * sign) * sign, rule.safe(hi * sign) * sign);
        if self.stepping == Stepping::Safe {
            return (a, b);
        }
        // A brick's rule reaches at most the value over its slope, and rule 1 with what its walls add.
        let least = self.slopes.bricks.iter().fold(self.slopes.top(), |m, v| m.min(*v));
        let most = |v: f64| v.abs() / f64::from(least);
        (
            if lo < 0.0 { -most(lo) } else { a.min(lo / self.slopes.a) },
            if hi > 0.0 { most(hi) } else { b.max(hi / self.slopes.a) },
        )
    }
}

/// Calls `f` for every place from `first` to `last`, both included.
fn each(first: [usize; 3], last: [usize; 3], mut f: impl FnMut([usize; 3])) {
    for z in first[2]..=last[2] {
        for y in first[1]..=last[1] {
            for x in first[0]..=last[0] {
                f([x, y, z]);
            }
        }
    }
}
