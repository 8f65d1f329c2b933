//! The way of a packet from line to line, until the packet arrives or is dropped.
//!
//! The usual way of packets is `#[inline(always)]`, from the call with the packet to the queue of events and back, and rare branches are `#[inline(never)]` or
//! `#[cold]`. The crate with the type of the payload then compiles the usual way as one function. `benches/benches/mesh.rs` measures the speed.

use cohaptic_units::Instant;

use super::Network;
use super::id::Path;
use super::pending::{InNetwork, LineId, Pending, SizeAndMarks};
use super::traffic::Exits;
use crate::fates::fate::{DropCause, Fate};
use crate::fates::record::PacketEvent;
use crate::line::Line;
use crate::line::filter::Offered;
use crate::line::pipeline::Outcome;
use crate::packet::{Marks, Outputs};

impl<P: Clone> Network<P> {
    /// Lets all events due by `now` happen, and keeps the final arrivals in `happened` for the poll.
    #[inline]
    pub(super) fn let_happen(&mut self, now: Instant) {
        while let Some(pending) = self.traffic.pop_due(now) {
            if let Some(event) = self.happen(pending) {
                self.traffic.happened.push_back(event);
            }
        }
    }

    /// Lets everything due happen before an event is appended at `now`, mere arrivals included. Networks with inner events have done so at the offer of the
    /// packet. In networks without inner events arrivals wait in `pending` for the poll, and `pending` orders events of one instant by link. The order of
    /// waiting arrivals among events of the present instant would depend on a poll of the driver in between, and on inner events of another link of the
    /// network.
    #[inline(always)]
    pub(super) fn settle(&mut self, now: Instant) {
        if !self.has_inner_events && self.traffic.quiet_until() <= now {
            self.settle_all(now);
        }
    }

    #[inline(never)]
    fn settle_all(&mut self, now: Instant) {
        self.let_happen(now);
        // Arrivals later than a dropped packet come after the packet.
        while let Some(dropped) = self.traffic.pop_dropped() {
            self.traffic.happened.push_back(dropped);
            self.let_happen(now);
        }
    }

    /// Settles due events if a packet is offered and arrives at `now`. Any other arrival is later than all due events.
    #[inline(always)]
    pub(super) fn settle_before(&mut self, at: Instant, now: Instant) {
        if at <= now {
            self.settle(now);
        }
    }

    /// Lets one pending event happen, and returns the arrival if the packet has left its last line.
    #[inline(always)]
    pub(super) fn happen(&mut self, pending: Pending<P>) -> Option<PacketEvent<P, Path>> {
        let Pending { at, sequence, offered, entered, turn, path, size, payload } = pending;
        let line = turn.line();
        let Some(payload) = payload else {
            self.wake(at, line);
            return None;
        };
        let packet = InNetwork { sequence, offered, entered, path, size, payload };
        let next = match line {
            // The packet has no receiver yet. `relay` makes a packet for each receiver.
            LineId::Uplink(_) if path.is_to_relay() => {
                // The delivery is counted on the uplink once, whatever the number of receivers.
                self.lines.get_mut(line).deliver(entered, at);
                self.relay(at, packet);
                return None;
            }
            LineId::Uplink(_) => Some(LineId::Link(self.link(path))),
            LineId::Link(_) if self.has_inner_events && self.lines.downlinks[path.to.index()].is_some() => Some(LineId::Downlink(path.to)),
            LineId::Link(_) | LineId::Downlink(_) => None,
        };
        // The left line has delivered the packet, whatever the next line does.
        let Some(next) = next else { return Some(self.arrive(at, line, packet)) };
        self.lines.get_mut(line).deliver(entered, at);
        self.offer(at, next, || InNetwork { entered: at, ..packet });
        None
    }

    /// Ends the way of a packet after the last line: counts and returns the delivery, or the drop of a packet discarded on arrival.
    #[inline(always)]
    fn arrive(&mut self, at: Instant, line: LineId, packet: InNetwork<P>) -> PacketEvent<P, Path> {
        let last = self.lines.get_mut(line);
        // A checksum is a matter of the receiver: the packet takes its full way before the drop.
        if packet.size.has(SizeAndMarks::DISCARDED_ON_ARRIVAL) {
            last.drop(DropCause::Checksum);
            return self.traffic.event(line, packet, at, Fate::Dropped(DropCause::Checksum));
        }
        last.deliver(packet.entered, at);
        if packet.size.has(SizeAndMarks::TRAIN) {
            last.deliver_further(packet.size.further_packets(), packet.entered, at);
        }
        self.traffic.event(line, packet, at, Fate::Delivered(at))
    }

    #[cold]
    fn wake(&mut self, at: Instant, line: LineId) {
        self.with_engine(line, |line, outputs, exits| line.wake(at, outputs, exits));
    }

