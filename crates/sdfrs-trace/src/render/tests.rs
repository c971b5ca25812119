use sdfrs_core::{Field, Prune, Rays, Scratch, Status, Value, contract::Work, pool};

use super::*;
use crate::camera::Kind;
use crate::{march, tracer::Form};

const LIMITS: Limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 1000, prune: Prune::Off };

fn sphere() -> Shape {
    Shape::build("sphere", vec![("radius".into(), Value::Num(1.0))], vec![]).unwrap()
}

fn camera(width: u32, height: u32) -> Camera {
    Camera {
        kind: Kind::Pinhole { fov_deg: 40.0 },
        origin: [3.0, 2.0, 4.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        width,
        height,
    }
}

fn picture<T: Native>(shape: &Shape, camera: &Camera) -> Picture<T> {
    let lights = [PointLight::at([4.0, 6.0, 3.0])];
    let scene = Scene { shape, camera, lights: &lights, surface: Surface::default() };
    render(&scene, &Tracer::Basic { guards: true }, &LIMITS, 100.0, &Control::new()).unwrap()
}

type Bits = (Vec<u64>, Vec<u32>, Vec<[u8; 3]>, Vec<[u32; 3]>);

/// Everything that must not depend on how the work is split.
fn bits<T: Native>(p: &Picture<T>) -> Bits {
    let t = p.hits.t.iter().map(|t| t.f64().to_bits()).collect();
    (t, p.hits.steps.clone(), p.rgb.clone(), p.normals.iter().map(|n| n.map(f32::to_bits)).collect())
}

#[test]
fn a_sphere_is_where_it_should_be() {
    fn run<T: Native>(tolerance: f64) {
        let camera = camera(61, 47);
        let p = picture::<T>(&sphere(), &camera);
        let (mut hits, mut misses) = (0, 0);
        for y in 0..camera.height {
            for x in 0..camera.width {
                let i = (y * camera.width + x) as usize;
                let (o, d) = camera.ray(x, y).unwrap();
                let b: f64 = (0..3).map(|a| o[a] * d[a]).sum();
                let gap = o.iter().map(|v| v * v).sum::<f64>() - b * b;
                let t = p.depth()[i].f64();
                if gap > 1.001 {
                    assert_eq!((p.hits.status[i], p.normals[i]), (Status::Miss as u8, [0.0; 3]));
                    assert!(t == f64::INFINITY && p.rgb[i] == [237, 242, 250]);
                    misses += 1;
                } else if gap < 0.98 {
                    assert_eq!(p.hits.status[i], Status::Hit as u8);
                    assert!((t - (-b - (1.0 - gap).sqrt())).abs() < 1e-3, "pixel {x} {y}: {t}");
                    for a in 0..3 {
                        let want = o[a] + t * d[a];
                        assert!((f64::from(p.normals[i][a]) - want).abs() < tolerance, "pixel {x} {y}");
                    }
                    hits += 1;
                }
            }
        }
        assert!(hits > 300 && misses > 1000, "{hits} {misses}");
        assert_eq!(p.summary.rays, 61 * 47);
    }
    // A hit lies up to eps above the surface.
    run::<f32>(2e-4);
    run::<f64>(2e-4);
}

#[test]
fn the_lit_side_is_bright() {
    let camera = camera(41, 41);
    let p = picture::<f32>(&sphere(), &camera);
    let (bright, dark) = (p.rgb[41 * 17 + 20], p.rgb[41 * 24 + 15]);
    assert!(bright[0] > dark[0], "{bright:?} {dark:?}");
}

#[test]
fn hits_are_those_of_the_cameras_rays() {
    fn run<T: Native>() {
        let (shape, camera) = (sphere(), camera(37, 31));
        let p = picture::<T>(&shape, &camera);
        let (origins, mut directions) = camera.rays::<T>().unwrap();
        check_rays(&origins, &mut directions).unwrap();
        let spans = (Span::All(T::of(0.0)), Span::All(T::of(100.0)));
        let rays = Rays { origins: &origins, directions: &directions, t_min: spans.0, t_max: spans.1 };
        let program = Program::<T>::for_tracing(&shape).unwrap();
        let tracer = Tracer::Basic { guards: true };
        let hits = march::trace(&program, &tracer, &rays, &LIMITS, &Control::new()).unwrap();
        assert_eq!((&hits.t, &hits.steps, &hits.status), (&p.hits.t, &p.hits.steps, &p.hits.status));
        let (again, summary) =
            trace_camera(&shape, &camera, &tracer, &LIMITS, 100.0, &Control::new()).unwrap();
        assert_eq!((&hits.t, &hits.steps), (&again.t, &again.steps));
        assert_eq!(summary.evaluations, p.summary.evaluations);
        // A picture keeps the largest witness alone.
        let steepest = hits.witness.iter().fold(0.0, |most, w| f64::max(most, w.f64()));
        assert!(p.hits.distance.is_empty() && p.hits.witness.is_empty() && steepest > 0.5);
        assert_eq!((p.summary.witness, summary.witness), (steepest, steepest));
    }
    run::<f32>();
    run::<f64>();
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (shape, camera) = (sphere(), camera(113, 71));
    let mut seen = Vec::new();
    for threads in [1, 2, 5] {
        pool::set_threads(threads);
        seen.push((bits(&picture::<f32>(&shape, &camera)), bits(&picture::<f64>(&shape, &camera))));
    }
    pool::set_threads(0);
    assert!(seen.windows(2).all(|w| w[0] == w[1]));
    // The comparison can fail: a grown sphere gives other bits.
    let grown = Shape::build("dilate", vec![("radius".into(), Value::Num(1e-3))], vec![shape]).unwrap();
    assert_ne!(bits(&picture::<f32>(&grown, &camera)), seen[0].0);
}

#[test]
fn packs_of_rays_and_pixels_have_the_bits_of_one() {
    fn run<T: Native>(camera: &Camera) {
        let rays = CameraRays::<T>::new(camera, &Tracer::Basic { guards: true }, 9.0).unwrap();
        let mut bundle = Bundle::blank();
        let width = camera.width as usize;
        let (count, pack) = (rays.count(), T::Lanes::WIDTH);
        for first in (0..count).step_by(pack) {
            let pixel = |i: usize| Pixel::at(i % width, i / width);
            let pixels: Vec<Pixel> = (first..count.min(first + pack)).map(pixel).collect();
            rays.bundle(&pixels, &mut bundle);
            for (lane, i) in (first..count.min(first + pack)).enumerate() {
                let Ray { origin, direction, t_min, t_max } = rays.ray(i);
                let one = [origin, direction].concat().into_iter().chain([t_min, t_max]);
                let of =
                    [bundle.origin, bundle.direction].concat().into_iter().chain([bundle.t, bundle.t_max]);
                assert!(
                    one.map(T::f64).map(f64::to_bits).eq(of.map(|v| v.lane(lane).f64().to_bits())),
                    "ray {i}"
                );
            }
        }
        // Single precision holds the normal of a single precision trace to the bit.
        if size_of::<T>() == 8 {
            return;
        }
        let lights = [
            PointLight::at([4.0, 6.0, 3.0]),
            PointLight { color: [0.2, 0.1, 0.4], ..PointLight::at([-2.0; 3]) },
        ];
        let red = Surface { albedo: [0.9, 0.3, 0.2], ..Surface::default() };
        let shape = sphere();
        for (lights, surface) in
            [(&lights[..1], Surface::default()), (&lights[..], Surface::default()), (&lights[..1], red)]
        {
            let scene = Scene { shape: &shape, camera, lights, surface };
            let p =
                render::<T>(&scene, &Tracer::Basic { guards: true }, &LIMITS, 9.0, &Control::new()).unwrap();
            let light = Light { lights, surface: &surface };
            for i in 0..count {
                let (ray, t) = (rays.ray(i), p.hits.t[i]);
                let point = std::array::from_fn(|a| ray.origin[a] + t * ray.direction[a]);
                let normal = p.normals[i].map(|v| T::of(v.into()));
                assert_eq!(p.rgb[i], light.pixel(p.hits.status[i], point, normal), "pixel {i}");
            }
        }
    }
    let pinhole = camera(37, 29);
    let flat = Camera { kind: Kind::Orthographic { extent: 2.5 }, ..pinhole };
    for camera in [pinhole, flat] {
        run::<f32>(&camera);
        run::<f64>(&camera);
    }
}

#[test]
fn what_cannot_win_changes_no_normal() {
    // 300 balls, joined smoothly with 80 boxes and cut by a torus.
    let place = |i: usize, f: f64| Value::Vec3([1.0, 1.7, 2.3].map(|k| 1.5 * (f * k * i as f64).sin()));
    let part = |op: &str, name: &str, v: Value| Shape::build(op, vec![(name.into(), v)], vec![]).unwrap();
    let moved =
        |s: Shape, by: Value| Shape::build("translate", vec![("offset".into(), by)], vec![s]).unwrap();
    let joined =
        |k: f64, of: Vec<Shape>| Shape::build("union", vec![("k".into(), Value::Num(k))], of).unwrap();
    let balls = (0..300).map(|i| moved(part("sphere", "radius", Value::Num(0.1)), place(i, 1.0)));
    let boxes = (0..80).map(|i| moved(part("box", "size", Value::Vec3([0.2, 0.1, 0.3])), place(i, 1.3)));
    let shape = joined(0.02, vec![joined(0.0, balls.collect()), joined(0.0, boxes.collect())]);
    let camera = camera(150, 90);
    let lights = [PointLight::at([4.0, 6.0, 3.0])];
    let scene = Scene { shape: &shape, camera: &camera, lights: &lights, surface: Surface::default() };
    fn run<T: Native>(scene: &Scene, tracer: &Tracer, max_steps: u32, prune: Prune) -> Picture<T> {
        let limits = Limits { prune, max_steps, ..LIMITS };
        render(scene, tracer, &limits, 100.0, &Control::new()).unwrap()
    }
    // Few steps leave rays behind their cell, where its program says nothing.
    fn same<T: Native>(scene: &Scene, tracer: &Tracer, max_steps: u32) -> Summary {
        let whole = run::<T>(scene, tracer, max_steps, Prune::Off);
        let short = run::<T>(scene, tracer, max_steps, Prune::Exact);
        assert!(short.summary.mean_ops < 0.5 * whole.summary.mean_ops);
        assert!(whole.hits.t == short.hits.t && whole.rgb == short.rgb);
        for (i, (a, b)) in whole.normals.iter().zip(&short.normals).enumerate() {
            assert_eq!(a, b, "{tracer:?}, {max_steps} steps: pixel {i}");
        }
        whole.summary
    }
    let (basic, form) = (Tracer::Basic { guards: true }, Form::Y2018);
    for tracer in [basic, Tracer::Enhanced { omega: 0.9, form, guards: true }] {
        assert!(same::<f32>(&scene, &tracer, 1000).hits > 3000);
        assert!(same::<f64>(&scene, &tracer, 1000).hits > 3000);
        assert!(same::<f32>(&scene, &tracer, 9).out_of_steps > 1000);
    }
}

#[test]
fn surfaces_are_shown_where_rays_have_come_to() {
    use sdfrs_core::{
        bake::{Plan, bake},
        grid::Stepping,
    };
    // A bound too small takes safe steps through the surface, which is then looked for in between.
    let steep = Shape::build("with_lipschitz", vec![("lipschitz".into(), Value::Num(0.8))], vec![sphere()]);
    let plan = Plan { dims: [40; 3], lo: [-1.2; 3], hi: [1.2; 3], band: None, wide: false };
    let grid = bake(&sphere(), &plan, u64::MAX, &Control::new()).unwrap();
    let baked = Shape::texture(grid.with_stepping(Stepping::Voxel)).unwrap();
    let (steep, camera) = (steep.unwrap(), camera(63, 47));
    let form = Form::Y2018;
    let shown = |shape: &Shape, tracer: Tracer, max_steps: u32| {
        let lights = [PointLight::at([1.5, 0.5, 1.0])];
        let light = Light { lights: &lights, surface: &Surface::default() };
        let scene = Scene { shape, camera: &camera, lights: &lights, surface: Surface::default() };
        let limits = Limits { max_steps, ..LIMITS };
        let p = render::<f32>(&scene, &tracer, &limits, 100.0, &Control::new()).unwrap();
        let rays = CameraRays::<f32>::new(&camera, &tracer, 100.0).unwrap();
        for i in 0..p.rgb.len() {
            let point = rays.ray(i).at(p.hits.t[i]);
            let want = light.pixel(p.hits.status[i], point, p.normals[i]);
            assert_eq!(p.rgb[i], want, "{tracer:?}, {max_steps} steps: pixel {i}");
        }
        p.summary
    };
    let basic = Tracer::Basic { guards: true };
    for tracer in [
        basic,
        Tracer::Relaxed { omega: 1.6, form, guards: true },
        Tracer::Basic { guards: false },
        Tracer::CoverageSearch { guards: true },
    ] {
        assert!(shown(&sphere(), tracer, 1000).hits > 200);
        assert!(shown(&sphere(), tracer, 3).out_of_steps > 50, "{tracer:?}");
    }
    assert!(shown(&steep, basic, 1000).crossings > 50);
    assert!(shown(&baked, basic, 1000).hits > 200);
}

#[test]
fn normals_without_a_slope_face_their_rays() {
    // All rays begin at a ball's centre, where its distance has no slope.
    fn run<T: Native>() {
        let camera = Camera { origin: [0.0; 3], target: [1.0, 2.0, 3.0], ..camera(23, 19) };
        let rays = CameraRays::<T>::new(&camera, &Tracer::Basic { guards: true }, 100.0).unwrap();
        let p = picture::<T>(&sphere(), &camera);
        for (i, normal) in p.normals.iter().enumerate() {
            assert_eq!((p.hits.status[i], p.hits.t[i].f64()), (Status::Hit as u8, 0.0));
            assert_eq!(*normal, rays.ray(i).direction.map(|d| -(d.f64() as f32)), "pixel {i}");
        }
    }
    run::<f32>();
    run::<f64>();
}

#[test]
fn out_of_steps_is_shaded_where_it_got_to() {
    let (shape, camera) = (sphere(), camera(21, 21));
    let scene = Scene { shape: &shape, camera: &camera, lights: &[], surface: Surface::default() };
    let limits = Limits { max_steps: 2, ..LIMITS };
    let tracer = Tracer::Basic { guards: true };
    let p = render::<f32>(&scene, &tracer, &limits, 100.0, &Control::new()).unwrap();
    let i = 21 * 4 + 10;
    assert_eq!(p.hits.status[i], Status::OutOfSteps as u8);
    assert!(p.hits.t[i].is_finite() && p.normals[i] != [0.0; 3]);
    assert_eq!(
        p.rgb[i],
        Light { lights: &[], surface: &scene.surface }.pixel(Status::Hit as u8, [0.0f32; 3], [0.0; 3])
    );
}

/// A field with holes that are no numbers.
struct Torn<'a>(&'a Program<f32>, fn(f32, f32) -> bool);

