#![allow(clippy::unwrap_used)]
use super::*;

struct Random(u64);
impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }
    fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.unit()
    }
}

/// The first of the nearest spheres, asked one by one.
fn brute<S: Scalar>(rows: &[f64], p: [S; 3]) -> (S, [S; 4]) {
    let mut best = (S::INFINITY, Nearest::nobody().sphere);
    for s in rows.chunks(4) {
        let s: [S; 4] = std::array::from_fn(|a| S::of(s[a]));
        let d = S::len3(p[0] - s[0], p[1] - s[1], p[2] - s[2]) - s[3];
        if d < best.0 {
            best = (d, s);
        }
    }
    best
}

/// All.
impl Sieve for () {
    fn keeps(&self, _: [f32; 4]) -> bool {
        true
    }
}

fn rows(n: usize, sphere: impl FnMut(usize) -> [f64; 4]) -> Vec<f64> {
    (0..n).flat_map(sphere).collect()
}

/// Clouds of every kind: even, of all sizes, dense in places, flat, in line, far away, on a lattice.
fn clouds() -> Vec<(&'static str, Vec<f64>)> {
    let mut r = Random(5);
    let at = |r: &mut Random, lo: f64, hi: f64| [0; 3].map(|_| r.within(lo, hi));
    let even = rows(3000, |_| {
        let [x, y, z] = at(&mut r, -1.5, 1.5);
        [x, y, z, 0.03]
    });
    let sizes = rows(700, |_| {
        let [x, y, z] = at(&mut r, -2.0, 2.0);
        [x, y, z, 10f64.powf(r.within(-4.0, 0.3))]
    });
    let dense = rows(4000, |i| {
        let [x, y, z] = at(&mut r, -1.0, 1.0);
        let s = if i % 2 == 0 { 1.0 } else { 1e-3 };
        [x * s + 0.3, y * s, z * s, 0.01 * s]
    });
    let flat = rows(500, |_| [r.within(-1.0, 1.0), 0.25, r.within(-1.0, 1.0), 0.02]);
    let line = rows(300, |i| [i as f64 * 0.1, 0.0, 0.0, 0.05]);
    let far = rows(400, |_| [1e6 + r.within(0.0, 9.0), r.within(0.0, 9.0) - 1e6, r.within(0.0, 9.0), 0.5]);
    let lattice = rows(1000, |i| [(i % 10) as f64, (i / 10 % 10) as f64, (i / 100) as f64, 0.25]);
    let same = rows(200, |_| [0.5, 0.5, 0.5, 0.25]);
    vec![
        ("even", even),
        ("sizes", sizes),
        ("dense", dense),
        ("flat", flat),
        ("line", line),
        ("far", far),
        ("lattice", lattice),
        ("same", same),
    ]
}

fn points<S: Scalar>(rows: &[f64]) -> Vec<[S; 3]> {
    let mut random = Random(9);
    let n = rows.len() / 4;
    let extreme =
        |a: usize, sign: f64| sign * rows[a..].iter().step_by(4).fold(f64::MIN, |m, v| m.max(sign * v));
    // Among the spheres, around them, on spheres, between them, and far away.
    let point = |i: usize| {
        std::array::from_fn(|a| {
            let (lo, hi) = (extreme(a, -1.0), extreme(a, 1.0));
            let sphere = |i: usize| rows[i * 7919 % n * 4 + a];
            S::of(match i % 5 {
                2 => sphere(i) + random.within(-0.05, 0.05),
                3 => 0.5 * (sphere(i) + sphere(i + 1)),
                kind => {
                    0.5 * (lo + hi)
                        + [1.0, 3.0, 0.0, 0.0, 1000.0][kind] * (hi - lo + 0.1) * random.within(-0.5, 0.5)
                }
            })
        })
    };
    (0..1500).map(point).collect()
}

fn check<S: Scalar>(name: &str, rows: &[f64], crowd: &Crowd) {
    let mut before = Nearest::nobody();
    for p in points::<S>(rows) {
        let expected = brute(rows, p);
        // From no guess, and from a bad one.
        for guess in [Nearest::nobody(), before] {
            before = crowd.nearest(S::levels(crowd), p, guess);
            assert_eq!(expected.1.map(S::f64), before.sphere.map(S::f64), "{name}: {p:?}");
        }
    }
}

fn crowd(rows: &[f64]) -> Crowd {
    Crowd::of(rows.as_chunks::<4>().0.to_vec())
}

#[test]
fn the_nearest_sphere_is_the_unions() {
    for (name, rows) in clouds() {
        let crowd = crowd(&rows);
        check::<f32>(name, &rows, &crowd);
        check::<f64>(name, &rows, &crowd);
    }
}

#[test]
fn none_within_reach_is_left_out() {
    let mut found = Vec::new();
    for (name, rows) in clouds() {
        let crowd = crowd(&rows);
        for (i, p) in points::<f32>(&rows).into_iter().enumerate().step_by(10) {
            let reach = brute(&rows, p).0 + [0.0, 0.1, 1.0][i % 3];
            let all = crowd.within(p, reach, &(), usize::MAX, &mut found);
            assert!(all && found.is_sorted());
            for (id, s) in rows.as_chunks::<4>().0.iter().enumerate() {
                let s = s.map(|v| v as f32);
                let near = f32::len3(p[0] - s[0], p[1] - s[1], p[2] - s[2]) - s[3] <= reach;
                assert!(!near || found.binary_search(&(id as u32)).is_ok(), "{name}: {p:?} and sphere {id}");
            }
            let half = found.len() / 2;
            assert!(half == 0 || !crowd.within(p, reach, &(), half, &mut found), "{name}: {half} are enough");
        }
    }
}

#[test]
fn nobody_is_near_what_is_no_number() {
    let crowd = crowd(&clouds()[0].1);
    for p in [[f32::NAN, 0.0, 0.0], [0.0, f32::INFINITY, 0.0], [3e38, 3e38, 3e38]] {
        let near = crowd.nearest(crowd.single(), [0.0; 3], Nearest::nobody());
        for guess in [Nearest::nobody(), near] {
            assert_eq!(crowd.nearest(crowd.single(), p, guess), Nearest::nobody());
        }
    }
}
