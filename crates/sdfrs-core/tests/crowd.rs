//! Law: a union of many spheres, found by place, has the bits of the same union asked sphere by sphere:
//! values and gradients, in both precisions, moved, carved and blended, on every instruction set.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Random, build, moved, num, vec3};
use sdfrs_core::{
    Program, Scratch, Shape,
    eval::{Isa, Native, best},
    op::Op,
};

/// Balls of a few sizes; some twice, so that several are equally near.
fn cloud(n: usize) -> Shape {
    let mut random = Random(3);
    let balls: Vec<Shape> = (0..n)
        .map(|i| {
            let [x, y, z] = random.point(1.5);
            let ball = build("sphere", &[("radius", num([0.01, 0.02, 0.05][i % 3]))], &[]);
            moved(&ball, if i % 10 == 0 { x.signum() } else { x }, y, z)
        })
        .collect();
    build("union", &[("k", num(0.0))], &balls.iter().collect::<Vec<_>>())
}

fn scenes() -> [(&'static str, Shape); 4] {
    let cloud = cloud(5000);
    let drawn = build("elongate", &[("amount", vec3(0.3, 0.0, 0.2))], &[&cloud]);
    let cube = build("box", &[("size", vec3(1.0, 1.0, 1.0))], &[]);
    let carved = build("difference", &[("k", num(0.1))], &[&cube, &cloud]);
    let turned = build("rotate", &[("angle", num(0.7)), ("axis", vec3(0.3, 1.0, 0.2))], &[&cloud]);
    [("cloud", cloud), ("turned", turned), ("drawn out", drawn), ("carved", carved)]
}

/// Value and gradient.
fn all<T: Native>(program: &Program<T>, isa: Isa, p: &[Vec<T>; 3]) -> Vec<[u64; 5]> {
    let mut scratch = Scratch::new();
    let n = p[0].len();
    let mut value = vec![T::of(0.0); n];
    program.evaluate_on(isa, &mut scratch, [&p[0], &p[1], &p[2]], &mut value);
    let mut out = [(); 4].map(|()| vec![T::of(0.0); n]);
    let [v, x, y, z] = &mut out;
    program.gradient_on(isa, &mut scratch, [&p[0], &p[1], &p[2]], [v, x, y, z]);
    let bits = |v: T| v.f64().to_bits();
    (0..n)
        .map(|i| [bits(value[i]), bits(out[0][i]), bits(out[1][i]), bits(out[2][i]), bits(out[3][i])])
        .collect()
}

fn check<T: Native>(name: &str, shape: &Shape) {
    let mut random = Random(8);
    let mut p = [(); 3].map(|()| Vec::new());
    for i in 0..1000 {
        let at = random.point([1.6, 5.0, 1e4][i % 3]);
        (0..3).for_each(|a| p[a].push(T::of(at[a])));
    }
    p[0][17] = T::INFINITY;
    p[1][99] = T::of(f64::NAN);
    let (found, asked) = (Program::<T>::values(shape).unwrap(), Program::<T>::for_tracing(shape).unwrap());
    let has = |program: &Program<T>| program.tape().instructions().iter().any(|i| i.op == Op::SphereCrowd);
    assert!(has(&found) && !has(&asked), "{name}");
    let expected = all(&asked, best(), &p);
    for isa in [Isa::Baseline, best()] {
        for (i, (a, b)) in expected.iter().zip(all(&found, isa, &p)).enumerate() {
            assert_eq!(*a, b, "{name} at {:?}", p.each_ref().map(|v| v[i]));
        }
    }
}

#[test]
fn found_by_place_is_asked_one_by_one() {
    for (name, shape) in scenes() {
        check::<f32>(name, &shape);
        check::<f64>(name, &shape);
    }
}
