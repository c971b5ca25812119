//! The exact walk through a texture that stands alone: from voxel to voxel, and in each the cubic's root.
//!
//! Where the texture's own steps reach farther than a voxel they are taken; near the surface the ray visits
//! cell by cell and asks each for its first root, so a hit lies on the interpolant's surface to the last
//! digits, whatever `eps` is. Placements (moved, turned, scaled) keep the ray's parameter. A step is an
//! evaluation of the field or of a cell's cubic. A scene of more than the texture is traced by `march`.
//! Law: `tests.rs` beside it; hits agree with a march at 1e-9 in f64, and none is missed.

use std::sync::Arc;

use sdfrs_core::{
    Control, Grid, Hits, Limits, Program, Scalar, Shape, Status,
    contract::FLAG_INSIDE,
    eval::Native,
    grid::{Step, Stepping, bricks_along, voxel},
    math::{Matrix, rotation},
    shape::Kind,
};

use crate::{
    error::TraceError,
    march::{self, End, Image, Ray, Shaders, Source},
    tracer::Tracer,
};

/// A texture and how points of the scene become points of its own.
pub struct Placed {
    grid: Arc<Grid>,
    m: Matrix,
    t: [f64; 3],
}

/// The texture that a shape is, moved, turned or scaled; None for any other shape, and for textures that
/// ask for another stepping.
pub fn placed(shape: &Shape) -> Option<Placed> {
    let mut m: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut t = [0.0; 3];
    let mut shape = shape;
    loop {
        match shape.kind() {
            Kind::Texture { grid } if grid.stepping() == Stepping::Voxel => {
                return Some(Placed { grid: grid.clone(), m, t });
            }
            Kind::Translate { offset } => t = std::array::from_fn(|i| t[i] - offset[i]),
            Kind::Rotate { angle, axis } => {
                // The point goes back by the transpose.
                let r = rotation(*angle, axis);
                let back = |v: [f64; 3], i: usize| r[0][i] * v[0] + r[1][i] * v[1] + r[2][i] * v[2];
                let column = |j: usize| [m[0][j], m[1][j], m[2][j]];
                m = std::array::from_fn(|i| std::array::from_fn(|j| back(column(j), i)));
                t = std::array::from_fn(|i| back(t, i));
            }
            Kind::Scale { factors } => {
                for i in 0..3 {
                    m[i] = m[i].map(|v| v / factors[i]);
                    t[i] /= factors[i];
                }
            }
            Kind::WithBounds { .. } => {}
            _ => return None,
        }
        shape = shape.children().first()?;
    }
}

/// Traces a shape's rays: voxel by voxel where it is a texture that asks for it, by `march` elsewhere.
pub fn trace<T: Native>(
    shape: &Shape,
    program: &Program<T>,
    tracer: &Tracer,
    rays: &dyn Source<T>,
    limits: &Limits,
    control: &Control,
) -> Result<Hits<T>, TraceError> {
    match placed(shape) {
        Some(placed) => Ok(placed.trace(program, tracer, rays, limits, control, None)?.0),
        None => march::trace_source(program, tracer, rays, limits, control),
    }
}

/// The same for the rays of a picture, row by row; what they find is shown.
pub fn trace_shown<T: Native>(
    shape: &Shape,
    program: &Program<T>,
    tracer: &Tracer,
    rays: &dyn Source<T>,
    limits: &Limits,
    control: &Control,
    shaders: &dyn Shaders<T>,
) -> Result<(Hits<T>, Image), TraceError> {
    match placed(shape) {
        Some(placed) => placed.trace(program, tracer, rays, limits, control, Some(shaders)),
        None => march::trace_shown(program, tracer, rays, limits, control, shaders),
    }
}

impl Placed {
    pub fn grid(&self) -> &Arc<Grid> {
        &self.grid
    }

    /// From the scene to cells: three factors and an offset for each axis.
    pub fn to_cells(&self) -> [[f64; 4]; 3] {
        let ((lo, _), h) = (self.grid.bounds(), self.grid.spacing());
        std::array::from_fn(|i| {
            let [x, y, z] = self.m[i].map(|v| v / h[i]);
            [x, y, z, (self.t[i] - lo[i]) / h[i]]
        })
    }

