//! Order policy of a link: whether a packet may overtake another packet.

use crate::parameters::{Choices, Form, Key, usual, words};
use cohaptic_units::Instant;

/// Order policy of a link. The policy is applied last: the stage sees arrival instants and can only postpone an arrival.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Order {
    /// A packet with a shorter delay overtakes. The marginal law of the delay is the configured law.
    #[default]
    AllowReordering,
    /// No packet arrives before an earlier packet: Dₙ = max(aₙ + dₙ, Dₙ₋₁). Waiting packets arrive later than by the configured law.
    InOrder,
}

/// Stage with the policy and the latest arrival so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OrderStage {
    policy: Order,
    /// Latest arrival so far. Tracked even while reordering is allowed, so after a live change to `in-order` no packet overtakes the packets already on the
    /// way.
    latest: Instant,
}

impl OrderStage {
    pub(crate) const fn new(policy: Order) -> Self {
        Self { policy, latest: Instant::ZERO }
    }

    /// Makes a stage that allows reordering, after packets of which the latest arrives at `latest`.
    pub(crate) const fn resumed(latest: Instant) -> Self {
        Self { policy: Order::AllowReordering, latest }
    }

    pub(crate) const fn set_policy(&mut self, policy: Order) {
        self.policy = policy;
    }

    /// Returns the allowed arrival of a packet with the wanted arrival `wanted`.
    #[inline]
    pub(crate) fn arrival(&mut self, wanted: Instant) -> Instant {
        self.latest = self.latest.max(wanted);
        match self.policy {
            Order::AllowReordering => wanted,
            Order::InOrder => self.latest,
        }
    }
}

/// Parameter of the order of packets.
pub(crate) const KEYS: [Key; 1] =
    [usual("order", Form::Words(&ORDERS), "\"allow-reordering\"", "Whether a packet with a shorter delay overtakes those before it")];
const ORDERS: [(&str, &str); 2] = words(&Order::CHOICES);

impl Order {
    /// Names of the policies in files, each with its value and its description.
    pub const CHOICES: Choices<Self, 2> = [
        ("allow-reordering", Self::AllowReordering, "a packet with a shorter delay overtakes"),
        ("in-order", Self::InOrder, "a packet with a shorter delay waits for those before it"),
    ];
}
