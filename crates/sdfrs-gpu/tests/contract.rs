//! Needs no GPU: every combination of shaders is valid, and both sides lay their structs out alike.
#![allow(clippy::unwrap_used, clippy::panic)]

#[path = "../../sdfrs-core/tests/common/mod.rs"]
mod shapes;

mod rays;

use std::mem::{offset_of, size_of};

use sdfrs_core::{
    Control, Field, Program, Shape,
    graph::{Form, Graph},
    grid::Stepping,
};
use sdfrs_gpu::{
    compiled,
    contract::{Light, Line, Params, Ray, Shaded, Tally, View},
    emit::{
        Emitted, emit, emit_patches, emit_voxels,
        patches::{LENGTHS, Raster},
    },
    tracer,
};
use sdfrs_trace::voxel;

fn parse(text: &str, name: &str) -> naga::Module {
    let module =
        naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
    let (flags, none) = (naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
    let checked = naga::valid::Validator::new(flags, none).validate(&module);
    let checked = checked.unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
    // What is valid may still be more than the back end can write.
    let options = naga::back::spv::Options::default();
    let written = naga::back::spv::write_vec(&module, &checked, &options, None);
    assert!(written.unwrap_or_else(|e| panic!("{name}: {e}")).len() > 100);
    module
}

fn scene(strict: bool) -> Emitted {
    let ball = shapes::build("sphere", &[("radius", shapes::num(1.0))], &[]);
    emit(&Graph::new(&ball, Form::Walk).unwrap(), strict).unwrap()
}

/// Offsets of a struct's members, and its size.
fn layout(module: &naga::Module, name: &str) -> (Vec<(String, u32)>, u32) {
    let (handle, kind) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap();
    let naga::TypeInner::Struct { members, .. } = &kind.inner else { panic!("{name} is no struct") };
    let members = members.iter().map(|m| (m.name.clone().unwrap(), m.offset)).collect();
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).unwrap();
    (members, layouter[handle].size)
}

macro_rules! same_layout {
    ($module:expr, $name:literal, $type:ty, [$($field:ident),+]) => {
        let (members, size) = layout($module, $name);
        let host = vec![$((stringify!($field).to_owned(), offset_of!($type, $field) as u32)),+];
        assert_eq!((members, size), (host, size_of::<$type>() as u32), $name);
    };
}

/// The same scene beside another, its programs shortened patch by patch, with and without leaps.
fn patched(strict: bool, skip: bool) -> Emitted {
    let ball = shapes::build("sphere", &[("radius", shapes::num(1.0))], &[]);
    let cube = shapes::build("box", &[("size", shapes::vec3(1.0, 1.0, 1.0))], &[]);
    let both =
        shapes::build("union", &[("k", shapes::num(0.1))], &[&ball, &shapes::moved(&cube, 2.0, 0.0, 0.0)]);
    let all: Vec<_> = (0..6).map(|i| shapes::moved(&both, f64::from(i), 0.0, 0.0)).collect();
    let all = shapes::build("union", &[("k", shapes::num(0.0))], &all.iter().collect::<Vec<_>>());
    let program = Program::<f32>::for_tracing(&all).unwrap();
    let frame = rays::camera(40, 30).frame().unwrap();
    let raster = Raster { frame, width: 40, height: 30, t_max: 30.0, eps: 1e-4, cone: 0.0, skip };
    let graph = Graph::new(&all, Form::Walk).unwrap();
    emit_patches(&graph, program.pruner().unwrap(), &raster, strict, &Control::new()).unwrap().unwrap()
}

/// All passes of all tracers over both kinds of rays, strict and plain, over whole and shortened programs.
#[test]
fn every_combination_is_valid() {
    for strict in [false, true] {
        let scenes = [scene(strict), patched(strict, false), patched(strict, true)];
        for (scene, source) in scenes.iter().flat_map(|s| [(s, "source/batch"), (s, "source/camera")]) {
            let patches = scene.patches.as_ref();
            for kind in rays::tracers() {
                let parts = tracer::parts_of(&kind);
                if patches.is_some_and(|patches| patches.skip) && !parts.can_leap() {
                    continue;
                }
                let modules = compiled::modules(&parts, source, patches);
                for entry in ["march_begin", "march_pass"] {
                    let text = scene.link(&compiled::texts(&modules), entry).unwrap();
                    let module = parse(&text, &format!("{kind:?} {source} {entry} strict {strict}"));
                    let storage = module
                        .global_variables
                        .iter()
                        .filter(|(_, v)| matches!(v.space, naga::AddressSpace::Storage { .. }));
                    assert!(storage.count() <= 8, "more than every adapter binds: {kind:?}");
                    let (members, size) = layout(&module, "Walker");
                    assert_eq!((members[0].1, u64::from(size)), (0, parts.walker_bytes), "{kind:?}");
                }
            }
            let modules = sdfrs_gpu::shade::modules(source, patches.is_some());
            let text = scene.link(&compiled::texts(&modules), "shade_pass").unwrap();
            parse(&text, &format!("shade {source} strict {strict}"));
        }
    }
}

