//! Packets of a network after the decisions of its lines: packets in propagation, and events not polled yet.

use alloc::boxed::Box;
use alloc::collections::{BTreeMap, VecDeque};
use core::ops::ControlFlow;

use cohaptic_units::Instant;

use super::awaited::Awaited;
use super::broadcast::Sent;
use super::groups::{Group, Groups};
use super::id::{LinkId, NodeId, Path};
use super::pending::{InNetwork, LineId, Pending, SizeAndMarks, Turn};
use super::sendings::{Open, Sendings};
use crate::event_queue::{Event, Queue};
use crate::fates::damage::Damage;
use crate::fates::fate::Fate;
use crate::fates::record::PacketEvent;
use crate::line::Sink;
use crate::packet::Marks;

#[derive(Clone, Debug)]
pub(super) struct Traffic<P> {
    /// Events to come, apart from the packets in `groups`.
    pending: Queue<Pending<P>, Sendings<P>>,
    groups: Groups<P>,
    pub(super) happened: VecDeque<PacketEvent<P, Path>>,
    /// Packets dropped at their offer in a network without inner events, in the order of their instants. A packet comes after all arrivals due at its instant,
    /// and these need not happen before the poll.
    dropped: VecDeque<PacketEvent<P, Path>>,
    /// Instant of the first packet in `dropped`, or [`Instant::MAX`] if there is none.
    first_dropped: Instant,
    /// Damage of packets on their way, indexed by path, sequence and copy bits. A packet has an entry exactly if its flag `DAMAGED` is set, so undamaged
    /// packets are never looked up.
    damages: BTreeMap<(Path, u64, u8), Damage>,
    /// Instants of possible packets for single receivers; `None` if no driver asks for single receivers.
    pub(super) awaited: Option<Box<Awaited>>,
}

impl<P: Clone> Traffic<P> {
    pub(super) fn new() -> Self {
        Self {
            pending: Queue::new(Sendings::new()),
            groups: Groups::new(),
            happened: VecDeque::new(),
            dropped: VecDeque::new(),
            first_dropped: Instant::MAX,
            damages: BTreeMap::new(),
            awaited: None,
        }
    }

    /// Returns the instant of the next event.
    pub(super) fn next_at(&self) -> Option<Instant> {
        self.pending.next_at().into_iter().chain(self.groups.next_at()).min()
    }

    /// Returns an instant before which no event is due, without a search: see [`Queue::quiet_until`].
    #[inline(always)]
    pub(super) fn quiet_until(&self) -> Instant {
        if !self.happened.is_empty() || !self.dropped.is_empty() {
            return Instant::ZERO;
        }
        self.pending.quiet_until().min(self.groups.next_at().unwrap_or(Instant::MAX))
    }

    /// Removes and returns the first event if its instant is at most `now`, and at most the instant of the first packet in `dropped`.
    #[inline(always)]
    pub(super) fn pop_due(&mut self, now: Instant) -> Option<Pending<P>> {
        self.pop_until(self.until(now))
    }

    /// Returns the latest instant of events that come before the first packet in `dropped`, at most `now`.
    #[inline(always)]
    pub(super) fn until(&self, now: Instant) -> Instant {
        now.min(self.first_dropped)
    }

    /// Removes and returns the first event if its instant is at most `until`, an instant from [`Traffic::until`].
    #[inline(always)]
    pub(super) fn pop_until(&mut self, until: Instant) -> Option<Pending<P>> {
        match self.groups.due_key(until) {
            // In most networks with groups the queue is empty.
            Some(key) if self.pending.len() == 0 || self.pending.due_key(until).is_none_or(|other| key < other) => self.groups.take(),
            Some(_) | None => self.pending.take_due(until, |pending| pending),
        }
    }

