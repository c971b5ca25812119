//! Laws of grids: what a step promises, and that all ways to ask give the same bits.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use half::f16;

use super::{slope::BLOCK, *};

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    fn point(&mut self, r: f64) -> [f64; 3] {
        std::array::from_fn(|_| r * (2.0 * self.unit() - 1.0))
    }
}

/// Distances: a small ball, a plate thinner than a voxel and a box's corner.
fn distance(p: [f64; 3]) -> f64 {
    let ball = ((p[0] - 0.4).powi(2) + (p[1] + 0.3).powi(2) + p[2].powi(2)).sqrt() - 0.21;
    let q = [p[0] + 0.45, p[1] - 0.1, p[2] - 0.05].map(|v| v.abs() - 0.3);
    let out = q.map(|v| v.max(0.0)).iter().map(|v| v * v).sum::<f64>().sqrt();
    let cube = out + q[0].max(q[1]).max(q[2]).min(0.0);
    ball.min(cube)
}

fn position(n: [usize; 3], at: [usize; 3]) -> [f64; 3] {
    std::array::from_fn(|a| -1.0 + 2.0 * at[a] as f64 / (n[a] - 1) as f64)
}

fn dense(n: [usize; 3], f: impl Fn([f64; 3]) -> f64) -> Vec<f64> {
    let mut out = Vec::new();
    for z in 0..n[2] {
        for y in 0..n[1] {
            for x in 0..n[0] {
                out.push(f(position(n, [x, y, z])));
            }
        }
    }
    out
}

/// Bricks within `band` of the surface.
fn sparse(n: [usize; 3], band: f64, f: impl Fn([f64; 3]) -> f64) -> Bricks {
    let count = bricks_along(n);
    let (mut table, mut far, mut nodes) = (Vec::new(), Vec::new(), Vec::new());
    let h = 2.0 / (n.iter().min().unwrap() - 1) as f64;
    for i in 0..count.iter().product() {
        let at = [i % count[0], i / count[0] % count[1], i / count[0] / count[1]];
        let spread = |v: usize, k: usize| v * BRICK + k;
        let centre: [f64; 3] =
            std::array::from_fn(|a| -1.0 + 2.0 * (at[a] as f64 + 0.5) * BRICK as f64 / (n[a] - 1) as f64);
        let bound = f(centre).abs() - 3f64.sqrt() * h * BRICK as f64 / 2.0;
        if bound > band {
            table.push(bricks::FAR);
            far.push((bound as f32 * 0.999).copysign(f(centre) as f32));
            continue;
        }
        table.push((nodes.len() / BLOCK) as u32);
        far.push(0.0);
        for k in 0..BLOCK {
            let k = [k % 9, k / 9 % 9, k / 81];
            nodes.push(f(position(n, std::array::from_fn(|a| spread(at[a], k[a])))) as f32);
        }
    }
    Bricks::of_table(&table, &far, BrickValues::F32(Arc::new(nodes))).unwrap()
}

const SIZES: [[usize; 3]; 2] = [[33, 33, 33], [42, 33, 29]];
const CLAIM: Claim = Claim { lipschitz: Some(1.0), max_error: 1e-7 };

fn make(store: Store, n: [usize; 3], claim: Claim) -> Grid {
    Grid::with_claim(store, n, [-1.0; 3], [1.0; 3], claim).unwrap()
}

fn grids() -> Vec<(String, Grid)> {
    let mut all = Vec::new();
    for n in SIZES {
        let values = dense(n, distance);
        let f32s: Vec<f32> = values.iter().map(|v| *v as f32).collect();
        let d32 = make(Store::Dense(GridValues::F32(f32s.into())), n, CLAIM);
        let s32 = make(Store::Sparse(sparse(n, 0.25, distance)), n, CLAIM);
        let list = [
            ("f64", make(Store::Dense(GridValues::F64(values.into())), n, Claim::default())),
            ("f16", d32.to_f16().unwrap()),
            ("sparse f16", s32.to_f16().unwrap()),
            ("sparse u8", s32.to_u8(0.25).unwrap()),
            ("unfolded", s32.to_dense().unwrap()),
            ("f32", d32),
            ("sparse f32", s32),
        ];
        all.extend(list.into_iter().map(|(name, g)| (format!("{name} {n:?}"), g)));
    }
    all
}

const STEPPINGS: [Stepping; 3] = [Stepping::Safe, Stepping::Bricks, Stepping::Voxel];

