//! Triangles to a grid of signed distances.
//!
//! Everything is done relative to the middle of the grid's box and divided by a power of two, in f64 until the kernels
//! round once: offsets and scales change no digit.

use std::sync::Mutex;

use glam::DVec3;
use rayon::prelude::*;
use sdfrs_core::eval::{Isa, isa};

use crate::{
    Mesh, MeshError, Pulse, Watch,
    afterwards::Judge,
    assembly::SIDE,
    bricks::Bricks,
    budget::Budget,
    check::{Checked, Findings, check_until},
    clusters,
    dense::Dense,
    descent::{Descent, prepare},
    error_bound::{bound, slack},
    frames::{Slab, Tri},
    grid::Grid,
    kernels::Kernels,
    layout::{self, Layout},
    sign::{Method, SignRule, Signs},
    store::{Store, Units},
};

pub use crate::store::Sparse;

/// Nodes along an axis: at least 2, at most this.
pub const MAX_RESOLUTION: u32 = 1 << 16;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resolution {
    /// As many along every axis. Without bounds: over a cube around the padded box's centre.
    Cube(u32),
    /// Along x, y and z.
    Each([u32; 3]),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    pub resolution: Resolution,
    /// World units; taken exactly. None: the mesh's box and padding.
    pub bounds: Option<([f64; 3], [f64; 3])>,
    /// Added on every side, in parts of the box's longest.
    pub padding: f64,
    pub sign: SignRule,
    pub sparse: bool,
    /// World units: |d| is cut there. Sparse: 4 voxels unless given.
    pub band: Option<f64>,
    /// How sure each sign is (dense only).
    pub confidence: bool,
    /// Most memory.
    pub budget_bytes: u64,
    /// The instruction set; None: the best one here.
    pub isa: Option<Isa>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            resolution: Resolution::Cube(128),
            bounds: None,
            padding: 0.1,
            sign: SignRule::Auto,
            sparse: false,
            band: None,
            confidence: false,
            budget_bytes: u64::MAX,
            isa: None,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// x fastest, node-centred.
    Dense(Vec<f32>),
    Sparse(Sparse),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Baked {
    /// Nodes along x, y and z.
    pub dims: [u64; 3],
    /// The first and the last node.
    pub lo: [f64; 3],
    pub hi: [f64; 3],
    pub values: Values,
    /// 0 to 1, one a node.
    pub confidence: Option<Vec<f32>>,
    pub findings: Findings,
    pub method: Method,
    /// Why that method.
    pub why: String,
    /// No node is farther from its true distance (cut at the band), world units.
    pub max_error: f64,
}

/// Signed distances of `mesh` at the nodes of a grid. `watch` hears of nodes: dims' product in all, and for sparse grids
/// those that the last bricks have beyond it.
pub fn bake(mesh: &Mesh, settings: &Settings, watch: &dyn Watch) -> Result<Baked, MeshError> {
    let budget = Budget::new(settings.budget_bytes);
    let layout = layout::given(settings)?;
    let (checked, findings) = check_until(mesh, watch)?;
    if watch.cancelled() {
        return Err(MeshError::Cancelled);
    }
    let layout = match layout {
        Some(layout) => layout,
        None => layout::around(settings, findings.bounds)?,
    };
    let mut job = Job::new(&checked, &layout, settings, &budget, watch)?;
    job.closed = findings.closed() && findings.needle_faces == 0;
    // Neighbours are looked for by one thread, and the other has something to do meanwhile.
    let (signs, prepared) =
        rayon::join(|| Signs::until(&checked, &findings, settings.sign, watch), || job.prepare(watch));
    let (signs, prepared) = (signs?, prepared?);
    let descent = job.descent(prepared, &signs, watch);
    let values = if settings.sparse { job.sparse(descent, &signs)? } else { job.dense(descent, &signs)? };
    let confidence = if settings.confidence { Some(job.confidence(&signs, watch)?) } else { None };
    let (method, why, max_error) = (signs.method(), signs.why(), job.max_error);
    let Layout { dims, lo, hi } = layout;
    Ok(Baked { dims: dims.map(u64::from), lo, hi, values, confidence, findings, method, why, max_error })
}

/// The mesh's triangles as the descent wants them.
struct Prepared {
    tris: Vec<Tri>,
    slabs: Vec<Slab>,
    /// The mesh's face behind each triangle.
    faces: Vec<u32>,
}

/// How large things are in the descent's frame.
struct Sizes {
    /// The largest coordinate of mesh and grid; at least 1.
    size: f64,
    /// The longest edge.
    longest: f64,
    /// A vertex' distance from the middle of the grid.
    nearest: f64,
}

impl Sizes {
    /// Of no use once the watch wants no more.
    fn of(mesh: &Checked, grid: &Grid, watch: &dyn Watch) -> Self {
        let vertex = |v: &[f64; 3]| {
            if watch.cancelled() {
                return (1.0, f64::INFINITY);
            }
            let f = grid.frame(*v);
            (f.abs().max_element(), f.length_squared())
        };
        let both = |a: (f64, f64), b: (f64, f64)| (a.0.max(b.0), a.1.min(b.1));
        let (size, nearest) = mesh.vertices.par_iter().map(vertex).reduce(|| (1.0, f64::INFINITY), both);
        let edge = |face: usize| {
            if watch.cancelled() {
                return 0.0;
            }
            let [a, b, c] = mesh.corners(face).map(DVec3::from_array);
            (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared())
        };
        let longest = (0..mesh.faces.len()).into_par_iter().map(edge).reduce(|| 0.0, f64::max);
        Self { size, longest: longest.sqrt() / grid.scale, nearest: nearest.sqrt() }
    }
}

/// One bake, its frames chosen.
struct Job<'a> {
    mesh: &'a Checked,
    settings: &'a Settings,
    budget: &'a Budget,
    layout: &'a Layout,
    grid: Grid,
    /// World units a unit of the descent's frame: a power of two.
    scale: f32,
    /// World units; infinite: no band.
    band: f32,
    /// What rounding can do to a distance, and how wrong a value can be: descent's frame, world units.
    slack: f64,
    max_error: f64,
    bricks: [u32; 3],
    /// Signs change only through the surface.
    closed: bool,
}

