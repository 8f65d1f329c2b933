//! The time of a run for libraries that want `std::time::Instant`.

use std::time::Instant as StdInstant;

use cohaptic_units::Instant;

/// The time of a run for libraries that want [`std::time::Instant`]: the instant that stands for the run's beginning. Which one it is does not matter, as long as
/// all nodes take the same.
///
/// ```
/// use cohaptic_testkit::{Instant, node::Epoch};
///
/// let epoch = Epoch(std::time::Instant::now());
/// let deadline = epoch.to_std(Instant::from_nanos(1_500_000_000));
/// assert_eq!(epoch.from_std(deadline), Instant::from_nanos(1_500_000_000));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Epoch(pub StdInstant);

impl Epoch {
    /// The instant in the clock of the system.
    ///
    /// # Panics
    ///
    /// If the system's clock does not reach so far.
    #[must_use]
    pub fn to_std(self, at: Instant) -> StdInstant {
        self.0 + at.saturating_duration_since(Instant::ZERO)
    }

    /// The instant in the time of the run; its beginning if it was before.
    #[must_use]
    #[expect(clippy::wrong_self_convention, reason = "the other direction of `to_std`")]
    pub fn from_std(self, at: StdInstant) -> Instant {
        Instant::ZERO.saturating_add(at.saturating_duration_since(self.0))
    }
}
