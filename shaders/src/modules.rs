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
}

/// What every scene calls: its memory, the ops and their gradients. The uniform `u` with a member `zero`
/// is the pass's to declare.
pub fn ops(strict: bool) -> Vec<&'static str> {
    let keep = if strict { STRICT } else { PLAIN };
    let values = [MEMORY, keep, MATH, SCALAR, FUSED, SOLID, TABLE, TEXTURE];
    let gradients = [GRADIENT_SCALAR, GRADIENT_SOLID, GRADIENT_TABLE];
    values.iter().chain(&gradients).map(|module| module.text).collect()
}
