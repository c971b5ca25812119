//! Front to back through the cells of a group of rays: patches go together as long as nothing is near, then ray by
//! ray.

use sdfrs_core::{Field, eval::Native, prune::Pruner};

use super::{
    Job,
    beam::Beam,
    cells::{Cells, Found},
    columns::Columns,
    cones::{Patch, Patches},
    feed::Feed,
    order::Rectangle,
    swarm::{Span, Swarm},
    worker::Samples,
};
use crate::tracer::guarded::Rule;

/// What all groups of a trace share.
pub struct Sweep<'a, T: Native, R> {
    pub job: &'a Job<'a, T>,
    pub pruner: &'a Pruner,
    pub rule: R,
}

impl<T: Native, R: Rule<T::Lanes>> Sweep<'_, T, R> {
    /// Walks patches and rays to their ends.
    pub fn group(
        &self,
        beam: Option<Beam>,
        patches: &mut Patches<T>,
        swarm: &mut Swarm<T>,
        cells: &mut Cells<T>,
        samples: &mut Samples<T>,
        out: &mut Columns<T>,
    ) {
        let Self { job, pruner, rule } = *self;
        let mut nobody = Feed::empty(job.rays);
        let Some(beam) = beam else {
            // Rays without a common direction share no cells.
            patches.stop(|patch, end| self.leave(&patch, end, swarm));
            samples.walk(job, cells.whole(job.field), rule, swarm, &mut nobody, out);
            return show_later(out);
        };
        cells.begin_group(beam);
        samples.picked.clear();
        swarm.note(&mut samples.picked);
        let mut inside = Inside { parted: false, from: f64::NAN };
        while (patches.under_way() || swarm.alive() > 0) && !job.control.is_cancelled() {
            let ahead = patches.nearest();
            let near = ahead.min(swarm.nearest());
            show(cells, near.f64(), out);
            let (from, span, field): (_, _, &dyn Field<T>) = match cells.find(pruner, near.f64()) {
                Found::Empty(from, to) if T::of(to) > near => {
                    let (from, to) = (T::of(from), T::of(to));
                    swarm.jump::<R>((from, to), &mut samples.picked, out);
                    patches.jump(to, |patch, end| self.leave(&patch, end, swarm));
                    inside.from = f64::NAN;
                    continue;
                }
                Found::Cell(cell) if ahead < T::of(cell.to) => {
                    let leave = |patch, end| self.leave(&patch, end, swarm);
                    let points = patches.step(&cell, &mut samples.scratch, leave);
                    let ops = cell.program.ops();
                    cells.probe(ops, points);
                    continue;
                }
                Found::Cell(cell) if T::of(cell.to) > near => {
                    inside.parted |= cell.near;
                    let until = T::of(cell.to);
                    let edge = if cell.near { until } else { T::INFINITY };
                    (cell.from, Span { until, edge }, cell.program)
                }
                _ if patches.under_way() => {
                    patches.stop(|patch, end| self.leave(&patch, end, swarm));
                    continue;
                }
                _ => (EVERYWHERE, Span::ALL, cells.whole(job.field)),
            };
            if inside.enter::<T, R>(from, (near, span.until), swarm, &mut samples.picked) {
                continue;
            }
            let ops = field.ops();
            let points = samples.cross(job, field, rule, (T::of(from), span), swarm, &mut nobody, out);
            cells.count(ops, points);
            if from == EVERYWHERE {
                show_later(out);
            }
        }
        show(cells, f64::INFINITY, out);
    }

    /// A patch's rays go on one by one; if not, they are misses already.
    fn leave(&self, patch: &Rectangle, end: Patch<T>, swarm: &mut Swarm<T>) {
        if let Patch::Rays(t) = end {
            patch.few(|pixels| swarm.add::<R>(self.job.rays, pixels, t));
        }
    }
}

/// Surfaces found in a cell are shown before it is left for another depth.
#[inline(always)]
fn show<T: Native>(cells: &Cells<T>, t: f64, out: &mut Columns<T>) {
    if let Some(surface) = &mut out.surface
        && surface.waits()
        && let Some((depths, program)) = cells.left(t)
    {
        surface.show(program, T::of(depths.start)..T::of(depths.end));
    }
}

/// What belongs to no cell is shown when the block is done.
fn show_later<T: Native>(out: &mut Columns<T>) {
    if let Some(surface) = &mut out.surface {
        surface.show_later();
    }
}

/// Where a stretch begins that is none: the whole field.
const EVERYWHERE: f64 = f64::NEG_INFINITY;

/// The stretch that rays are in, by its beginning. Once one had a field of its own, none is stepped into from another.
struct Inside {
    parted: bool,
    from: f64,
}

impl Inside {
    /// Rays come to a stretch. Whether some of them have to take a shorter step first.
    fn enter<T: Native, R: Rule<T::Lanes>>(
        &mut self,
        from: f64,
        (near, to): (T, T),
        swarm: &mut Swarm<T>,
        picked: &mut Vec<u32>,
    ) -> bool {
        if !self.parted || self.from == from {
            return false;
        }
        self.from = from;
        let begin = if from == EVERYWHERE { near } else { T::of(from) };
        swarm.enter::<R>((begin, to), picked);
        !(swarm.nearest() >= begin && swarm.nearest() < to)
    }
}
