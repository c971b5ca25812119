//! Surfaces shown while the program that found them is at hand: nothing has to be shortened once more for their normals.
//!
//! A picture's tile comes with its part of the picture. What its rays end on is noted, and shown along a cell's program
//! before that gives way to another's; what has left the cell, or belongs to none, along the whole field.
//! Law: shortened programs change no pixel (tests in `render`).

use std::{ops::Range, time::Instant};

use rayon::prelude::*;
use sdfrs_core::{
    Program, Status,
    eval::Native,
    fresh::{Fresh, Piece},
};

use super::{
    columns::{Cut, parts},
    ends::End,
    order::{Corner, Order},
    pixel::Pixel,
};

/// A surface that a ray of a tile has found, or was closing in on when its steps ran out.
#[derive(Debug, Clone, Copy)]
pub struct Found<T> {
    /// Of its pixel, in the tile.
    pub place: u32,
    /// Depth.
    t: T,
    pub point: [T; 3],
}

/// What turns surfaces into pixels; a worker has its own.
pub trait Shader<T: Native>: Send {
    /// Shows surfaces along a program that has the field's values there, or along the whole field.
    fn show(&mut self, program: Option<&Program<T>>, found: &[Found<T>], on: &mut Canvas);
}

/// What all workers show alike.
pub trait Shaders<T: Native>: Sync {
    fn shader(&self) -> Box<dyn Shader<T> + '_>;
    /// What a ray shows that ended with `status` where there is no surface.
    fn unlit(&self, status: Status) -> [u8; 3];
}

/// What is shown of all rays of a picture.
#[derive(Debug, Clone, Default)]
pub struct Image {
    pub normals: Vec<[f32; 3]>,
    pub rgb: Vec<[u8; 3]>,
    /// Of the time that all workers took, the share that went into showing.
    pub share: f64,
}

/// A picture in the making. What nobody has filled yet holds no values.
pub struct Blank {
    normals: Fresh<[f32; 3]>,
    rgb: Fresh<[u8; 3]>,
}

impl Blank {
    pub fn new(pixels: usize) -> Self {
        Self { normals: Fresh::new(pixels), rgb: Fresh::new(pixels) }
    }

    /// So many pixels each.
    pub fn bands(&mut self, size: usize) -> impl IndexedParallelIterator<Item = Band<'_>> {
        let pieces = self.normals.pieces(size).zip(self.rgb.pieces(size));
        pieces.map(|(normals, rgb)| Band { normals, rgb })
    }

    /// Once all bands are filled, and what it took.
    pub fn done(self, times: &[Times]) -> Image {
        let sum = |of: fn(&Times) -> f64| times.iter().map(of).sum::<f64>();
        let (all, showing) = (sum(|t| t.all), sum(|t| t.showing));
        let share = if all > 0.0 { showing / all } else { 0.0 };
        Image { normals: self.normals.done(), rgb: self.rgb.done(), share }
    }
}

/// Whole rows of a picture, which some tiles share.
pub struct Band<'a> {
    normals: Piece<'a, [f32; 3]>,
    rgb: Piece<'a, [u8; 3]>,
}

impl<'a> Band<'a> {
    /// As if nothing was hit, filled at once: processors write whole lines without reading them first.
    pub fn tiles(self, order: &Order, miss: [u8; 3], number: usize) -> Vec<Canvas<'a>> {
        let (mut normals, mut rgb) = (Cut(self.normals.clear()), Cut(self.rgb.fill(miss)));
        let tiles = order.band().0;
        let first = number * tiles;
        let canvas = |tile| Canvas { corner: order.corner(tile), rows: Vec::with_capacity(order.rows()) };
        let mut canvases: Vec<Canvas> = (first..order.tiles().min(first + tiles)).map(canvas).collect();
        order.pieces(number, |tile, n| {
            canvases[tile - first].rows.push(Row { normals: normals.take(n), rgb: rgb.take(n) });
        });
        canvases
    }
}

