//! From a scene and a camera to a picture: trace, then normals, then light.
//!
//! Rays are made band by band, tile by tile, never all at once. Twin: the GPU's render.
//! Law: the same bits for any number of threads, and the hits are those of `march::trace` on the
//! camera's rays (tests below).

use std::time::Instant;

use rayon::prelude::*;
use sdfrs_core::{Control, Hits, Limits, Program, Rays, Shape, Span, Status, contract, eval::Native, pool};

use crate::{
    budget,
    camera::{Camera, Frame},
    error::TraceError,
    march,
    shade::{PointLight, Surface, normal::Gradients},
    stats::Summary,
    tracer::Tracer,
};

/// Rays in memory at a time: some hundred tiles, so that no worker waits long for the last one.
const BAND: u64 = 1 << 18;
/// Consecutive pixels shaded by one worker at a time.
const TILE: usize = 1024;

/// What is rendered.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    pub shape: &'a Shape,
    pub camera: &'a Camera,
    pub lights: &'a [PointLight],
    pub surface: Surface,
}

/// Seconds spent.
#[derive(Debug, Clone, Copy, Default)]
pub struct Timings {
    pub trace_seconds: f64,
    pub shade_seconds: f64,
}

/// A picture and everything known about its rays; row-major, row 0 at the top.
#[derive(Debug, Clone)]
pub struct Picture<T> {
    pub width: u32,
    pub height: u32,
    /// Unit length; zero where nothing was hit.
    pub normals: Vec<[f32; 3]>,
    pub rgb: Vec<[u8; 3]>,
    pub hits: Hits<T>,
    pub summary: Summary,
    pub timings: Timings,
}

impl<T> Picture<T> {
    /// Distance along each pixel's ray, infinite on a miss.
    pub fn depth(&self) -> &[T] {
        &self.hits.t
    }
}

/// Traces all rays of a camera from t = 0, without shading.
pub fn trace_camera<T: Native>(
    shape: &Shape,
    camera: &Camera,
    tracer: &Tracer,
    limits: &Limits,
    t_max: f64,
    control: &Control,
) -> Result<(Hits<T>, Summary), TraceError> {
    let program = Program::<T>::for_tracing(shape)?;
    let frame = checked(camera)?;
    let start = Instant::now();
    let hits = trace_frame(&program, &frame, camera.pixels(), tracer, limits, t_max, control)?;
    let summary = summarise(shape, &program, &hits, start.elapsed().as_secs_f64());
    Ok((hits, summary))
}

/// Renders a picture.
pub fn render<T: Native>(
    scene: &Scene,
    tracer: &Tracer,
    limits: &Limits,
    t_max: f64,
    control: &Control,
) -> Result<Picture<T>, TraceError> {
    scene.surface.check()?;
    scene.lights.iter().try_for_each(PointLight::check)?;
    let program = Program::<T>::for_tracing(scene.shape)?;
    let frame = checked(scene.camera)?;
    let start = Instant::now();
    let hits = trace_frame(&program, &frame, scene.camera.pixels(), tracer, limits, t_max, control)?;
    let trace_seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let (normals, rgb) = shade(&program, &frame, scene, &hits, control)?;
    let shade_seconds = start.elapsed().as_secs_f64();
    Ok(Picture {
        width: scene.camera.width,
        height: scene.camera.height,
        normals,
        rgb,
        summary: summarise(scene.shape, &program, &hits, trace_seconds),
        hits,
        timings: Timings { trace_seconds, shade_seconds },
    })
}

/// The camera's frame, if there is memory for its picture.
fn checked(camera: &Camera) -> Result<Frame, TraceError> {
    let frame = camera.frame()?;
    budget::check_image(camera.width.into(), camera.height.into())?;
    Ok(frame)
}

fn summarise<T: Native>(shape: &Shape, program: &Program<T>, hits: &Hits<T>, seconds: f64) -> Summary {
    Summary::of(hits, seconds, shape.meta().lip_trace, program.tape().instructions().len() as u64)
}

fn trace_frame<T: Native>(
    program: &Program<T>,
    frame: &Frame,
    pixels: u64,
    tracer: &Tracer,
    limits: &Limits,
    t_max: f64,
    control: &Control,
) -> Result<Hits<T>, TraceError> {
    let mut hits = Hits::default();
    let (mut origins, mut directions) = (Vec::new(), Vec::new());
    for start in (0..pixels).step_by(BAND as usize) {
        rays(frame, start..pixels.min(start + BAND), &mut origins, &mut directions)?;
        let (t_min, t_max) = (Span::All(T::of(0.0)), Span::All(T::of(t_max)));
        let band = Rays { origins: &origins, directions: &directions, t_min, t_max };
        append(&mut hits, march::trace(program, tracer, &band, limits, control)?);
    }
    Ok(hits)
}

