//! What a scene is to the pruner, or what is left of it in a ball.

use std::sync::Arc;

use super::ROUNDING;
use crate::{
    eval::Native,
    graph::INPUTS,
    op::{Ins, Op, Stock},
    tape::Tape,
};

/// What is known of an instruction's value.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known {
    pub(super) slope: f32,
    pub(super) size: f32,
    pub(super) everywhere: bool,
}

impl Known {
    /// What rounding may add to or take from a value in a cell whose points have coordinates up to `far`.
    pub(super) fn noise(&self, far: f32) -> f32 {
        ROUNDING * f32::EPSILON * (self.size + (1.0 + self.slope) * far)
    }
}

/// A program in which every instruction keeps a slot of its own, its number behind the point's coordinates:
/// a scene, or what is left of it in a ball.
#[derive(Debug)]
pub struct Part {
    pub(super) ins: Vec<Ins>,
    pub(super) consts: Vec<f64>,
    pub(super) known: Vec<Known>,
    pub(super) root: u32,
    /// Whether a repetition is in it.
    pub(super) folds: bool,
    /// The same, to be probed.
    pub(super) tape: Tape<f32>,
}

impl Part {
    pub fn blank() -> Self {
        let (ins, consts, known) = (Vec::new(), Vec::new(), Vec::new());
        Self { ins, consts, known, root: 0, folds: false, tape: Tape::blank() }
    }
    /// Operations for a point.
    pub fn ops(&self) -> u64 {
        self.tape.ops()
    }
    pub fn bytes(&self) -> usize {
        self.ins.capacity() * size_of::<Ins>()
            + self.consts.capacity() * size_of::<f64>()
            + self.known.capacity() * size_of::<Known>()
            + self.tape.bytes()
    }

    pub(super) fn known_of(&self, slot: u32) -> Known {
        match slot.checked_sub(INPUTS) {
            Some(i) => self.known[i as usize],
            None => Known { slope: 1.0, size: 0.0, everywhere: true },
        }
    }

    /// Up to where an instruction's operands have to keep their values, so that its own keep theirs up to `below`
    /// and none above comes down.
    pub(super) fn exact_below(&self, one: &Ins, below: f32) -> f32 {
        let constant = || self.consts[one.k as usize] as f32;
        match one.op {
            Op::Min | Op::Max | Op::Smax => below,
            // A blend differs from its smaller operand by a quarter of its radius, while the other is within it.
            Op::Smin => below + 1.25 * constant(),
            _ => f32::INFINITY,
        }
    }

    pub(super) fn clear(&mut self) {
        self.ins.clear();
        self.consts.clear();
        self.known.clear();
        self.folds = false;
    }

    /// Another instruction, and what is known of it.
    pub(super) fn push(&mut self, one: Ins, known: Known) {
        self.folds |= one.op == Op::Repeat;
        self.ins.push(one);
        self.known.push(known);
    }

    /// Makes the program to be probed from the instructions.
    pub(super) fn close(&mut self, stock: &Arc<Stock>) {
        let Self { ins, consts, root, tape, .. } = self;
        tape.rewrite(stock, |to, single| {
            to.extend_from_slice(ins);
            single.extend(consts.iter().map(|v| *v as f32));
            (ins.len() as u32 + INPUTS, *root)
        });
    }

    /// Slots given out anew, so that few are needed.
    pub(super) fn assemble<T: Native>(
        &self,
        memory: &mut Memory,
        ins: &mut Vec<Ins>,
        consts: &mut Vec<T>,
    ) -> (u32, u32) {
        let Memory { last, slot_of, free, .. } = memory;
        last.clear();
        last.resize(self.ins.len() + INPUTS as usize, u32::MAX);
        for (i, one) in self.ins.iter().enumerate() {
            for a in &one.a[..one.op.arity()] {
                last[*a as usize] = i as u32;
            }
        }
        last[self.root as usize] = u32::MAX;
        slot_of.clear();
        slot_of.extend(0..INPUTS);
        free.clear();
        let mut slots = INPUTS;
        for (i, one) in self.ins.iter().enumerate() {
            let mut to = *one;
            for (slot, a) in to.a.iter_mut().zip(&one.a[..one.op.arity()]) {
                *slot = slot_of[*a as usize];
            }
            // The first operand's slot last: it is the next one taken, so that chains of joins stay in one slot.
            for (n, a) in one.a[..one.op.arity()].iter().enumerate().rev() {
                // Given back once, and never a coordinate's: every chunk fills those afresh.
                let again = one.a[..n].contains(a);
                if *a >= INPUTS && last[*a as usize] == i as u32 && !again {
                    free.push(slot_of[*a as usize]);
                }
            }
            to.d = free.pop().unwrap_or_else(|| {
                slots += 1;
                slots - 1
            });
            slot_of.push(to.d);
            ins.push(to);
        }
        consts.extend(self.consts.iter().map(|v| T::of(*v)));
        (slots, slot_of[self.root as usize])
    }
}

/// What writing programs needs, kept from one to the next.
#[derive(Debug, Default)]
pub struct Memory {
    pub(super) last: Vec<u32>,
    pub(super) slot_of: Vec<u32>,
    pub(super) free: Vec<u32>,
    pub(super) live: Vec<bool>,
    /// The operand that an instruction always equals here.
    pub(super) same: Vec<u32>,
    /// Whether a repetition jumps inside the ball.
    pub(super) broken: Vec<bool>,
    /// Up to where an instruction's value has to be kept.
    pub(super) exact: Vec<f32>,
    /// Spheres of a crowd, and what is known of a union's.
    pub(super) near: Vec<u32>,
    pub(super) sifted: Vec<u8>,
}
