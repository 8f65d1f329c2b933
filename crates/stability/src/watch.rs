//! The watch over a computation, and the limits of its cost.

use crate::cost::{MOST_MEMORY, PartCost};

/// Sees how far a computation is, and may end it.
pub trait Watch: Sync {
    /// The most memory that the matrices of a part of a scene may take \[bytes\]; what takes more is refused before it is begun.
    fn most_memory(&self) -> u64 {
        MOST_MEMORY
    }

    /// A part of that cost is about to be begun.
    fn begins(&self, _cost: &PartCost) {}

    /// Operations that are still to be done, by the estimate (see [`FrameCost`](crate::FrameCost)); called before they are begun.
    fn expects(&self, _operations: f64) {}

    /// The operations that are done.
    fn done(&self, _operations: f64) {}

    /// Whether the computation is to be given up; asked every few milliseconds where the computation is a loop.
    fn stops(&self) -> bool {
        false
    }
}

/// Nobody watches.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Unwatched;

impl Watch for Unwatched {}

/// The limits of an analysis, and the watch over it.
#[derive(Clone, Copy)]
pub struct Limits<'a> {
    /// More numbers of the second moment than this are refused ([`crate::mean_square_within`]).
    pub unknowns: usize,
    /// A second moment that takes more operations than this, by the estimate, is refused.
    pub operations: f64,
    /// Sees the progress, and may end it.
    pub watch: &'a dyn Watch,
}

impl Limits<'static> {
    /// Whatever it takes, but for the unknowns; nobody watches.
    #[must_use]
    pub const fn of_unknowns(unknowns: usize) -> Self {
        Self { unknowns, operations: f64::INFINITY, watch: &Unwatched }
    }
}

impl std::fmt::Debug for Limits<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { unknowns, operations, .. } = self;
        formatter.debug_struct("Limits").field("unknowns", unknowns).field("operations", operations).finish_non_exhaustive()
    }
}

/// A watch that does nothing but ask.
pub(crate) struct Asks<F>(pub(crate) F);

impl<F: Fn() -> bool + Sync> Watch for Asks<F> {
    fn stops(&self) -> bool {
        (self.0)()
    }
}