fn texture() -> voxel::Placed {
    let grid = shapes::grid(9).with_stepping(Stepping::Voxel);
    voxel::placed(&Shape::texture(grid).unwrap()).unwrap()
}

#[test]
fn every_walk_through_voxels_is_valid() {
    for (strict, source) in [(false, "source/batch"), (false, "source/camera"), (true, "source/batch")] {
        let scene = emit_voxels(&texture(), strict).unwrap();
        let parts = tracer::voxels(strict);
        for entry in ["voxels_begin", "voxels_pass"] {
            let modules = compiled::voxel_modules(&parts, source);
            let text = scene.link(&compiled::texts(&modules), entry).unwrap();
            let module = parse(&text, &format!("{source} {entry} strict {strict}"));
            if entry == "voxels_pass" {
                assert_eq!(u64::from(layout(&module, "Walker").1), parts.walker_bytes);
            }
        }
    }
}

#[test]
fn both_sides_lay_their_structs_out_alike() {
    let scene = scene(true);
    let parts = tracer::parts_of(&rays::tracers()[0]);
    let text =
        scene.link(&compiled::texts(&compiled::modules(&parts, "source/batch", None)), "march_pass").unwrap();
    let module = parse(&text, "march");
    let (members, size) = layout(&module, "Params");
    assert_eq!(size, size_of::<Params>() as u32);
    let view = offset_of!(Params, view) as u32;
    let own = [
        ("zero", offset_of!(Params, zero)),
        ("rays", offset_of!(Params, rays)),
        ("base", offset_of!(Params, base)),
        ("first", offset_of!(Params, first)),
        ("count", offset_of!(Params, count)),
        ("half_read", offset_of!(Params, half_read)),
        ("steps", offset_of!(Params, steps)),
        ("max_steps", offset_of!(Params, max_steps)),
        ("guards", offset_of!(Params, guards)),
        ("max_level", offset_of!(Params, max_level)),
        ("depth", offset_of!(Params, depth)),
        ("blocks", offset_of!(Params, blocks)),
        ("eps", offset_of!(Params, eps)),
        ("cone", offset_of!(Params, cone)),
        ("factor", offset_of!(Params, factor)),
        ("t_max", offset_of!(Params, t_max)),
        ("origin", view as usize + offset_of!(View, origin)),
        ("scale", view as usize + offset_of!(View, scale)),
        ("forward", view as usize + offset_of!(View, forward)),
        ("scale_low", view as usize + offset_of!(View, scale_low)),
        ("right", view as usize + offset_of!(View, right)),
        ("width", view as usize + offset_of!(View, width)),
        ("up", view as usize + offset_of!(View, up)),
        ("height", view as usize + offset_of!(View, height)),
        ("origin_low", view as usize + offset_of!(View, origin_low)),
        ("perspective", view as usize + offset_of!(View, perspective)),
        ("forward_low", view as usize + offset_of!(View, forward_low)),
        ("unused", view as usize + offset_of!(View, unused)),
        ("right_low", view as usize + offset_of!(View, right_low)),
        ("unused_too", view as usize + offset_of!(View, unused_too)),
        ("up_low", view as usize + offset_of!(View, up_low)),
        ("unused_three", view as usize + offset_of!(View, unused_three)),
        ("albedo", offset_of!(Params, albedo)),
        ("background", offset_of!(Params, background)),
    ];
    let own: Vec<(String, u32)> = own.iter().map(|(n, o)| ((*n).to_owned(), *o as u32)).collect();
    assert_eq!(members, own);
    let patched = patched(true, true);
    let modules = compiled::modules(&parts, "source/batch", patched.patches.as_ref());
    let counted = parse(&patched.link(&compiled::texts(&modules), "march_pass").unwrap(), "patched");
    let (lists, _) = layout(&counted, "Lists");
    assert_eq!((lists[2].1, lists[3].1), (8, 8 + 4 * LENGTHS as u32));
    same_layout!(&module, "Ray", Ray, [origin, t_min, direction, t_max]);
    same_layout!(&module, "Tally", Tally, [steps, fallbacks, accepted, ratios, t, r, witness, outcome]);

    let voxels = emit_voxels(&texture(), true).unwrap();
    let modules = compiled::voxel_modules(&tracer::voxels(true), "source/batch");
    let text = voxels.link(&compiled::texts(&modules), "voxels_pass").unwrap();
    let voxels = parse(&text, "voxels");
    same_layout!(&voxels, "Line", Line, [o, t_min, d, t_max, speed, unused, unused_too, unused_three]);

    let text = scene
        .link(&compiled::texts(&sdfrs_gpu::shade::modules("source/camera", false)), "shade_pass")
        .unwrap();
    let module = parse(&text, "shade");
    same_layout!(&module, "Light", Light, [position, unused, color, unused_too]);
    let (members, size) = layout(&module, "Shaded");
    let offsets: Vec<u32> = members.iter().map(|m| m.1).collect();
    assert_eq!((offsets, size), (vec![0, 4, 8, 12], size_of::<Shaded>() as u32));
    assert_eq!((offset_of!(Shaded, normal), offset_of!(Shaded, rgb)), (0, 12));
}
