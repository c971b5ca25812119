//! From a scene and a camera to a picture: rays, and light on what they find.
//!
//! Rays are made as they are needed, never all at once. Twin: the GPU's render.
//! Law: the same bits for any number of threads, and the hits are those of `march::trace` on the
//! camera's rays (tests below).

use std::time::Instant;

use sdfrs_core::{
    Control, Hits, Limits, Program, Real, Shape, Span,
    contract::{check_rays, check_spans},
    eval::{Kernel, Lanes, Native, vectorise},
};

use crate::{
    budget,
    camera::{Camera, Frame},
    error::TraceError,
    march::{Bundle, Pixel, Ray, Source, WIDEST},
    shade::{Light, PointLight, Shading, Surface},
    stats::Summary,
    tracer::Tracer,
    voxel,
};

/// What is rendered.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    pub shape: &'a Shape,
    pub camera: &'a Camera,
    pub lights: &'a [PointLight],
    pub surface: Surface,
}

/// Seconds spent. Surfaces are shown as they are found: each has its share of the workers' time.
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

/// The rays of a camera, each made when it is asked for.
pub struct CameraRays<T> {
    pub frame: Frame,
    count: usize,
    t_max: T,
}

impl<T: Native> CameraRays<T> {
    /// Refuses cameras whose picture this machine can't hold, or whose rays this precision can't.
    pub fn new(camera: &Camera, tracer: &Tracer, t_max: f64) -> Result<Self, TraceError> {
        let frame = camera.frame()?;
        budget::check_image(camera.width.into(), camera.height.into())?;
        let t_max = T::of(t_max);
        check_spans(1, &Span::All(T::of(0.0)), &Span::All(t_max), tracer.needs_finite_range())?;
        // Origins are affine over the image: where the corners are finite, all are.
        let (right, bottom) = (camera.width - 1, camera.height - 1);
        let corners = [(0, 0), (right, 0), (0, bottom), (right, bottom)].map(|(x, y)| frame.ray(x, y));
        check_rays(&corners.map(|(o, _)| o.map(T::of)), &mut corners.map(|(_, d)| d.map(T::of)))?;
        Ok(Self { frame, count: camera.pixels() as usize, t_max })
    }
}

impl<T: Native> Source<T> for CameraRays<T> {
    fn count(&self) -> usize {
        self.count
    }
    fn width(&self) -> Option<usize> {
        Some(self.frame.width())
    }
    fn eye(&self) -> Option<([T; 3], T)> {
        self.frame.eye().map(|p| (p.map(T::of), self.t_max))
    }
    fn planar(&self) -> bool {
        true
    }
    fn ray(&self, i: usize) -> Ray<T> {
        let width = self.frame.width();
        // Both fit: a checked camera has at most 65536 columns and rows.
        let (o, d) = self.frame.ray((i % width) as u32, (i / width) as u32);
        let d = d.map(T::of);
        // As `check_rays` does for rays that come as a batch, so that both give the same bits.
        let length = T::len3(d[0], d[1], d[2]);
        Ray { origin: o.map(T::of), direction: d.map(|v| v / length), t_min: T::of(0.0), t_max: self.t_max }
    }
    fn bundle(&self, pixels: &[Pixel], to: &mut Bundle<T::Lanes>) {
        vectorise(Lines { rays: self, pixels, to });
    }
}

/// A camera's rays, a pack at a time. Law: the bits of `CameraRays::ray` (tests below).
struct Lines<'a, T: Native> {
    rays: &'a CameraRays<T>,
    pixels: &'a [Pixel],
    to: &'a mut Bundle<T::Lanes>,
}

impl<T: Native> Kernel for Lines<'_, T> {
    #[inline(always)]
    fn run(self) {
        type Double = <f64 as Native>::Lanes;
        let mut lines = [[0.0f64; WIDEST]; 6];
        for at in (0..T::Lanes::WIDTH).step_by(Double::WIDTH) {
            let rest = self.pixels.get(at..).unwrap_or_default();
            let short: [Pixel; Double::WIDTH];
            let pixels = match rest.first_chunk() {
                Some(pixels) => pixels,
                None => {
                    short = few(rest, self.pixels.last());
                    &short
                }
            };
            let (mut x, mut y) = (Double::c(0.0), Double::c(0.0));
            for lane in 0..Double::WIDTH {
                x.set(lane, f64::from(pixels[lane].x()));
                y.set(lane, f64::from(pixels[lane].y()));
            }
            let (o, d) = self.rays.frame.lanes(x, y);
            for a in 0..3 {
                o[a].store(&mut lines[a][at..]);
                d[a].store(&mut lines[3 + a][at..]);
            }
        }
        let mut single = [[T::default(); WIDEST]; 6];
        for (single, line) in single.iter_mut().zip(&lines) {
            for lane in 0..T::Lanes::WIDTH {
                single[lane] = T::of(line[lane]);
            }
        }
        let [ox, oy, oz, dx, dy, dz] = &single;
        let (x, y, z) = (T::Lanes::load(dx), T::Lanes::load(dy), T::Lanes::load(dz));
        let length = T::Lanes::len3(x, y, z);
        *self.to = Bundle {
            origin: [T::Lanes::load(ox), T::Lanes::load(oy), T::Lanes::load(oz)],
            direction: [x / length, y / length, z / length],
            t: T::Lanes::c(0.0),
            t_max: T::Lanes::splat(self.rays.t_max),
        };
    }
}

/// A pack that is not full: the last pixel again.
#[cold]
#[inline(never)]
fn few<const N: usize>(rest: &[Pixel], last: Option<&Pixel>) -> [Pixel; N] {
    let last = last.copied().unwrap_or_default();
    std::array::from_fn(|lane| rest.get(lane).copied().unwrap_or(last))
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
    let rays = CameraRays::new(camera, tracer, t_max)?;
    let start = Instant::now();
    let hits = voxel::trace(shape, &program, tracer, &rays, limits, control)?;
    let summary = summarise(shape, &hits, start.elapsed().as_secs_f64());
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
    let rays = CameraRays::new(scene.camera, tracer, t_max)?;
    let light = Light { lights: scene.lights, surface: &scene.surface };
    let shading = Shading::new(&program, &rays, light);
    let start = Instant::now();
    let (hits, image) = voxel::trace_shown(scene.shape, &program, tracer, &rays, limits, control, &shading)?;
    let seconds = start.elapsed().as_secs_f64();
    let shade_seconds = seconds * image.share;
    let trace_seconds = seconds - shade_seconds;
    Ok(Picture {
        width: scene.camera.width,
        height: scene.camera.height,
        normals: image.normals,
        rgb: image.rgb,
        summary: summarise(scene.shape, &hits, trace_seconds),
        hits,
        timings: Timings { trace_seconds, shade_seconds },
    })
}

fn summarise<T: Native>(shape: &Shape, hits: &Hits<T>, seconds: f64) -> Summary {
    Summary::of(hits, seconds, shape.lipschitz())
}

#[cfg(test)]
mod tests;
