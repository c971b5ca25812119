//! Normals and colours of all pixels, tile by tile: rays made again, gradients, light; a pack at a time.
//!
//! Law: a pixel is what `Light::pixel` gives for it; the same bits for any number of threads (tests in `render`).

use rayon::prelude::*;
use sdfrs_core::{
    Control, Hits, Program, Prune, Status,
    eval::{Kernel, Lanes, Native, vectorise},
    pool,
};

use super::{
    direct::{Light, shows_surface},
    normal::unit,
    slopes::Slopes,
    srgb::Srgb,
};
use crate::{
    error::TraceError,
    march::{Bundle, Source, WIDEST, Wanted, squares},
};

/// Rows of pixels shaded by one worker at a time, and pixels along a side of the squares that share a
/// shortened program.
const ROWS: usize = 16;
const SQUARE: usize = 8;

/// Normals and colours.
type Shaded = (Vec<[f32; 3]>, Vec<[u8; 3]>);

/// What every tile of a picture is shaded from.
pub struct Shading<'a, T: Native> {
    pub program: &'a Program<T>,
    pub prune: Prune,
    pub rays: &'a dyn Source<T>,
    /// Pixels of a row.
    pub width: usize,
    pub light: Light<'a>,
    pub hits: &'a Hits<T>,
}

impl<T: Native> Shading<'_, T> {
    /// Normals and colours of all pixels, tile by tile on the pool.
    pub fn run(&self, control: &Control) -> Result<Shaded, TraceError> {
        let mut normals = vec![[0f32; 3]; self.hits.t.len()];
        let mut rgb = vec![[0u8; 3]; self.hits.t.len()];
        pool::install(|| {
            let size = ROWS * self.width;
            let tiles = normals.par_chunks_mut(size).zip(rgb.par_chunks_mut(size)).enumerate();
            tiles.try_for_each_init(Tile::default, |tile, (i, (normals, rgb))| {
                if control.is_cancelled() {
                    return Err(TraceError::Cancelled);
                }
                self.tile(tile, i * size, normals, rgb);
                Ok(())
            })
        })?;
        Ok((normals, rgb))
    }

    /// Whole rows of pixels from the pixel `first` on.
    fn tile(&self, tile: &mut Tile<T>, first: usize, normals: &mut [[f32; 3]], rgb: &mut [[u8; 3]]) {
        self.find(tile, first, rgb);
        let packs = tile.lit.len().div_ceil(T::Lanes::WIDTH);
        tile.fit(packs * T::Lanes::WIDTH);
        let mut bundle = Bundle::blank();
        let Tile { lit, points, towards, .. } = &mut *tile;
        for (pack, lit) in lit.chunks(T::Lanes::WIDTH).enumerate() {
            self.rays.bundle(lit, &mut bundle);
            let mut t = [T::default(); WIDEST];
            for (t, lit) in t.iter_mut().zip(lit) {
                *t = self.hits.t[first + lit.place as usize];
            }
            let at = pack * T::Lanes::WIDTH;
            vectorise(Meet { bundle: &bundle, t: &t, points, towards, at });
        }
        let Tile { slopes, squares, points, gradient, lit, .. } = &mut *tile;
        slopes.run(self.program, self.prune, &squares[..], lit.len(), points, gradient);
        vectorise(Lit { light: self.light, tile });
        let table = Srgb::get();
        for (k, lit) in tile.lit.iter().enumerate() {
            let i = lit.place as usize;
            rgb[i] =
                [table.byte(tile.colour[0][k]), table.byte(tile.colour[1][k]), table.byte(tile.colour[2][k])];
            normals[i] = [tile.normal[0][k], tile.normal[1][k], tile.normal[2][k]];
        }
    }

    /// The pixels that show a surface, square by square; the others get their colour.
    fn find(&self, tile: &mut Tile<T>, first: usize, rgb: &mut [[u8; 3]]) {
        let (width, top, height) = (self.width, first / self.width, rgb.len() / self.width);
        let sky = self.light.surface.unlit(Status::Miss as u8);
        tile.lit.clear();
        tile.squares.clear();
        squares([0, 0], [width, height], [SQUARE, ROWS], |from, to| {
            squares(from, to, [SQUARE; 2], |from, to| {
                for y in from[1]..to[1] {
                    let row = y * width + from[0]..y * width + to[0];
                    let statuses = &self.hits.status[first + row.start..first + row.end];
                    let pixels = rgb[row.clone()].iter_mut().zip(statuses);
                    for ((x, i), (pixel, &status)) in (from[0]..).zip(row).zip(pixels) {
                        *pixel = sky;
                        if status == Status::Invalid as u8 {
                            *pixel = self.light.surface.unlit(status);
                        } else if shows_surface(status) {
                            tile.lit.push(Wanted { x: x as u32, y: (top + y) as u32, place: i as u32 });
                        }
                    }
                }
                if tile.lit.len() > tile.squares.last().copied().unwrap_or(0) {
                    tile.squares.push(tile.lit.len());
                }
            });
        });
    }
}

