//! Gradients at many points: cluster by cluster along shortened programs, where that pays.
//!
//! Points of a cluster lie close together, so most of a scene cannot win there (see
//! `sdfrs_core::prune`); a ball around clusters that are about as far away decides first. Law: what is left
//! has the value's bits in the ball, and so the gradient's (tests in `render`).

use std::ops::Range;

use sdfrs_core::{
    Field, Program, Prune, Scratch,
    eval::{Lanes, Native},
    prune::{CELLS, Cell, Memory, Part, Probe, Pruner},
};

use super::clusters::{Cluster, extents};

/// Operations from which on anything is shortened.
const WORTH: u64 = 16;
/// Operations times packs from which on a cluster is: a probe and a rewrite cost as much.
const WORTH_FINE: u64 = 128;

/// A worker's memory.
pub struct Slopes<T: Native> {
    scratch: Scratch<T>,
    boxes: Vec<Bounds>,
    groups: Vec<Range<usize>>,
    /// Of groups, and of clusters.
    probes: [Probe; 2],
    coarse: Part,
    fine: Part,
    memory: Memory,
    /// What is left in a group, and in a cluster.
    programs: [Program<T>; 2],
}

impl<T: Native> Slopes<T> {
    pub fn new() -> Self {
        Self {
            scratch: Scratch::new(),
            boxes: Vec::new(),
            groups: Vec::new(),
            probes: Default::default(),
            coarse: Part::blank(),
            fine: Part::blank(),
            memory: Memory::default(),
            programs: [Program::blank(), Program::blank()],
        }
    }

    /// What shortens a program, where that pays.
    pub fn pruner(program: &Program<T>, prune: Prune) -> Option<&Pruner> {
        let worth = prune != Prune::Off && program.tape().ops() >= WORTH;
        program.pruner().filter(|p| worth && p.has_choices())
    }

    /// Values and slopes at all points, one cluster or group of them after the other.
    pub fn run(
        &mut self,
        program: &Program<T>,
        pruner: Option<&Pruner>,
        clusters: &mut [Cluster],
        deep: impl Fn(f64) -> f64,
        points: &[Vec<T>; 3],
        out: &mut [Vec<T>; 4],
    ) {
        let Some(pruner) = pruner else {
            return gradient(program, &mut self.scratch, 0..points[0].len(), points, out);
        };
        self.group(clusters, deep, points);
        let groups = std::mem::take(&mut self.groups);
        for groups in groups.chunks(CELLS) {
            let mut cells = [Cell::default(); CELLS];
            for (cell, group) in cells.iter_mut().zip(groups) {
                *cell = self.boxes[group.clone()].iter().fold(Bounds::NONE, Bounds::join).ball();
            }
            self.probes[0].look(pruner.whole(), &cells[..groups.len()]);
            for (i, group) in groups.iter().enumerate() {
                self.probes[0].narrow(
                    pruner,
                    pruner.whole(),
                    (i, f32::INFINITY),
                    &mut self.memory,
                    &mut self.coarse,
                );
                self.each(pruner, clusters, group.clone(), points, out);
            }
        }
        self.groups = groups;
    }

    /// Clusters in groups, from near to far; no group is deeper than `deep` says at its near end.
    fn group(&mut self, clusters: &mut [Cluster], deep: impl Fn(f64) -> f64, points: &[Vec<T>; 3]) {
        clusters.sort_unstable_by(|a, b| a.near.total_cmp(&b.near).then(a.from.cmp(&b.from)));
        self.boxes.clear();
        self.boxes.extend(clusters.iter().map(|c| Bounds::of(points, c.from..c.to)));
        self.groups.clear();
        let mut from = 0;
        for to in 1..=clusters.len() {
            let near = clusters[from].near;
            if to - from == CELLS || clusters.get(to).is_none_or(|next| next.near - near > deep(near)) {
                self.groups.push(from..to);
                from = to;
            }
        }
    }

    /// A group's clusters along what is left around them.
    fn each(
        &mut self,
        pruner: &Pruner,
        clusters: &[Cluster],
        group: Range<usize>,
        points: &[Vec<T>; 3],
        out: &mut [Vec<T>; 4],
    ) {
        let Self { scratch, boxes, probes: [_, probe], coarse, fine, memory, .. } = self;
        let [rough, short] = &mut self.programs;
        pruner.program(coarse, memory, rough);
        let mut cells = [Cell::default(); CELLS];
        for (cell, around) in cells.iter_mut().zip(&boxes[group.clone()]) {
            *cell = around.ball();
        }
        probe.look(coarse, &cells[..group.len()]);
        for (i, cluster) in clusters[group].iter().enumerate() {
            let at = cluster.from..cluster.to;
            if coarse.ops() * at.len().div_ceil(T::Lanes::WIDTH) as u64 >= WORTH_FINE {
                probe.narrow_last(pruner, coarse, (i, f32::INFINITY), memory, fine);
                pruner.program(fine, memory, short);
                gradient(short, scratch, at, points, out);
            } else {
                gradient(rough, scratch, at, points, out);
            }
        }
    }
}

fn gradient<T: Native>(
    program: &Program<T>,
    scratch: &mut Scratch<T>,
    at: Range<usize>,
    [x, y, z]: &[Vec<T>; 3],
    [v, dx, dy, dz]: &mut [Vec<T>; 4],
) {
    let out = [&mut v[at.clone()], &mut dx[at.clone()], &mut dy[at.clone()], &mut dz[at.clone()]];
    program.gradient(scratch, [&x[at.clone()], &y[at.clone()], &z[at]], out);
}

/// Least and largest coordinates.
#[derive(Debug, Clone, Copy)]
struct Bounds([[f64; 2]; 3]);

impl Bounds {
    const NONE: Self = Self([[f64::INFINITY, -f64::INFINITY]; 3]);

    fn of<T: Native>(points: &[Vec<T>; 3], at: Range<usize>) -> Self {
        Self(extents(points.each_ref().map(|column| &column[at.clone()])))
    }

    fn join(self, other: &Self) -> Self {
        Self([0, 1, 2].map(|a| {
            let ([lo, hi], [least, most]) = (self.0[a], other.0[a]);
            [lo.min(least), hi.max(most)]
        }))
    }

    /// A ball around it; an infinite one drops nothing.
    fn ball(&self) -> Cell {
        let mut centre = [0f64; 3];
        let (mut square, mut size) = (0.0, 0.0);
        for (centre, [lo, hi]) in centre.iter_mut().zip(self.0) {
            let half = 0.5 * hi - 0.5 * lo;
            *centre = lo + half;
            square += half * half;
            size += centre.abs();
        }
        // The corner of the box is as far as any point; what rounding adds is that of `march`'s cells.
        let radius = f64::sqrt(square);
        Cell::ball(centre, radius, size + radius)
    }
}
