//! One link and what is on the way through it.

use alloc::collections::VecDeque;

use cohaptic_units::{Bytes, Instant};

use crate::bottleneck::Departure;
use crate::event_queue::Event;
use crate::pipeline::{Enqueued, Outcome, Pipeline, check_time};
use crate::{DropCause, EventQueue, Fate, LinkConfig, LinkName, LinkStats, TimeWentBack};

/// A directed link as a state machine: packets in with [`Link::handle_packet`], packets and their fates out with [`Link::poll_event`].
///
/// The driver hands packets in, asks with [`Link::poll_timeout`] when to come back, calls [`Link::handle_timeout`] then, and drains
/// [`Link::poll_event`] until it gives `None`. Being late costs nothing but lateness: every event carries the instant at which it happened. The
/// answer of `poll_timeout` may change after `handle_packet`, `handle_timeout` and `set_config`.
///
/// At equal instants a packet leaves the bottleneck before another is offered to it, and events come in the order of (instant, sequence).
#[derive(Clone, Debug)]
pub struct Link<P> {
    seed: u64,
    name: LinkName,
    now: Instant,
    pipeline: Pipeline<InLink<P>>,
    pending: EventQueue<Pending<P>>,
    /// Drops and arrivals that have happened and were not polled yet.
    happened: VecDeque<LinkEvent<P>>,
    stats: LinkStats,
}

/// What became of one packet.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct LinkEvent<P> {
    /// The number of the packet on this link, from 0.
    pub sequence: u64,
    /// When it was offered.
    pub sent: Instant,
    /// When it arrived or was dropped.
    pub at: Instant,
    /// Its size.
    pub size: Bytes,
    /// What it carries.
    pub payload: P,
    /// What became of it.
    pub fate: Fate,
}

#[derive(Clone, Debug)]
struct InLink<P> {
    sequence: u64,
    sent: Instant,
    size: Bytes,
    payload: P,
}

/// A departure from the bottleneck or an arrival.
#[derive(Clone, Debug)]
struct Pending<P> {
    at: Instant,
    what: What<P>,
}

#[derive(Clone, Debug)]
enum What<P> {
    Departs(u64),
    Arrives(InLink<P>),
}

impl<P> Event for Pending<P> {
    type Key = (Instant, bool, u64);

    fn at(&self) -> Instant {
        self.at
    }

    fn key(&self) -> Self::Key {
        match &self.what {
            What::Departs(ticket) => (self.at, false, *ticket),
            What::Arrives(packet) => (self.at, true, packet.sequence),
        }
    }
}

impl<P> Link<P> {
    /// A link with that configuration. Links of equal seed and name draw the same random numbers.
    #[must_use]
    pub fn new(seed: u64, name: &LinkName, config: LinkConfig) -> Self {
        Self {
            seed,
            name: name.clone(),
            now: Instant::ZERO,
            pipeline: Pipeline::new(seed, name, config, false),
            pending: EventQueue::new(),
            happened: VecDeque::new(),
            stats: LinkStats::default(),
        }
    }

    /// Takes a packet in.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant; nothing was changed.
    pub fn handle_packet(&mut self, now: Instant, size: Bytes, payload: P) -> Result<(), TimeWentBack> {
        self.handle_timeout(now)?;
        let sequence = self.stats.offered;
        self.stats.offered += 1;
        let packet = InLink { sequence, sent: now, size, payload };
        match self.pipeline.offer(now, sequence, self.pipeline.words(sequence)) {
            Outcome::Arrives(at) => self.pending.push(Pending { at, what: What::Arrives(packet) }),
            Outcome::Dropped(cause) => self.drop(now, cause, packet),
            Outcome::Queues => match self.pipeline.enqueue(now, sequence, size, packet) {
                Enqueued::Served(departure) => self.announce(departure),
                Enqueued::Waits => {}
                Enqueued::Dropped(cause, packet) => self.drop(now, cause, packet),
            },
        }
        Ok(())
    }

    /// Lets time pass until `now`.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant; nothing was changed.
    pub fn handle_timeout(&mut self, now: Instant) -> Result<(), TimeWentBack> {
        check_time(&mut self.now, now)?;
        while let Some(Pending { at, what }) = self.pending.pop_due(now) {
            match what {
                What::Departs(ticket) => {
                    if let Some((packet, arrival, next)) = self.pipeline.depart(Departure { at, ticket }) {
                        self.pending.push(Pending { at: arrival, what: What::Arrives(packet) });
                        if let Some(next) = next {
                            self.announce(next);
                        }
                    }
                }
                What::Arrives(packet) => {
                    self.stats.delivered += 1;
                    self.stats.delay_nanos += u128::from(at.as_nanos() - packet.sent.as_nanos());
                    self.happened.push_back(packet.event(at, Fate::Delivered(at)));
                }
            }
        }
        Ok(())
    }

    /// When [`Link::handle_timeout`] must be called next; `None` if nothing is on the way. Never before the last instant given. After a
    /// change of rate it may name an instant at which nothing happens.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.pending.next_at()
    }

    /// The next packet that has arrived or was dropped; `None` when all have been polled.
    #[must_use]
    pub fn poll_event(&mut self) -> Option<LinkEvent<P>> {
        self.happened.pop_front()
    }

    /// Changes the configuration from `now` on. Packets that propagate keep their delay; one that is being serialised keeps the bits already
    /// sent; those that wait are served at the new rate, or leave at once if there is no bottleneck any more.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant; nothing was changed.
    pub fn set_config(&mut self, now: Instant, config: LinkConfig) -> Result<(), TimeWentBack> {
        self.handle_timeout(now)?;
        let (departure, released) = self.pipeline.reconfigure(now, self.seed, &self.name, config);
        if let Some(departure) = departure {
            self.announce(departure);
        }
        for (packet, at) in released {
            self.pending.push(Pending { at, what: What::Arrives(packet) });
        }
        Ok(())
    }

    /// What the link did so far.
    #[must_use]
    pub const fn stats(&self) -> &LinkStats {
        &self.stats
    }

    fn drop(&mut self, now: Instant, cause: DropCause, packet: InLink<P>) {
        self.stats.dropped[cause.index()] += 1;
        self.happened.push_back(packet.event(now, Fate::Dropped(cause)));
    }

    fn announce(&mut self, Departure { at, ticket }: Departure) {
        self.pending.push(Pending { at, what: What::Departs(ticket) });
    }
}

impl<P> InLink<P> {
    fn event(self, at: Instant, fate: Fate) -> LinkEvent<P> {
        let Self { sequence, sent, size, payload } = self;
        LinkEvent { sequence, sent, at, size, payload, fate }
    }
}
