//! Any loop over packs, compiled for each instruction set and picked at run time, as the evaluator's own are.

use crate::isa::{Isa, isa};

/// A loop over packs. `run` and all it calls must be `#[inline(always)]`: a function of its own would be
/// compiled for the platform's baseline.
pub trait Kernel {
    fn run(self);
}

macro_rules! versions {
    ($($(#[$on:meta])? $name:ident $features:literal)*) => {$(
        $(#[$on])?
        #[cfg_attr(target_arch = "x86_64", target_feature(enable = $features))]
        fn $name<K: Kernel>(kernel: K) {
            kernel.run();
        }
    )*};
}
versions! {
    #[cfg(target_arch = "x86_64")] avx512 "avx512f,avx512vl,avx512dq,avx512bw"
    #[cfg(target_arch = "x86_64")] avx2 "avx2"
    #[cfg(target_arch = "x86_64")] sse41 "sse4.1"
}

/// Runs a kernel on the best instruction set here. No fused multiply-add in any: the bits don't depend on it.
#[inline]
#[allow(unsafe_code)]
pub fn vectorise<K: Kernel>(kernel: K) {
    // SAFETY: `isa` names only what this processor has.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        match isa() {
            Isa::Avx512 => return avx512(kernel),
            Isa::Avx2 => return avx2(kernel),
            Isa::Sse41 => return sse41(kernel),
            Isa::Baseline => {}
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _: Isa = isa();
    kernel.run();
}
