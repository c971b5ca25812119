//! Faces in clusters of 16, those in clusters of 16, and so on, each packed for 16 lanes.
//!
//! The order comes from median splits along the longest axis, at multiples of powers of 16: every cluster but the last
//! of its level is full, and the tree needs no pointers.

use super::Nearest;
use super::moments::Moments;
use super::pseudo::foot;
use crate::check::Checked;
use crate::select::select;
use crate::{MeshError, Pulse, Watch};
use glam::DVec3;
use rayon::prelude::*;

pub const WIDE: usize = 16;
pub type Lanes = [f32; WIDE];

/// Clusters nearer to each other than this to a point are opened: f32 tells no directions there.
const SMALLEST: f64 = 1e-5;

/// 16 clusters seen from afar: moments of their area vectors about their centres, up to the second.
#[derive(Clone)]
#[repr(align(64))]
pub struct Far {
    pub centre: [Lanes; 3],
    /// Squared radius.
    pub radius: Lanes,
    pub area: [Lanes; 3],
    /// Symmetric and without trace, as all that counts: xx, yy, 2 xy, 2 xz, 2 yz, times -3.
    pub first: [Lanes; 5],
    /// Likewise: xxx, yyy, 3 xxy, 3 xyy, xxz, yyz, 6 xyz, times 15/2.
    pub second: [Lanes; 7],
}

/// 16 faces.
#[derive(Clone)]
#[repr(align(64))]
pub struct Near {
    pub corners: [[Lanes; 3]; 3],
    /// Of twice the area's length.
    pub normal: [Lanes; 3],
    /// Below this a point's height over the plane is rounding, times the normal's length.
    pub noise: Lanes,
}

#[derive(Default)]
pub struct Tree {
    /// Faces in the order of their clusters.
    pub order: Vec<u32>,
    pub near: Vec<Near>,
    /// From the smallest clusters to the largest, of which there are at most 16.
    pub levels: Vec<Vec<Far>>,
}

impl Tree {
    pub fn new(mesh: &Checked, watch: &dyn Watch) -> Result<Self, MeshError> {
        let order = order(mesh, watch)?;
        let on = || if watch.cancelled() { Err(MeshError::Cancelled) } else { Ok(()) };
        let clusters = || order.par_chunks(WIDE);
        let near = clusters().map(|faces| on().map(|()| Near::of(mesh, faces))).collect::<Result<_, _>>()?;
        let moments = clusters().map(|faces| on().map(|()| Moments::of(mesh, faces)));
        let mut moments: Vec<Moments> = moments.collect::<Result<_, _>>()?;
        let mut levels = Vec::new();
        loop {
            levels.push(moments.chunks(WIDE).map(Far::of).collect());
            if moments.len() <= WIDE {
                return Ok(Self { order, near, levels });
            }
            moments = moments.chunks(WIDE).map(Moments::sum).collect();
        }
    }

    /// The faces of one of the smallest clusters.
    pub fn faces(&self, cluster: usize) -> &[u32] {
        &self.order[cluster * WIDE..((cluster + 1) * WIDE).min(self.order.len())]
    }
}

fn order(mesh: &Checked, watch: &dyn Watch) -> Result<Vec<u32>, MeshError> {
    let pulse = Pulse::new(watch);
    let middles: Vec<[f64; 3]> = mesh
        .faces
        .par_iter()
        .enumerate()
        .map(|(i, f)| {
            if i.is_multiple_of(1 << 12) {
                pulse.ask()?;
            }
            let [a, b, c] = *f;
            let [a, b, c] = [mesh.vertices[a as usize], mesh.vertices[b as usize], mesh.vertices[c as usize]];
            Ok(std::array::from_fn(|i| a[i] + b[i] + c[i]))
        })
        .collect::<Result<_, MeshError>>()?;
    let mut order: Vec<u32> = (0..mesh.faces.len() as u32).collect();
    let mut size = WIDE;
    while size < order.len() {
        size *= WIDE;
    }
    split(&mut order, &middles, size / WIDE, watch)?;
    Ok(order)
}

