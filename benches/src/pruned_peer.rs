//! fidget with its own pruning: tiles of 64 and 16 pixels, depth slabs, intervals, simplified tapes
//! compiled again. The strongest opponent of our pruned trace.
//!
//! A ray stays in the slab that its next sample lies in; a slab proven empty is stepped over.

use fidget::{
    context::{Context, Tree},
    eval::{BulkEvaluator, Function, MathFunction, Tape, TracingEvaluator},
    jit::JitFunction,
    types::Interval,
    var::{Var, VarMap},
};

use crate::{
    number::Formula,
    trace::{EPS, Line, MAX_STEPS, T_MAX, Totals},
};

type Ranges = <JitFunction as Function>::IntervalEval;
type Slices = <JitFunction as Function>::FloatSliceEval;

/// Pixels along the side of a tile, outer and inner.
pub const TILES: [usize; 2] = [64, 16];
const INNER: usize = TILES[1] * TILES[1];

pub struct Pruned {
    function: JitFunction,
    ranges: Ranges,
    slices: Slices,
}

/// Rays of an outer tile: the way gone (NaN where the ray has ended) and samples taken.
struct Wave<'a> {
    lines: &'a [Line],
    t: Vec<f32>,
    steps: Vec<u32>,
    totals: Totals,
}

impl Wave<'_> {
    fn any_before(&self, tile: std::ops::Range<usize>, end: f32) -> bool {
        self.t[tile].iter().any(|t| *t < end)
    }
    /// Nothing lies in front of `end`.
    fn skip(&mut self, tile: std::ops::Range<usize>, end: f32) {
        for t in &mut self.t[tile] {
            if *t < end {
                *t = if end > T_MAX { f32::NAN } else { end };
            }
        }
    }
    /// A box around the tile's rays between two depths.
    fn hull(&self, tile: std::ops::Range<usize>, from: f32, to: f32) -> [Interval; 3] {
        let lines = &self.lines[tile];
        std::array::from_fn(|a| {
            let (mut lo, mut hi) = (f32::INFINITY, f32::NEG_INFINITY);
            for line in lines {
                let (p, q) = (line.o[a] + from * line.d[a], line.o[a] + to * line.d[a]);
                (lo, hi) = (lo.min(p.min(q)), hi.max(p.max(q)));
            }
            Interval::new(lo, hi)
        })
    }
}

impl Pruned {
    pub fn new(formula: &impl Formula) -> Self {
        let tree = formula.at([Tree::x(), Tree::y(), Tree::z()]);
        let mut context = Context::new();
        let node = context.import(&tree);
        Self {
            function: JitFunction::new(&context, &[node]).unwrap(),
            ranges: JitFunction::new_interval_eval(),
            slices: JitFunction::new_float_slice_eval(),
        }
    }

    /// Rays in the order of [`crate::trace::nested`]; slabs of `depths` for the outer and the inner tiles.
    pub fn trace(&mut self, lines: &[Line], depths: [f32; 2]) -> Totals {
        let mut sum = Totals { hits: 0, steps: 0 };
        let outer = self.function.interval_tape(Default::default());
        for lines in lines.chunks(TILES[0] * TILES[0]) {
            let n = lines.len();
            let totals = Totals { hits: 0, steps: 0 };
            let mut wave = Wave { lines, t: vec![0.0; n], steps: vec![0; n], totals };
            let mut from = 0.0;
            while from <= T_MAX {
                let to = from + depths[0];
                if wave.any_before(0..n, to) {
                    let function = self.function.clone();
                    match self.simplified(&function, &outer, wave.hull(0..n, from, to)) {
                        None => wave.skip(0..n, to),
                        Some(kept) => self.inner(&kept, &mut wave, from..to, depths[1]),
                    }
                }
                from = to;
            }
            sum.hits += wave.totals.hits;
            sum.steps += wave.totals.steps;
        }
        sum
    }

    /// What is left of the function in a box; nothing where no surface can be.
    fn simplified(
        &mut self,
        function: &JitFunction,
        tape: &<Ranges as TracingEvaluator>::Tape,
        hull: [Interval; 3],
    ) -> Option<JitFunction> {
        let vars = ordered(tape.vars(), hull);
        let (out, trace) = self.ranges.eval(tape, &vars).unwrap();
        if out[0].lower() > EPS {
            return None;
        }
        Some(match trace {
            Some(trace) => function.simplify(trace, Default::default(), &mut Default::default()).unwrap(),
            None => function.clone(),
        })
    }

    fn inner(&mut self, function: &JitFunction, wave: &mut Wave, slab: std::ops::Range<f32>, depth: f32) {
        let tape = function.interval_tape(Default::default());
        for first in (0..wave.t.len()).step_by(INNER) {
            let tile = first..first + INNER;
            let mut from = slab.start;
            while from < slab.end {
                let to = (from + depth).min(slab.end);
                if wave.any_before(tile.clone(), to) {
                    match self.simplified(function, &tape, wave.hull(tile.clone(), from, to)) {
                        None => wave.skip(tile.clone(), to),
                        Some(kept) => self.march(&kept, wave, tile.clone(), to),
                    }
                }
                from = to;
            }
        }
    }

    /// Waves of a tile's rays until each has left the slab or ended.
    fn march(&mut self, function: &JitFunction, wave: &mut Wave, tile: std::ops::Range<usize>, end: f32) {
        let tape = function.float_slice_tape(Default::default());
        let mut p: [Vec<f32>; 3] = Default::default();
        let mut active: Vec<usize> = tile.filter(|k| wave.t[*k] < end).collect();
        while !active.is_empty() {
            for a in 0..3 {
                p[a].clear();
                p[a].extend(active.iter().map(|k| wave.lines[*k].at(wave.t[*k])[a]));
            }
            let vars = ordered(tape.vars(), [&p[0][..], &p[1], &p[2]]);
            let out = self.slices.eval(&tape, &vars).unwrap();
            wave.totals.steps += active.len() as u64;
            let mut kept = 0;
            for i in 0..active.len() {
                let (k, r) = (active[i], out[0][i]);
                wave.steps[k] += 1;
                let t = wave.t[k] + r;
                wave.totals.hits += usize::from(r < EPS);
                let over = r < EPS || !(t <= T_MAX) || wave.steps[k] == MAX_STEPS;
                wave.t[k] = if over { f32::NAN } else { t };
                active[kept] = k;
                kept += usize::from(wave.t[k] < end);
            }
            active.truncate(kept);
        }
    }
}

/// Coordinates in the order that a tape wants them.
fn ordered<T: Copy>(vars: &VarMap, p: [T; 3]) -> Vec<T> {
    let mut out = vec![p[0]; vars.len()];
    for (axis, var) in [Var::X, Var::Y, Var::Z].iter().enumerate() {
        if let Some(at) = vars.get(var) {
            out[at] = p[axis];
        }
    }
    out
}