    /// A ray in cells; in f64 as far as the grid's own frame, the rest is the ray's precision.
    pub fn line<T: Native>(&self, ray: &Ray<T>) -> Line<T> {
        let (o, d) = (ray.origin.map(T::f64), ray.direction.map(T::f64));
        let (lo, _) = self.grid.bounds();
        let h = self.grid.spacing();
        let turn = |v: [f64; 3], i: usize| self.m[i][0] * v[0] + self.m[i][1] * v[1] + self.m[i][2] * v[2];
        Line {
            o: std::array::from_fn(|i| T::of((turn(o, i) + self.t[i] - lo[i]) / h[i])),
            d: std::array::from_fn(|i| T::of(turn(d, i) / h[i])),
            speed: T::of((0..3).map(|i| turn(d, i).powi(2)).sum::<f64>().sqrt()),
        }
    }

    fn trace<T: Native>(
        &self,
        program: &Program<T>,
        tracer: &Tracer,
        rays: &dyn Source<T>,
        limits: &Limits,
        control: &Control,
        shaders: Option<&dyn Shaders<T>>,
    ) -> Result<(Hits<T>, Image), TraceError> {
        tracer.check()?;
        let walk = |ray: &Ray<T>| self.walk(ray, limits.max_steps);
        let (hits, image) = march::trace_each(program, walk, rays, limits, control, shaders)?;
        Ok((Hits { threshold: T::of(limits.eps), ..hits }, image))
    }

    fn walk<T: Native>(&self, ray: &Ray<T>, most: u32) -> End<T> {
        Walk { grid: &self.grid, line: self.line(ray), steps: 0, most }.run(ray)
    }
}

/// A ray in cells: a point has its cell's number before the point and its place in the cell behind.
#[derive(Debug, Clone, Copy)]
pub struct Line<T> {
    pub o: [T; 3],
    pub d: [T; 3],
    /// Length in the texture's space of a step of length 1.
    pub speed: T,
}

impl<T: Scalar> Line<T> {
    fn at(&self, t: T) -> [T; 3] {
        std::array::from_fn(|i| self.o[i] + t * self.d[i])
    }
    /// Where the line leaves a box of cells, and through which wall.
    fn leaves(&self, low: [T; 3], high: [T; 3]) -> (T, usize) {
        let (mut t, mut axis) = (T::INFINITY, 0);
        for a in 0..3 {
            let wall = if self.d[a] > T::of(0.0) { high[a] } else { low[a] };
            let to = (wall - self.o[a]) / self.d[a];
            if self.d[a] != T::of(0.0) && to < t {
                (t, axis) = (to, a);
            }
        }
        (t, axis)
    }
    /// Where the line is inside a box that starts at the origin.
    fn within(&self, size: [T; 3]) -> (T, T) {
        let (mut from, mut to) = (-T::INFINITY, T::INFINITY);
        for a in 0..3 {
            if self.d[a] == T::of(0.0) {
                if !(self.o[a] >= T::of(0.0) && self.o[a] <= size[a]) {
                    return (T::INFINITY, -T::INFINITY);
                }
                continue;
            }
            let (p, q) = ((T::of(0.0) - self.o[a]) / self.d[a], (size[a] - self.o[a]) / self.d[a]);
            from = from.max(p.min(q));
            to = to.min(p.max(q));
        }
        (from, to)
    }
}

struct Walk<'a, T> {
    grid: &'a Grid,
    line: Line<T>,
    steps: u32,
    most: u32,
}

