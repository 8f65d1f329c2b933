//! One link without what is on the way: the chain of stages that decides what becomes of a packet.
//!
//! ```text
//! offer ──► outage ──► loss ──► bottleneck ──► delay + jitter ──► order ──► arrival instant
//!             │          │       │     │
//!          dropped    dropped  dropped  waits, until `depart`
//! ```
//!
//! A link whose only impairment is a constant delay is compiled to one addition.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

use cohaptic_units::{Bytes, Instant};

use crate::bottleneck::{BottleneckStage, Departure};
use crate::delay::DelayStage;
use crate::loss::LossStage;
use crate::order::OrderStage;
use crate::random::{Purpose, Stream};
use crate::{DropCause, LinkConfig, Order, Outages};

/// The name of a link: the address of its random numbers, and what records call it.
///
/// It is made of the names of the nodes, not of their places in a list, so that adding a node moves nobody else's randomness.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct LinkName(String);

impl LinkName {
    /// The link from one node to another: `left->right`.
    #[must_use]
    pub fn between(from: &str, to: &str) -> Self {
        Self(alloc::format!("{from}->{to}"))
    }

    /// The line that a node sends through: `left->*`.
    #[must_use]
    pub fn uplink(node: &str) -> Self {
        Self::between(node, "*")
    }

    /// The line that a node receives through: `*->left`.
    #[must_use]
    pub fn downlink(node: &str) -> Self {
        Self::between("*", node)
    }

    /// The name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// Time was given that is earlier than a time given before. Nothing was changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("time went back to {now} after {was}")]
#[non_exhaustive]
pub struct TimeWentBack {
    /// The time given.
    pub now: Instant,
    /// The latest time given before.
    pub was: Instant,
}

/// Checks that time does not go back, and remembers it.
pub(crate) fn check_time(clock: &mut Instant, now: Instant) -> Result<(), TimeWentBack> {
    if now < *clock {
        return Err(TimeWentBack { now, was: *clock });
    }
    *clock = now;
    Ok(())
}

/// What becomes of an offered packet, as far as it is known at once.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Outcome {
    Arrives(Instant),
    Dropped(DropCause),
    /// It must pass the bottleneck: see [`Pipeline::enqueue`].
    Queues,
}

/// What the bottleneck does with a packet.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Enqueued<T> {
    /// The line was idle and begins to send it.
    Served(Departure),
    Waits,
    Dropped(DropCause, T),
}

/// The first words of a packet for loss and for jitter.
pub(crate) type Words = [u64; 2];

/// The stages of one link.
#[derive(Clone, Debug)]
pub(crate) enum Pipeline<T> {
    /// Nothing but a constant delay \[ns\]. The order stage only remembers the latest arrival, for a live change to `in-order`.
    Constant(u64, OrderStage),
    Chain(Box<Chain<T>>),
}

#[derive(Clone, Debug)]
pub(crate) struct Chain<T> {
    outages: Outages,
    /// The random numbers of the link, one address a packet.
    draws: Stream,
    is_random: bool,
    loss: Option<LossStage>,
    /// In a box, so that a link without one is small: the links of a large mesh fill the cache.
    bottleneck: Option<Box<BottleneckStage<(u64, T)>>>,
    /// The last announcement of a bottleneck that was taken away.
    announced: u64,
    delay: DelayStage,
    order: OrderStage,
}

impl<T> Pipeline<T> {
    /// The least that this configuration needs, or the whole chain if `general`.
    pub(crate) fn new(seed: u64, name: &LinkName, config: LinkConfig, general: bool) -> Self {
        if config.is_constant_delay() && !general {
            Self::Constant(constant_nanos(&config), OrderStage::new(Order::AllowReordering))
        } else {
            Self::Chain(Box::new(Chain::new(seed, name, config)))
        }
    }

    /// Decides about packet number `number` of this link.
    #[inline]
    pub(crate) fn offer(&mut self, now: Instant, number: u64, words: Words) -> Outcome {
        match self {
            Self::Constant(delay, order) => Outcome::Arrives(order.arrival(later(now, *delay))),
            Self::Chain(chain) => chain.offer(now, number, words),
        }
    }

    /// The first random words of packet number `number`, which [`Pipeline::offer`] wants; zeros if the link draws none.
    #[inline]
    pub(crate) fn words(&self, number: u64) -> Words {
        match self {
            Self::Constant(..) => [0; 2],
            Self::Chain(chain) if chain.is_random => chain.draws.packet(number).loss_and_jitter(),
            Self::Chain(_) => [0; 2],
        }
    }

