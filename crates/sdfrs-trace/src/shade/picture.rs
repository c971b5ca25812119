//! Normals and colours of all pixels, block by block: rays made again, gradients, light; a pack at a time.
//!
//! A block's columns stay in a near cache from one stage to the next. Law: a pixel is what `Light::pixel`
//! gives for it; the same bits for any number of threads (tests in `render`).

use rayon::prelude::*;
use sdfrs_core::{
    Control, Hits, Program, Prune, Status,
    eval::{Kernel, Lanes, Native, vectorise},
    pool,
    prune::Pruner,
};

use super::{
    clusters::{Clusters, SQUARE},
    direct::Light,
    normal::unit,
    slopes::Slopes,
    srgb::Srgb,
};
use crate::{
    camera::Frame,
    error::TraceError,
    march::{Bundle, Source, WIDEST, Wanted, squares},
};

/// Pixels along a block: some squares whose pixels share a program shortened for their surroundings.
const BLOCK: [usize; 2] = [128, 32];

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
    /// The first pixel's number.
    first: usize,
    normals: &'a mut [[f32; 3]],
    rgb: &'a mut [[u8; 3]],
}

impl<T: Native> Shading<'_, T> {
    /// Normals and colours of all pixels, some rows at a time on the pool.
    pub fn run(&self, control: &Control) -> Result<Shaded, TraceError> {
        let mut normals = vec![[0f32; 3]; self.hits.t.len()];
        let width = self.frame.width();
        // What is shown where nothing is hit: a row of it, again and again.
        let row = vec![self.light.surface.unlit(Status::Miss as u8); width];
        let mut rgb = row.repeat(self.hits.t.len() / width);
        pool::install(|| {
            let size = BLOCK[1] * width;
            let rows = normals.par_chunks_mut(size).zip(rgb.par_chunks_mut(size)).enumerate();
            rows.try_for_each_init(Block::default, |block, (i, (normals, rgb))| {
                if control.is_cancelled() {
                    return Err(TraceError::Cancelled);
                }
                let height = rgb.len() / width;
                let mut rows = Rows { first: i * size, normals, rgb };
                squares([0; 2], [width, height], BLOCK, |from, to| self.block(block, from, to, &mut rows));
                Ok(())
            })
        })?;
        Ok((normals, rgb))
    }

    /// One of the blocks of some rows.
    fn block(&self, block: &mut Block<T>, from: [usize; 2], to: [usize; 2], rows: &mut Rows) {
        let pruner = Slopes::pruner(self.program, self.prune);
        self.find(&mut block.clusters, pruner, from, to, rows);
        if block.clusters.len() == 0 {
            return;
        }
        block.fit();
        self.meet(block);
        let Block { slopes, clusters, points, gradient, .. } = &mut *block;
        let deep = |near: f64| self.frame.span(BLOCK[0], near);
        slopes.run(self.program, pruner, &mut clusters.list, deep, points, gradient);
        vectorise(Lit { light: self.light, block });
        block.show(rows);
    }

    /// The pixels that show a surface, square by square.
    fn find(
        &self,
        clusters: &mut Clusters<T>,
        pruner: Option<&Pruner>,
        from: [usize; 2],
        to: [usize; 2],
        rows: &mut Rows,
    ) {
        let (width, top) = (self.frame.width(), rows.first / self.frame.width());
        clusters.begin(BLOCK[0] * BLOCK[1]);
        squares(from, to, [SQUARE; 2], |from, to| {
            let start = clusters.len();
            for y in from[1]..to[1] {
                let place = y * width + from[0];
                let at = rows.first + place..rows.first + place + to[0] - from[0];
                let (statuses, depths) = (&self.hits.status[at.clone()], &self.hits.t[at]);
                if statuses.first_chunk() == Some(&[Status::Miss as u8; SQUARE]) {
                    continue;
                }
                let (x, y) = (from[0] as u32, (top + y) as u32);
                clusters.add(Wanted { x, y, place: place as u32 }, depths, statuses);
                for (pixel, status) in rows.rgb[place..].iter_mut().zip(statuses) {
                    if *status == Status::Invalid as u8 {
                        *pixel = self.light.surface.unlit(*status);
                    }
                }
            }
            if pruner.is_some() {
                clusters.close(start, self.frame);
            }
        });
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
    slopes: Slopes<T>,
    clusters: Clusters<T>,
    points: [Vec<T>; 3],
    /// Directions of their rays.
    towards: [Vec<T>; 3],
    /// The field's value and slopes.
    gradient: [Vec<T>; 4],
    normal: [Vec<f32>; 3],
    /// Linear.
    colour: [Vec<f64>; 3],
}

