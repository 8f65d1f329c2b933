//! One link and what is on the way through it.

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;
use core::fmt;

use cohaptic_units::{Bytes, Instant};

use crate::event_queue::{Event, EventQueue};
use crate::fates::fate::PacketRecord;
use crate::fates::fate::{DropCause, Fate};
use crate::fates::stats::LinkStats;
use crate::line::filter::{Filter, Offered};
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::line::pipeline::{Outcome, Pipeline, TimeWentBack, check_time};
use crate::packet::damage::Damage;
use crate::packet::{Exit, Marks, Outputs, Packet, PacketInfo};

/// A directed link as a state machine: packets in with [`Link::handle_packet`], packets and their fates out with [`Link::poll_event`].
///
/// The driver hands packets in, asks with [`Link::poll_timeout`] when to come back, calls [`Link::handle_timeout`] then, and drains
/// [`Link::poll_event`] until it gives `None`. Being late costs nothing but lateness: every event carries the instant at which it happened. The
/// answer of `poll_timeout` may change after `handle_packet`, `handle_timeout` and `set_model`.
///
/// At equal instants a packet leaves a queue before another is offered to it, and events come in the order of (instant, sequence, copy).
#[derive(Clone)]
pub struct Link<P> {
    seed: u64,
    name: LinkName,
    now: Instant,
    filter: Option<Filter<P>>,
    pipeline: Pipeline<InLink<P>>,
    pending: EventQueue<Pending<P>>,
    /// Events that have happened and were not polled yet.
    happened: VecDeque<LinkEvent<P>>,
    stats: LinkStats,
    outputs: Outputs<InLink<P>>,
}

/// What became of one packet, or that a copy of it was made.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LinkEvent<P> {
    /// The number of the packet on this link, from 0.
    pub sequence: u64,
    /// 0 for the packet itself, 1 for a copy that the link made. With [`Fate::Duplicated`] it is the number of the new copy.
    pub copy: u8,
    /// When it was offered.
    pub sent: Instant,
    /// When it arrived or was dropped, or when the copy was made.
    pub at: Instant,
    /// Its size.
    pub size: Bytes,
    /// What it carries, as it was offered: see `damage`.
    pub payload: P,
    /// What became of it.
    pub fate: Fate,
    /// Whether an active queue marked it: congestion experienced.
    pub marked: bool,
    /// The bits that were flipped. [`Damage::apply`] flips them.
    pub damage: Option<Damage>,
}

impl<P> LinkEvent<P> {
    /// The event as a row of a fate log.
    #[must_use]
    pub const fn record(&self) -> PacketRecord {
        PacketRecord {
            sequence: self.sequence,
            copy: self.copy,
            offered: self.sent,
            at: self.at,
            size: self.size,
            fate: self.fate,
            marked: self.marked,
            damaged: self.damage.is_some(),
        }
    }
}

#[derive(Clone, Debug)]
struct InLink<P> {
    sequence: u64,
    sent: Instant,
    size: Bytes,
    payload: P,
}

#[derive(Clone, Debug)]
struct Pending<P> {
    at: Instant,
    arrival: Arrival<P>,
}

#[derive(Clone, Debug)]
struct Arrival<P> {
    packet: InLink<P>,
    copy: u8,
    marks: Option<Box<Marks>>,
}

impl<P> Event for Pending<P> {
    type Key = (Instant, u64, u8);

    #[inline]
    fn at(&self) -> Instant {
        self.at
    }

    #[inline]
    fn key(&self) -> Self::Key {
        (self.at, self.arrival.packet.sequence, self.arrival.copy)
    }
}

impl<P: Clone> Link<P> {
    /// An empty link. The seed and the name are the address of its random numbers.
    #[must_use]
    pub fn new(seed: u64, name: &LinkName, model: impl Into<LinkModel>) -> Self {
        Self {
            seed,
            name: name.clone(),
            now: Instant::ZERO,
            filter: None,
            pipeline: Pipeline::new(seed, name, model.into(), false),
            pending: EventQueue::new(),
            happened: VecDeque::new(),
            stats: LinkStats::default(),
            outputs: Vec::new(),
        }
    }