impl<'a> Job<'a> {
    fn new(
        mesh: &'a Checked,
        layout: &'a Layout,
        settings: &'a Settings,
        budget: &'a Budget,
        watch: &dyn Watch,
    ) -> Result<Self, MeshError> {
        let Layout { dims, lo, hi } = *layout;
        let unit =
            |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| (p[k] - mesh.centre[k]) / mesh.scale) };
        let bricks = dims.map(|n| (n - 1).div_ceil(SIDE));
        let nodes = if settings.sparse { bricks.map(|b| b * SIDE + 1) } else { dims };
        let (first, last) = (unit(lo), unit(hi));
        let grid = Grid::new(first, last, dims, nodes);
        let Sizes { size, longest, nearest } = Sizes::of(mesh, &grid, watch);
        Pulse::new(watch).ask()?;
        let scale = mesh.scale * grid.scale;
        if !(size < 1e9) {
            let message =
                format!("the mesh is {size:.0e} times as large, or as far away; at most 1e9 is allowed");
            return Err(MeshError::bad("bounds", message));
        }
        if !(scale * size < 1e36 && scale > 1e-30) {
            let message = format!("distances up to {:e} don't fit 32-bit floats", scale * size);
            return Err(MeshError::bad("bounds", message));
        }
        let voxel = (0..3).map(|k| (hi[k] - lo[k]) / f64::from(dims[k] - 1)).fold(0.0, f64::max);
        let band = match settings.band {
            Some(band) => band,
            None if settings.sparse => 4.0 * voxel,
            None => f64::INFINITY,
        };
        // From the middle of the grid no node is farther than its corners.
        let farthest = (nearest + 3f64.sqrt()).min(band / scale);
        let (slack, max_error) = (slack(size, longest), bound(size, longest, farthest) * scale);
        Ok(Self {
            mesh,
            settings,
            budget,
            layout,
            grid,
            scale: scale as f32,
            band: band as f32,
            slack,
            max_error,
            bricks,
            closed: false,
        })
    }

    /// Triangles in the descent's frame and order.
    fn prepare(&self, watch: &dyn Watch) -> Result<Prepared, MeshError> {
        let faces = self.mesh.faces.len();
        let each = size_of::<Tri>() + size_of::<Slab>() / clusters::CLUSTER + 4 + 16;
        self.budget.take((faces * each) as u64, "triangles in their frames")?;
        let corners = |f: usize| self.mesh.faces[f].map(|v| self.grid.frame(self.mesh.vertices[v as usize]));
        let order = clusters::order(corners, faces, watch)?;
        let (tris, slabs) = prepare(self.mesh, &self.grid, &order, watch)?;
        Ok(Prepared { tris, slabs, faces: order })
    }

    fn descent<'s>(&'s self, prepared: Prepared, signs: &'s Signs<'s>, watch: &'s dyn Watch) -> Descent<'s> {
        let Prepared { tris, slabs, faces } = prepared;
        let band = f64::from(self.band) / f64::from(self.scale);
        Descent {
            tris,
            slabs,
            faces,
            mesh: self.mesh,
            grid: &self.grid,
            kernels: Kernels::of(self.settings.isa.unwrap_or_else(isa)),
            signs: (signs.method() == Method::Pseudonormal).then_some(signs),
            each: !self.closed,
            steps: self.grid.step().map(|s| (s * (1.0 + 1e-6) + 4.0 * self.slack) as f32),
            band: self.band.is_finite().then_some((band * (1.0 + 1e-6)) as f32),
            bricks: self.settings.sparse,
            slack: (self.slack * (1.0 + 1e-6)) as f32,
            budget: self.budget,
            watch,
            arenas: Mutex::new(Vec::new()),
        }
    }

    /// Winding numbers and parity need no nearest triangle, and come after the distances.
    fn signs_follow(&self, signs: &Signs) -> bool {
        matches!(signs.method(), Method::Winding | Method::Parity)
    }

    fn dense(&self, descent: Descent, signs: &Signs) -> Result<Values, MeshError> {
        let dims = self.layout.dims;
        let mut values = self.floats(dims)?;
        let sink = Dense::new(&mut values, &self.grid, dims, self.scale, self.band);
        descent.run(&sink)?;
        if self.signs_follow(signs) {
            Judge::new(signs, &self.grid, self.budget, descent.watch)?.dense(&mut values, dims)?;
        }
        Ok(Values::Dense(values))
    }

    /// Zeros, one a node; the system's answer is asked for first.
    fn floats(&self, dims: [u32; 3]) -> Result<Vec<f32>, MeshError> {
        let count = dims.iter().map(|&n| u64::from(n)).product::<u64>();
        self.budget.take(count.saturating_mul(4), "the grid")?;
        let refused = || MeshError::bad("memory", format!("the system has none for {count} nodes"));
        let count = usize::try_from(count).map_err(|_| refused())?;
        Vec::<f32>::new().try_reserve_exact(count).map_err(|_| refused())?;
        Ok(vec![0.0; count])
    }

    fn sparse(&self, descent: Descent, signs: &Signs) -> Result<Values, MeshError> {
        let units = Units { scale: self.scale, band: self.band };
        let store = Store::new(&self.grid, units, self.bricks, self.budget)?;
        let judge = self.signs_follow(signs);
        let judge = judge.then(|| Judge::new(signs, &self.grid, self.budget, descent.watch)).transpose()?;
        descent.run(&Bricks::new(&store, judge.as_ref()))?;
        drop((descent, judge));
        Ok(Values::Sparse(store.finish()?))
    }

    fn confidence(&self, signs: &Signs, watch: &dyn Watch) -> Result<Vec<f32>, MeshError> {
        let dims = self.layout.dims;
        let mut out = self.floats(dims)?;
        signs.prepare_confidence(watch)?;
        let (axes, width) = (self.grid.axes, dims[0] as usize);
        out.par_chunks_mut(width).enumerate().try_for_each(|(row, values)| {
            if watch.cancelled() {
                return Err(MeshError::Cancelled);
            }
            let (y, z) = (row as u32 % dims[1], row as u32 / dims[1]);
            let node = |x: u32| self.grid.node(axes.map(|k| [x, y, z][k]));
            let points: Vec<[f64; 3]> = (0..dims[0]).map(node).collect();
            let mut sure = vec![0.0; points.len()];
            signs.confidence_many(&points, &mut sure);
            for (value, sure) in values.iter_mut().zip(sure) {
                *value = sure as f32;
            }
            Ok(())
        })?;
        Ok(out)
    }
}
