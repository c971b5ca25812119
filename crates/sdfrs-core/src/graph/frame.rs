//! Frames: where a part of the scene lies, as coordinates plus an affine map not yet computed.

use std::collections::HashMap;

use super::Graph;
use crate::{error::SceneError, math::Matrix, op::Op};

const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Local point = `m * base + t`.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    pub base: [u32; 3],
    m: Matrix,
    t: [f64; 3],
    /// How much farther apart two local points can be than the points they come from, as long as no
    /// repetition jumps between them; infinite where the map turns ever faster.
    pub stretch: f64,
    /// Whether a repetition lies above.
    pub jumps: bool,
}

impl Frame {
    pub fn at(base: [u32; 3], stretch: f64, jumps: bool) -> Self {
        Self { base, m: IDENTITY, t: [0.0; 3], stretch, jumps }
    }
    /// The frame of other coordinates that are as far apart as this one's.
    pub fn with_base(&self, base: [u32; 3]) -> Self {
        Self::at(base, self.stretch, self.jumps)
    }
    pub fn translated(mut self, offset: &[f64; 3]) -> Self {
        for i in 0..3 {
            self.t[i] -= offset[i];
        }
        self
    }
    /// The child is rotated by `r`: the point goes back by its transpose.
    pub fn rotated(self, r: &Matrix) -> Self {
        let row = |i: usize, v: [f64; 3]| r[0][i] * v[0] + r[1][i] * v[1] + r[2][i] * v[2];
        let column = |j: usize| [self.m[0][j], self.m[1][j], self.m[2][j]];
        Self {
            base: self.base,
            m: std::array::from_fn(|i| std::array::from_fn(|j| row(i, column(j)))),
            t: std::array::from_fn(|i| row(i, self.t)),
            ..self
        }
    }
    pub fn scaled(mut self, factors: &[f64; 3]) -> Self {
        for i in 0..3 {
            self.m[i] = self.m[i].map(|v| v / factors[i]);
            self.t[i] /= factors[i];
        }
        self.stretch /= factors.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        self
    }
    /// Where the local origin lies in base coordinates, if the frame is only moved.
    pub fn moved_to(&self) -> Option<[f64; 3]> {
        (self.m == IDENTITY).then(|| self.t.map(|v| 0.0 - v))
    }
    /// The same if it is moved and turned, nothing else: what is round asks for no more.
    pub fn turned_to(&self) -> Option<[f64; 3]> {
        let dot = |i: usize, j: usize| (0..3).map(|k| self.m[i][k] * self.m[j][k]).sum::<f64>();
        // A few turns' rounding.
        let is_unit = |i: usize, j: usize| (dot(i, j) - f64::from(u8::from(i == j))).abs() < 1e-12;
        let rigid = (0..3).all(|i| (0..=i).all(|j| is_unit(i, j)));
        rigid.then(|| std::array::from_fn(|j| 0.0 - (0..3).map(|i| self.m[i][j] * self.t[i]).sum::<f64>()))
    }
    /// The local point's coordinates as values.
    pub fn coordinates(&self, graph: &mut Graph) -> Result<[u32; 3], SceneError> {
        let mut out = self.base;
        for i in 0..3 {
            let [a, b, c] = self.m[i];
            out[i] = match self.moved_to() {
                Some(centre) if centre[i] == 0.0 => self.base[i],
                Some(centre) => graph.emit(Op::SubC, &[self.base[i]], &[centre[i]])?,
                None => graph.emit(Op::Dot, &self.base, &[a, b, c, self.t[i]])?,
            };
        }
        Ok(out)
    }
    fn key(&self) -> ([u32; 3], [u64; 12]) {
        let mut bits = [0; 12];
        for i in 0..3 {
            for j in 0..3 {
                bits[3 * i + j] = self.m[i][j].to_bits();
            }
            bits[9 + i] = self.t[i].to_bits();
        }
        (self.base, bits)
    }
}

/// Frames by number, equal ones once.
#[derive(Default)]
pub struct Frames {
    all: Vec<Frame>,
    known: HashMap<([u32; 3], [u64; 12]), u32>,
}

impl Frames {
    pub fn intern(&mut self, frame: Frame) -> u32 {
        *self.known.entry(frame.key()).or_insert_with(|| {
            self.all.push(frame);
            self.all.len() as u32 - 1
        })
    }
    pub fn get(&self, id: u32) -> Frame {
        self.all[id as usize]
    }
}
