//! Time passes: packets arrive, timers go off, and nodes are asked what they want.

use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;
use cohaptic_wan::{Fate, PacketEvent, PacketInfo, Path};

use super::address::{addresses, place_of};
use super::run::Parcel;
use super::{NodeRun, Packet, Transmit};
use crate::core::{network_node, seen};
use crate::seed::hash;
use crate::trace::{Happening, Lost, PacketName};

/// What a node does that keeps time from passing.
#[derive(Clone, Copy, Debug)]
pub(super) enum Does {
    Sends,
    Receives,
    Wakes,
}

impl NodeRun {
    /// Lets happen what is due at an instant.
    pub(super) fn pass(&mut self, at: Instant) {
        if at > self.now {
            self.now = at;
            self.done = 0;
        }
        while self.changes.front().is_some_and(|change| change.at <= at) {
            if let Some(change) = self.changes.pop_front() {
                self.change_link(change.from, change.to, change.link);
            }
        }
        if self.network.poll_timeout().is_some_and(|at| at <= self.now) {
            let passed = self.network.handle_timeout(self.now);
            debug_assert_eq!(passed, Ok(()), "time does not go back");
            self.take_events();
            self.hand_over();
        }
        let mut from = 0;
        while let Some(place) = self.deadlines.due(from, self.now) {
            from = place + 1;
            self.count(Does::Wakes, place);
            self.counts[place].timeouts += 1;
            if let Some(node) = &mut self.nodes[place] {
                node.handle_timeout(self.now);
            }
            self.ask(place, Does::Wakes);
        }
        self.hand_over();
    }

    /// Asks a node what it wants to send, and when it wants to be woken; `because` of what it is asked.
    pub(super) fn ask(&mut self, place: usize, because: Does) {
        let Some(mut node) = self.nodes[place].take() else { return self.deadlines.set(place, None) };
        let mut sent = 0;
        while let Some(transmit) = node.poll_transmit(self.now) {
            sent += 1;
            // Who sends one packet for each that comes answers; who sends most of all that is done now, asked but once, never ends to send.
            self.count(if sent > self.patience / 2 { Does::Sends } else { because }, place);
            self.send(place, transmit);
        }
        // What is late is due now: so that nodes are woken in their order, however late they are.
        let deadline = node.poll_timeout().map(|deadline| deadline.max(self.now));
        self.deadlines.set(place, deadline);
        self.nodes[place] = Some(node);
    }

    fn send(&mut self, from: usize, transmit: Transmit) {
        self.counts[from].sent += 1;
        let Transmit { to: address, from_port, bytes, ecn_capable } = transmit;
        let Some(to) = place_of(address.ip()).filter(|place| *place < self.names.len()) else {
            self.counts[from].unroutable += 1;
            if self.traces {
                let note = format!("{} sent {} bytes to {address}, which is no node's address", self.names[from], bytes.len());
                self.recording.note(self.now, Happening::Note(note));
            }
            return;
        };
        let parcel = Parcel { from_port, to_port: address.port(), is_six: address.is_ipv6(), bytes };
        if to == from {
            // It does not leave the node, and so meets no link.
            return self.arrive(from, to, parcel, false);
        }
        let pair = from * self.names.len() + to;
        let packet = PacketName { from, to, sequence: self.offered[pair], copy: 0 };
        if self.cut[pair] {
            // It does not reach the link, so that it uses up none of the link's numbers.
            self.counts[from].cut += 1;
            return self.recording.note(self.now, Happening::Lost { packet, why: Lost::Cut });
        }
        if self.traces {
            let digest = hash(&parcel.bytes);
            self.recording.note(self.now, Happening::Sent { packet, len: parcel.bytes.len(), digest });
        }
        self.offered[pair] += 1;
        let info = PacketInfo { size: cohaptic_units::Bytes::new(parcel.bytes.len() as u64), ecn_capable };
        let offered = self.network.handle_packet(self.now, network_node(from), network_node(to), info, parcel);
        debug_assert_eq!(offered, Ok(()), "both are nodes, and time does not go back");
        self.take_events();
    }

    /// Deals with what has come out of the links.
    pub(super) fn take_events(&mut self) {
        while let Some(event) = self.network.poll_event() {
            let (from, to) = (event.path.from.index(), event.path.to.index());
            self.recording.keep(|| seen(&event, event.payload.bytes.clone()));
            let packet = PacketName { from, to, sequence: event.sequence, copy: event.copy >> 1 };
            match event.fate {
                Fate::Delivered(at) => {
                    if self.cut[from * self.names.len() + to] {
                        self.counts[from].cut += 1;
                        self.recording.note(at, Happening::Lost { packet, why: Lost::Cut });
                    } else if !self.up[to] {
                        self.counts[to].while_down += 1;
                        self.recording.note(at, Happening::Lost { packet, why: Lost::HostDown });
                    } else {
                        self.recording.note(at, Happening::Arrived { packet });
                        let marked = event.marked;
                        self.arrive(from, to, as_received(event), marked);
                    }
                }
                Fate::Dropped(cause) => self.recording.note(event.at, Happening::Lost { packet, why: Lost::Link(cause) }),
                Fate::Duplicated => self.recording.note(event.at, Happening::Copied { packet }),
            }
        }
    }

    fn arrive(&mut self, from: usize, to: usize, parcel: Parcel, marked: bool) {
        let Parcel { from_port, to_port, is_six, bytes } = parcel;
        let address = |place: usize, port: u16| {
            let addresses = addresses(place);
            let ip = if is_six { addresses.v6.into() } else { addresses.v4.into() };
            std::net::SocketAddr::new(ip, port)
        };
        self.arrived.push_back((to, Packet { from: address(from, from_port), to: address(to, to_port), bytes, marked }));
    }

    /// Hands over what has arrived, in its order, and what arrives at once because of it.
    pub(super) fn hand_over(&mut self) {
        while let Some((to, packet)) = self.arrived.pop_front() {
            self.count(Does::Receives, to);
            self.counts[to].arrived += 1;
            if let Some(node) = &mut self.nodes[to] {
                node.handle_packet(self.now, packet);
            }
            self.ask(to, Does::Receives);
        }
    }

    /// Counts what is done at one instant.
    #[inline]
    fn count(&mut self, does: Does, place: usize) {
        self.done += 1;
        if self.done > self.patience {
            self.give_up(does, place);
        }
    }

    #[cold]
    #[expect(clippy::panic, reason = "time cannot pass; says why, and the way out")]
    fn give_up(&self, does: Does, place: usize) -> ! {
        let what = match does {
            Does::Sends => "sends without end: `poll_transmit` must give `None` when there is nothing more to send now",
            Does::Receives => "answers without end over links without delay: give them one, or let the nodes stop",
            Does::Wakes => "wants to be woken again and again: after `handle_timeout`, `poll_timeout` must name a later instant, or none",
        };
        panic!("time stands still at {} s after {} packets and timers: node `{}` {what}", Seconds(self.now), self.patience, self.names[place]);
    }
}

/// What a packet carries, with the damage that was done to it.
fn as_received(event: PacketEvent<Parcel, Path>) -> Parcel {
    let mut parcel = event.payload;
    if let Some(damage) = &event.damage {
        // A copy of it may be on its way still, undamaged.
        let mut bytes = Vec::from(parcel.bytes);
        damage.apply(&mut bytes);
        parcel.bytes = bytes.into();
    }
    parcel
}