impl Field<f32> for Torn<'_> {
    fn eval(&self, scratch: &mut Scratch<f32>, [x, y, z]: [&[f32]; 3], out: &mut [f32]) {
        self.0.eval(scratch, [x, y, z], out);
        for ((x, y), v) in x.iter().zip(y).zip(out) {
            if self.1(*x, *y) {
                *v = f32::NAN;
            }
        }
    }
}

#[test]
fn what_is_no_number_is_seen() {
    let (shape, surface, control) = (sphere(), Surface::default(), Control::new());
    let camera = Camera { kind: Kind::Orthographic { extent: 2.2 }, ..camera(30, 30) };
    let program = Program::<f32>::for_tracing(&shape).unwrap();
    for tracer in [Tracer::Basic { guards: true }, Tracer::Basic { guards: false }] {
        let rays = CameraRays::<f32>::new(&camera, &tracer, 100.0).unwrap();
        let shading = Shading::new(&program, &rays, Light { lights: &[], surface: &surface });
        let shown = |field: &dyn Field<f32>| {
            march::trace_shown(field, &tracer, &rays, &LIMITS, &control, &shading).unwrap()
        };
        let (whole, (hits, torn)) = (shown(&program).1, shown(&Torn(&program, |x, y| x > y)));
        let mut seen = [0; 3];
        for (i, status) in hits.status.iter().enumerate() {
            seen[usize::from(*status == Status::Hit as u8)
                + 2 * usize::from(*status == Status::Invalid as u8)] += 1;
            let lost = ([0.0; 3], [255, 0, 255]);
            let kept = (whole.normals[i], whole.rgb[i]);
            let want = if *status == Status::Invalid as u8 { lost } else { kept };
            assert_eq!((torn.normals[i], torn.rgb[i]), want, "pixel {i}");
        }
        assert!(seen.iter().all(|n| *n > 50), "{seen:?}");
    }
}