/// Puts `faces` into clusters of `size`, and those into smaller ones.
fn split(
    faces: &mut [u32],
    middles: &[[f64; 3]],
    mut size: usize,
    watch: &dyn Watch,
) -> Result<(), MeshError> {
    while faces.len() <= size {
        if size <= WIDE {
            return Ok(());
        }
        size /= WIDE;
    }
    let clusters = faces.len().div_ceil(size);
    let at = clusters / 2 * size;
    let axis = longest_axis(faces, middles);
    // The index decides between equals, so that the order is one and the same everywhere.
    let order =
        |&a: &u32, &b: &u32| middles[a as usize][axis].total_cmp(&middles[b as usize][axis]).then(a.cmp(&b));
    select(faces, at, order, watch)?;
    let (low, high) = faces.split_at_mut(at);
    if low.len() + high.len() > 4096 {
        Pulse::new(watch).ask()?;
        let (a, b) = rayon::join(|| split(low, middles, size, watch), || split(high, middles, size, watch));
        a.and(b)
    } else {
        split(low, middles, size, watch)?;
        split(high, middles, size, watch)
    }
}

fn longest_axis(faces: &[u32], middles: &[[f64; 3]]) -> usize {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for &f in faces {
        for axis in 0..3 {
            lo[axis] = lo[axis].min(middles[f as usize][axis]);
            hi[axis] = hi[axis].max(middles[f as usize][axis]);
        }
    }
    let side = |axis: usize| hi[axis] - lo[axis];
    if side(0) >= side(1) && side(0) >= side(2) {
        0
    } else if side(1) >= side(2) {
        1
    } else {
        2
    }
}

impl Near {
    fn of(mesh: &Checked, faces: &[u32]) -> Self {
        // Missing faces are a point far away.
        let mut near = Self { corners: [[[1e3; WIDE]; 3]; 3], normal: [[0.0; WIDE]; 3], noise: [0.0; WIDE] };
        for (lane, &face) in faces.iter().enumerate() {
            let corners = mesh.points(face as usize);
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            for axis in 0..3 {
                for k in 0..3 {
                    near.corners[k][axis][lane] = corners[k][axis] as f32;
                }
                near.normal[axis][lane] = normal[axis] as f32;
            }
            near.noise[lane] = (4e-7 * normal.length()) as f32;
        }
        near
    }
}

impl Far {
    fn of(clusters: &[Moments]) -> Self {
        let none = [0.0; WIDE];
        let mut far = Self {
            centre: [[1e3; WIDE]; 3],
            radius: none,
            area: [none; 3],
            first: [none; 5],
            second: [none; 7],
        };
        for (lane, cluster) in clusters.iter().enumerate() {
            for axis in 0..3 {
                far.centre[axis][lane] = cluster.centre[axis] as f32;
                far.area[axis][lane] = cluster.area[axis] as f32;
            }
            far.radius[lane] = (cluster.radius.max(SMALLEST) as f32).powi(2);
            for (row, value) in cluster.first().into_iter().enumerate() {
                far.first[row][lane] = value as f32;
            }
            for (row, value) in cluster.second().into_iter().enumerate() {
                far.second[row][lane] = value as f32;
            }
        }
        far
    }
}

impl Tree {
    /// The face nearest to `p`, in f64; of equally near ones the first in the mesh.
    pub fn nearest(&self, mesh: &Checked, p: [f64; 3]) -> Nearest {
        let p = DVec3::from(p);
        let mut best = (f64::INFINITY, u32::MAX, p);
        let mut open = vec![(0.0, self.levels.len(), 0)];
        while let Some((bound, level, block)) = open.pop() {
            if bound > best.0.sqrt() {
                continue;
            }
            if level == 0 {
                for &face in self.faces(block) {
                    let foot = foot(p, &mesh.points(face as usize));
                    if foot.squared < best.0 || (foot.squared == best.0 && face < best.1) {
                        best = (foot.squared, face, foot.point);
                    }
                }
                continue;
            }
            let from = open.len();
            let clusters = if level == 1 { self.near.len() } else { self.levels[level - 2].len() };
            for cluster in block * WIDE..((block + 1) * WIDE).min(clusters) {
                let (far, lane) = (&self.levels[level - 1][block], cluster % WIDE);
                let centre = DVec3::from([0, 1, 2].map(|axis| f64::from(far.centre[axis][lane])));
                // What f32 has rounded away is far less than the last term.
                let bound = (p - centre).length() - f64::from(far.radius[lane]).sqrt() * (1.0 + 1e-6) - 1e-6;
                if bound <= best.0.sqrt() {
                    open.push((bound, level - 1, cluster));
                }
            }
            // The nearest last, so that it is opened first.
            open[from..].sort_by(|a, b| b.0.total_cmp(&a.0));
        }
        Nearest { face: best.1, point: best.2.to_array() }
    }
}