    /// Drops every packet of which the filter says so, before anything else happens to it. The filter sees the packet and its payload.
    #[must_use]
    pub fn with_filter(mut self, drops: impl Fn(&Offered<'_, P>) -> bool + Send + Sync + 'static) -> Self {
        self.filter = Some(Filter::new(drops));
        self
    }

    /// Takes a packet in. A size alone is a packet without ECN.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant; nothing was changed.
    #[inline]
    pub fn handle_packet(&mut self, now: Instant, info: impl Into<PacketInfo>, payload: P) -> Result<(), TimeWentBack> {
        check_time(&mut self.now, now)?;
        if self.pipeline.engine().is_some() {
            self.let_happen(now);
        }
        let info = info.into();
        let sequence = self.stats.flow.offered;
        self.stats.flow.offered += 1;
        let filtered = self.filter.as_ref().is_some_and(|filter| filter.drops(&Offered { sequence, now, info, payload: &payload }));
        let packet = InLink { sequence, sent: now, size: info.size, payload };
        if filtered {
            self.drop(now, DropCause::Filter, packet, 0, Marks::default());
            return Ok(());
        }
        match self.pipeline.offer(now, sequence, self.pipeline.words(sequence)) {
            Outcome::Arrives(at) => self.pending.push(Pending { at, arrival: Arrival { packet, copy: 0, marks: None } }),
            Outcome::Dropped(cause) => self.drop(now, cause, packet, 0, Marks::default()),
            Outcome::Enters => self.enter(now, info, packet),
        }
        Ok(())
    }

    /// Lets time pass until `now`.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant; nothing was changed.
    #[inline]
    pub fn handle_timeout(&mut self, now: Instant) -> Result<(), TimeWentBack> {
        check_time(&mut self.now, now)?;
        self.let_happen(now);
        Ok(())
    }

    /// When [`Link::handle_timeout`] must be called next; `None` if nothing is on the way. Never before the last instant given. After a live change it may name an instant at which nothing happens.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let wake = self.pipeline.next_wake();
        let next = self.pending.next_at().map_or(wake, |arrival| Some(wake.map_or(arrival, |wake| wake.min(arrival))))?;
        // What has arrived and was not polled yet is there now.
        Some(next.max(self.now))
    }

    /// The next packet that has arrived or was dropped, or a copy that was made; `None` when all have been polled.
    #[must_use]
    #[inline]
    pub fn poll_event(&mut self) -> Option<LinkEvent<P>> {
        if let Some(event) = self.happened.pop_front() {
            return Some(event);
        }
        // Without an engine arrivals wait here: nothing that comes meanwhile depends on them.
        let Pending { at, arrival } = self.pending.pop_due(self.now)?;
        Some(self.arrive(at, arrival))
    }

    /// Changes the model from `now` on. Packets that propagate keep their delay; one that is being serialised keeps the bits already sent; those that wait
    /// are served at the new rate, or go on at once if what they wait for is gone. Chains and correlations go on from the state they are in.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant; nothing was changed.
    pub fn set_model(&mut self, now: Instant, model: impl Into<LinkModel>) -> Result<(), TimeWentBack> {
        self.handle_timeout(now)?;
        let mut outputs = core::mem::take(&mut self.outputs);
        self.pipeline.reconfigure(now, self.seed, &self.name, model.into(), &mut outputs);
        self.come_out(outputs);
        Ok(())
    }

    /// What the link did so far. A packet counts as delivered when its arrival is polled, or when time is let pass beyond it.
    #[must_use]
    pub const fn stats(&self) -> &LinkStats {
        &self.stats
    }

