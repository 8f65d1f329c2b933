//! Whether a packet may overtake another.

use crate::parameters::{Choices, Form, Key, usual, words};
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

/// The stage: the policy and the latest arrival so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OrderStage {
    policy: Order,
    /// Known even while reordering is allowed, so that a live change to `in-order` holds for the packets already on the way.
    latest: Instant,
}

impl OrderStage {
    pub(crate) const fn new(policy: Order) -> Self {
        Self { policy, latest: Instant::ZERO }
    }

    pub(crate) const fn set_policy(&mut self, policy: Order) {
        self.policy = policy;
    }

    /// The arrival that the policy allows for one that is wanted.
    #[inline]
    pub(crate) fn arrival(&mut self, wanted: Instant) -> Instant {
        self.latest = self.latest.max(wanted);
        match self.policy {
            Order::AllowReordering => wanted,
            Order::InOrder => self.latest,
        }
    }
}

/// The parameter of the order of packets.
pub(crate) const KEYS: [Key; 1] =
    [usual("order", Form::Words(&ORDERS), "\"allow-reordering\"", "Whether a packet with a shorter delay overtakes those before it")];
const ORDERS: [(&str, &str); 2] = words(&Order::CHOICES);

impl Order {
    /// The words of files.
    pub const CHOICES: Choices<Self, 2> = [
        ("allow-reordering", Self::AllowReordering, "a packet with a shorter delay overtakes"),
        ("in-order", Self::InOrder, "a packet with a shorter delay waits for those before it"),
    ];
}
