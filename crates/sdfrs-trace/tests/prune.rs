//! Over 1,000 random scenes, cameras, tracers and both precisions: under `Exact` a trace equals the
//! unpruned one in depth, status, steps, fallbacks, multiplier and witness, to the bit; under `Skip` in
//! status, but for rays that graze. And both do save work.
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use common::{Random, bits, build, camera, trace};
use sdfrs_core::{
    Control, Hits, Limits, Program, Prune, Rays, Shape, Span, Status, Value, contract, eval::Native,
};
use sdfrs_trace::{
    Camera, SearchForm, Tracer,
    march::{self, Source},
    render::CameraRays,
};

/// A random solid of about `n` parts.
fn tree(random: &mut Random, n: usize) -> Shape {
    if n <= 1 {
        let num = |v: f64| Value::Num(v);
        let r = random.within(0.1, 0.5);
        let part = match random.below(6) {
            0 => build("box", &[("size", random.vector(0.2, 0.9))], &[]),
            1 => build("torus", &[("major", num(r)), ("minor", num(r / 3.0))], &[]),
            2 => build("cylinder", &[("radius", num(r)), ("height", num(0.8))], &[]),
            3 => build("ellipsoid", &[("radii", random.vector(0.1, 0.6))], &[]),
            _ => build("sphere", &[("radius", num(r))], &[]),
        };
        return build("translate", &[("offset", random.vector(-1.5, 1.5))], &[&part]);
    }
    let left = 1 + random.below(n - 1);
    let (a, b) = (tree(random, left), tree(random, n - left));
    let k = if random.below(3) == 0 { random.within(0.01, 0.3) } else { 0.0 };
    let both = match random.below(8) {
        0 => build("difference", &[("k", Value::Num(k))], &[&a, &b]),
        1 => build("intersection", &[("k", Value::Num(k))], &[&a, &b]),
        _ => build("union", &[("k", Value::Num(k))], &[&a, &b]),
    };
    match random.below(10) {
        0 => build("rotate", &[("angle", Value::Num(1.0)), ("axis", Value::Vec3([0.3, 1.0, 0.2]))], &[&both]),
        1 => build("scale", &[("factors", random.vector(0.6, 1.4))], &[&both]),
        2 => build("mirror", &[("axis", Value::Text("x".into()))], &[&both]),
        3 => build("shell", &[("thickness", Value::Num(0.05))], &[&both]),
        4 => build("with_lipschitz", &[("lipschitz", Value::Num(1.5))], &[&both]),
        _ => both,
    }
}

fn tracers() -> [Tracer; 7] {
    let (form, guards) = (sdfrs_trace::Form::Y2023, true);
    [
        Tracer::Basic { guards },
        Tracer::Relaxed { omega: 1.5, form, guards },
        Tracer::Enhanced { omega: 0.88, form, guards },
        Tracer::Enhanced { omega: 0.88, form, guards },
        Tracer::AutoRelaxed { beta: 0.3, guards },
        Tracer::BinarySearch { form: SearchForm::Stackless, max_level: 18, guards },
        Tracer::CoverageSearch { guards },
    ]
}

/// Work saved over all scenes, and rays whose status is another under `Skip`, of how many.
struct Saved {
    whole: u64,
    exact: u64,
    skip: u64,
    other: usize,
    rays: usize,
}

/// A ray that comes within a few thresholds of a surface it does not hit, or hits it at a glance.
fn grazes<T: Native>(a: &Hits<T>, b: &Hits<T>, i: usize) -> bool {
    [a, b].iter().any(|h| h.status[i] == Status::OutOfSteps as u8 || h.distance[i].f64().abs() <= 4e-4)
}

/// A miss has gone without an end, and nothing was near last.
fn is_far_if_missed<T: Native>(h: &Hits<T>, i: usize) -> bool {
    h.status[i] != Status::Miss as u8 || (h.t[i].f64() == f64::INFINITY && h.distance[i].f64() > 0.0)
}

