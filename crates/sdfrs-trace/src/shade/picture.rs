//! Normals and colours of all pixels, block by block: rays made again, gradients, light; a pack at a time.
//!
//! A block's columns stay in a near cache from one stage to the next. Law: a pixel is what `Light::pixel`
//! gives for it; the same bits for any number of threads (tests in `render`).

use std::ops::Range;

use rayon::prelude::*;
use sdfrs_core::{
    Control, Hits, Program, Prune, Status,
    eval::{Kernel, Lanes, Native, vectorise},
    fresh::Fresh,
    pool,
};

use super::{
    clusters::Clusters,
    direct::{Lamps, Light},
    normal::unit,
    slopes::Slopes,
    srgb::{self, Srgb},
    window::{BLOCK, Window},
};
use crate::{
    camera::Frame,
    error::TraceError,
    march::{Bundle, Pixel, Source, squares},
};

/// Pixels that are lit and shown before the next ones are: what is known of them stays in the nearest cache.
const RUN: usize = 256;

/// Normals and colours.
type Shaded = (Vec<[f32; 3]>, Vec<[u8; 3]>);

/// What every block of a picture is shaded from.
pub struct Shading<'a, T: Native> {
    pub program: &'a Program<T>,
    pub prune: Prune,
    pub rays: &'a dyn Source<T>,
    pub frame: &'a Frame,
    pub light: Light<'a>,
    pub hits: &'a Hits<T>,
}

/// Whole rows of pixels, as high as a block.
struct Rows<'a> {
    /// The first one's number.
    top: usize,
    width: usize,
    normals: &'a mut [[f32; 3]],
    rgb: &'a mut [[u8; 3]],
}

impl Rows<'_> {
    fn place(&self, pixel: Pixel) -> usize {
        (pixel.y() as usize - self.top) * self.width + pixel.x() as usize
    }
}

impl<T: Native> Shading<'_, T> {
    /// Normals and colours of all pixels, some rows at a time on the pool.
    pub fn run(&self, control: &Control) -> Result<Shaded, TraceError> {
        let (width, n) = (self.frame.width(), self.hits.t.len());
        let lamps = self.light.lamps();
        // What is shown where nothing is hit.
        let unlit = self.light.surface.unlit(Status::Miss as u8);
        let (mut normals, mut rgb) = (Fresh::new(n), Fresh::new(n));
        pool::install(|| {
            let size = BLOCK[1] * width;
            let rows = normals.pieces(size).zip(rgb.pieces(size)).enumerate();
            rows.try_for_each_init(Block::default, |block, (i, (normals, rgb))| {
                if control.is_cancelled() {
                    return Err(TraceError::Cancelled);
                }
                let (normals, rgb) = (normals.clear(), rgb.fill(unlit));
                let (top, height) = (i * BLOCK[1], rgb.len() / width);
                let mut rows = Rows { top, width, normals, rgb };
                squares([0, top], [width, top + height], BLOCK, |from, to| {
                    self.block(block, &lamps, [from, to], &mut rows);
                });
                Ok(())
            })
        })?;
        Ok((normals.done(), rgb.done()))
    }

    /// One of the blocks of some rows.
    fn block(&self, block: &mut Block<T>, lamps: &Lamps<T>, [from, to]: [[usize; 2]; 2], rows: &mut Rows) {
        let most = block.window.copy(self.hits, rows.width, from, to);
        if most == Status::Miss as u8 {
            return;
        }
        if most == Status::Invalid as u8 {
            for pixel in block.window.invalid() {
                rows.rgb[rows.place(pixel)] = self.light.surface.unlit(most);
            }
        }
        let pruner = Slopes::pruner(self.program, self.prune);
        block.clusters.begin(BLOCK[0] * BLOCK[1]);
        block.window.squares(&mut block.clusters, |clusters, start| {
            if pruner.is_some() {
                clusters.close(start, self.frame);
            }
        });
        block.fit();
        self.meet(block);
        let Block { slopes, clusters, points, gradient, .. } = &mut *block;
        let deep = |near: f64| self.frame.span(BLOCK[0], near);
        slopes.run(self.program, pruner, &mut clusters.list, deep, points, gradient);
        let grey = lamps.grey();
        for from in (0..block.clusters.len()).step_by(RUN) {
            let at = from..block.points[0].len().min(from + RUN);
            vectorise(Lit { lamps, block, at: at.clone() });
            vectorise(Show { grey, block, rows, at });
        }
    }

    /// Where the rays have come to.
    fn meet(&self, block: &mut Block<T>) {
        let Block { clusters, points, towards, .. } = block;
        let mut bundle = Bundle::blank();
        let width = T::Lanes::WIDTH;
        let packs = clusters.pixels().chunks(width).zip(clusters.depths().chunks(width));
        for (pack, (pixels, t)) in packs.enumerate() {
            self.rays.bundle(pixels, &mut bundle);
            vectorise(Meet { bundle: &bundle, t, points, towards, at: pack * width });
        }
    }
}

/// A worker's memory for the pixels of a block that show something, in whole packs.
struct Block<T: Native> {
    window: Window<T>,
    slopes: Slopes<T>,
    clusters: Clusters<T>,
    points: [Vec<T>; 3],
    /// Directions of their rays.
    towards: [Vec<T>; 3],
    /// The field's value and slopes.
    gradient: [Vec<T>; 4],
    /// Of a run of pixels.
    normal: [[T; RUN]; 3],
    /// Linear, and its steps in the table of bytes.
    colour: [[T; RUN]; 3],
    steps: [[u32; RUN]; 3],
    /// As they are shown.
    normals: [[f32; 3]; RUN],
    rgb: [[u8; 3]; RUN],
}