    /// Hands a packet to the engine.
    fn enter(&mut self, now: Instant, info: PacketInfo, packet: InLink<P>) {
        // The packet itself is counted already.
        let inside = self.stats.in_flight() - 1;
        let mut outputs = core::mem::take(&mut self.outputs);
        if let Some(engine) = self.pipeline.engine() {
            let carried = Packet::new(packet.sequence, info, Marks::default(), packet);
            engine.offer(now, carried, inside, &mut outputs);
        }
        self.come_out(outputs);
    }

    /// Lets all that is due happen, and keeps the events until they are polled.
    #[inline(always)]
    fn let_happen(&mut self, now: Instant) {
        loop {
            // The engine is woken before anything arrives at the same instant.
            if let Some(wake) = self.pipeline.next_wake().filter(|wake| *wake <= now)
                && self.pending.next_at().is_none_or(|arrival| wake <= arrival)
            {
                self.wake(wake);
                continue;
            }
            let Some(Pending { at, arrival }) = self.pending.pop_due(now) else { return };
            let event = self.arrive(at, arrival);
            self.happened.push_back(event);
        }
    }

    #[inline(always)]
    fn arrive(&mut self, at: Instant, arrival: Arrival<P>) -> LinkEvent<P> {
        let Arrival { packet, copy, marks } = arrival;
        let marks = marks.map_or_else(Marks::default, |marks| *marks);
        if marks.discarded_on_arrival {
            self.stats.seldom.dropped[DropCause::Checksum.index()] += 1;
            return packet.event(at, Fate::Dropped(DropCause::Checksum), copy, marks);
        }
        self.stats.flow.delivered += 1;
        self.stats.flow.delay_nanos += u128::from(at.as_nanos() - packet.sent.as_nanos());
        packet.event(at, Fate::Delivered(at), copy, marks)
    }

    fn wake(&mut self, at: Instant) {
        let mut outputs = core::mem::take(&mut self.outputs);
        if let Some(engine) = self.pipeline.engine() {
            engine.pass(at, &mut outputs);
        }
        self.come_out(outputs);
    }

    /// Deals with what has come out of the engine.
    fn come_out(&mut self, mut outputs: Outputs<InLink<P>>) {
        for output in outputs.drain(..) {
            let Packet { copy, marks, item, .. } = *output.packet;
            match output.exit {
                Exit::Arrives(at) => {
                    self.stats.seldom.marked += u64::from(marks.congestion);
                    self.stats.seldom.damaged += u64::from(marks.damage.is_some());
                    let marks = (marks != Marks::default()).then(|| Box::new(marks));
                    self.pending.push(Pending { at, arrival: Arrival { packet: item, copy, marks } });
                }
                Exit::Dropped(at, cause) => self.drop(at, cause, item, copy, marks),
                Exit::Copied(at) => {
                    self.stats.seldom.duplicated += 1;
                    self.happened.push_back(item.event(at, Fate::Duplicated, copy, marks));
                }
            }
        }
        self.outputs = outputs;
    }

    fn drop(&mut self, now: Instant, cause: DropCause, packet: InLink<P>, copy: u8, marks: Marks) {
        if self.pipeline.engine().is_none() {
            // Arrivals that wait to be polled came before this drop.
            self.let_happen(now);
        }
        self.stats.seldom.dropped[cause.index()] += 1;
        self.happened.push_back(packet.event(now, Fate::Dropped(cause), copy, marks));
    }
}

impl<P> InLink<P> {
    #[inline]
    fn event(self, at: Instant, fate: Fate, copy: u8, marks: Marks) -> LinkEvent<P> {
        let Self { sequence, sent, size, payload } = self;
        LinkEvent { sequence, copy, sent, at, size, payload, fate, marked: marks.congestion, damage: marks.damage }
    }
}

impl<P> fmt::Debug for Link<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Link").field("name", &self.name).field("now", &self.now).field("stats", &self.stats).finish_non_exhaustive()
    }
}
