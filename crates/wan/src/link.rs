//! One directed link, with the packets inside the link.

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;
use core::fmt;

use cohaptic_units::{Bytes, Instant};

use crate::event_queue::{Event, EventQueue};
use crate::fates::fate::{DropCause, Fate};
use crate::fates::record::{PacketEvent, PacketRecord, PathPart};
use crate::fates::stats::LinkStats;
use crate::line::filter::{Filter, Offered};
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::line::pipeline::{Outcome, TimeWentBack, check_time};
use crate::line::{Line, Sink};
use crate::packet::{Marks, Outputs, PacketInfo};

/// State machine of a directed link. Packets enter with [`Link::handle_packet`]; packets and their fates come out with [`Link::poll_event`].
///
/// The driver passes packets in, asks [`Link::poll_timeout`] for the next deadline, calls [`Link::handle_timeout`] at that instant, and drains
/// [`Link::poll_event`] until it returns `None`. A late driver changes no fate, because every event carries its instant. The answer of `poll_timeout` can
/// change after `handle_packet`, `handle_timeout` and `set_model`.
///
/// At equal instants a packet leaves a queue before the next packet is offered to the queue, and events come in the order of (instant, sequence, copy).
#[derive(Clone)]
pub struct Link<P> {
    /// Seed of the random numbers, needed when the model changes.
    seed: u64,
    name: LinkName,
    /// Latest instant given by the driver.
    now: Instant,
    /// Stages and counters of the link.
    line: Line<P, InLink<P>>,
    /// Number of the flow of a packet by its payload. Under `None` all packets are one flow.
    flows: Option<fn(&P) -> u32>,
    traffic: Traffic<P>,
    /// Buffer for the outputs of stages, empty between calls. A field, for the reuse of its memory.
    outputs: Outputs<InLink<P>>,
}

/// Packets after the stages.
#[derive(Clone)]
struct Traffic<P> {
    /// Packets in propagation, in the order of arrival.
    pending: EventQueue<Pending<P>>,
    /// Events before their poll, in the order of happening.
    happened: VecDeque<PacketEvent<P>>,
}

impl<P: Clone> Link<P> {
    /// Returns an empty link. Seed and name are the address of its random numbers.
    #[must_use]
    pub fn new(seed: u64, name: &LinkName, model: impl Into<LinkModel>) -> Self {
        Self {
            seed,
            name: name.clone(),
            now: Instant::ZERO,
            line: Line::new(seed, name, model.into(), false),
            flows: None,
            traffic: Traffic { pending: EventQueue::new(), happened: VecDeque::new() },
            outputs: Vec::new(),
        }
    }

    /// Sets the filter of the link. A packet with `drops` true is dropped before all stages. The filter sees the packet and its payload.
    #[must_use]
    pub fn with_filter(mut self, drops: impl Fn(&Offered<'_, P>) -> bool + Send + Sync + 'static) -> Self {
        self.line.set_filter(Filter::new(drops));
        self
    }

    /// Sets the function from a payload to the number of the packet's flow, for queues with [`FqCoDel`](crate::FqCoDel). Packets with different numbers are
    /// packets of different flows. Without this function all packets are one flow.
    #[must_use]
    pub fn with_flows(mut self, flow: fn(&P) -> u32) -> Self {
        self.flows = Some(flow);
        self
    }

    /// Offers a packet to the link. A size alone stands for a packet without ECN.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant. The link is then unchanged.
    pub fn handle_packet(&mut self, now: Instant, info: impl Into<PacketInfo>, payload: P) -> Result<(), TimeWentBack> {
        check_time(&mut self.now, now)?;
        // Stages with queues must be up to date before the offer: at equal instants a packet leaves a queue first.
        if self.line.has_engine() {
            self.let_happen(now);
        }
        let info = info.into();
        // `filters` counts a filtered packet as offered, so a filter does not change the numbers and the draws of later packets.
        let sequence = self.line.offered();
        let is_filtered = self.line.has_filter() && self.line.filters(&Offered { sequence, now, info, payload: &payload });
        let packet = InLink { sequence, offered: now, size: info.size, payload };
        if is_filtered {
            self.drop(now, DropCause::Filter, packet);
            return Ok(());
        }
        // Without an engine the fate is known at the offer. Only a packet for the engine is boxed.
        match self.line.offer(now, None) {
            Outcome::Arrives(at) => self.traffic.pending.push(Pending { at, packet, copy: 0, marks: None }),
            Outcome::Dropped(cause) => self.drop(now, cause, packet),
            Outcome::Enters => {
                let flow = self.flows.map_or(0, |flow| flow(&packet.payload));
                self.line.enter(now, (info, flow), Marks::default(), packet, &mut self.outputs, &mut self.traffic);
            }
        }
        Ok(())
    }

    /// Lets time pass inside the link until `now`.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant. The link is then unchanged.
    pub fn handle_timeout(&mut self, now: Instant) -> Result<(), TimeWentBack> {
        check_time(&mut self.now, now)?;
        self.let_happen(now);
        Ok(())
    }

    /// Lets time pass until `now` like [`Link::handle_timeout`], and computes the packets of [cross-traffic](crate::CrossTraffic) up to `now`. A link without
    /// packets of its own asks for no wake, so the next packet has to wait for the computation of all cross packets since the last packet. A driver in real time
    /// calls this function several times a second, so that no wait is long. Fates and counters are the same with any calls.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant. The link is then unchanged.
    pub fn catch_up(&mut self, now: Instant) -> Result<(), TimeWentBack> {
        self.handle_timeout(now)?;
        self.line.catch_up(now, &mut self.outputs, &mut self.traffic);
        Ok(())
    }

    /// Returns the instant of the next necessary call of [`Link::handle_timeout`], or `None` if no packet is inside the link. Never before the latest instant
    /// given. After a live change, nothing need happen at the returned instant.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let next = self.line.next_wake().into_iter().chain(self.traffic.pending.next_at()).min()?;
        // Due arrivals before their poll can lie before `now`.
        Some(next.max(self.now))
    }

