//! fidget's JIT behind the few words that the benches need.

use fidget::{
    context::{Context, Tree},
    eval::{BulkEvaluator, Function, MathFunction, Tape},
    jit::JitFunction,
    var::Var,
};

use crate::number::Formula;

type Evaluator = <JitFunction as Function>::FloatSliceEval;

/// A compiled scene.
pub struct Jit {
    tape: <Evaluator as BulkEvaluator>::Tape,
    eval: Evaluator,
    /// Which coordinate each of the tape's variables is.
    axes: Vec<usize>,
}

impl Jit {
    pub fn new(formula: &impl Formula) -> Self {
        let tree = formula.at([Tree::x(), Tree::y(), Tree::z()]);
        let mut context = Context::new();
        let node = context.import(&tree);
        let function = JitFunction::new(&context, &[node]).unwrap();
        let tape = function.float_slice_tape(Default::default());
        let mut axes = vec![0; tape.vars().len()];
        for (axis, var) in [Var::X, Var::Y, Var::Z].iter().enumerate() {
            if let Some(at) = tape.vars().get(var) {
                axes[at] = axis;
            }
        }
        Self { tape, eval: JitFunction::new_float_slice_eval(), axes }
    }

    /// Shows the values at `p` to `look`: they live in the evaluator, nothing is copied.
    pub fn eval<R>(&mut self, p: [&[f32]; 3], look: impl FnOnce(&[f32]) -> R) -> R {
        let mut vars: [&[f32]; 3] = [&[]; 3];
        for (var, axis) in vars.iter_mut().zip(&self.axes) {
            *var = p[*axis];
        }
        let out = self.eval.eval(&self.tape, &vars[..self.axes.len()]).unwrap();
        look(&out[0])
    }
}