#[test]
fn packs_and_points_agree() {
    let mut random = Random(1);
    for (name, grid) in grids() {
        for stepping in STEPPINGS {
            let grid = grid.with_stepping(stepping);
            for step in [Step::Raw, Step::Safe, Step::SafeNegated] {
                for _ in 0..50 {
                    let p: [[f32; 3]; 16] = std::array::from_fn(|_| random.point(1.3).map(|v| v as f32));
                    let lanes = [0, 1, 2].map(|a| p.map(|p| p[a]));
                    let pack = grid.sample_lanes(lanes, step);
                    let alone = p.map(|p| grid.sample(p, step));
                    assert_eq!(pack.map(f32::to_bits), alone.map(f32::to_bits), "{name}");
                    let slope = p.map(|p| grid.sample_gradient(p, step).0);
                    assert_eq!(pack.map(f32::to_bits), slope.map(f32::to_bits), "{name}");
                }
            }
        }
    }
}

/// Walks from random points by the grid's own steps in random directions, and looks between the samples
/// at a hundred places: none may have another sign.
#[test]
fn steps_never_pass_the_zero_set() {
    for (name, grid) in grids() {
        for stepping in STEPPINGS {
            let grid = grid.with_stepping(stepping);
            let (mut random, mut wrong) = (Random(7), 0);
            for _ in 0..4000 {
                let p = random.point(1.1);
                let r: f64 = grid.sample(p, Step::Safe);
                let v: f64 = grid.sample(p, Step::Raw);
                assert!((r > 0.0) == (v > 0.0), "{name} {stepping:?}: {r} for {v} at {p:?}");
                let back: f64 = grid.sample(p, Step::SafeNegated);
                assert!((back > 0.0) == (v > 0.0));
                for reach in [r, back] {
                    let d = random.point(1.0);
                    let n = d.iter().map(|v| v * v).sum::<f64>().sqrt();
                    let end: [f64; 3] =
                        std::array::from_fn(|a| p[a] + d[a] / n * reach.abs() * random.unit().sqrt());
                    let there: f64 = grid.sample(end, Step::Raw);
                    wrong += usize::from((there > 0.0) != (v > 0.0) && there.abs() > 1e-12);
                }
            }
            assert_eq!(wrong, 0, "{name} {stepping:?}");
        }
    }
}