    /// Returns the next event: an arrival, a drop, or the making of a copy. Returns `None` when all events up to now have been polled.
    #[must_use]
    pub fn poll_event(&mut self) -> Option<PacketEvent<P>> {
        if let Some(event) = self.traffic.happened.pop_front() {
            return Some(event);
        }
        // Without an engine, arrivals stay in `pending` until the poll, because no later packet depends on an arrival.
        let Pending { at, packet, copy, marks } = self.traffic.pending.pop_due(self.now)?;
        Some(self.arrive(at, packet, copy, marks))
    }

    /// Changes the model from `now` on. Packets in propagation keep their delay. A packet in serialisation keeps the bits already sent. Waiting packets are
    /// served at the new rate, or go on at once if the new model lacks their stage. Chains and correlations continue from their present state.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant. The link is then unchanged.
    pub fn set_model(&mut self, now: Instant, model: impl Into<LinkModel>) -> Result<(), TimeWentBack> {
        // The old model applies up to `now`.
        self.handle_timeout(now)?;
        self.line.reconfigure(now, self.seed, &self.name, model.into(), &mut self.outputs, &mut self.traffic);
        Ok(())
    }

    /// Returns the counters of the link. A packet counts as delivered when its arrival is polled, or when time passes beyond its arrival.
    #[must_use]
    pub fn stats(&self) -> LinkStats {
        self.line.stats()
    }

    /// Processes all wakes and arrivals up to `now` in order, and keeps the events for the poll.
    #[inline(always)]
    fn let_happen(&mut self, now: Instant) {
        loop {
            // At equal instants the engine is woken before packets arrive.
            if let Some(wake) = self.line.next_wake().filter(|wake| *wake <= now)
                && self.traffic.pending.next_at().is_none_or(|arrival| wake <= arrival)
            {
                self.line.wake(wake, &mut self.outputs, &mut self.traffic);
                continue;
            }
            let Some(Pending { at, packet, copy, marks }) = self.traffic.pending.pop_due(now) else { return };
            let event = self.arrive(at, packet, copy, marks);
            self.traffic.happened.push_back(event);
        }
    }

    /// Counts the arrival of a packet, and returns its event: a delivery, or a drop if the checksum of the receiver finds damage.
    #[inline(always)]
    fn arrive(&mut self, at: Instant, packet: InLink<P>, copy: u8, marks: Option<Box<Marks>>) -> PacketEvent<P> {
        let marks = marks.map_or_else(Marks::default, |marks| *marks);
        // The checksum is checked at the end of the way, so the packet was in flight until now.
        if marks.discarded_on_arrival {
            self.line.drop(DropCause::Checksum);
            return packet.event(at, Fate::Dropped(DropCause::Checksum), copy, marks);
        }
        self.line.deliver(packet.offered, at);
        packet.event(at, Fate::Delivered(at), copy, marks)
    }

    /// Records the drop of a packet at its offer.
    #[inline(never)]
    fn drop(&mut self, now: Instant, cause: DropCause, packet: InLink<P>) {
        self.line.drop(cause);
        if !self.line.has_engine() {
            // Due arrivals in `pending` happened before this drop, and must be polled before the drop.
            self.let_happen(now);
        }
        self.traffic.happened(now, Fate::Dropped(cause), packet, 0, Marks::default());
    }
}

impl<P> Sink<InLink<P>> for Traffic<P> {
    fn arrives(&mut self, at: Instant, packet: InLink<P>, copy: u8, marks: Marks) {
        // Nearly all packets have no marks, so an allocation is rare.
        let marks = (marks != Marks::default()).then(|| Box::new(marks));
        self.pending.push(Pending { at, packet, copy, marks });
    }

    fn happened(&mut self, at: Instant, fate: Fate, packet: InLink<P>, copy: u8, marks: Marks) {
        self.happened.push_back(packet.event(at, fate, copy, marks));
    }
}

/// Packet inside the link, with its payload.
#[derive(Clone, Debug)]
struct InLink<P> {
    /// Number of the packet on this link, counted from 0.
    sequence: u64,
    /// Instant of the offer.
    offered: Instant,
    size: Bytes,
    payload: P,
}

impl<P> InLink<P> {
    /// Returns the event of a fate of this packet at the instant `at`.
    fn event(self, at: Instant, fate: Fate, copy: u8, marks: Marks) -> PacketEvent<P> {
        let Self { sequence, offered, size, payload } = self;
        let Marks { congestion: marked, damage, .. } = marks;
        let record = PacketRecord { path: (), sequence, copy, offered, at, size, fate, marked, damaged: damage.is_some() };
        PacketEvent { record, payload, damage, part: PathPart::Link }
    }
}

/// Packet in propagation.
#[derive(Clone, Debug)]
struct Pending<P> {
    /// Instant of arrival.
    at: Instant,
    packet: InLink<P>,
    /// Number of the copy. 0 is the packet itself.
    copy: u8,
    /// Marks and damage, or `None` without any. Boxed, because few packets have marks and an unboxed value would enlarge every event.
    marks: Option<Box<Marks>>,
}

impl<P> Event for Pending<P> {
    type Key = (Instant, u64, u8);

    fn at(&self) -> Instant {
        self.at
    }

    fn key(&self) -> Self::Key {
        (self.at, self.packet.sequence, self.copy)
    }
}

impl<P> fmt::Debug for Link<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Link").field("name", &self.name).field("now", &self.now).field("stats", &self.line.stats()).finish_non_exhaustive()
    }
}
