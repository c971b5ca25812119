//! Tiles of rays on all threads, and what comes of them side by side.

use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;
use sdfrs_core::{Hits, Real, Status, contract::Work, eval::Native, pool};

use super::{
    Job,
    columns::{Columns, split},
    order::Order,
    surface::{Blank, Canvas, Easel, Surface, Times},
};
use crate::error::TraceError;

impl<T: Native> Job<'_, T> {
    /// Runs tiles of rays on the pool. A tile takes a memory that no other uses; there are as many as threads.
    pub(super) fn tiles<M: Send>(
        &self,
        order: &Order,
        memory: impl Fn() -> M + Send + Sync,
        run: impl Fn(&mut M, usize, &mut Columns<T>) + Send + Sync,
    ) -> Result<(Hits<T>, Vec<M>), TraceError> {
        let mut hits = std::mem::take(&mut *lock(&self.old));
        let used = hits.t.len() == self.rays.count();
        let loud = used && !hits.work.quiet;
        if !used {
            let room = if self.shaders.is_some() { Hits::picture } else { Hits::blank };
            hits = room(self.rays.count());
        }
        let mut blank = self.shaders.map(|_| Blank::new(self.rays.count()));
        let all = Workers { job: self, loud, memory, kept: Mutex::default() };
        let mut tiles = split(&mut hits, order, !used);
        let (workers, run, room, bands) = (&all, &run, &mut tiles[..], blank.as_mut());
        let work = move || match (self.shaders, bands) {
            (Some(shaders), Some(blank)) => {
                let (side, size) = order.band();
                let miss = shaders.unlit(Status::Miss);
                let bands = room.par_chunks_mut(side).zip(blank.bands(size)).enumerate();
                bands.for_each(|(number, (tiles, band))| {
                    let canvases = band.tiles(order, miss, number);
                    let tiles = tiles.par_iter_mut().zip(canvases).enumerate();
                    tiles.for_each(|(i, (out, canvas))| workers.tile(run, number * side + i, out, canvas));
                });
            }
            _ => {
                let tiles = room.par_iter_mut().enumerate();
                tiles.for_each(|(tile, out)| workers.tile(run, tile, out, Canvas::default()));
            }
        };
        pool::install(work);
        if self.control.is_cancelled() {
            return Err(TraceError::Cancelled);
        }
        let (memories, times) = all.told();
        let (mut threshold, mut steepest, mut work) = (T::of(0.0), T::of(0.0), Work::default());
        for out in &tiles {
            threshold = Real::max(threshold, out.threshold);
            steepest = Real::max(steepest, out.steepest);
            work.join(&out.work);
        }
        work.quiet = tiles.iter().all(|out| out.work.quiet);
        drop(tiles);
        (hits.threshold, hits.steepest, hits.work) = (threshold, steepest, work);
        order.restore(&mut hits);
        if let Some(blank) = blank {
            *lock(&self.image) = blank.done(&times);
        }
        Ok((hits, memories))
    }
}

/// What workers share.
struct Workers<'a, T: Native, M, F> {
    job: &'a Job<'a, T>,
    /// Columns may hold what an earlier trace left there.
    loud: bool,
    /// Makes a worker's memory.
    memory: F,
    /// Memories that no tile uses.
    kept: Mutex<Vec<(M, Option<Easel<'a, T>>)>>,
}

impl<'a, T: Native, M, F: Fn() -> M> Workers<'a, T, M, F> {
    fn tile(
        &self,
        run: impl Fn(&mut M, usize, &mut Columns<T>),
        tile: usize,
        out: &mut Columns<'a, T>,
        canvas: Canvas<'a>,
    ) {
        let Self { job, loud, memory, kept } = self;
        if job.control.is_cancelled() {
            return;
        }
        let free = lock(kept).pop();
        let (mut own, easel) = free.unwrap_or_else(|| (memory(), job.shaders.map(Easel::new)));
        out.begin(*loud);
        out.surface = easel.map(|easel| Surface::new(easel, canvas));
        run(&mut own, tile, out);
        let easel = out.surface.take().map(Surface::finish);
        lock(kept).push((own, easel));
        job.control.advance(out.len() as u64);
    }

    /// The memories, and how long it took to show what was found.
    fn told(self) -> (Vec<M>, Vec<Times>) {
        let kept = self.kept.into_inner().unwrap_or_else(PoisonError::into_inner);
        let (memories, easels): (Vec<M>, Vec<_>) = kept.into_iter().unzip();
        (memories, easels.into_iter().flatten().map(|easel| easel.times).collect())
    }
}

/// A panic elsewhere has its own report.
fn lock<V>(of: &Mutex<V>) -> MutexGuard<'_, V> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