/// Operations for the steps alone: on pictures this small the probes and the empty lanes outweigh them.
fn operations<T: Native>(hits: &Hits<T>) -> u64 {
    let run: u64 = hits.work.lengths.iter().map(|(ops, n)| ops * n).sum();
    let lanes: u64 = hits.work.lengths.values().sum();
    let steps: u64 = hits.steps.iter().map(|n| u64::from(*n)).sum();
    run * steps / lanes.max(1)
}

fn compare<T: Native>(seed: u64, scenes: usize) -> Saved {
    let mut random = Random(seed);
    let mut saved = Saved { whole: 0, exact: 0, skip: 0, other: 0, rays: 0 };
    for scene in 0..scenes {
        let parts = 1 + random.below(40);
        let shape = tree(&mut random, parts);
        let view = camera(&mut random);
        let tracer = tracers()[scene % 7];
        let a = trace::<T>(&shape, &view, &tracer, Prune::Off);
        let b = trace::<T>(&shape, &view, &tracer, Prune::Exact);
        let what = format!("seed {seed}, scene {scene} of {parts} parts, {tracer:?}");
        for (i, (x, y)) in bits(&a).iter().zip(bits(&b)).enumerate() {
            assert_eq!(*x, y, "{what}, ray {i}");
        }
        let c = trace::<T>(&shape, &view, &tracer, Prune::Skip);
        for i in 0..a.t.len() {
            if a.status[i] != c.status[i] {
                assert!(grazes(&a, &c, i), "{what}, ray {i}: {} and {}", a.status[i], c.status[i]);
                saved.other += 1;
            }
            assert!(is_far_if_missed(&c, i), "{what}, ray {i}: no miss");
            let steps = [a.steps[i], c.steps[i]];
            assert!(steps[1] <= steps[0] + 40, "{what}, ray {i}: {steps:?} steps");
        }
        // Cells of other programs are no steps of one field.
        let steepest = |h: &Hits<T>| h.witness.iter().fold(0.0, |most, w| f64::max(most, w.f64()));
        let (steep, seen) = (steepest(&a), steepest(&c));
        assert!(seen <= 1.01 || seen <= steep * 1.01, "{what}: slopes of {seen} seen, not {steep}");
        saved.rays += a.t.len();
        saved.whole += operations(&a);
        saved.exact += operations(&b);
        saved.skip += operations(&c);
    }
    saved
}

#[test]
fn exact_changes_no_bit_and_skip_no_status() {
    for saved in [compare::<f32>(1, 600), compare::<f64>(2, 400)] {
        assert!(saved.exact < saved.whole, "exact keeps {} of {}", saved.exact, saved.whole);
        assert!(saved.skip < saved.exact, "skip keeps {} of {}", saved.skip, saved.whole);
        assert!(saved.other * 5000 < saved.rays, "{} of {} rays end otherwise", saved.other, saved.rays);
    }
}

/// Pictures whose groups are larger, and rays of whom nobody knows that they are a picture's.
fn compare_large<T: Native>(seed: u64) {
    let mut random = Random(seed);
    let shape = tree(&mut random, 25);
    let view = Camera { width: 523, height: 507, ..camera(&mut random) };
    for tracer in [tracers()[0], tracers()[4]] {
        let a = trace::<T>(&shape, &view, &tracer, Prune::Off);
        let b = trace::<T>(&shape, &view, &tracer, Prune::Skip);
        let (origins, mut directions) = {
            let (o, d): (Vec<_>, Vec<_>) = view.rays::<f64>().unwrap();
            let of = |v: Vec<[f64; 3]>| v.iter().map(|v| v.map(T::of)).collect::<Vec<_>>();
            (of(o), of(d))
        };
        contract::check_rays(&origins, &mut directions).unwrap();
        let (t_min, t_max) = (Span::All(T::of(0.0)), Span::All(T::of(20.0)));
        let rays = Rays { origins: &origins, directions: &directions, t_min, t_max };
        let limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 300, prune: Prune::Skip };
        let program = Program::<T>::for_tracing(&shape).unwrap();
        let c = march::trace(&program, &tracer, &rays, &limits, &Control::new()).unwrap();
        let steps = |h: &Hits<T>| h.steps.iter().map(|n| u64::from(*n)).sum::<u64>();
        assert!(steps(&b) * 5 < steps(&c) * 4 && steps(&c) * 5 < steps(&a) * 4);
        for h in [&b, &c] {
            alike(&a, h);
        }
    }
}

