//! Choice of the processor's instructions.
//!
//! Only code that is inlined into the call of [`on_widest`] is compiled for the wide instructions: a function that stays a call has the instructions of any
//! processor. Most functions that the loops over ticks and packets reach are therefore `#[inline(always)]`, in the arrays and in `cohaptic_peer`. Rare branches
//! are `#[inline(never)]` or `#[cold]`, so that the loops stay short. `benches/benches/mesh.rs` measures the loops.

use pulp::{Arch, NullaryFnOnce};

/// Calls a function that is compiled twice, for any processor and for processors with AVX2. Both versions round every operation in the same way.
#[inline(always)]
pub(super) fn on_widest<O: NullaryFnOnce>(processor: Arch, what: O) -> O::Output {
    match processor {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        Arch::V3(wide) => wide.vectorize(what),
        _ => on_any(processor, what),
    }
}

/// Calls a function compiled for any processor. Not inlined, because `on_widest` is inlined into many callers.
#[cold]
fn on_any<O: NullaryFnOnce>(processor: Arch, what: O) -> O::Output {
    processor.dispatch(what)
}
