//! The instruction loop, compiled once for each instruction set.

use std::sync::OnceLock;

use crate::{
    op::{Tables, execute},
    real::Real,
    tape::Tape,
};

/// Instruction sets with a loop of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Isa {
    /// What every processor of the platform has.
    Baseline,
    Sse41,
    Avx2,
    Avx512,
}

impl Isa {
    pub fn name(self) -> &'static str {
        match self {
            Isa::Baseline => "baseline",
            Isa::Sse41 => "sse4.1",
            Isa::Avx2 => "avx2",
            Isa::Avx512 => "avx512",
        }
    }
}

/// The best instruction set here, or the one that SDFRS_ISA names if the processor has it.
pub fn isa() -> Isa {
    static ISA: OnceLock<Isa> = OnceLock::new();
    *ISA.get_or_init(|| {
        let wanted = std::env::var("SDFRS_ISA").unwrap_or_default();
        let all = [Isa::Baseline, Isa::Sse41, Isa::Avx2, Isa::Avx512];
        let cap = all.into_iter().find(|i| i.name() == wanted).unwrap_or(Isa::Avx512);
        best().min(cap)
    })
}

#[cfg(target_arch = "x86_64")]
fn best() -> Isa {
    use std::arch::is_x86_feature_detected as has;
    if has!("avx512f") && has!("avx512vl") && has!("avx512dq") && has!("avx512bw") {
        Isa::Avx512
    } else if has!("avx2") {
        Isa::Avx2
    } else if has!("sse4.1") {
        Isa::Sse41
    } else {
        Isa::Baseline
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn best() -> Isa {
    Isa::Baseline
}

#[inline(always)]
#[allow(unsafe_code)]
unsafe fn all<R: Real>(tape: &Tape<R::S>, slots: &mut [R], width: usize) {
    let t: Tables<R::S> = tape.tables();
    for ins in tape.instructions() {
        // SAFETY: the tape is checked, and the caller has `width` values for each of its slots.
        unsafe { execute::<R>(ins, slots.as_mut_ptr(), width, &t) };
    }
}

/// A module for each, so that they compile side by side.
macro_rules! versions {
    ($($name:ident $features:literal),*) => {$(
        #[cfg(target_arch = "x86_64")]
        mod $name {
            use super::{Real, Tape};

            #[target_feature(enable = $features)]
            #[allow(unsafe_code)]
            pub unsafe fn run<R: Real>(tape: &Tape<R::S>, slots: &mut [R], width: usize) {
                // SAFETY: passed on.
                unsafe { super::all::<R>(tape, slots, width) }
            }
        }
    )*};
}
versions!(avx512 "avx512f,avx512vl,avx512dq,avx512bw", avx2 "avx2", sse41 "sse4.1");

/// Runs the tape over `width` values a slot.
#[allow(unsafe_code)]
pub fn run<R: Real>(tape: &Tape<R::S>, slots: &mut [R], width: usize) {
    assert!(slots.len() >= tape.slots() * width);
    // SAFETY: the memory was just measured; the processor has the features that `isa` names.
    unsafe {
        match isa() {
            #[cfg(target_arch = "x86_64")]
            Isa::Avx512 => avx512::run::<R>(tape, slots, width),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 => avx2::run::<R>(tape, slots, width),
            #[cfg(target_arch = "x86_64")]
            Isa::Sse41 => sse41::run::<R>(tape, slots, width),
            _ => all::<R>(tape, slots, width),
        }
    }
}