/// What the finer rules are for.
#[test]
fn bricks_step_farther() {
    let n = [65; 3];
    let ball = |p: [f64; 3]| (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt() - 0.6;
    let grid = make(Store::Dense(GridValues::F64(dense(n, ball).into())), n, CLAIM);
    let finer = grid.with_stepping(Stepping::Bricks);
    let (mut random, mut coarse, mut fine, mut true_) = (Random(3), 0.0, 0.0, 0.0);
    for _ in 0..2000 {
        // About the surface, where most steps are taken.
        let p = random.point(1.0);
        let len = p.iter().map(|v| v * v).sum::<f64>().sqrt();
        let p = p.map(|v| v / len * (0.6 + 0.1 * random.unit()));
        let (a, b): (f64, f64) = (grid.sample(p, Step::Safe), finer.sample(p, Step::Safe));
        assert!(b.abs() >= a.abs() * (1.0 - 1e-12));
        (coarse, fine, true_) = (coarse + a.abs(), fine + b.abs(), true_ + ball(p).abs());
    }
    assert!(fine / true_ > 0.8 && coarse / true_ < 0.75, "{} {}", fine / true_, coarse / true_);
}

#[test]
fn brick_slopes_bound_what_is_measured() {
    for (name, grid) in grids() {
        let count = bricks_along(grid.dims());
        let mut random = Random(5);
        for _ in 0..20_000 {
            let p = random.point(1.0);
            let g = grid.sample_gradient(p, Step::Raw).1;
            let cell: [usize; 3] = std::array::from_fn(|a| {
                (((p[a] + 1.0) / grid.spacing()[a]) as usize).min(grid.dims()[a] - 2) / BRICK
            });
            let bound = grid.slopes_of(cell[0] + count[0] * (cell[1] + count[1] * cell[2]))[0];
            let steep = g.iter().map(|v| v * v).sum::<f64>().sqrt();
            assert!(steep <= f64::from(bound) * (1.0 + 1e-6), "{name}: {steep} > {bound} at {p:?}");
        }
    }
}

#[test]
fn rounding_stays_within_the_claimed_error() {
    for n in SIZES {
        let exact = make(Store::Sparse(sparse(n, 0.25, distance)), n, CLAIM);
        for (grid, least) in [(exact.to_f16().unwrap(), 1e-5), (exact.to_u8(0.25).unwrap(), 1e-4)] {
            let error = grid.claim().max_error;
            let mut seen = 0f64;
            for z in 0..n[2] {
                for y in 0..n[1] {
                    for x in 0..n[0] {
                        let (a, b): (f64, f64) = (exact.node([x, y, z]), grid.node([x, y, z]));
                        if a.abs() <= 0.25 {
                            seen = seen.max((a - b).abs());
                        }
                        assert!(b.abs() <= a.abs() + error);
                    }
                }
            }
            assert!(seen <= error && seen > least, "{seen} {error}");
            assert!(error <= 0.25 / 127.0, "{error}");
        }
    }
}

/// Both sides of a wall decode to one number, else the interpolant would jump.
#[test]
fn shared_nodes_agree() {
    let n = [41, 41, 41];
    // Very different magnitudes side by side: fine and coarse scales meet.
    let field = |p: [f64; 3]| (p[0] * p[0] * p[0] * p[1]).abs() * 0.4 - 0.001;
    for grid in [make(Store::Sparse(sparse(n, 0.2, field)), n, CLAIM).to_u8(0.2).unwrap()] {
        let bricks = grid.bricks().unwrap();
        let BrickValues::U8 { scale, .. } = bricks.nodes() else { unreachable!() };
        let finest = scale.iter().fold(f32::INFINITY, |a, b| a.min(*b));
        assert!(scale.iter().any(|s| *s >= 8.0 * finest), "the test needs scales that differ");
        let count = bricks_along(n);
        let mut met = 0;
        for i in 0..bricks.words().len() {
            let (Some(a), true) = (bricks.slot(i), i % count[0] + 1 < count[0]) else { continue };
            let Some(b) = bricks.slot(i + 1) else { continue };
            for k in 0..81 {
                let (left, right): (f64, f64) = (bricks.node(a, 8 + 9 * k), bricks.node(b, 9 * k));
                assert_eq!(left, right);
                met += 1;
            }
        }
        assert!(met > 1000);
    }
}

#[test]
fn halves_widen_exactly() {
    use super::dense::Sample;
    for bits in 0..=u16::MAX {
        let h = f16::from_bits(bits);
        if h.is_finite() {
            assert_eq!(h.wide::<f32>().to_bits(), h.to_f32().to_bits(), "{bits:#x}");
        }
    }
}

#[test]
fn normals_are_continuous_and_slopes_are_exact() {
    let n = [33; 3];
    let ball = |p: [f64; 3]| (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt() - 0.6;
    let grid = make(Store::Dense(GridValues::F64(dense(n, ball).into())), n, CLAIM);
    let mut random = Random(11);
    let (mut jump, mut rough) = (0f64, 0f64);
    for _ in 0..5000 {
        let mut p = random.point(1.0);
        let len = p.iter().map(|v| v * v).sum::<f64>().sqrt();
        p = p.map(|v| v / len * 0.6);
        // Onto the nearest wall between voxels along x, and to both sides of it.
        let wall = (p[0] / grid.spacing()[0]).round() * grid.spacing()[0];
        let sides = [wall - 1e-9, wall + 1e-9].map(|x| [x, p[1], p[2]]);
        let far = |g: [[f64; 3]; 2]| (0..3).map(|a| (g[0][a] - g[1][a]).powi(2)).sum::<f64>().sqrt();
        jump = jump.max(far(sides.map(|p| grid.sample_gradient(p, Step::Safe).1)));
        rough = rough.max(far(sides.map(|p| grid.sample_gradient(p, Step::Raw).1)));
        let step = 1e-6;
        let (v, g) = grid.sample_gradient::<f64>(p, Step::Raw);
        let moved: f64 = grid.sample([p[0], p[1] + step, p[2]], Step::Raw);
        let inside = (p[1] / grid.spacing()[1]).fract().abs();
        if inside > 1e-3 && inside < 1.0 - 1e-3 {
            assert!(((moved - v) / step - g[1]).abs() < 1e-6);
        }
    }
    assert!(jump < 1e-6 && rough > 1e-2, "{jump} {rough}");
}

#[test]
fn unfolded_values_are_bounds_of_the_distance() {
    for n in SIZES {
        let sparse = make(Store::Sparse(sparse(n, 0.1, distance)), n, CLAIM);
        let dense = sparse.to_dense().unwrap();
        let (mut far, mut kept) = (0, 0);
        for z in 0..n[2] {
            for y in 0..n[1] {
                for x in 0..n[0] {
                    let (got, want): (f64, f64) = (dense.node([x, y, z]), distance(position(n, [x, y, z])));
                    assert!(got.abs() <= want.abs() + 1e-6 && got * want >= 0.0, "{got} {want}");
                    *(if got == f64::from(want as f32) { &mut kept } else { &mut far }) += 1;
                }
            }
        }
        assert!(kept > 1000 && far > 1000);
    }
}

#[test]
fn ranges_hold_all_values() {
    let mut random = Random(2);
    for (name, grid) in grids() {
        for stepping in STEPPINGS {
            let grid = grid.with_stepping(stepping);
            for step in [Step::Raw, Step::Safe, Step::SafeNegated] {
                for _ in 0..30 {
                    let (p, size) = (random.point(1.2), 0.3 * random.unit());
                    let (lo, hi) = grid.range(p.map(|v| [v, v + size]), step);
                    for _ in 0..30 {
                        let q = p.map(|v| v + size * random.unit());
                        let v: f64 = grid.sample(q, step);
                        let tiny = 1e-12;
                        assert!(
                            lo - tiny <= v && v <= hi + tiny,
                            "{name} {stepping:?} {step:?}: {v} not in {lo} {hi}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn steep_samples_are_no_distance() {
    let n = [9; 3];
    // Slope 1 along each axis, sqrt(3) in space: the difference over a diagonal gives it away.
    let grid = make(
        Store::Dense(GridValues::F64(dense(n, |p| p[0] + p[1] + p[2] + 2.9).into())),
        n,
        Claim::default(),
    );
    let p = [0.9, 0.9, 0.9];
    let v: f64 = grid.sample(p, Step::Safe);
    assert!(v <= (2.7 + 2.9) / 3f64.sqrt() + 1e-9, "{v}");
}

#[test]
fn bad_bricks_are_refused() {
    let n = [17; 3];
    let good = sparse(n, 0.2, distance);
    let (table, far) = good.words().iter().map(|w| (w.entry(), w.value())).unzip::<_, _, Vec<_>, Vec<_>>();
    let BrickValues::F32(nodes) = good.nodes().clone() else { unreachable!() };
    let nodes = nodes.to_vec();
    type Parts = (Vec<u32>, Vec<f32>, Vec<f32>);
    type Spoil = (&'static str, fn(&mut Parts));
    let spoil: [Spoil; 6] = [
        ("table", |p| {
            p.0.pop();
        }),
        ("brick 0 is at", |p| p.0[0] = 1 << 20),
        ("far", |p| {
            p.1.push(1.0);
        }),
        ("nodes", |p| {
            p.2.pop();
        }),
        ("finite", |p| p.2[5] = f32::NAN),
        ("far value", |p| {
            p.0[0] = bricks::FAR;
            p.1[0] = 0.0;
        }),
    ];
    for (word, spoil) in spoil {
        let mut parts = (table.clone(), far.clone(), nodes.clone());
        spoil(&mut parts);
        let bricks = Bricks::of_table(&parts.0, &parts.1, BrickValues::F32(Arc::new(parts.2)));
        let grid = bricks.and_then(|b| Grid::with_claim(Store::Sparse(b), n, [-1.0; 3], [1.0; 3], CLAIM));
        let error = grid.unwrap_err();
        assert!(error.to_string().contains(word), "{word}: {error}");
    }
}

#[test]
fn flat_fields_are_walked_in_numbers() {
    let n = [12; 3];
    // The first fills the box, whose faces are then the surface.
    for (slope, level) in [(1.0, -1.0), (0.25, 0.3), (1.0, 3.0)] {
        let field = |p: [f64; 3]| level + 0.25 * slope * p[0];
        let claim = Claim { lipschitz: Some(slope), max_error: 0.0 };
        let grid = make(Store::Dense(GridValues::F64(dense(n, field).into())), n, claim);
        let flat = make(Store::Dense(GridValues::F64(dense(n, |_| level).into())), n, claim);
        assert_eq!(grid.strict_slope(Step::Raw).is_infinite(), level < 0.0);
        let mut random = Random(8);
        for _ in 0..500 {
            let (p, d) = (random.point(1.4), random.point(0.05));
            let q: [f64; 3] = std::array::from_fn(|a| p[a] + d[a]);
            let far = d.iter().map(|v| v * v).sum::<f64>().sqrt();
            let [a, b]: [f64; 2] = [p, q].map(|p| grid.sample(p, Step::Safe));
            assert!((a - b).abs() <= grid.strict_slope(Step::Safe) * far * (1.0 + 1e-9), "{a} {b} {far}");
            for stepping in STEPPINGS {
                let v: f32 = flat.with_stepping(stepping).sample(p.map(|v| v as f32), Step::Safe);
                assert!(v.is_finite() && v != 0.0);
            }
        }
    }
}
