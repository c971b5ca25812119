//! Which instruction set to run on: asked of the processor once, capped by SDFRS_ISA; the baker of meshes uses it too.

use std::sync::OnceLock;

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
    pub const ALL: [Isa; 4] = [Isa::Baseline, Isa::Sse41, Isa::Avx2, Isa::Avx512];

    /// The instruction sets that this processor can run.
    pub fn available() -> impl Iterator<Item = Isa> {
        Self::ALL.into_iter().filter(|isa| *isa <= best())
    }
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
#[inline]
pub fn isa() -> Isa {
    static ISA: OnceLock<Isa> = OnceLock::new();
    // Asked several times a step: a look at a word, and no call.
    *ISA.get_or_init(choose)
}

#[cold]
fn choose() -> Isa {
    let wanted = std::env::var("SDFRS_ISA").unwrap_or_default();
    let cap = Isa::ALL.into_iter().find(|i| i.name() == wanted).unwrap_or(Isa::Avx512);
    best().min(cap)
}

/// The best instruction set here; asked of the processor once.
#[inline]
pub fn best() -> Isa {
    static BEST: OnceLock<Isa> = OnceLock::new();
    *BEST.get_or_init(detect)
}

#[cfg(target_arch = "x86_64")]
fn detect() -> Isa {
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
fn detect() -> Isa {
    Isa::Baseline
}
