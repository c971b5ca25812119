//! Front to back through the cells of a group of rays: patches go together as long as nothing is near, then ray by
//! ray.

use sdfrs_core::{Field, eval::Native, prune::Pruner};

use super::{
    Job,
    beam::Beam,
    cells::{Cells, Found, Stretch},
    columns::Columns,
    cones::{Patch, Patches},
    feed::Feed,
    order::Rectangle,
    swarm::{End, QUAD, Sink, Span, Swarm},
    worker::Samples,
};
use crate::tracer::guarded::Rule;

/// What all groups of a trace share.
pub struct Sweep<'a, T: Native, R> {
    pub job: &'a Job<'a, T>,
    pub pruner: &'a Pruner,
    pub rule: R,
}

/// Where a stretch begins that is none: the whole field.
const EVERYWHERE: f64 = f64::NEG_INFINITY;

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
            patches.stop(|patch, end| self.leave(&patch, end, swarm, out));
            return samples.walk(job, cells.whole(job.field), rule, swarm, &mut nobody, out);
        };
        cells.begin_group(beam);
        swarm.note(&[]);
        // Whether some cell had a field of its own: from then on none is stepped into from another.
        let (mut parted, mut inside) = (false, f64::NAN);
        while patches.nearest().min(swarm.nearest()) < T::INFINITY && !job.control.is_cancelled() {
            let ahead = patches.nearest();
            let near = ahead.min(swarm.nearest());
            let (span, field): (_, &dyn Field<T>) = match cells.find(pruner, near.f64()) {
                Found::Empty(from, to) if T::of(to) > near => {
                    let (from, to) = (T::of(from), T::of(to));
                    swarm.jump::<R>((from, to), &mut samples.picked, out);
                    patches.jump(to, |patch, end| self.leave(&patch, end, swarm, out));
                    inside = f64::NAN;
                    continue;
                }
                Found::Cell(cell) if ahead < T::of(cell.to) => {
                    let Stretch { program, clearance, to, .. } = cell;
                    let leave = |patch, end| self.leave(&patch, end, swarm, out);
                    let n = patches.step(program, &mut samples.scratch, clearance, T::of(to), leave);
                    let ops = program.ops();
                    cells.probe(ops, n);
                    continue;
                }
                Found::Cell(cell) if T::of(cell.to) > near => {
                    let (from, to) = (T::of(cell.from), T::of(cell.to));
                    parted |= cell.near;
                    if parted && inside != cell.from {
                        inside = cell.from;
                        swarm.enter::<R>((from, to), &mut samples.picked);
                        // Some may have to take a shorter step first.
                        if !(swarm.nearest() >= from && swarm.nearest() < to) {
                            continue;
                        }
                    }
                    (Span { until: to, edge: if cell.near { to } else { T::INFINITY } }, cell.program)
                }
                _ if ahead < T::INFINITY => {
                    patches.stop(|patch, end| self.leave(&patch, end, swarm, out));
                    continue;
                }
                _ => {
                    if parted && inside != EVERYWHERE {
                        inside = EVERYWHERE;
                        swarm.enter::<R>((near, T::INFINITY), &mut samples.picked);
                        if swarm.nearest() < near {
                            continue;
                        }
                    }
                    (Span::ALL, cells.whole(job.field))
                }
            };
            let ops = field.ops();
            swarm.pick(span.until, &mut samples.picked);
            let points = samples.step(job, field, rule, span, swarm, &mut nobody, out);
            swarm.note(&samples.picked);
            cells.count(ops, points);
        }
    }

    /// A patch's rays go on one by one, or are all at their ends.
    fn leave(&self, patch: &Rectangle, end: Patch<T>, swarm: &mut Swarm<T>, out: &mut Columns<T>) {
        match end {
            Patch::Passed => {
                let end = End::passed();
                patch.rows(|place, _, columns| match columns.len() {
                    QUAD => out.same::<QUAD>(place, &end),
                    n => (place..).take(n).for_each(|place| out.end(place, &end)),
                });
            }
            Patch::Rays(t) => patch.few(|pixels| swarm.add::<R>(self.job.rays, pixels, t)),
        }
    }
}
