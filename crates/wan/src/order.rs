//! Whether a packet may overtake another.

use cohaptic_units::Instant;

/// The order policy of a link. It is the last stage: it sees arrival instants and may only put them off.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Order {
    /// A packet with a shorter delay overtakes. The marginal law of the delay is the configured one.
    #[default]
    AllowReordering,
    /// No packet arrives before one that was sent before it: Dₙ = max(aₙ + dₙ, Dₙ₋₁). Packets that must wait arrive later than the configured law says.
    InOrder,
}

/// The stage: the latest arrival so far.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct InOrderStage {
    latest: Instant,
}

impl InOrderStage {
    /// Puts an arrival off until no earlier packet is overtaken.
    pub(crate) fn arrival(&mut self, wanted: Instant) -> Instant {
        self.latest = self.latest.max(wanted);
        self.latest
    }
}