/// Rays end as those of the whole scene do, but for grazing ones.
fn alike<T: Native>(a: &Hits<T>, h: &Hits<T>) {
    let other = (0..a.t.len()).filter(|&i| a.status[i] != h.status[i]);
    let other: Vec<_> = other.inspect(|&i| assert!(grazes(a, h, i), "ray {i}")).collect();
    assert!(other.len() * 5000 < a.t.len(), "{} rays end otherwise", other.len());
    assert!((0..a.t.len()).all(|i| is_far_if_missed(h, i)));
    let hits = (0..a.t.len()).filter(|&i| a.status[i] == 1 && h.status[i] == 1);
    let (far, near): (Vec<_>, Vec<_>) = hits.partition(|&i| (a.t[i] - h.t[i]).f64().abs() > 1.5e-4);
    assert!(far.len() * 200 < near.len(), "{} of {} hits lie elsewhere", far.len(), near.len());
}

/// Groups and blocks of every size, none of which divides the picture.
#[test]
fn pictures_of_all_sizes_end_alike() {
    let mut random = Random(5);
    let (shape, view, tracer) = (tree(&mut random, 25), camera(&mut random), tracers()[0]);
    for (width, height) in [(301, 203), (701, 613), (1031, 707), (1501, 1403)] {
        let view = Camera { width, height, ..view };
        let a = trace::<f32>(&shape, &view, &tracer, Prune::Off);
        let hits = a.status.iter().filter(|s| **s == Status::Hit as u8).count();
        assert!(hits * 10 > a.t.len(), "{hits} of {} rays hit", a.t.len());
        assert!(bits(&a) == bits(&trace::<f32>(&shape, &view, &tracer, Prune::Exact)), "{width}x{height}");
        let skip = trace::<f32>(&shape, &view, &tracer, Prune::Skip);
        assert!(operations(&skip) * 2 < operations(&a), "{width}x{height}");
        alike(&a, &skip);
    }
}

/// Whatever stood in the memory before.
#[test]
fn results_over_old_ones_are_those_of_new_memory() {
    let mut random = Random(8);
    let shape = tree(&mut random, 20);
    let view = camera(&mut random);
    let program = Program::<f32>::for_tracing(&shape).unwrap();
    for tracer in [tracers()[0], tracers()[2]] {
        let rays = CameraRays::<f32>::new(&view, &tracer, 20.0).unwrap();
        for prune in [Prune::Off, Prune::Exact, Prune::Skip] {
            let limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 300, prune };
            let over =
                |old| march::trace_over(&program, &tracer, &rays, &limits, &Control::new(), old).unwrap();
            let n = rays.count();
            let old = Hits {
                t: vec![0.5; n],
                status: vec![1; n],
                steps: vec![77; n],
                fallbacks: vec![3; n],
                multiplier: vec![9.0; n],
                distance: vec![-1.0; n],
                witness: vec![4.0; n],
                flags: vec![7; n],
                ..Hits::default()
            };
            let (new, used) = (over(Hits::default()), over(old));
            assert_eq!(bits(&new), bits(&used), "{tracer:?} {prune:?}");
            assert!(new.distance == used.distance && new.status.contains(&0) && new.status.contains(&1));
        }
    }
}

