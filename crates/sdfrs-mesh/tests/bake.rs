//! Whatever the mesh's place and size; what is refused; memory, cancelling, progress.

#![allow(clippy::unwrap_used, clippy::panic)] // A helper that fails is a test that fails.

mod common;

use std::{
    sync::atomic::{AtomicBool, AtomicU64, Ordering},
    time::{Duration, Instant},
};

use common::*;
use sdfrs_mesh::{
    Mesh, MeshError, Watch,
    bake::{Resolution, Settings, Values, bake},
    sign::{Method, SignRule},
};

/// By a power of two in size and place, so that the input itself loses no digit.
fn moved(mesh: &Mesh, scale: f64, offset: f64) -> Mesh {
    let vertices = mesh.vertices.iter().map(|v| v.map(|x| (x + offset) * scale)).collect();
    Mesh { vertices, faces: mesh.faces.clone() }
}

#[test]
fn place_and_size_change_nothing() {
    // Coordinates with few digits, exact 2^27 away.
    let mut mesh = knot(100, 10);
    for x in mesh.vertices.iter_mut().flatten() {
        *x = (*x * 4096.0).round() / 4096.0;
    }
    let settings = settings([40, 33, 50]);
    let (_, want) = dense(&mesh, &settings);
    for (power, offset) in [(0, 134_217_728.0), (-66, 0.0), (66, 0.0), (-40, -8192.0)] {
        let scale = 2f64.powi(power);
        let (_, got) = dense(&moved(&mesh, scale, offset), &settings);
        let worst = want
            .iter()
            .zip(&got)
            .map(|(w, g)| (f64::from(*w) - f64::from(*g) / scale).abs())
            .fold(0.0, f64::max);
        assert!(worst <= 1e-6, "scale 2^{power}, offset {offset}: {worst}");
    }
}

#[test]
fn the_grid_is_what_was_asked_for() {
    let mesh = cube([1.0, 2.0, 3.0]);
    let (baked, _) = dense(&mesh, &Settings { resolution: Resolution::Cube(20), ..Settings::default() });
    assert_eq!(baked.dims, [20; 3]);
    assert!((baked.hi[0] - 3.6).abs() < 1e-12 && (baked.lo[2] + 3.6).abs() < 1e-12);
    let (baked, _) = dense(&mesh, &Settings { padding: 0.5, ..settings([3, 4, 5]) });
    assert!((baked.hi[0] - 4.0).abs() < 1e-12 && (baked.hi[2] - 6.0).abs() < 1e-12);
    let bounds = ([0.0, 0.5, -1.0], [0.25, 8.0, 7.0]);
    let (baked, values) = dense(&mesh, &Settings { bounds: Some(bounds), ..settings([3, 4, 5]) });
    assert_eq!((baked.lo, baked.hi), bounds);
    assert_eq!(values.len(), 60);
    // Node (0, 0, 0) is (0, 0.5, -1), one away from the wall.
    assert_eq!(values[0], -1.0);
}

#[test]
fn a_band_cuts() {
    let mesh = icosphere(3);
    let (_, whole) = dense(&mesh, &settings([50; 3]));
    let (_, cut) = dense(&mesh, &Settings { band: Some(0.125), ..settings([50; 3]) });
    assert!(whole.iter().zip(&cut).all(|(w, c)| w.clamp(-0.125, 0.125) == *c));
}

#[test]
fn open_meshes_have_winding_numbers() {
    let mut mesh = icosphere(3);
    mesh.faces.drain(0..20);
    let (baked, values) = dense(&mesh, &settings([30; 3]));
    assert_eq!(baked.method, Method::Winding);
    let (_, wrong) = compare(&mesh, &baked, &values, 3_000, 3_000, 0.0);
    assert_eq!(wrong, 0);
    let (baked, values) = dense(&mesh, &Settings { sign: SignRule::Unsigned, ..settings([30; 3]) });
    assert_eq!(baked.method, Method::Unsigned);
    assert!(values.iter().all(|v| *v >= 0.0));
    let sure = dense(&mesh, &Settings { confidence: true, ..settings([10; 3]) }).0.confidence.unwrap();
    assert!(
        sure.len() == 1000 && sure.iter().all(|c| (0.0..=1.0).contains(c)) && sure.iter().any(|c| *c < 0.99)
    );
}

fn refused(mesh: &Mesh, settings: &Settings) -> String {
    match bake(mesh, settings, &()) {
        Err(e) => e.to_string(),
        Ok(_) => panic!("{settings:?} was accepted"),
    }
}