impl<T: Native> Default for Block<T> {
    fn default() -> Self {
        Self {
            slopes: Slopes::new(),
            clusters: Clusters::new(),
            points: Default::default(),
            towards: Default::default(),
            gradient: Default::default(),
            normal: Default::default(),
            colour: Default::default(),
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
        self.normal.iter_mut().for_each(|column| column.resize(n, 0.0));
        self.colour.iter_mut().for_each(|column| column.resize(n, 0.0));
    }

    /// Writes normals and colours to where they belong.
    fn show(&self, rows: &mut Rows) {
        let (table, pixels) = (Srgb::get(), self.clusters.pixels());
        // Cut to one length, so that only places are checked below.
        let [r, g, b] = [0, 1, 2].map(|a| &self.colour[a][..pixels.len()]);
        let [x, y, z] = [0, 1, 2].map(|a| &self.normal[a][..pixels.len()]);
        for (k, pixel) in pixels.iter().enumerate() {
            let i = pixel.place as usize;
            rows.rgb[i] = table.bytes([r[k], g[k], b[k]]);
            rows.normals[i] = [x[k], y[k], z[k]];
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
    light: Light<'a>,
    block: &'a mut Block<T>,
}

impl<T: Native> Kernel for Lit<'_, T> {
    #[inline(always)]
    fn run(self) {
        type Double = <f64 as Native>::Lanes;
        let Block { points, towards, gradient: [_, slopes @ ..], normal, colour, .. } = self.block;
        let width = T::Lanes::WIDTH;
        let ([gx, gy, gz], [tx, ty, tz]) = (slopes, towards);
        for at in (0..gx.len()).step_by(width) {
            let at = at..at + width;
            let g = [&gx[at.clone()], &gy[at.clone()], &gz[at.clone()]];
            let d = [&tx[at.clone()], &ty[at.clone()], &tz[at.clone()]];
            let n = unit(
                [T::Lanes::load(g[0]), T::Lanes::load(g[1]), T::Lanes::load(g[2])],
                [T::Lanes::load(d[0]), T::Lanes::load(d[1]), T::Lanes::load(d[2])],
            );
            // Points and normals in double precision, lane by lane.
            let mut double = [[0f64; WIDEST]; 6];
            for a in 0..3 {
                let mut lanes = [T::default(); WIDEST];
                n[a].store(&mut lanes);
                let (point, normal) = (&points[a][at.clone()], &mut normal[a][at.clone()]);
                for l in 0..width {
                    double[a][l] = point[l].f64();
                    double[3 + a][l] = lanes[l].f64();
                    normal[l] = lanes[l].f64() as f32;
                }
            }
            for from in (0..width).step_by(Double::WIDTH) {
                let [px, py, pz, nx, ny, nz] = &double;
                let p = [Double::load(&px[from..]), Double::load(&py[from..]), Double::load(&pz[from..])];
                let n = [Double::load(&nx[from..]), Double::load(&ny[from..]), Double::load(&nz[from..])];
                let rgb = self.light.linear(p, n);
                for a in 0..3 {
                    rgb[a].store(&mut colour[a][at.start + from..][..Double::WIDTH]);
                }
            }
        }
    }
}
