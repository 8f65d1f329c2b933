//! What a link does to its packets.

use crate::{Bottleneck, Delay, Loss, Order, Outages};

/// The configuration of one directed link: which impairments it has, each checked when it was made.
///
/// The default is the ideal link: no loss, no queue, no delay. Packets pass the stages in the order of the fields.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct LinkConfig {
    /// When the link is down. A packet offered meanwhile is dropped; what is already on the way arrives.
    pub outages: Outages,
    /// Which packets are lost. Loss stands before the queue: a lost packet uses no bandwidth.
    pub loss: Loss,
    /// The rate at which packets are serialised, and the queue before it; `None`: unlimited, nothing waits.
    pub bottleneck: Option<Bottleneck>,
    /// The propagation delay and its jitter.
    pub delay: Delay,
    /// Whether a packet may overtake another.
    pub order: Order,
}

impl LinkConfig {
    /// Whether this link draws random numbers.
    #[must_use]
    pub fn is_random(&self) -> bool {
        !matches!(self.loss, Loss::None) || self.delay.jitter().is_some()
    }

    /// Whether all that this link does is to delay every packet by the same span.
    #[must_use]
    pub fn is_constant_delay(&self) -> bool {
        // The order policy counts: a live change to a shorter delay lets later packets overtake.
        self.order == Order::AllowReordering
            && self.outages.is_empty()
            && matches!(self.loss, Loss::None)
            && self.bottleneck.is_none()
            && self.delay.jitter().is_none()
    }
}