    /// Removes and returns the first group, if its packets are due at `until`, an instant from [`Traffic::until`], and no event of the queue is due. The caller
    /// [puts back](Traffic::put_back) what it does not take of the group.
    #[inline(always)]
    pub(super) fn pop_group(&mut self, until: Instant) -> Option<Group<P>> {
        let is_due = self.groups.next_at().is_some_and(|at| at <= until);
        if is_due && (self.pending.len() == 0 || self.pending.due_key(until).is_none()) { self.groups.take_group() } else { None }
    }

    /// Returns whether no group is due at `until`, an instant from [`Traffic::until`], and the queue is a calendar, so that due events can be taken by
    /// [`Traffic::take_some`].
    #[inline(always)]
    pub(super) fn has_only_singles(&self, until: Instant) -> bool {
        !self.pending.is_in_order() && self.groups.next_at().is_none_or(|at| at > until)
    }

    /// Returns whether events are due at `until`, if [only single events](Traffic::has_only_singles) can be due.
    #[inline(always)]
    pub(super) fn has_singles_due(&mut self, until: Instant) -> bool {
        self.pending.is_due(until)
    }

    /// Takes events that [are due](Traffic::has_singles_due): see [`Queue::take_some_due`].
    #[inline(always)]
    pub(super) fn take_some<T>(&mut self, until: Instant, take: impl FnMut(Pending<P>) -> ControlFlow<T>) -> Option<T> {
        self.pending.take_some_due(until, take)
    }

    /// Puts back the rest of a group from [`Traffic::pop_group`].
    #[cold]
    pub(super) fn put_back(&mut self, group: Group<P>) {
        self.groups.put_back(group);
    }

    /// Appends a packet that was dropped at its offer.
    pub(super) fn push_dropped(&mut self, event: PacketEvent<P, Path>) {
        self.first_dropped = self.first_dropped.min(event.at);
        self.dropped.push_back(event);
    }

    /// Removes and returns the first packet that was dropped at its offer.
    pub(super) fn pop_dropped(&mut self) -> Option<PacketEvent<P, Path>> {
        let event = self.dropped.pop_front()?;
        self.first_dropped = self.dropped.front().map_or(Instant::MAX, |next| next.at);
        Some(event)
    }

    /// Lets the packets of a group leave their links at the same instant.
    pub(super) fn schedule_group(&mut self, mut group: Group<P>) {
        // A driver that awaits single receivers is told of each packet.
        if !group.is_single() && self.awaited.is_none() && self.groups.takes(&group) {
            return self.groups.push(group);
        }
        while let Some((link, packet)) = group.pop() {
            self.schedule(group.at, LineId::Link(link), packet);
        }
    }

    /// Lets a packet leave `line` at `at`: the packet propagates until then.
    #[inline(always)]
    pub(super) fn schedule(&mut self, at: Instant, line: LineId, packet: InNetwork<P>) {
        let InNetwork { sequence, offered, entered, path, size, payload } = packet;
        if let Some(awaited) = &mut self.awaited {
            // After a relay the packet goes to every receiver of its sender, so any awaited node may be concerned.
            if path.is_to_relay() { awaited.announce(at, line) } else { awaited.schedule(at, path.to) }
        }
        let turn = Turn::arrival(line);
        // `Pending::key` orders the events. Instants and turns differ for nearly all pairs, so the whole key is compared only when both are
        // equal. A closure here would be compiled as a function of its own, with all that it compares written to the stack first.
        let follows = match self.pending.last_in_order() {
            None => true,
            Some(last) if last.at != at => last.at < at,
            Some(last) if last.turn != turn => last.turn < turn,
            Some(last) => last.key() <= (at, turn, sequence, path, size.copy()),
        };
        self.pending.push_made(at, follows, || Pending { at, sequence, offered, entered, turn, path, size, payload: Some(payload) });
    }

    /// Makes the entry of packets that are then [added](Traffic::schedule_shared): see [`Sendings::open`].
    #[inline(never)]
    pub(super) fn open(&mut self, sent: &Sent<'_, P>, first: LinkId, sequence: u64) -> Open {
        self.pending.open_store().open(sent, first, sequence)
    }