#[test]
fn large_pictures_and_loose_rays_end_alike() {
    compare_large::<f32>(6);
    compare_large::<f64>(7);
}

#[test]
fn hits_under_skip_lie_where_the_others_do() {
    let mut random = Random(5);
    let (mut far, mut hits) = (0, 0);
    for _ in 0..60 {
        let parts = 2 + random.below(20);
        let shape = tree(&mut random, parts);
        let view = camera(&mut random);
        let tracer = Tracer::Basic { guards: true };
        let (a, b) = (
            trace::<f64>(&shape, &view, &tracer, Prune::Off),
            trace::<f64>(&shape, &view, &tracer, Prune::Skip),
        );
        for i in (0..a.t.len()).filter(|&i| a.status[i] == 1 && b.status[i] == 1) {
            hits += 1;
            far += usize::from((a.t[i] - b.t[i]).abs() > 1e-4);
        }
    }
    // A glance may end at another of the places within the threshold.
    assert!(hits > 10_000 && far * 1000 < hits, "{far} of {hits} hits lie elsewhere");
}

/// `n` balls in a cube.
fn cloud(random: &mut Random, n: usize, radius: f64, half: f64) -> Shape {
    let ball = build("sphere", &[("radius", Value::Num(radius))], &[]);
    let balls: Vec<_> =
        (0..n).map(|_| build("translate", &[("offset", random.vector(-half, half))], &[&ball])).collect();
    build("union", &[("k", Value::Num(0.0))], &balls.iter().collect::<Vec<_>>())
}

#[test]
fn a_thousand_spheres_cost_a_few() {
    let mut random = Random(3);
    let shape = cloud(&mut random, 1000, 0.05, 1.5);
    let view = Camera { width: 256, height: 256, ..camera(&mut random) };
    let tracer = Tracer::Basic { guards: true };
    let (a, b) = (
        trace::<f32>(&shape, &view, &tracer, Prune::Off),
        trace::<f32>(&shape, &view, &tracer, Prune::Exact),
    );
    assert_eq!(bits(&a), bits(&b));
    assert_eq!((a.work.prune, b.work.prune), (Prune::Off, Prune::Exact));
    let (all, left) = (a.work.node_evaluations, b.work.node_evaluations);
    assert!(left * 20 < all, "{left} of {all}");
    // Most of what could win somewhere in a cell is met by none of its rays.
    let c = trace::<f32>(&shape, &view, &tracer, Prune::Skip);
    assert!(c.work.node_evaluations * 3 < left * 2, "{} of {left}", c.work.node_evaluations);
    assert!(b.work.arena_bytes > 0 && b.work.arena_bytes < 1 << 24, "{} bytes", b.work.arena_bytes);
}

/// Spheres found by place, with a cube carved out of them and a blend beside.
#[test]
fn a_crowd_is_walked_as_if_each_was_asked() {
    let mut random = Random(4);
    let crowd = cloud(&mut random, 5000, 0.03, 1.2);
    let cube = build("box", &[("size", random.vector(0.8, 1.2))], &[]);
    let carved = build("difference", &[("k", Value::Num(0.0))], &[&crowd, &cube]);
    let shape = build("union", &[("k", Value::Num(0.1))], &[&carved, &tree(&mut random, 3)]);
    crowd_is_walked::<f32>(&shape, &camera(&mut random));
    crowd_is_walked::<f64>(&shape, &camera(&mut random));
}