impl<T: Native> Default for Block<T> {
    fn default() -> Self {
        Self {
            window: Window::new(),
            slopes: Slopes::new(),
            clusters: Clusters::new(),
            points: Default::default(),
            towards: Default::default(),
            gradient: Default::default(),
            normal: [[T::default(); RUN]; 3],
            colour: [[T::default(); RUN]; 3],
            steps: [[0; RUN]; 3],
            normals: [[0.0; 3]; RUN],
            rgb: [[0; 3]; RUN],
        }
    }
}

impl<T: Native> Block<T> {
    /// Makes room for whole packs.
    fn fit(&mut self) {
        let n = self.clusters.len().next_multiple_of(T::Lanes::WIDTH);
        for column in self.points.iter_mut().chain(&mut self.towards).chain(&mut self.gradient) {
            column.resize(n, T::default());
        }
    }
}

/// The points that rays have come to.
struct Meet<'a, T: Native> {
    bundle: &'a Bundle<T::Lanes>,
    t: &'a [T],
    points: &'a mut [Vec<T>; 3],
    towards: &'a mut [Vec<T>; 3],
    at: usize,
}

impl<T: Native> Kernel for Meet<'_, T> {
    #[inline(always)]
    fn run(self) {
        let (t, to) = (T::Lanes::load(self.t), self.at..self.at + T::Lanes::WIDTH);
        for a in 0..3 {
            let (o, d) = (self.bundle.origin[a], self.bundle.direction[a]);
            (o + t * d).store(&mut self.points[a][to.clone()]);
            d.store(&mut self.towards[a][to.clone()]);
        }
    }
}

/// Normals from gradients, and the light there.
struct Lit<'a, T: Native> {
    lamps: &'a Lamps<T>,
    block: &'a mut Block<T>,
    /// Whole packs, at most a run.
    at: Range<usize>,
}

impl<T: Native> Kernel for Lit<'_, T> {
    #[inline(always)]
    fn run(self) {
        let Block { points: p, towards: d, gradient: [_, g @ ..], normal, colour, steps, .. } = self.block;
        let width = T::Lanes::WIDTH;
        for (at, to) in self.at.step_by(width).zip((0..).step_by(width)) {
            let n = unit(pack(g, at), pack(d, at));
            let rgb = self.lamps.linear(pack(p, at), n);
            for a in 0..3 {
                n[a].store(&mut normal[a][to..to + width]);
                rgb[a].store(&mut colour[a][to..to + width]);
                srgb::step(rgb[a]).cells(&mut steps[a][to..to + width]);
            }
        }
    }
}

/// A pack of three columns. No closure, nor a `map` over arrays: those are calls, without the kernel's instructions.
#[inline(always)]
fn pack<T: Native>([x, y, z]: &[Vec<T>; 3], at: usize) -> [T::Lanes; 3] {
    let at = at..at + T::Lanes::WIDTH;
    [T::Lanes::load(&x[at.clone()]), T::Lanes::load(&y[at.clone()]), T::Lanes::load(&z[at])]
}

/// Writes a run's normals and colours to where they belong.
struct Show<'a, 'b, T: Native> {
    /// One byte tells all of a pixel.
    grey: bool,
    block: &'a mut Block<T>,
    rows: &'a mut Rows<'b>,
    at: Range<usize>,
}

impl<T: Native> Kernel for Show<'_, '_, T> {
    #[inline(always)]
    fn run(self) {
        let Self { grey, block, rows, at } = self;
        let Block { clusters, normal: [x, y, z], colour, steps, normals, rgb, .. } = block;
        let pixels = clusters.pixels();
        let pixels = &pixels[at.start..at.end.min(pixels.len())];
        for (i, normal) in normals[..pixels.len()].iter_mut().enumerate() {
            *normal = [x[i].f64() as f32, y[i].f64() as f32, z[i].f64() as f32];
        }
        let table = Srgb::get();
        for (i, rgb) in rgb[..pixels.len()].iter_mut().enumerate() {
            let first = table.at(steps[0][i], colour[0][i]);
            *rgb = [first; 3];
            if !grey {
                rgb[1] = table.at(steps[1][i], colour[1][i]);
                rgb[2] = table.at(steps[2][i], colour[2][i]);
            }
        }
        for ((pixels, normals), rgb) in pixels.chunks(EIGHT).zip(normals.chunks(EIGHT)).zip(rgb.chunks(EIGHT))
        {
            let place = rows.place(pixels[0]);
            if pixels.first_chunk().is_some_and(in_row) {
                rows.rgb[place..place + EIGHT].copy_from_slice(rgb);
                rows.normals[place..place + EIGHT].copy_from_slice(normals);
                continue;
            }
            for ((pixel, normal), rgb) in pixels.iter().zip(normals).zip(rgb) {
                let place = rows.place(*pixel);
                (rows.rgb[place], rows.normals[place]) = (*rgb, *normal);
            }
        }
    }
}

/// Pixels that are written at once where they are neighbours.
const EIGHT: usize = 8;

/// Neighbours in a row, from left to right?
#[inline(always)]
fn in_row(run: &[Pixel; EIGHT]) -> bool {
    (0..).zip(run).fold(true, |all, (i, pixel)| all & (pixel.0.wrapping_sub(run[0].0) == i))
}
