//! One link and what is on the way through it.

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;
use core::fmt;

use cohaptic_units::{Bytes, Instant};

use crate::event_queue::{Event, EventQueue};
use crate::fates::fate::{DropCause, Fate};
use crate::fates::record::{PacketEvent, PacketRecord};
use crate::fates::stats::LinkStats;
use crate::line::filter::{Filter, Offered};
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::line::pipeline::{Outcome, TimeWentBack, check_time};
use crate::line::{Line, Sink};
use crate::packet::{Marks, Outputs, PacketInfo};

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
    line: Line<P, InLink<P>>,
    traffic: Traffic<P>,
    outputs: Outputs<InLink<P>>,
}

/// The packets behind the line.
#[derive(Clone)]
struct Traffic<P> {
    pending: EventQueue<Pending<P>>,
    /// Events that have happened and were not polled yet.
    happened: VecDeque<PacketEvent<P>>,
}

impl<P: Clone> Link<P> {
    /// An empty link. The seed and the name are the address of its random numbers.
    #[must_use]
    pub fn new(seed: u64, name: &LinkName, model: impl Into<LinkModel>) -> Self {
        Self {
            seed,
            name: name.clone(),
            now: Instant::ZERO,
            line: Line::new(seed, name, model.into(), false),
            traffic: Traffic { pending: EventQueue::new(), happened: VecDeque::new() },
            outputs: Vec::new(),
        }
    }

    /// Drops every packet of which the filter says so, before anything else happens to it. The filter sees the packet and its payload.
    #[must_use]
    pub fn with_filter(mut self, drops: impl Fn(&Offered<'_, P>) -> bool + Send + Sync + 'static) -> Self {
        self.line.set_filter(Filter::new(drops));
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
        if self.line.has_engine() {
            self.let_happen(now);
        }
        let info = info.into();
        let sequence = self.line.offered();
        if self.line.filters(&Offered { sequence, now, info, payload: &payload }) {
            self.drop(now, DropCause::Filter, InLink { sequence, offered: now, size: info.size, payload });
            return Ok(());
        }
        let packet = InLink { sequence, offered: now, size: info.size, payload };
        match self.line.offer(now, self.line.words()) {
            Outcome::Arrives(at) => self.traffic.pending.push(Pending { at, packet, copy: 0, marks: None }),
            Outcome::Dropped(cause) => self.drop(now, cause, packet),
            Outcome::Enters => self.line.enter(now, info, Marks::default(), packet, &mut self.outputs, &mut self.traffic),
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
        let next = self.line.next_wake().into_iter().chain(self.traffic.pending.next_at()).min()?;
        // What has arrived and was not polled yet is there now.
        Some(next.max(self.now))
    }

    /// The next packet that has arrived or was dropped, or a copy that was made; `None` when all have been polled.
    #[must_use]
    #[inline]
    pub fn poll_event(&mut self) -> Option<PacketEvent<P>> {
        if let Some(event) = self.traffic.happened.pop_front() {
            return Some(event);
        }
        // Without an engine arrivals wait here: nothing that comes meanwhile depends on them.
        let pending = self.traffic.pending.pop_due(self.now)?;
        Some(self.arrive(pending))
    }

    /// Changes the model from `now` on. Packets that propagate keep their delay; one that is being serialised keeps the bits already sent; those that wait
    /// are served at the new rate, or go on at once if what they wait for is gone. Chains and correlations go on from the state they are in.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant; nothing was changed.
    pub fn set_model(&mut self, now: Instant, model: impl Into<LinkModel>) -> Result<(), TimeWentBack> {
        self.handle_timeout(now)?;
        self.line.reconfigure(now, self.seed, &self.name, model.into(), &mut self.outputs, &mut self.traffic);
        Ok(())
    }

    /// What the link did so far. A packet counts as delivered when its arrival is polled, or when time is let pass beyond it.
    #[must_use]
    pub fn stats(&self) -> LinkStats {
        self.line.stats()
    }

    /// Lets all that is due happen, and keeps the events until they are polled.
    #[inline(always)]
    fn let_happen(&mut self, now: Instant) {
        loop {
            // The engine is woken before anything arrives at the same instant.
            if let Some(wake) = self.line.next_wake().filter(|wake| *wake <= now)
                && self.traffic.pending.next_at().is_none_or(|arrival| wake <= arrival)
            {
                self.line.wake(wake, &mut self.outputs, &mut self.traffic);
                continue;
            }
            let Some(pending) = self.traffic.pending.pop_due(now) else { return };
            let event = self.arrive(pending);
            self.traffic.happened.push_back(event);
        }
    }

    #[inline(always)]
    fn arrive(&mut self, pending: Pending<P>) -> PacketEvent<P> {
        let Pending { at, packet, copy, marks } = pending;
        let marks = marks.map_or_else(Marks::default, |marks| *marks);
        if marks.discarded_on_arrival {
            self.line.discard();
            return packet.event(at, Fate::Dropped(DropCause::Checksum), copy, marks);
        }
        self.line.deliver(packet.offered, at);
        packet.event(at, Fate::Delivered(at), copy, marks)
    }

    /// The packet was dropped when it was offered.
    fn drop(&mut self, now: Instant, cause: DropCause, packet: InLink<P>) {
        if !self.line.has_engine() {
            // Arrivals that wait to be polled came before this drop.
            self.let_happen(now);
        }
        self.traffic.happened(now, Fate::Dropped(cause), packet, 0, Marks::default());
    }
}

impl<P> Sink<InLink<P>> for Traffic<P> {
    #[inline]
    fn arrives(&mut self, at: Instant, packet: InLink<P>, copy: u8, marks: Marks) {
        let marks = (marks != Marks::default()).then(|| Box::new(marks));
        self.pending.push(Pending { at, packet, copy, marks });
    }

    #[inline]
    fn happened(&mut self, at: Instant, fate: Fate, packet: InLink<P>, copy: u8, marks: Marks) {
        self.happened.push_back(packet.event(at, fate, copy, marks));
    }
}

/// A packet in the link.
#[derive(Clone, Debug)]
struct InLink<P> {
    sequence: u64,
    offered: Instant,
    size: Bytes,
    payload: P,
}

impl<P> InLink<P> {
    #[inline]
    fn event(self, at: Instant, fate: Fate, copy: u8, marks: Marks) -> PacketEvent<P> {
        let Self { sequence, offered, size, payload } = self;
        let Marks { congestion: marked, damage, .. } = marks;
        let record = PacketRecord { path: (), sequence, copy, offered, at, size, fate, marked, damaged: damage.is_some() };
        PacketEvent { record, payload, damage }
    }
}

/// A packet that propagates, until it arrives.
#[derive(Clone, Debug)]
struct Pending<P> {
    at: Instant,
    packet: InLink<P>,
    copy: u8,
    /// In a box, since few packets have any.
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
        (self.at, self.packet.sequence, self.copy)
    }
}

impl<P> fmt::Debug for Link<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Link").field("name", &self.name).field("now", &self.now).field("stats", &self.line.stats()).finish_non_exhaustive()
    }
}