impl<T: Native> Walk<'_, T> {
    fn run(mut self, ray: &Ray<T>) -> End<T> {
        let cells = self.grid.dims().map(|n| n - 1);
        let (from, to) = self.line.within(cells.map(|n| T::of(n as f64)));
        let start = ray.t_min.max(from);
        let end = ray.t_max.min(to);
        if ray.origin.iter().chain(&ray.direction).any(|v| v.is_nan()) {
            return self.end(ray.t_min, Status::Invalid, T::of(0.0));
        }
        if !(start <= end) {
            self.steps += 1;
            return self.end(T::INFINITY, Status::Miss, T::INFINITY);
        }
        let mut t = start;
        let mut cell = self.cell_at(t, cells);
        loop {
            if self.steps >= self.most {
                return self.end(t, Status::OutOfSteps, T::INFINITY);
            }
            self.steps += 1;
            let voxel::Cell::Corners(corners) = self.grid.cell::<T>(cell) else {
                t = self.over_brick(t, cell);
                if !(t < end) {
                    return self.end(T::INFINITY, Status::Miss, T::INFINITY);
                }
                cell = self.cell_at(t, cells);
                continue;
            };
            let (low, high) = (cell.map(|v| T::of(v as f64)), cell.map(|v| T::of((v + 1) as f64)));
            let (leaves, axis) = self.line.leaves(low, high);
            let out = leaves.min(end).max(t);
            let here = |t: T| -> [T; 3] {
                let p = self.line.at(t);
                std::array::from_fn(|a| (p[a] - low[a]).max(T::of(0.0)).min(T::of(1.0)))
            };
            let (a, e) = (here(t), here(out));
            if let Some(s) = voxel::first_root(&corners, a, std::array::from_fn(|i| e[i] - a[i])) {
                let hit = t + s * (out - t);
                let flags = if hit == ray.t_min { FLAG_INSIDE } else { 0 };
                return End { flags, ..self.end(hit, Status::Hit, T::of(0.0)) };
            }
            let step = self.step(out);
            if !(leaves < end) {
                return self.end(T::INFINITY, Status::Miss, T::INFINITY);
            }
            // A step beyond the next cell is worth an evaluation there; a shorter one is not.
            if step > (out - t) + (out - t) {
                t = out + step;
                if !(t < end) {
                    return self.end(T::INFINITY, Status::Miss, T::INFINITY);
                }
                cell = self.cell_at(t, cells);
            } else {
                t = out;
                let ahead = self.line.d[axis] > T::of(0.0);
                if (ahead && cell[axis] + 1 == cells[axis]) || (!ahead && cell[axis] == 0) {
                    return self.end(T::INFINITY, Status::Miss, T::INFINITY);
                }
                cell[axis] = if ahead { cell[axis] + 1 } else { cell[axis] - 1 };
            }
        }
    }

    fn end(&self, t: T, status: Status, r: T) -> End<T> {
        let (steps, witness, multiplier) = (self.steps, T::of(0.0), T::of(1.0));
        End { t, r, witness, multiplier, steps, fallbacks: 0, status, flags: 0 }
    }

    fn cell_at(&self, t: T, cells: [usize; 3]) -> [usize; 3] {
        let p = self.line.at(t);
        std::array::from_fn(|a| (p[a].max(T::of(0.0)).f64() as usize).min(cells[a] - 1))
    }

    /// How far the texture's own rule reaches from `t` on, in the ray's parameter.
    fn step(&mut self, t: T) -> T {
        let (p, (lo, _), h) = (self.line.at(t), self.grid.bounds(), self.grid.spacing());
        let p = std::array::from_fn(|a| T::of(lo[a]) + p[a] * T::of(h[a]));
        // What rounding of the place may add to the value.
        let slack = T::of(1.0 - 1e-3);
        self.grid.sample(p, Step::Safe).max(T::of(0.0)) * slack / self.line.speed
    }

    /// Behind a brick without samples, or farther where its value reaches farther.
    fn over_brick(&mut self, t: T, cell: [usize; 3]) -> T {
        let size = sdfrs_core::grid::BRICK;
        let count = bricks_along(self.grid.dims());
        let low = cell.map(|v| T::of((v / size * size) as f64));
        let high: [T; 3] = std::array::from_fn(|a| T::of(((cell[a] / size + 1).min(count[a]) * size) as f64));
        let (leaves, _) = self.line.leaves(low, high);
        // Not to stay on the wall for the rounding of its place.
        let past = leaves + (leaves.abs() + T::of(1.0)) * T::EPS * T::of(2.0);
        let reach = self.step(t);
        past.max(t + reach)
    }
}

#[cfg(test)]
mod tests;
