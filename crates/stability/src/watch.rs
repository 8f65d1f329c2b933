//! The watch over a computation, and the limits of its cost.

use crate::AnalysisError;
use crate::cost::{MOST_MEMORY, Memory, PartCost};

/// Observer of a computation, which learns its progress and can stop it.
pub trait Watch: Sync {
    /// Returns the largest memory that the matrices of a part of a scene may take \[bytes\]. A part that takes more is refused before its analysis begins.
    fn most_memory(&self) -> u64 {
        MOST_MEMORY
    }

    /// Called before the analysis of a part of the given cost begins.
    fn begins(&self, _cost: &PartCost) {}

    /// Called before work begins, with the estimated number of its operations. The estimate is good to a factor of about three.
    fn expects(&self, _operations: f64) {}

    /// Called after work, with the number of operations of that work.
    fn done(&self, _operations: f64) {}

    /// Tells whether the computation must stop. Asked every few milliseconds where the computation is a loop.
    fn stops(&self) -> bool {
        false
    }
}

/// A watch that ignores the progress and never stops a computation.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Unwatched;

impl Watch for Unwatched {}

/// The limits of an analysis, and the watch over it.
#[derive(Clone, Copy)]
pub struct Limits<'a> {
    /// Largest number of unknowns of a second moment. With many joint states, 2^17 unknowns take seconds and 2^20 take minutes.
    pub unknowns: usize,
    /// Largest estimated number of operations of a second moment; a second moment with more is refused.
    pub operations: f64,
    /// Observer of the progress, which can stop the analysis.
    pub watch: &'a dyn Watch,
}

impl Limits<'static> {
    /// Returns limits on the number of unknowns only, without a watch.
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

/// A watch that asks a closure whether to stop, and ignores the progress.
pub(crate) struct Asks<F>(pub(crate) F);

impl<F: Fn() -> bool + Sync> Watch for Asks<F> {
    fn stops(&self) -> bool {
        (self.0)()
    }
}

impl PartCost {
    /// Tells the watch the cost before memory of that size is allocated.
    ///
    /// # Errors
    ///
    /// [`AnalysisError::TooMuchMemory`] beyond what the watch allows; [`AnalysisError::Stopped`] if the watch stops the analysis.
    pub(crate) fn begin(self, watch: &dyn Watch) -> Result<(), AnalysisError> {
        self.allowed(watch)?;
        watch.begins(&self);
        watch.expects(self.operations);
        if watch.stops() { Err(AnalysisError::Stopped) } else { Ok(()) }
    }

    /// Checks the memory against the watch's limit like [`PartCost::begin`], without telling the watch the cost.
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
