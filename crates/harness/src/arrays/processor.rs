//! Which instructions there are.

use pulp::{Arch, NullaryFnOnce};

/// Does something that is compiled once for any processor and once for one that has AVX2: with wider registers, and not one rounding less.
#[inline(always)]
pub(super) fn on_widest<O: NullaryFnOnce>(processor: Arch, what: O) -> O::Output {
    match processor {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        Arch::V3(wide) => wide.vectorize(what),
        _ => on_any(processor, what),
    }
}

/// Not where it is called from: there are many such places.
#[cold]
#[inline(never)]
fn on_any<O: NullaryFnOnce>(processor: Arch, what: O) -> O::Output {
    processor.dispatch(what)
}