fn crowd_is_walked<T: Native>(shape: &Shape, view: &Camera) {
    for tracer in [&tracers()[0], &tracers()[4]] {
        let a = trace::<T>(shape, view, tracer, Prune::Off);
        let b = trace::<T>(shape, view, tracer, Prune::Exact);
        assert_eq!(bits(&a), bits(&b));
        assert!(b.work.node_evaluations * 2 < a.work.node_evaluations);
        let c = trace::<T>(shape, view, tracer, Prune::Skip);
        let other = (0..a.t.len()).filter(|&i| a.status[i] != c.status[i]);
        assert!(other.into_iter().all(|i| grazes(&a, &c, i)));
        let hits = (0..a.t.len()).filter(|&i| a.status[i] == 1 && c.status[i] == 1);
        let (far, near): (Vec<_>, Vec<_>) = hits.partition(|&i| (a.t[i] - c.t[i]).f64().abs() > 2e-4);
        assert!(far.len() * 200 < near.len(), "{} of {} hits lie elsewhere", far.len(), near.len());
        assert!(c.work.node_evaluations * 2 < a.work.node_evaluations);
        assert!(a.status.contains(&(Status::Hit as u8)) && a.status.contains(&(Status::Miss as u8)));
    }
}

#[test]
fn rays_in_any_order_keep_their_bits() {
    let mut random = Random(11);
    let shape = tree(&mut random, 30);
    let view = camera(&mut random);
    let (mut origins, mut directions) = view.rays::<f64>().unwrap();
    for i in (1..origins.len()).rev() {
        let j = random.below(i + 1);
        origins.swap(i, j);
        directions.swap(i, j);
    }
    contract::check_rays(&origins, &mut directions).unwrap();
    let rays =
        Rays { origins: &origins, directions: &directions, t_min: Span::All(0.0), t_max: Span::All(20.0) };
    let program = Program::<f64>::for_tracing(&shape).unwrap();
    let run = |prune| {
        let limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 300, prune };
        march::trace(
            &program,
            &Tracer::Enhanced { omega: 0.88, form: Default::default(), guards: true },
            &rays,
            &limits,
            &Control::new(),
        )
        .unwrap()
    };
    let (a, b) = (run(Prune::Off), run(Prune::Exact));
    assert_eq!(bits(&a), bits(&b));
    assert!(operations(&b) < operations(&a));
}

/// Half of a group looks one way, half the other: there is no mean ray, but every ray has to be walked.
#[test]
fn rays_without_a_common_direction_are_walked() {
    let shape = tree(&mut Random(11), 30);
    let program = Program::<f32>::for_tracing(&shape).unwrap();
    // Sorted, the first 256 are one group; the others give the block a direction.
    let opposite = (0..256).map(|i| ([0.0, 0.0, 9.0], [if i < 128 { 1.0 } else { -1.0 }, 0.0, 0.0]));
    let rays: Vec<([f32; 3], [f32; 3])> =
        opposite.chain((0..128).map(|_| ([9.0, 0.0, 9.0], [0.0, 1.0, 0.0]))).collect();
    let (origins, directions): (Vec<_>, Vec<_>) = rays.into_iter().unzip();
    let rays =
        Rays { origins: &origins, directions: &directions, t_min: Span::All(0.0), t_max: Span::All(20.0) };
    let run = |prune| {
        let limits = Limits { eps: 1e-4, cone: 0.0, max_steps: 300, prune };
        march::trace(&program, &Tracer::Basic { guards: true }, &rays, &limits, &Control::new()).unwrap()
    };
    let (a, b) = (run(Prune::Off), run(Prune::Exact));
    assert!(a.steps.iter().all(|n| *n > 0));
    for (i, (x, y)) in bits(&a).into_iter().zip(bits(&b)).enumerate() {
        assert_eq!(x, y, "ray {i}");
    }
}

#[test]
fn one_primitive_is_left_alone() {
    let shape = build("sphere", &[("radius", Value::Num(1.0))], &[]);
    let view = camera(&mut Random(1));
    let of = |prune| trace::<f32>(&shape, &view, &Tracer::Basic { guards: true }, prune).work.prune;
    assert_eq!(of(Prune::Auto { skip: true }), Prune::Off);
    assert_eq!(of(Prune::Auto { skip: false }), Prune::Off);
}