    /// Lets the packet of a broadcast to the node `to` leave its link at `at`. [`Traffic::close`] must follow before the next event is taken.
    #[inline(always)]
    pub(super) fn schedule_shared(&mut self, at: Instant, to: NodeId, open: &mut Open) {
        if let Some(awaited) = &mut self.awaited {
            awaited.schedule(at, to);
        }
        self.pending.push_stored(at, open.add(to));
    }

    /// Ends the additions to an entry.
    #[inline(never)]
    pub(super) fn close(&mut self, open: &Open) {
        self.pending.open_store().close(open);
    }

    /// Schedules a wake of the engine of `line` at `at`.
    pub(super) fn announce(&mut self, at: Instant, line: LineId) {
        // A wake may end in an arrival at the same instant.
        if let Some(awaited) = &mut self.awaited {
            awaited.announce(at, line);
        }
        let turn = Turn::waking(line);
        // A wake belongs to no packet, and its path and size are never read.
        let (path, size) = (Path { from: NodeId(0), to: NodeId(0) }, SizeAndMarks::NOTHING);
        self.pending.push(Pending { at, sequence: 0, offered: at, entered: at, turn, path, size, payload: None });
    }

    #[inline(always)]
    pub(super) fn event(&mut self, line: LineId, packet: InNetwork<P>, at: Instant, fate: Fate) -> PacketEvent<P, Path> {
        let damage = self.take_damage(&packet);
        packet.event(line, at, fate, damage)
    }

    #[inline(always)]
    pub(super) fn take_damage(&mut self, packet: &InNetwork<P>) -> Option<Damage> {
        if packet.size.has(SizeAndMarks::DAMAGED) { self.find_damage(packet.path, packet.sequence, packet.size) } else { None }
    }

    pub(super) fn put_damage(&mut self, packet: &InNetwork<P>, damage: Damage) {
        self.damages.insert((packet.path, packet.sequence, packet.size.copy()), damage);
    }

    #[cold]
    fn find_damage(&mut self, path: Path, sequence: u64, size: SizeAndMarks) -> Option<Damage> {
        self.damages.remove(&(path, sequence, size.copy()))
    }
}

/// The way out of one line's engine, into the traffic of the network.
pub(super) struct Exits<'a, P> {
    pub(super) traffic: &'a mut Traffic<P>,
    pub(super) line: LineId,
}

impl<P: Clone> Exits<'_, P> {
    fn marked(&self, packet: InNetwork<P>, copy: u8, marks: &Marks) -> InNetwork<P> {
        let size = packet
            .size
            .with(self.line.copy_bit(), copy == 1)
            .with(SizeAndMarks::MARKED, marks.congestion)
            .with(SizeAndMarks::DAMAGED, marks.damage.is_some())
            .with(SizeAndMarks::DISCARDED_ON_ARRIVAL, marks.discarded_on_arrival);
        // A packet keeps earlier copy bits: each kind of line has a separate bit.
        InNetwork { size, ..packet }
    }
}

impl<P: Clone> Sink<InNetwork<P>> for Exits<'_, P> {
    fn arrives(&mut self, at: Instant, packet: InNetwork<P>, copy: u8, marks: Marks) {
        let packet = self.marked(packet, copy, &marks);
        if let Some(damage) = marks.damage {
            self.traffic.put_damage(&packet, damage);
        }
        self.traffic.schedule(at, self.line, packet);
    }

    fn happened(&mut self, at: Instant, fate: Fate, packet: InNetwork<P>, copy: u8, marks: Marks) {
        let packet = self.marked(packet, copy, &marks);
        // A copy event is not the end of its packet: packet and copy each get a later event, and the damage goes with the last event only.
        let damage = marks.damage.filter(|_| fate.is_end());
        self.traffic.happened.push_back(packet.event(self.line, at, fate, damage));
    }
}
