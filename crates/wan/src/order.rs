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
pub(crate) struct OrderStage {
    latest: Instant,
}

impl OrderStage {
    /// The arrival that the policy allows for one that is wanted. The latest arrival is known even while reordering is allowed, so that a live
    /// change to `in-order` holds for the packets already on the way.
    #[inline]
    pub(crate) fn arrival(&mut self, order: Order, wanted: Instant) -> Instant {
        self.latest = self.latest.max(wanted);
        match order {
            Order::AllowReordering => wanted,
            Order::InOrder => self.latest,
        }
    }
}