#[test]
fn what_cannot_be_baked_is_refused() {
    let mesh = icosphere(1);
    let base = settings([8; 3]);
    let with = |change: &dyn Fn(&mut Settings)| {
        let mut settings = base.clone();
        change(&mut settings);
        refused(&mesh, &settings)
    };
    assert!(with(&|s| s.resolution = Resolution::Cube(0)).contains("resolution: 0"));
    assert!(with(&|s| s.resolution = Resolution::Each([8, 1, 8])).contains("resolution: 1"));
    assert!(with(&|s| s.resolution = Resolution::Cube(u32::MAX)).contains("at most 65536"));
    assert!(with(&|s| s.padding = -0.1).contains("padding: -0.1"));
    assert!(with(&|s| s.padding = f64::NAN).contains("padding: NaN"));
    assert!(with(&|s| s.band = Some(0.0)).contains("band: 0"));
    assert!(with(&|s| s.bounds = Some(([0.0; 3], [1.0, -1.0, 1.0]))).contains("bounds: y runs from 0 to -1"));
    assert!(with(&|s| s.bounds = Some(([f64::NAN; 3], [1.0; 3]))).contains("bounds: x"));
    assert!(with(&|s| s.bounds = Some(([0.0; 3], [1e-12; 3]))).contains("bounds"));
    assert!(with(&|s| (s.sparse, s.confidence) = (true, true)).contains("confidence"));
    let huge = Mesh {
        vertices: mesh.vertices.iter().map(|v| v.map(|x| x * 1e60)).collect(),
        faces: mesh.faces.clone(),
    };
    assert!(refused(&huge, &base).contains("32-bit floats"));
}

#[test]
fn memory_is_bounded_before_it_is_taken() {
    let mesh = icosphere(4);
    let big = Settings { resolution: Resolution::Cube(60_000), budget_bytes: 1 << 30, ..Settings::default() };
    let start = Instant::now();
    let said = refused(&mesh, &big);
    assert!(said.contains("864000000000000 bytes") && said.contains("1073741824"), "{said}");
    assert!(start.elapsed() < Duration::from_millis(50));
    let said = refused(&mesh, &Settings { sparse: true, ..big });
    assert!(said.contains("bytes are allowed"), "{said}");
    // Enough for the tables, not for what comes next: lists or bricks, as threads get there.
    let said = refused(&mesh, &Settings { sparse: true, budget_bytes: 12 << 20, ..settings([512; 3]) });
    assert!(said.contains("12582912 bytes are allowed"), "{said}");
}

#[derive(Default)]
struct Listener {
    stop: AtomicBool,
    done: AtomicU64,
}

impl Watch for Listener {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
    fn advance(&self, done: u64) {
        self.done.fetch_add(done, Ordering::Relaxed);
    }
}

#[test]
fn progress_adds_up() {
    for (sparse, band) in [(false, None), (false, Some(0.1)), (true, None)] {
        let listener = Listener::default();
        let settings = Settings { sparse, band, ..settings([97, 65, 121]) };
        let baked = bake(&icosphere(3), &settings, &listener).unwrap();
        assert!(matches!(baked.values, Values::Sparse(_)) == sparse);
        assert_eq!(listener.done.into_inner(), 97 * 65 * 121, "sparse {sparse}, band {band:?}");
    }
}

#[test]
fn it_stops_when_asked() {
    let listener = Listener::default();
    let mesh = icosphere(6);
    std::thread::scope(|scope| {
        let worker = scope.spawn(|| {
            let result = bake(&mesh, &settings([400; 3]), &listener);
            (Instant::now(), result.map(|_| ()))
        });
        std::thread::sleep(Duration::from_millis(400));
        let asked = Instant::now();
        listener.stop.store(true, Ordering::Relaxed);
        let (ended, result) = worker.join().unwrap();
        assert_eq!(result, Err(MeshError::Cancelled));
        assert!(ended - asked < Duration::from_millis(500), "{:?}", ended - asked);
    });
}

/// Gives up at the n-th question.
struct Patience {
    asked: AtomicU64,
    most: u64,
}

impl Watch for Patience {
    fn cancelled(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) + 1 >= self.most
    }
}

/// Before the first cell is looked at, a large mesh asks many times, and every time it may end.
#[test]
fn checks_and_signs_stop_when_asked() {
    let (ball, cut) = (icosphere(6), Mesh { faces: icosphere(6).faces[1..].to_vec(), ..icosphere(6) });
    for (mesh, sign) in [(&ball, SignRule::Auto), (&cut, SignRule::Auto), (&cut, SignRule::Parity)] {
        for sparse in [false, true] {
            let settings = Settings { sign, sparse, ..settings([24; 3]) };
            let ask = |most| {
                let watch = Patience { asked: AtomicU64::new(0), most };
                (bake(mesh, &settings, &watch).err(), watch.asked.into_inner())
            };
            let (none, all) = ask(u64::MAX);
            assert!(none.is_none() && all > 80, "asked {all} times");
            for most in [1, 2, 5, 10, 20, 30, 40, 50, 60, 70, all / 2, all - all / 4] {
                assert_eq!(ask(most).0, Some(MeshError::Cancelled), "{sign:?}: at {most} of {all}");
            }
        }
    }
}
