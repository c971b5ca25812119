//! Normals and colours of what rays have found: gradients, and light; some packs at a time.
//!
//! Law: a pixel is what `Light::pixel` gives for it; the same bits for any number of threads (tests in `render`).

use sdfrs_core::{
    Program, Real, Scratch, Status,
    eval::{Kernel, Lanes, Native, vectorise},
};

use super::{
    direct::{Lamps, Light},
    normal::{aimed, unit},
    srgb::{self, Srgb},
};
use crate::march::{Bundle, Canvas, Found, Pixel, Shader, Shaders, Source, WIDEST};

/// Surfaces from rays to bytes at a time: what is known of them stays in the nearest cache.
const RUN: usize = 256;

/// What all workers show alike.
pub struct Shading<'a, T: Native> {
    program: &'a Program<T>,
    rays: &'a dyn Source<T>,
    light: Light<'a>,
    lamps: Lamps<T>,
}

impl<'a, T: Native> Shading<'a, T> {
    /// What rays of a program's field find in such light.
    pub fn new(program: &'a Program<T>, rays: &'a dyn Source<T>, light: Light<'a>) -> Self {
        Self { program, rays, light, lamps: light.lamps() }
    }
}

impl<T: Native> Shaders<T> for Shading<'_, T> {
    fn shader(&self) -> Box<dyn Shader<T> + '_> {
        Box::new(Worker { shading: self, scratch: Scratch::new(), run: Run::blank() })
    }

    fn unlit(&self, status: Status) -> [u8; 3] {
        self.light.surface.unlit(status as u8)
    }
}

/// One that shows, and its memory.
struct Worker<'a, T: Native> {
    shading: &'a Shading<'a, T>,
    scratch: Scratch<T>,
    run: Run<T>,
}

impl<T: Native> Shader<T> for Worker<'_, T> {
    fn show(&mut self, program: Option<&Program<T>>, found: &[Found<T>], on: &mut Canvas) {
        let Self { shading, scratch, run } = self;
        let program = program.unwrap_or(shading.program);
        for found in found.chunks(RUN) {
            run.meet(found);
            let n = found.len().next_multiple_of(T::Lanes::WIDTH);
            let ([x, y, z], [v, dx, dy, dz]) = (&run.points, &mut run.gradient);
            let out = [&mut v[..n], &mut dx[..n], &mut dy[..n], &mut dz[..n]];
            program.gradient(scratch, [&x[..n], &y[..n], &z[..n]], out);
            let mut all_aimed = true;
            vectorise(Lit { lamps: &shading.lamps, run, n, all_aimed: &mut all_aimed });
            if !all_aimed {
                run.face(shading.rays, found, on);
                vectorise(Lit { lamps: &shading.lamps, run, n, all_aimed: &mut all_aimed });
            }
            run.show(shading.lamps.grey(), found, on);
        }
    }
}

/// What is known of some surfaces, in whole packs.
struct Run<T: Native> {
    points: [[T; RUN]; 3],
    /// Directions of their rays, where a slope has none.
    towards: [[T; RUN]; 3],
    /// The field's value and slopes.
    gradient: [[T; RUN]; 4],
    normal: [[T; RUN]; 3],
    /// Linear, and its steps in the table of bytes.
    colour: [[T; RUN]; 3],
    steps: [[u32; RUN]; 3],
}

impl<T: Native> Run<T> {
    fn blank() -> Self {
        let none = [[T::default(); RUN]; 3];
        let gradient = [[T::default(); RUN]; 4];
        Self { points: none, towards: none, gradient, normal: none, colour: none, steps: [[0; RUN]; 3] }
    }

    /// Where the rays have come to. Lanes beyond are as the last one.
    fn meet(&mut self, found: &[Found<T>]) {
        let Some(last) = found.last() else { return };
        let [x, y, z] = &mut self.points;
        let n = found.len().next_multiple_of(T::Lanes::WIDTH);
        let points = found.iter().chain(std::iter::repeat_n(last, n - found.len()));
        for (((x, y), z), found) in x.iter_mut().zip(y).zip(z).zip(points) {
            [*x, *y, *z] = found.point;
        }
    }

    /// Makes the rays again, for their directions.
    #[cold]
    fn face(&mut self, rays: &dyn Source<T>, found: &[Found<T>], on: &Canvas) {
        let mut bundle = Bundle::blank();
        for (found, at) in found.chunks(T::Lanes::WIDTH).zip((0..).step_by(T::Lanes::WIDTH)) {
            let mut pixels = [Pixel::default(); WIDEST];
            for (pixel, found) in pixels.iter_mut().zip(found) {
                *pixel = on.pixel(found.place);
            }
            rays.bundle(&pixels[..found.len()], &mut bundle);
            for (d, towards) in bundle.direction.iter().zip(&mut self.towards) {
                d.store(&mut towards[at..at + T::Lanes::WIDTH]);
            }
        }
    }

    /// Normals and bytes to where they belong.
    fn show(&self, grey: bool, found: &[Found<T>], on: &mut Canvas) {
        let (table, Self { normal: [x, y, z], colour: [r, g, b], steps, .. }) = (Srgb::get(), self);
        for (i, found) in found.iter().enumerate().take(RUN) {
            let first = table.at(steps[0][i], r[i]);
            // Where there is no colour one byte tells all.
            let rgb = match grey {
                true => [first; 3],
                false => [first, table.at(steps[1][i], g[i]), table.at(steps[2][i], b[i])],
            };
            on.set(found.place, [x[i], y[i], z[i]].map(|v| v.f64() as f32), rgb);
        }
    }
}

/// Normals from gradients, and the light there.
struct Lit<'a, T: Native> {
    lamps: &'a Lamps<T>,
    run: &'a mut Run<T>,
    n: usize,
    /// Whether every slope had a direction.
    all_aimed: &'a mut bool,
}

impl<T: Native> Kernel for Lit<'_, T> {
    #[inline(always)]
    fn run(self) {
        let Run { points, towards, gradient: [_, slopes @ ..], normal, colour, steps } = self.run;
        let width = T::Lanes::WIDTH;
        let mut all = T::Lanes::c(1.0);
        for at in (0..self.n.min(RUN)).step_by(width) {
            let slope = pack(slopes, at);
            all = all.min(aimed(slope));
            let n = unit(slope, pack(towards, at));
            let rgb = self.lamps.linear(pack(points, at), n);
            for a in 0..3 {
                n[a].store(&mut normal[a][at..at + width]);
                rgb[a].store(&mut colour[a][at..at + width]);
                srgb::step(rgb[a]).cells(&mut steps[a][at..at + width]);
            }
        }
        *self.all_aimed = all.least() > T::of(0.0);
    }
}

/// A pack of three columns. No closure, nor a `map` over arrays: those are calls, without the kernel's instructions.
#[inline(always)]
fn pack<T: Native>([x, y, z]: &[[T; RUN]; 3], at: usize) -> [T::Lanes; 3] {
    let at = at..at + T::Lanes::WIDTH;
    [T::Lanes::load(&x[at.clone()]), T::Lanes::load(&y[at.clone()]), T::Lanes::load(&z[at])]
}
