//! The watch over a computation, and the limits of its cost.

use crate::AnalysisError;
use crate::cost::{MOST_MEMORY, Memory, PartCost};

/// Sees how far a computation is, and may end it.
pub trait Watch: Sync {
    /// The most memory that the matrices of a part of a scene may take \[bytes\]; what takes more is refused before it is begun.
    fn most_memory(&self) -> u64 {
        MOST_MEMORY
    }

    /// A part of that cost is about to be begun.
    fn begins(&self, _cost: &PartCost) {}

    /// Operations that are still to be done, by an estimate that is good to a factor of about three; called before they are begun.
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
    /// More numbers of the second moment than this are refused: of many joint states, 2^17 take seconds and 2^20 minutes.
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

impl PartCost {
    /// Tells the watch of the cost before anything of that size is made.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::TooMuchMemory`] beyond what the watch allows; [`AnalysisError::Stopped`] if it ends the analysis.
    pub(crate) fn begin(self, watch: &dyn Watch) -> Result<(), AnalysisError> {
        self.allowed(watch)?;
        watch.begins(&self);
        watch.expects(self.operations);
        if watch.stops() { Err(AnalysisError::Stopped) } else { Ok(()) }
    }

    /// [`PartCost::begin`] without telling the watch.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::TooMuchMemory`] beyond what the watch allows.
    pub(crate) fn allowed(self, watch: &dyn Watch) -> Result<(), AnalysisError> {
        let Self { states, bytes, .. } = self;
        let most = watch.most_memory();
        if bytes <= Memory::of(most).0 { Ok(()) } else { Err(AnalysisError::TooMuchMemory { states, bytes, most }) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 8192 states are 2^26 entries, of 8 bytes, in 16 matrices: 8 GiB.
    #[test]
    fn the_memory_of_a_part_is_refused_beyond_the_limit_before_it_is_taken() {
        assert_eq!(PartCost::of_eigenvalues(8192).begin(&Unwatched), Ok(()));
        let refused = PartCost::of_eigenvalues(8193).begin(&Unwatched).unwrap_err();
        assert!(matches!(refused, AnalysisError::TooMuchMemory { states: 8193, most: MOST_MEMORY, .. }), "{refused}");
        assert!(refused.to_string().contains("8193 states") && refused.to_string().contains("8.0 GiB"), "{refused}");
    }
}