    /// Offers a packet to its link in a network without uplinks.
    #[inline(always)]
    pub(super) fn send(&mut self, now: Instant, path: Path, size: SizeAndMarks, payload: P) {
        let (link, place) = self.link_and_place(path);
        // As if the packets of a broadcast were sent singly: an arrival of an earlier packet at `now` comes before the events of this packet. After `let_pass`,
        // because the link may just have been made, and may have switched the network to inner events.
        if self.has_inner_events && self.traffic.quiet_until() <= now {
            self.let_happen(now);
        }
        let sequence = self.lines.links[place].offered();
        self.offer(now, LineId::Link(link), || InNetwork { sequence, offered: now, entered: now, path, size, payload });
    }

    /// Offers a packet to a line. `packet` is called only in the branch that needs the packet, so a packet in mere propagation is written once, into the event
    /// queue.
    #[inline(always)]
    pub(super) fn offer(&mut self, now: Instant, line: LineId, packet: impl FnOnce() -> InNetwork<P>) {
        if self.has_filters {
            return self.offer_filtered(now, line, packet());
        }
        let outcome = self.lines.get_mut(line).offer(now, None);
        self.decided(now, line, outcome, packet);
    }

    /// Lets happen what a line has decided about a packet that was offered to it.
    #[inline(always)]
    pub(super) fn decided(&mut self, now: Instant, line: LineId, outcome: Outcome, packet: impl FnOnce() -> InNetwork<P>) {
        match outcome {
            Outcome::Arrives(at) => {
                self.settle_before(at, now);
                self.traffic.schedule(at, line, packet());
            }
            Outcome::Dropped(cause) => self.drop(now, line, cause, packet()),
            Outcome::Enters => self.enter_engine(now, line, packet()),
        }
    }

    /// Offers a packet like [`Network::offer`], in a network with filters.
    #[inline(never)]
    fn offer_filtered(&mut self, now: Instant, line: LineId, packet: InNetwork<P>) {
        // A filter stands before all stages of its line.
        if self.is_filtered(now, line, &packet) {
            return self.drop(now, line, DropCause::Filter, packet);
        }
        let outcome = self.lines.get_mut(line).offer(now, None);
        self.decided(now, line, outcome, || packet);
    }

    /// Returns whether the line's filter drops the packet.
    fn is_filtered(&mut self, now: Instant, line: LineId, packet: &InNetwork<P>) -> bool {
        let offered = Offered { sequence: packet.sequence, now, info: packet.size.info(), payload: &packet.payload };
        self.lines.get_mut(line).filters(&offered)
    }

    #[inline(never)]
    pub(super) fn enter_engine(&mut self, now: Instant, line: LineId, packet: InNetwork<P>) {
        // Marks of earlier lines travel with the packet, so the engine can add to them.
        let marks = Marks {
            congestion: packet.size.has(SizeAndMarks::MARKED),
            damage: self.traffic.take_damage(&packet),
            discarded_on_arrival: packet.size.has(SizeAndMarks::DISCARDED_ON_ARRIVAL),
        };
        let flow = match self.flows {
            Some(flow) => flow(packet.path, &packet.payload),
            // On every line either the sender or the receiver is the same for all packets, so the sum differs for different pairs.
            None => u32::from(packet.path.from.0) + u32::from(packet.path.to.0),
        };
        self.with_engine(line, |line, outputs, exits| line.enter(now, (packet.size.info(), flow), marks, packet, outputs, exits));
    }

    /// Lets `act` act on the engine of a line, and schedules the announced wake of the engine.
    pub(super) fn with_engine(&mut self, line: LineId, act: impl FnOnce(&mut Line<P, InNetwork<P>>, &mut Outputs<InNetwork<P>>, &mut Exits<'_, P>)) {
        self.settle(self.now);
        let engine = self.lines.get_mut(line);
        act(engine, &mut self.outputs, &mut Exits { traffic: &mut self.traffic, line });
        // An engine announces a wake only once, so the queue holds no second wake for the same instant.
        if let Some(at) = engine.announce() {
            self.traffic.announce(at, line);
        }
    }

    /// Counts and reports a packet dropped at its offer.
    #[inline(never)]
    pub(super) fn drop(&mut self, now: Instant, line: LineId, cause: DropCause, packet: InNetwork<P>) {
        self.lines.get_mut(line).drop(cause);
        let event = self.traffic.event(line, packet, now, Fate::Dropped(cause));
        // With inner events, everything due by `now` has happened at the offer. Without, arrivals that are due wait for the poll.
        if self.has_inner_events {
            self.traffic.happened.push_back(event);
        } else {
            self.traffic.push_dropped(event);
        }
    }
}