#[test]
fn a_quiet_trace_has_nothing_to_tell() {
    let quiet = |origin: [f64; 3], tracer: Tracer| {
        let camera = Camera { origin, ..camera(33, 17) };
        let (hits, summary) =
            trace_camera::<f32>(&sphere(), &camera, &tracer, &LIMITS, 100.0, &Control::new()).unwrap();
        let told = hits.flags.iter().any(|f| *f != 0) || hits.fallbacks.iter().any(|n| *n != 0);
        assert_eq!(hits.work.quiet, !told);
        let loud = Hits { work: Work { quiet: false, ..hits.work.clone() }, ..hits };
        assert_eq!(Summary::of(&loud, summary.seconds, 1.0), summary);
        !told
    };
    let outside = [3.0, 2.0, 4.0];
    assert!(quiet(outside, Tracer::Basic { guards: true }));
    assert!(!quiet([0.1, 0.2, 0.3], Tracer::Basic { guards: true }), "starts inside");
    assert!(!quiet(outside, Tracer::Relaxed { omega: 1.9, form: Form::Y2018, guards: true }), "falls back");
}

#[test]
fn refusals_come_before_work() {
    let (shape, camera) = (sphere(), camera(8, 8));
    let good = Scene { shape: &shape, camera: &camera, lights: &[], surface: Surface::default() };
    let dark = [PointLight { intensity: f64::NAN, ..PointLight::at([0.0; 3]) }];
    let blind = Camera { target: camera.origin, ..camera };
    let broken = Surface { albedo: [f64::NAN; 3], ..Surface::default() };
    let run = |scene: Scene, limits: Limits, t_max: f64| {
        render::<f32>(&scene, &Tracer::Basic { guards: true }, &limits, t_max, &Control::new())
    };
    assert!(run(good, LIMITS, 100.0).is_ok());
    assert!(run(Scene { lights: &dark, ..good }, LIMITS, 100.0).is_err());
    assert!(run(Scene { camera: &blind, ..good }, LIMITS, 100.0).is_err());
    assert!(run(Scene { surface: broken, ..good }, LIMITS, 100.0).is_err());
    assert!(run(good, Limits { eps: 0.0, ..LIMITS }, 100.0).is_err());
    assert!(run(good, LIMITS, f64::NAN).is_err());
    assert!(run(good, LIMITS, -1.0).is_err());
    let beyond = Camera { origin: [1e300, 0.0, 0.0], ..camera };
    assert!(run(Scene { camera: &beyond, ..good }, LIMITS, 100.0).is_err(), "1e300 is no f32");
    let stopped = Control::new();
    stopped.cancel();
    let result = render::<f32>(&good, &Tracer::Basic { guards: true }, &LIMITS, 100.0, &stopped);
    assert_eq!(result.err(), Some(TraceError::Cancelled));
}
