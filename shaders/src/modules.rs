//! The texts, by the names of their files.

/// A file of WGSL.
#[derive(Debug, Clone, Copy)]
pub struct Module {
    pub name: &'static str,
    pub text: &'static str,
}

macro_rules! modules {
    ($($const:ident $name:literal)*) => {
        $(pub const $const: Module = Module { name: $name, text: include_str!(concat!("../", $name, ".wgsl")) };)*
        /// Every module.
        pub const ALL: &[Module] = &[$($const),*];
    };
}

modules! {
    CONTRACT "contract"
    MEMORY "ops/memory"
    PLAIN "ops/plain"
    STRICT "ops/strict"
    MATH "ops/math"
    SCALAR "ops/scalar"
    FUSED "ops/fused"
    SOLID "ops/solid"
    TABLE "ops/table"
    TEXTURE "ops/texture"
    GRADIENT_SCALAR "ops/gradient_scalar"
    GRADIENT_SOLID "ops/gradient_solid"
    GRADIENT_TABLE "ops/gradient_table"
    EVALUATE "pass/evaluate"
    FIELD_COUNTED "field/counted"
    FIELD_PATCHES "field/patches"
    FIELD_WHOLE "field/whole"
    SOURCE_PAIR "source/pair"
    NUMBER "number"
    PASS_LISTS "pass/lists"
    PASS_MARCH "pass/march"
    PASS_VOXELS "pass/voxels"
    PASS_SHADE "pass/shade"
    SHADE_DIRECT "shade/direct"
    SHADE_NORMAL "shade/normal"
    SOURCE_BATCH "source/batch"
    SOURCE_CAMERA "source/camera"
    TRACER_AUTO_RELAXED "tracer/auto_relaxed"
    TRACER_BASIC "tracer/basic"
    TRACER_BINARY_HALVES "tracer/binary_halves"
    TRACER_BINARY_SPLIT "tracer/binary_split"
    TRACER_BINARY_STACK "tracer/binary_stack"
    TRACER_BINARY_STACKLESS "tracer/binary_stackless"
    TRACER_COVERAGE_SEARCH "tracer/coverage_search"
    TRACER_COVERAGE_SPANS "tracer/coverage_spans"
    TRACER_CROSSING "tracer/crossing"
    TRACER_ENHANCED "tracer/enhanced"
    TRACER_GUARDED "tracer/guarded"
    TRACER_LEAP "tracer/leap"
    TRACER_LETTER_AUTO_RELAXED "tracer/letter/auto_relaxed"
    TRACER_LETTER_BASIC "tracer/letter/basic"
    TRACER_LETTER_BINARY_SPLIT "tracer/letter/binary_split"
    TRACER_LETTER_ENHANCED "tracer/letter/enhanced"
    TRACER_LETTER_ENHANCED_2018 "tracer/letter/enhanced_2018"
    TRACER_LETTER_LISTING "tracer/letter/listing"
    TRACER_LETTER_RELAXED "tracer/letter/relaxed"
    TRACER_LETTER_RELAXED_2018 "tracer/letter/relaxed_2018"
    TRACER_LETTER_RETRY "tracer/letter/retry"
    TRACER_NO_LEAP "tracer/no_leap"
    TRACER_NO_STACK "tracer/no_stack"
    TRACER_RELAXED "tracer/relaxed"
    TRACER_SEARCH "tracer/search"
    TRACER_STACK "tracer/stack"
    TRACER_TALLY "tracer/tally"
    TRACER_WALK "tracer/walk"
    TRACER_WIDE "tracer/wide"
    VOXEL_LINES "voxel/lines"
    VOXEL_PLACED "voxel/placed"
    VOXEL_ROOT "voxel/root"
    VOXEL_WALK "voxel/walk"
}

/// What every scene calls: its memory, the ops and their gradients. The uniform `u` with a member `zero`
/// is the pass's to declare.
pub fn ops(strict: bool) -> Vec<&'static str> {
    let keep = if strict { STRICT } else { PLAIN };
    let values = [MEMORY, keep, MATH, SCALAR, FUSED, SOLID, TABLE, TEXTURE];
    let gradients = [GRADIENT_SCALAR, GRADIENT_SOLID, GRADIENT_TABLE];
    values.iter().chain(&gradients).map(|module| module.text).collect()
}
