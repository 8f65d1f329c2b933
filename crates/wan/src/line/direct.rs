//! The stages with immediate decisions and without copies: outage, loss, delay with jitter, and order.
//!
//! A link without further stages is a function from a packet to its arrival.

use alloc::boxed::Box;

use cohaptic_units::Instant;

use crate::fates::fate::DropCause;
use crate::line::name::LinkName;
use crate::random::{Purpose, Stream};
use crate::stages::config::LinkConfig;
use crate::stages::delay::DelayStage;
use crate::stages::loss::LossStage;
use crate::stages::order::OrderStage;
use crate::stages::outage::OutageStage;

/// First random words of a packet: the word for loss, then the word for jitter.
pub(crate) type Words = [u64; 2];

#[derive(Clone, Debug)]
pub(crate) struct Direct {
    /// Random numbers of the link, addressed by packet number.
    pub(crate) draws: Stream,
    is_random: bool,
    /// Boxed, because few links have outages and a large mesh has many links.
    outages: Option<Box<OutageStage>>,
    pub(crate) loss: Option<LossStage>,
    pub(crate) delay: DelayStage,
    pub(crate) order: OrderStage,
}

impl Direct {
    pub(crate) fn new(seed: u64, name: &LinkName, config: &LinkConfig) -> Self {
        let draws = Stream::new(seed, name.as_str().as_bytes());
        Self {
            draws,
            is_random: config.is_random(),
            outages: OutageStage::new(config.outages.clone(), draws).map(Box::new),
            loss: LossStage::new(config.loss.clone(), draws.packet(0).first(Purpose::InitialState)),
            delay: DelayStage::new(&config.delay),
            order: OrderStage::new(config.order),
        }
    }

    /// Returns the first random words of packet number `number` for [`Direct::offer`], or zeros without random draws.
    #[inline]
    pub(crate) fn words(&self, number: u64) -> Words {
        if self.is_random { self.draws.packet(number).loss_and_jitter() } else { [0; 2] }
    }

    /// Returns the arrival of a packet, or the cause of its drop.
    #[inline(always)]
    pub(crate) fn offer(&mut self, now: Instant, number: u64, words: Words) -> Result<Instant, DropCause> {
        self.offer_through(now, number, words, Ok)
    }

    /// Returns the arrival of a packet, or the cause of its drop. `queue` stands between loss and delay: `queue` takes the instant of the packet's entry, and
    /// returns the instant of its departure or the cause of its drop.
    #[inline(always)]
    pub(crate) fn offer_through(
        &mut self,
        now: Instant,
        number: u64,
        words: Words,
        queue: impl FnOnce(Instant) -> Result<Instant, DropCause>,
    ) -> Result<Instant, DropCause> {
        match self.dropped(now, number, words) {
            Some(cause) => Err(cause),
            None => Ok(self.arrival(queue(now)?, number, words)),
        }
    }

    /// Returns the cause of a packet's drop before the queue, or `None` if the packet reaches the queue.
    #[inline(always)]
    pub(crate) fn dropped(&mut self, now: Instant, number: u64, [word, _]: Words) -> Option<DropCause> {
        if self.is_down(now) {
            return Some(DropCause::Outage);
        }
        // Outage comes before loss, and a packet in an outage leaves the chain of losses unchanged.
        let draws = self.draws;
        let is_lost = self.loss.as_mut().is_some_and(|loss| loss.loses(now, number, word, || draws.packet(number)));
        is_lost.then_some(DropCause::Loss)
    }

    /// Returns the arrival of a packet with the departure `leaves` from the queue.
    #[inline(always)]
    pub(crate) fn arrival(&mut self, leaves: Instant, number: u64, [_, word]: Words) -> Instant {
        // Order comes last: a packet may wait for an earlier packet with a longer delay.
        let draws = self.draws;
        let delay = self.delay.draw_nanos(leaves, word, || draws.packet(number));
        self.order.arrival(leaves.saturating_add_nanos(delay))
    }

    pub(crate) const fn has_outages(&self) -> bool {
        self.outages.is_some()
    }

    /// Returns whether the link is down for a packet offered at `now`.
    #[inline]
    pub(crate) fn is_down(&mut self, now: Instant) -> bool {
        self.outages.as_mut().is_some_and(|outages| outages.is_down(now, self.draws))
    }

    /// Changes the configuration. The stages keep their state.
    pub(crate) fn reconfigure(&mut self, now: Instant, config: &LinkConfig) {
        self.is_random = config.is_random();
        self.outages = OutageStage::reconfigured(self.outages.take().map(|stage| *stage), now, config.outages.clone(), self.draws).map(Box::new);
        // A loss without earlier state begins in the state of a link with this loss from the start.
        let initial = self.draws.packet(0).first(Purpose::InitialState);
        self.loss = LossStage::reconfigured(self.loss.take(), config.loss.clone(), initial);
        self.delay.reconfigure(&config.delay);
        self.order.set_policy(config.order);
    }
}
