//! The walk from shapes to ops, on a stack of its own: visit a node, finish it when its operands are there.

use std::collections::{HashMap, HashSet};

use super::{
    Form, Graph,
    frame::{Frame, Frames},
    rules::{flatten, keeps_surface, slope},
};
use crate::{
    error::SceneError,
    math::rotation,
    op::Op,
    shape::{Kind, Shape, meta},
};

type Key = (usize, u32, Form);

enum Task<'a> {
    Visit(&'a Shape, u32, Form),
    /// Takes `n` operands off the values and pushes the node's own.
    Finish(&'a Shape, u32, Form, usize),
    /// Divides the value on top.
    Divide(f64),
    /// The value on top is no steeper than this, in the frame of that number.
    Bound(f64, u32),
}

/// A blend's constants: its width, and 1 / 4k as far as f32 goes.
fn blend(k: f64) -> [f64; 2] {
    [k, (0.25 / k).min(1e38)]
}

struct Lower<'a, 'g> {
    graph: &'g mut Graph,
    frames: Frames,
    tasks: Vec<Task<'a>>,
    values: Vec<u32>,
    /// Values of shared nodes.
    known: HashMap<Key, u32>,
}

pub fn lower(graph: &mut Graph, shape: &Shape, form: Form) -> Result<u32, SceneError> {
    let mut frames = Frames::default();
    let world = frames.intern(Frame::at([0, 1, 2], 1.0, false));
    let tasks = vec![Task::Visit(shape, world, form)];
    let mut state = Lower { graph, frames, tasks, values: Vec::new(), known: HashMap::new() };
    while let Some(task) = state.tasks.pop() {
        match task {
            Task::Visit(shape, frame, form) => match state.known.get(&(shape.ptr_id(), frame, form)) {
                Some(value) => state.values.push(*value),
                None if form == Form::Value || keeps_surface(shape.kind()) => {
                    state.visit(shape, frame, form)?
                }
                None => {
                    state.tasks.push(Task::Divide(shape.lipschitz()));
                    state.visit(shape, frame, Form::Value)?;
                }
            },
            Task::Bound(slope, frame) => {
                if let Some(top) = state.values.last() {
                    let at = state.frames.get(frame);
                    state.graph.bound(*top, slope * at.stretch, !at.jumps);
                }
            }
            Task::Divide(by) => {
                if let Some(top) = state.values.last_mut()
                    && by != 1.0
                {
                    *top = state.graph.emit(Op::DivC, &[*top], &[by])?;
                }
            }
            Task::Finish(shape, frame, form, n) => {
                let operands = state.values.split_off(state.values.len() - n);
                let value = state.finish(shape, frame, form, &operands)?;
                state.known.insert((shape.ptr_id(), frame, form), value);
                state.values.push(value);
            }
        }
    }
    state.values.pop().ok_or_else(|| SceneError::new("scene", "nothing to evaluate"))
}

impl<'a> Lower<'a, '_> {
    fn visit(&mut self, shape: &'a Shape, frame: u32, form: Form) -> Result<(), SceneError> {
        let at = self.frames.get(frame);
        let child = shape.children().first();
        match (shape.kind(), child) {
            (Kind::Translate { offset }, Some(child)) => self.pass(child, at.translated(offset), form),
            (Kind::Rotate { angle, axis }, Some(child)) => {
                self.pass(child, at.rotated(&rotation(*angle, axis)), form)
            }
            (Kind::WithLipschitz { .. } | Kind::Formula { .. }, Some(child)) => {
                self.tasks.push(Task::Bound(shape.lipschitz(), frame));
                self.pass(child, at, form);
            }
            (Kind::WithBounds { .. }, Some(child)) => self.pass(child, at, form),
            (Kind::Mirror { axis }, Some(child)) => {
                let mut p = at.coordinates(self.graph)?;
                p[*axis as usize] = self.graph.emit(Op::Abs, &[p[*axis as usize]], &[])?;
                self.pass(child, at.with_base(p), form);
            }
            (Kind::Twist { rate }, Some(child)) => {
                let [x, y, z] = at.coordinates(self.graph)?;
                let [x, z] = self.turned(*rate, y, [x, z])?;
                self.slowed(shape, child, form, frame);
                self.pass(child, Frame::at([x, y, z], f64::INFINITY, at.jumps), form);
            }
            (Kind::Bend { rate }, Some(child)) => {
                let [x, y, z] = at.coordinates(self.graph)?;
                let [u, v] = self.turned(*rate, x, [x, y])?;
                self.slowed(shape, child, form, frame);
                self.pass(child, Frame::at([u, v, z], f64::INFINITY, at.jumps), form);
            }
            (Kind::Scale { factors }, Some(child)) => {
                self.tasks.push(Task::Finish(shape, frame, form, 1));
                self.pass(child, at.scaled(factors), form);
            }
            (Kind::Elongate { amount }, Some(child)) => {
                let p = at.coordinates(self.graph)?;
                let mut q = p;
                for i in (0..3).filter(|&i| amount[i] > 0.0) {
                    q[i] = self.graph.emit(Op::Elongate, &[p[i]], &[amount[i]])?;
                }
                self.tasks.push(Task::Finish(shape, frame, form, 1));
                self.pass(child, at.with_base(q), form);
            }
            (Kind::Repeat { period, count }, Some(child)) => {
                self.repeat(shape, child, frame, form, period, count)?
            }
            (Kind::Union { k } | Kind::Intersection { k }, _) if *k == 0.0 => {
                let operands = flatten(shape);
                self.operands(shape, frame, form, operands.into_iter().map(|s| (s, form)).collect());
            }
            (Kind::Difference { k }, _) if *k == 0.0 => {
                let forms = [form, form.flipped()];
                self.operands(shape, frame, form, shape.children().iter().zip(forms).collect());
            }
            (Kind::Negate {}, _) => {
                self.operands(
                    shape,
                    frame,
                    form,
                    shape.children().iter().map(|s| (s, form.flipped())).collect(),
                );
            }
            _ => self.operands(shape, frame, form, shape.children().iter().map(|s| (s, form)).collect()),
        }
        Ok(())
    }

    /// A walk through a space that is turned on the way is shorter by as much as the turning is steep.
    fn slowed(&mut self, shape: &Shape, child: &Shape, form: Form, frame: u32) {
        if form == Form::Value {
            self.tasks.push(Task::Bound(shape.lipschitz(), frame));
            return;
        }
        if child.lipschitz() >= 1.0 {
            self.tasks.push(Task::Bound(1.0, frame));
        }
        self.tasks.push(Task::Divide(shape.lipschitz() / child.lipschitz()));
    }

    /// The node's value is its child's in another frame.
    fn pass(&mut self, child: &'a Shape, frame: Frame, form: Form) {
        let frame = self.frames.intern(frame);
        self.tasks.push(Task::Visit(child, frame, form));
    }

    fn operands(&mut self, shape: &'a Shape, frame: u32, form: Form, operands: Vec<(&'a Shape, Form)>) {
        self.tasks.push(Task::Finish(shape, frame, form, operands.len()));
        for (operand, form) in operands.into_iter().rev() {
            self.tasks.push(Task::Visit(operand, frame, form));
        }
    }

    /// Two coordinates turned by `rate * along`.
    fn turned(&mut self, rate: f64, along: u32, p: [u32; 2]) -> Result<[u32; 2], SceneError> {
        let angle = self.graph.emit(Op::MulC, &[along], &[rate])?;
        let c = self.graph.emit(Op::Cos, &[angle], &[])?;
        let s = self.graph.emit(Op::Sin, &[angle], &[])?;
        let [x, y] = p;
        Ok([self.graph.emit(Op::RotX, &[c, s, x, y], &[])?, self.graph.emit(Op::RotY, &[c, s, x, y], &[])?])
    }

    fn repeat(
        &mut self,
        shape: &'a Shape,
        child: &'a Shape,
        frame: u32,
        form: Form,
        period: &[f64; 3],
        count: &Option<[i64; 3]>,
    ) -> Result<(), SceneError> {
        let p = self.frames.get(frame).coordinates(self.graph)?;
        let copies = meta::copies(child.meta(), period)?;
        let at = self.frames.get(frame);
        // One copy of an even shape joins its neighbours without a jump; of several only the nearest counts.
        if copies.len() == 1 && child.lipschitz() >= 1.0 {
            let slope = if form == Form::Value { child.lipschitz() } else { 1.0 };
            self.tasks.push(Task::Bound(slope, frame));
        }
        self.tasks.push(Task::Finish(shape, frame, form, copies.len()));
        for copy in copies.into_iter().rev() {
            let mut q = p;
            for i in (0..3).filter(|&i| period[i] > 0.0) {
                let most = count.map_or(f64::INFINITY, |c| c[i] as f64);
                q[i] = self.graph.emit(Op::Repeat, &[p[i]], &[period[i], -most, most, copy[i] as f64])?;
            }
            self.pass(child, Frame::at(q, at.stretch, true), form);
        }
        Ok(())
    }

    fn finish(&mut self, shape: &Shape, frame: u32, form: Form, v: &[u32]) -> Result<u32, SceneError> {
        let at = self.frames.get(frame);
        match shape.kind() {
            Kind::Union { k } if *k == 0.0 => self.least(v),
            Kind::Repeat { .. } => self.least(v),
            Kind::Intersection { k } if *k == 0.0 => self.fold(Op::Max, v, &[]),
            Kind::Union { k } => self.fold(Op::Smin, v, &blend(*k)),
            Kind::Intersection { k } => self.fold(Op::Smax, v, &blend(*k)),
            Kind::Difference { k } => {
                let rest = self.graph.emit(Op::Neg, &[v[1]], &[])?;
                if *k == 0.0 {
                    self.graph.emit(Op::Max, &[v[0], rest], &[])
                } else {
                    self.graph.emit(Op::Smax, &[v[0], rest], &blend(*k))
                }
            }
            Kind::Negate {} => self.graph.emit(Op::Neg, v, &[]),
            Kind::Dilate { radius } => self.graph.emit(Op::SubC, v, &[*radius]),
            Kind::Shell { thickness } => self.graph.emit(Op::Shell, v, &[thickness / 2.0]),
            Kind::Displace {} => self.graph.emit(Op::Add, v, &[]),
            Kind::Scale { factors } => {
                let least = factors.iter().fold(f64::INFINITY, |a, b| a.min(*b));
                if least == 1.0 { Ok(v[0]) } else { self.graph.emit(Op::MulC, v, &[least]) }
            }
            Kind::Elongate { amount } => {
                if amount.contains(&0.0) {
                    return Ok(v[0]);
                }
                let p = at.coordinates(self.graph)?;
                let inside = self.graph.emit(Op::ElongateInside, &p, amount)?;
                self.graph.emit(Op::Add, &[v[0], inside], &[])
            }
            Kind::Expr(op) => self.graph.emit(meta::op_for(*op, v.len()), v, &[]),
            Kind::Const { value } => self.graph.emit(Op::Const, &[], &[*value]),
            Kind::Coordinate(axis) => Ok(at.coordinates(self.graph)?[*axis as usize]),
            kind => {
                let id = self.primitive(kind, &at, form)?;
                self.graph.bound(id, slope(kind, form) * at.stretch, false);
                Ok(id)
            }
        }
    }

    fn fold(&mut self, op: Op, v: &[u32], consts: &[f64]) -> Result<u32, SceneError> {
        let mut value = v[0];
        for next in &v[1..] {
            if op == Op::Smin || op == Op::Smax || *next != value {
                value = self.graph.emit(op, &[value, *next], consts)?;
            }
        }
        Ok(value)
    }

    /// Minimum of all values; spheres of one frame become one op.
    fn least(&mut self, v: &[u32]) -> Result<u32, SceneError> {
        let mut seen = HashSet::new();
        let mut rest = Vec::new();
        let mut spheres: Vec<([u32; 4], Vec<u32>)> = Vec::new();
        let mut group_of = HashMap::new();
        for &id in v.iter().filter(|id| seen.insert(**id)) {
            match self.graph.node(id) {
                Some(node) if node.op == Op::Sphere => {
                    let a = node.a;
                    let group = *group_of.entry(a).or_insert_with(|| {
                        spheres.push((a, Vec::new()));
                        spheres.len() - 1
                    });
                    spheres[group].1.push(id);
                }
                _ => rest.push(id),
            }
        }
        for (a, ids) in spheres {
            if ids.len() == 1 {
                rest.push(ids[0]);
                continue;
            }
            let nodes = ids.iter().filter_map(|id| self.graph.node(*id));
            let table: Vec<f64> = nodes.flat_map(|n| self.graph.constants(n).to_vec()).collect();
            let slope = ids.iter().map(|id| self.graph.known(*id).slope).fold(0.0, f64::max);
            let union = self.graph.emit(Op::SphereUnion, &a[..3], &table)?;
            self.graph.bound(union, slope, false);
            rest.push(union);
        }
        self.fold(Op::Min, &rest, &[])
    }

    /// Primitives that take their centre as constants: a translation costs no op of its own.
    fn placed(&mut self, kind: &Kind, at: &Frame) -> Result<Option<u32>, SceneError> {
        let half = |v: &f64| v / 2.0;
        let (op, sizes) = match kind {
            Kind::Sphere { radius } => (Op::Sphere, vec![*radius]),
            Kind::Box { size: [x, y, z] } => (Op::Box, vec![half(x), half(y), half(z), 0.0]),
            Kind::RoundedBox { size: [x, y, z], radius } => {
                (Op::Box, vec![half(x), half(y), half(z), *radius])
            }
            Kind::Torus { major, minor } => (Op::Torus, vec![*major, *minor]),
            Kind::Cylinder { radius, height } => (Op::Cylinder, vec![*radius, half(height)]),
            Kind::Cone { radius, height, top_radius } => {
                let n = (top_radius - radius).powi(2) + height * height;
                (Op::Cone, vec![half(height), *radius, *top_radius, 1.0 / n])
            }
            Kind::Ellipsoid { radii: [x, y, z] } => (Op::Ellipsoid, vec![*x, *y, *z, x.min(*y).min(*z)]),
            _ => return Ok(None),
        };
        let place = if op == Op::Sphere { at.turned_to() } else { at.moved_to() };
        let (p, centre) = match place {
            Some(centre) => (at.base, centre),
            None => (at.coordinates(self.graph)?, [0.0; 3]),
        };
        let consts: Vec<f64> = centre.into_iter().chain(sizes).collect();
        self.graph.emit(op, &p, &consts).map(Some)
    }

    fn primitive(&mut self, kind: &Kind, at: &Frame, form: Form) -> Result<u32, SceneError> {
        if let Some(placed) = self.placed(kind, at)? {
            return Ok(placed);
        }
        let p = at.coordinates(self.graph)?;
        match kind {
            Kind::Capsule { a, b, radius } => {
                let d: [f64; 3] = std::array::from_fn(|i| b[i] - a[i]);
                let n: f64 = d.iter().map(|v| v * v).sum();
                let inv = if n > 0.0 { 1.0 / n } else { 0.0 };
                self.graph.emit(Op::Capsule, &p, &[a[0], a[1], a[2], d[0], d[1], d[2], inv, *radius])
            }
            Kind::Plane { normal, point } => {
                let len = normal.iter().map(|v| v * v).sum::<f64>().sqrt();
                let [x, y, z] = normal.map(|v| v / len);
                self.graph.emit(Op::Dot, &p, &[x, y, z, -(x * point[0] + y * point[1] + z * point[2])])
            }
            Kind::Gyroid { period, thickness } => {
                let freq = std::f64::consts::TAU / period;
                self.graph.emit(Op::Gyroid, &p, &[freq, 1.0 / (3f64.sqrt() * freq), thickness / 2.0])
            }
            Kind::Mandelbulb { power, iterations } => {
                // At radius 2 the estimate is about ln 2; the outer field must also stay below the distance.
                let start = 2.0 - f64::min(std::f64::consts::LN_2, 2.0 - meta::mandelbulb_radius(*power));
                self.graph.emit(Op::Mandelbulb, &p, &[*power as f64, *iterations as f64, start])
            }
            Kind::Texture { grid } => {
                let op = match form {
                    Form::Value => Op::Texture,
                    Form::Walk => Op::TextureSafe,
                    Form::WalkNegated => Op::TextureSafeNegated,
                };
                let index = self.graph.grid(grid);
                self.graph.emit(op, &p, &[index])
            }
            other => Err(SceneError::new(other.op(), "cannot be evaluated here")),
        }
    }
}
