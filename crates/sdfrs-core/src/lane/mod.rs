//! Numbers wider than a scalar: packs of lanes, intervals, dual numbers.
//!
//! All of them give, lane by lane, the bits of the scalar (packs, values of duals).

/// Sets each of a pack's or a mask's `W` lanes; written out, because a closure that isn't inlined would cost a
/// factor of 30.
macro_rules! lanes {
    ($i:ident in $r:ident: $value:expr) => {{
        for $i in 0..W {
            $r.0[$i] = $value;
        }
        $r
    }};
}

mod array;
mod dual;
mod interval;
mod mask;
mod neighbours;
pub(crate) mod root;
#[cfg(target_arch = "x86_64")]
mod wide;

pub use array::Pack;
pub use dual::Dual;
pub use interval::Iv;
pub use mask::{Mask, Truth};
pub(crate) use neighbours::{neighbours, pairs, pairs_f32};
#[cfg(target_arch = "x86_64")]
pub use wide::Wide;

/// Nothing, but LLVM cannot know: it would turn a loop over packs into gathers across packs, 20 times slower.
#[inline(always)]
#[allow(unsafe_code)]
pub fn opaque() {
    // SAFETY: no instruction at all.
    unsafe { std::arch::asm!("", options(nomem, nostack, preserves_flags)) };
}