/// A worker's memory for the pixels of a tile that show something, in whole packs.
struct Tile<T: Native> {
    slopes: Slopes<T>,
    lit: Vec<Wanted>,
    /// Where each square ends among them.
    squares: Vec<usize>,
    points: [Vec<T>; 3],
    /// Directions of their rays.
    towards: [Vec<T>; 3],
    /// The field's value and slopes.
    gradient: [Vec<T>; 4],
    normal: [Vec<f32>; 3],
    /// Linear.
    colour: [Vec<f64>; 3],
}

impl<T: Native> Default for Tile<T> {
    fn default() -> Self {
        Self {
            slopes: Slopes::new(),
            lit: Vec::new(),
            squares: Vec::new(),
            points: Default::default(),
            towards: Default::default(),
            gradient: Default::default(),
            normal: Default::default(),
            colour: Default::default(),
        }
    }
}

impl<T: Native> Tile<T> {
    fn fit(&mut self, n: usize) {
        for column in self.points.iter_mut().chain(&mut self.towards).chain(&mut self.gradient) {
            column.resize(n, T::default());
        }
        self.normal.iter_mut().for_each(|column| column.resize(n, 0.0));
        self.colour.iter_mut().for_each(|column| column.resize(n, 0.0));
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
    tile: &'a mut Tile<T>,
}

impl<T: Native> Kernel for Lit<'_, T> {
    #[inline(always)]
    fn run(self) {
        type Double = <f64 as Native>::Lanes;
        let Tile { points, towards, gradient: [_, gx, gy, gz], normal, colour, .. } = self.tile;
        for at in (0..gx.len()).step_by(T::Lanes::WIDTH) {
            let g = [T::Lanes::load(&gx[at..]), T::Lanes::load(&gy[at..]), T::Lanes::load(&gz[at..])];
            let [dx, dy, dz] = &*towards;
            let d = [T::Lanes::load(&dx[at..]), T::Lanes::load(&dy[at..]), T::Lanes::load(&dz[at..])];
            let n = unit(g, d);
            // Points and normals in double precision, lane by lane.
            let mut double = [[0f64; WIDEST]; 6];
            for a in 0..3 {
                let mut lanes = [T::default(); WIDEST];
                n[a].store(&mut lanes);
                for l in 0..T::Lanes::WIDTH {
                    double[a][l] = points[a][at + l].f64();
                    double[3 + a][l] = lanes[l].f64();
                    normal[a][at + l] = lanes[l].f64() as f32;
                }
            }
            for from in (0..T::Lanes::WIDTH).step_by(Double::WIDTH) {
                let [px, py, pz, nx, ny, nz] = &double;
                let p = [Double::load(&px[from..]), Double::load(&py[from..]), Double::load(&pz[from..])];
                let n = [Double::load(&nx[from..]), Double::load(&ny[from..]), Double::load(&nz[from..])];
                let rgb = self.light.linear(p, n);
                for a in 0..3 {
                    rgb[a].store(&mut colour[a][at + from..]);
                }
            }
        }
    }
}