/// The rays of some pixels, exactly as a caller would have to hand them to `march::trace`.
fn rays<T: Native>(
    frame: &Frame,
    pixels: std::ops::Range<u64>,
    origins: &mut Vec<[T; 3]>,
    directions: &mut Vec<[T; 3]>,
) -> Result<(), TraceError> {
    origins.clear();
    directions.clear();
    frame.fill(pixels, origins, directions);
    Ok(contract::check_rays(origins, directions)?)
}

fn append<T>(all: &mut Hits<T>, mut band: Hits<T>) {
    if all.t.is_empty() {
        *all = band;
        return;
    }
    all.t.append(&mut band.t);
    all.status.append(&mut band.status);
    all.steps.append(&mut band.steps);
    all.fallbacks.append(&mut band.fallbacks);
    all.multiplier.append(&mut band.multiplier);
    all.distance.append(&mut band.distance);
    all.witness.append(&mut band.witness);
    all.flags.append(&mut band.flags);
}

type Shaded = (Vec<[f32; 3]>, Vec<[u8; 3]>);

/// Normals and colours of all pixels, tile by tile on the pool.
fn shade<T: Native>(
    program: &Program<T>,
    frame: &Frame,
    scene: &Scene,
    hits: &Hits<T>,
    control: &Control,
) -> Result<Shaded, TraceError> {
    let mut normals = vec![[0f32; 3]; hits.t.len()];
    let mut rgb = vec![[0u8; 3]; hits.t.len()];
    pool::install(|| {
        let tiles = normals.par_chunks_mut(TILE).zip(rgb.par_chunks_mut(TILE)).enumerate();
        tiles.try_for_each_init(Tile::new, |tile, (i, (normals, rgb))| {
            if control.is_cancelled() {
                return Err(TraceError::Cancelled);
            }
            tile.shade(program, frame, scene, hits, i * TILE, normals, rgb)
        })
    })?;
    Ok((normals, rgb))
}

/// A worker's memory.
struct Tile<T: Native> {
    origins: Vec<[T; 3]>,
    directions: Vec<[T; 3]>,
    /// Of the pixels that show something: where they are in the tile, and their points and rays.
    at: Vec<usize>,
    points: Vec<[T; 3]>,
    towards: Vec<[T; 3]>,
    normals: Vec<[T; 3]>,
    gradients: Gradients<T>,
}

impl<T: Native> Tile<T> {
    fn new() -> Self {
        Self {
            origins: Vec::new(),
            directions: Vec::new(),
            at: Vec::new(),
            points: Vec::new(),
            towards: Vec::new(),
            normals: Vec::new(),
            gradients: Gradients::new(),
        }
    }

    #[allow(clippy::too_many_arguments)] // the whole picture in, one tile of it out
    fn shade(
        &mut self,
        program: &Program<T>,
        frame: &Frame,
        scene: &Scene,
        hits: &Hits<T>,
        first: usize,
        normals: &mut [[f32; 3]],
        rgb: &mut [[u8; 3]],
    ) -> Result<(), TraceError> {
        let pixels = first as u64..(first + rgb.len()) as u64;
        rays(frame, pixels, &mut self.origins, &mut self.directions)?;
        self.at.clear();
        self.points.clear();
        self.towards.clear();
        let none = [T::of(0.0); 3];
        for (i, pixel) in rgb.iter_mut().enumerate() {
            let (status, t) = (hits.status[first + i], hits.t[first + i]);
            // A ray out of steps shows the surface it was closing in on.
            if status == Status::Hit as u8 || status == Status::OutOfSteps as u8 {
                let (o, d) = (self.origins[i], self.directions[i]);
                self.at.push(i);
                self.points.push(std::array::from_fn(|a| o[a] + t * d[a]));
                self.towards.push(d);
            } else {
                *pixel = scene.surface.pixel(scene.lights, status, none, none);
            }
        }
        self.gradients.normals(program, &self.points, &self.towards, &mut self.normals);
        for (k, &i) in self.at.iter().enumerate() {
            let (point, normal) = (self.points[k], self.normals[k]);
            rgb[i] = scene.surface.pixel(scene.lights, hits.status[first + i], point, normal);
            normals[i] = normal.map(|v| v.f64() as f32);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