    /// Hands the packet to the bottleneck, after [`Outcome::Queues`].
    pub(crate) fn enqueue(&mut self, now: Instant, number: u64, size: Bytes, item: T) -> Enqueued<T> {
        let bottleneck = match self {
            Self::Constant(..) => None,
            Self::Chain(chain) => chain.bottleneck.as_mut(),
        };
        match bottleneck.expect("only a link with a bottleneck answers that a packet queues").offer(now, size, (number, item)) {
            Ok(Some(departure)) => Enqueued::Served(departure),
            Ok(None) => Enqueued::Waits,
            Err((_, item)) => Enqueued::Dropped(DropCause::QueueFull, item),
        }
    }

    /// The packet that leaves the bottleneck with this announcement, its arrival, and the announcement of the next. `None` if it is stale.
    pub(crate) fn depart(&mut self, departure: Departure) -> Option<(T, Instant, Option<Departure>)> {
        match self {
            Self::Constant(..) => None,
            Self::Chain(chain) => chain.depart(departure),
        }
    }

    /// Changes the configuration. What propagates keeps its delay. Gives a new announcement if a packet is on the line, and the packets that a
    /// bottleneck gave up when it was taken away, which propagate from now on.
    pub(crate) fn reconfigure(&mut self, now: Instant, seed: u64, name: &LinkName, config: LinkConfig) -> (Option<Departure>, Vec<(T, Instant)>) {
        match self {
            Self::Constant(delay, _) if config.is_constant_delay() => *delay = constant_nanos(&config),
            Self::Constant(_, order) => {
                order.set_policy(config.order);
                *self = Self::Chain(Box::new(Chain { order: *order, ..Chain::new(seed, name, config) }));
            }
            Self::Chain(chain) => return chain.reconfigure(now, config),
        }
        (None, Vec::new())
    }
}

fn constant_nanos(config: &LinkConfig) -> u64 {
    u64::try_from(config.delay.mean().as_nanos()).unwrap_or(u64::MAX)
}

fn initial(draws: Stream) -> u64 {
    draws.packet(0).first(Purpose::InitialState)
}

#[inline]
fn later(now: Instant, nanos: u64) -> Instant {
    Instant::from_nanos(now.as_nanos().saturating_add(nanos))
}

impl<T> Chain<T> {
    fn new(seed: u64, name: &LinkName, config: LinkConfig) -> Self {
        let draws = Stream::new(seed, name.as_str().as_bytes());
        Self {
            is_random: config.is_random(),
            outages: config.outages,
            draws,
            loss: LossStage::new(config.loss, initial(draws)),
            bottleneck: config.bottleneck.map(|bottleneck| Box::new(BottleneckStage::new(bottleneck, 0))),
            announced: 0,
            delay: DelayStage::new(config.delay),
            order: OrderStage::new(config.order),
        }
    }

    #[inline(always)]
    fn offer(&mut self, now: Instant, number: u64, [loss_word, jitter_word]: Words) -> Outcome {
        if self.outages.covers(now) {
            return Outcome::Dropped(DropCause::Outage);
        }
        let packet = self.draws.packet(number);
        if let Some(loss) = &mut self.loss
            && loss.loses(loss_word, packet)
        {
            return Outcome::Dropped(DropCause::Loss);
        }
        if self.bottleneck.is_some() {
            return Outcome::Queues;
        }
        let delay = self.delay.draw_nanos(jitter_word, packet);
        Outcome::Arrives(self.order.arrival(later(now, delay)))
    }

    fn depart(&mut self, departure: Departure) -> Option<(T, Instant, Option<Departure>)> {
        let ((number, item), next) = self.bottleneck.as_mut()?.depart(departure)?;
        Some((item, self.arrival(departure.at, number), next))
    }

    fn reconfigure(&mut self, now: Instant, config: LinkConfig) -> (Option<Departure>, Vec<(T, Instant)>) {
        let initial = initial(self.draws);
        self.loss = match self.loss {
            Some(stage) => stage.reconfigured(config.loss, initial),
            None => LossStage::new(config.loss, initial),
        };
        self.is_random = config.is_random();
        self.outages = config.outages;
        self.delay = DelayStage::new(config.delay);
        self.order.set_policy(config.order);
        match (self.bottleneck.take(), config.bottleneck) {
            (None, None) => (None, Vec::new()),
            (None, Some(new)) => {
                self.bottleneck = Some(Box::new(BottleneckStage::new(new, self.announced)));
                (None, Vec::new())
            }
            (Some(mut stage), Some(new)) => {
                let departure = stage.reconfigure(now, new);
                self.bottleneck = Some(stage);
                (departure, Vec::new())
            }
            (Some(stage), None) => {
                let (announced, items) = stage.dismantle();
                self.announced = announced;
                (None, items.map(|(number, item)| (item, self.arrival(now, number))).collect())
            }
        }
    }

    /// When a packet that begins to propagate now arrives.
    #[inline(always)]
    fn arrival(&mut self, now: Instant, number: u64) -> Instant {
        let packet = self.draws.packet(number);
        let delay = self.delay.draw_nanos(packet.first(Purpose::Jitter), packet);
        self.order.arrival(later(now, delay))
    }
}