/// A tile's part of a picture.
#[derive(Default)]
pub struct Canvas<'a> {
    corner: Corner,
    rows: Vec<Row<'a>>,
}

struct Row<'a> {
    normals: &'a mut [[f32; 3]],
    rgb: &'a mut [[u8; 3]],
}

impl Canvas<'_> {
    /// Which pixel has that place.
    #[inline(always)]
    pub fn pixel(&self, place: u32) -> Pixel {
        self.corner.pixel(place)
    }

    #[inline(always)]
    pub fn set(&mut self, place: u32, normal: [f32; 3], rgb: [u8; 3]) {
        let (row, column) = parts(place);
        let row = &mut self.rows[row];
        (row.normals[column], row.rgb[column]) = (normal, rgb);
    }
}

/// Seconds that a worker spent on tiles, and of them on showing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Times {
    all: f64,
    showing: f64,
}

/// What a worker keeps from tile to tile.
pub struct Easel<'a, T: Native> {
    invalid: [u8; 3],
    shader: Box<dyn Shader<T> + 'a>,
    found: Vec<Found<T>>,
    /// Found where their cell's program says nothing.
    strays: Vec<Found<T>>,
    pub times: Times,
}

impl<'a, T: Native> Easel<'a, T> {
    pub fn new(shaders: &'a dyn Shaders<T>) -> Self {
        let (invalid, shader) = (shaders.unlit(Status::Invalid), shaders.shader());
        Self { invalid, shader, found: Vec::new(), strays: Vec::new(), times: Times::default() }
    }

    fn show(&mut self, program: Option<&Program<T>>, on: &mut Canvas) {
        let start = Instant::now();
        self.shader.show(program, &self.found, on);
        self.found.clear();
        self.times.showing += start.elapsed().as_secs_f64();
    }
}

/// A tile's surfaces.
pub struct Surface<'a, T: Native> {
    easel: Easel<'a, T>,
    canvas: Canvas<'a>,
    start: Instant,
}

impl<'a, T: Native> Surface<'a, T> {
    pub fn new(easel: Easel<'a, T>, canvas: Canvas<'a>) -> Self {
        Self { easel, canvas, start: Instant::now() }
    }

    /// A ray has ended.
    #[inline(always)]
    pub fn end(&mut self, place: u32, end: &End<T>, point: impl FnOnce() -> [T; 3]) {
        match end.status {
            Status::Hit | Status::OutOfSteps => {
                self.easel.found.push(Found { place, t: end.t, point: point() })
            }
            Status::Miss => {}
            Status::Invalid => self.canvas.set(place, [0.0; 3], self.easel.invalid),
        }
    }

    /// Whether something was found that belongs to a cell.
    #[inline(always)]
    pub fn waits(&self) -> bool {
        !self.easel.found.is_empty()
    }

    /// Shows what was found in a cell: along its program, if it lies between its depths.
    pub fn show(&mut self, program: &Program<T>, depths: Range<T>) {
        let Easel { found, strays, .. } = &mut self.easel;
        let outside = |of: &Found<T>| !(depths.start <= of.t && of.t < depths.end);
        if found.iter().fold(false, |any, of| any | outside(of)) {
            strays.extend(found.extract_if(.., |of| outside(of)));
        }
        if !self.easel.found.is_empty() {
            self.easel.show(Some(program), &mut self.canvas);
        }
    }

    /// What was found belongs to no cell.
    pub fn show_later(&mut self) {
        let Easel { found, strays, .. } = &mut self.easel;
        strays.append(found);
    }

    /// What is left is shown along the whole field.
    pub fn finish(mut self) -> Easel<'a, T> {
        let Easel { found, strays, .. } = &mut self.easel;
        found.append(strays);
        if !found.is_empty() {
            self.easel.show(None, &mut self.canvas);
        }
        self.easel.times.all += self.start.elapsed().as_secs_f64();
        self.easel
    }
}
