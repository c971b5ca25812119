#![allow(clippy::unwrap_used)]
use std::array;

use super::*;
use crate::{
    Tracer,
    camera::{Camera, Kind},
    march::{order::Order, swarm::Swarm},
    render::CameraRays,
    tracer::basic::Basic,
};
use sdfrs_core::{Control, Program, Shape, Value};

const T_MAX: f64 = 9.0;

/// An eye's rays, wide and narrow ones, and parallel ones; sides that are no multiples of a patch's.
fn cameras<T: Native>() -> Vec<CameraRays<T>> {
    let kinds = [
        Kind::Pinhole { fov_deg: 3.0 },
        Kind::Pinhole { fov_deg: 50.0 },
        Kind::Pinhole { fov_deg: 150.0 },
        Kind::Orthographic { extent: 3.0 },
    ];
    let camera = |kind| {
        let (origin, target, up) = ([1.0, 2.0, 3.0], [0.1, 0.2, -0.3], [0.0, 1.0, 0.0]);
        let camera = Camera { kind, origin, target, up, width: 39, height: 30 };
        CameraRays::new(&camera, &Tracer::Basic { guards: true }, T_MAX).unwrap()
    };
    kinds.map(camera).into()
}

/// Calls `take` for the patches of a picture's groups.
fn groups<T: Native>(rays: &CameraRays<T>, mut take: impl FnMut(&mut Patches<T>)) {
    let order = Order::in_blocks(rays, [64, 16], &Control::new());
    let mut patches = Patches::new();
    order.block(0).unwrap().squares(16, |group| {
        patches.begin(rays, group);
        take(&mut patches);
    });
}

/// The points of a patch's rays at a depth.
fn points<T: Native>(rays: &CameraRays<T>, patch: Rectangle, t: f64) -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    patch.few(|pixels| {
        for wanted in pixels {
            let ray = rays.ray(wanted.pixel.y() as usize * rays.width().unwrap() + wanted.pixel.x() as usize);
            points.push(array::from_fn(|a| (ray.origin[a] + T::of(t) * ray.direction[a]).f64()));
        }
    });
    points
}

fn cones_hold_their_rays<T: Native>() {
    let mut seen = 0;
    for rays in cameras::<T>() {
        groups(&rays, |patches| {
            for (i, patch) in patches.of.iter().enumerate() {
                let (cones, lane) = (&patches.cones[i / Patches::<T>::WIDTH], i % Patches::<T>::WIDTH);
                let at = |v: &T::Lanes| v.lane(lane).f64();
                let v = cones.direction.each_ref().map(at);
                let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
                for t in [0.0, 0.3, 4.0, T_MAX] {
                    let across = at(&cones.off.apart) + t * at(&cones.off.spread);
                    let along = at(&cones.off.along) + t * at(&cones.off.bulge);
                    // Points are rounded, too.
                    let noise = 8.0 * T::EPS.f64() * (4.0 + t);
                    for p in points(&rays, *patch, t) {
                        let off: [f64; 3] = array::from_fn(|a| p[a] - at(&cones.origin[a]) - t * v[a]);
                        let size = off.iter().map(|v| v * v).sum::<f64>().sqrt();
                        let far = (0..3).map(|a| off[a] * v[a]).sum::<f64>() / length;
                        assert!(size <= across + noise, "patch {i} at {t}: {size} over {across}");
                        assert!(far.abs() <= along + noise, "patch {i} at {t}: {far} over {along}");
                        seen += 1;
                    }
                }
            }
        });
    }
    assert_eq!(seen, 4 * 4 * 39 * 30);
}

#[test]
fn all_rays_of_a_patch_are_in_its_cone() {
    cones_hold_their_rays::<f32>();
    cones_hold_their_rays::<f64>();
}

/// Before the depth at which a patch's rays are made, none of them meets anything.
fn nothing_is_left_out<T: Native>() {
    let ball = |x: f64| {
        let ball = Shape::build("sphere", vec![("radius".into(), Value::Num(0.3))], vec![]).unwrap();
        let to = vec![("offset".into(), Value::Vec3([x, 0.1, 0.4 * x]))];
        Shape::build("translate", to, vec![ball]).unwrap()
    };
    let balls = (0..4).map(|i| ball(f64::from(i) * 0.9 - 1.0)).collect();
    let shape = Shape::build("union", vec![("k".into(), Value::Num(0.1))], balls).unwrap();
    let program = Program::<T>::for_tracing(&shape).unwrap();
    let mut scratch = Scratch::new();
    let clearance = Clearance { above: 1e-3, slope: 1.0 };
    let stretch = Stretch { from: 0.0, to: 20.0, program: &program, clearance, near: false };
    let (mut passed, mut stopped) = (0, 0);
    for rays in cameras::<T>() {
        groups(&rays, |patches| {
            let mut ends = Vec::new();
            while patches.under_way() {
                patches.step(&stretch, &mut scratch, |patch, end| ends.push((patch, end)));
            }
            assert_eq!(ends.len(), patches.of.len());
            for (patch, end) in ends {
                let to = match end {
                    Patch::Passed => T_MAX,
                    Patch::Rays(t) => t.f64(),
                };
                *if to == T_MAX { &mut passed } else { &mut stopped } += 1;
                for p in (0..=40).flat_map(|i| points(&rays, patch, to * f64::from(i) / 40.0)) {
                    let mut r = [T::of(0.0)];
                    let columns = p.map(|v| [T::of(v)]);
                    program.eval(&mut scratch, columns.each_ref().map(|v| v.as_slice()), &mut r);
                    assert!(r[0].f64() > 0.99e-3, "{:?} before {to}", r[0]);
                }
            }
        });
    }
    assert!(passed > 100 && stopped > 50, "{passed} passed, {stopped} stopped");
}

#[test]
fn patches_stop_before_anything_is_met() {
    nothing_is_left_out::<f32>();
    nothing_is_left_out::<f64>();
}

#[test]
fn rays_of_a_patch_begin_where_it_stopped() {
    let rays = &cameras::<f32>()[1];
    let mut swarm = Swarm::default();
    let (mut count, mut depths) = (0, Vec::new());
    groups(rays, |patches| {
        for patch in &patches.of {
            let t = 0.5 + 0.01 * depths.len() as f32;
            patch.few(|pixels| swarm.add::<Basic>(rays, pixels, t));
            patch.few(|pixels| count += pixels.len());
            depths.push(t);
        }
    });
    assert_eq!((swarm.alive(), swarm.packs().len()), (39 * 30, depths.len()));
    assert_eq!((count, swarm.nearest()), (39 * 30, 0.5));
    let mut under_way = 0;
    for (pack, t) in swarm.packs().iter().zip(depths) {
        for lane in (0..16).filter(|lane| pack.rays.t.lane(*lane) < f32::INFINITY) {
            assert_eq!((pack.rays.t.lane(lane), pack.state.t.lane(lane), pack.steps[lane]), (t, t, 0));
            under_way += 1;
        }
    }
    assert_eq!(under_way, 39 * 30);
}
