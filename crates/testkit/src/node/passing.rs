//! Passing of time in a run of nodes: packets arrive, timers go off, and nodes are asked for packets and deadlines.

use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;
use cohaptic_wan::{NodeId, Path};

use super::address::{addresses, place_of};
use super::run::{Does, Ports};
use super::{NodeRun, Packet, Transmit};
use crate::trace::{Happening, Lost};
use crate::wire::{Arrival, Held, Parcel};

impl NodeRun {
    /// Lets the events of the instant `at` happen.
    pub(super) fn pass(&mut self, at: Instant) {
        if self.wire.set_now(at) {
            self.done = 0;
        }
        // Packets that leave a link up to a change are delivered before the next change.
        while self.wire.change_next() {
            self.take_arrivals();
        }
        if self.wire.pass() {
            self.take_arrivals();
            self.hand_over();
        }
        let mut from = 0;
        while let Some(due) = self.deadlines.due(from, self.now()) {
            // The search goes on after the woken node. A node that wants to be woken again at this instant waits for the next step, so every other due node
            // gets a turn.
            from = due + 1;
            let (id, now) = (NodeId::new(due), self.now());
            self.count(Does::Wakes, id);
            self.counts[due].timeouts += 1;
            if let Some(node) = &mut self.nodes[due] {
                self.watched.pulse.begins(due + 1);
                node.handle_timeout(now);
            }
            self.ask(id, Does::Wakes);
        }
        // Packets that the woken nodes sent over links without delay arrive at this instant too.
        self.hand_over();
    }

    /// Asks a node for packets and its deadline. `because` is the cause of the question, for the message of a run that does not end.
    pub(super) fn ask(&mut self, id: NodeId, because: Does) {
        // The node is taken out of the list while its methods run, so that `send` can borrow the run.
        let Some(mut node) = self.nodes[id.index()].take() else { return self.deadlines.set(id.index(), None) };
        let mut sent = 0;
        // The pulse numbers the nodes in their order, from 1.
        self.watched.pulse.begins(id.index() + 1);
        while let Some(transmit) = node.poll_transmit(self.now()) {
            sent += 1;
            // A node that sends a packet per arrived packet answers. A node that sends more than half of all events of this instant in one question never stops
            // sending.
            self.count(if sent > self.patience / 2 { Does::Sends } else { because }, id);
            self.send(id, transmit);
        }
        // A past deadline counts as now, so that late nodes are woken in the order of nodes, however late each node is.
        let deadline = node.poll_timeout().map(|deadline| deadline.max(self.now()));
        self.deadlines.set(id.index(), deadline);
        self.nodes[id.index()] = Some(node);
        self.watched.pulse.returns();
    }

    fn send(&mut self, from: NodeId, transmit: Transmit) {
        self.counts[from.index()].sent += 1;
        let Transmit { to: address, from_port, bytes, ecn } = transmit;
        let Some(to) = place_of(address.ip()).filter(|place| *place < self.names.len()).map(NodeId::new) else {
            self.counts[from.index()].unroutable += 1;
            if self.wire.recording().traces {
                let note = format!("{} sent {} bytes to {address}, which is no node's address", self.names[from.index()], bytes.len());
                self.wire.note(Happening::Note(note));
            }
            return;
        };
        let addresses = Ports { from: from_port, to: address.port(), is_six: address.is_ipv6() };
        let parcel = Parcel::new(addresses, bytes.into(), ecn);
        let path = Path { from, to };
        if to == from {
            // The packet does not leave the node, so it meets no link.
            self.wire.held.add(Held::cost(parcel.bytes.len()));
            self.arrive(path, parcel, false);
        } else {
            match self.wire.offer(path, Box::new(parcel)) {
                // A link without delay delivers within the offer.
                Ok(_) => self.take_arrivals(),
                // Only a path that is cut refuses a packet.
                Err(_) => self.counts[from.index()].cut += 1,
            }
        }
        if self.wire.held.is_too_much() {
            let handed_over = self.arrived.iter().map(|(_, packet)| Held::cost(packet.bytes.len())).sum();
            self.wire.held.fail(format_args!("node `{}`", self.names[from.index()]), handed_over);
        }
    }

    /// Takes the packets that have come out of the links, for the later hand-over.
    pub(super) fn take_arrivals(&mut self) {
        while let Some(parcel) = self.wire.poll() {
            let Arrival { packet, at, marked, is_cut } = parcel.arrival;
            let Path { from, to } = packet.path;
            let why = if is_cut {
                self.counts[from.index()].cut += 1;
                Lost::Cut
            } else if !self.up[to.index()] {
                self.counts[to.index()].while_down += 1;
                Lost::HostDown
            } else {
                self.wire.ends(packet, at, Ok(()));
                self.arrive(packet.path, *parcel, marked);
                continue;
            };
            self.wire.held.remove(Held::cost(parcel.bytes.len()));
            self.wire.ends(packet, at, Err(why));
        }
    }

    fn arrive(&mut self, Path { from, to }: Path, parcel: Parcel<Ports>, marked: bool) {
        let Parcel { addresses: ports, bytes, .. } = parcel;
        let address = |node: NodeId, port: u16| {
            let addresses = addresses(node.index());
            let ip = if ports.is_six { addresses.v6.into() } else { addresses.v4.into() };
            std::net::SocketAddr::new(ip, port)
        };
        self.arrived.push_back((to, Packet { from: address(from, ports.from), to: address(to, ports.to), bytes: bytes.into(), marked }));
    }

    /// Hands arrived packets over, in the order of arrival, with packets that arrive at once as a consequence.
    pub(super) fn hand_over(&mut self) {
        // Over links without delay `ask` appends packets to `arrived`. The loop hands these packets over at the same instant.
        while let Some((to, packet)) = self.arrived.pop_front() {
            self.wire.held.remove(Held::cost(packet.bytes.len()));
            self.count(Does::Receives, to);
            self.counts[to.index()].arrived += 1;
            if let Some(node) = &mut self.nodes[to.index()] {
                self.watched.pulse.begins(to.index() + 1);
                node.handle_packet(self.wire.now(), packet);
            }
            self.ask(to, Does::Receives);
        }
    }

    /// Counts an event of the present instant. Fails the run beyond the patience.
    #[inline]
    fn count(&mut self, does: Does, node: NodeId) {
        self.done += 1;
        if self.done > self.patience {
            self.give_up(does, node);
        }
    }

    #[cold]
    #[expect(clippy::panic, reason = "time cannot pass; says why, and the way out")]
    fn give_up(&self, does: Does, node: NodeId) -> ! {
        let what = match does {
            Does::Sends => "sends without end: `poll_transmit` must give `None` when there is nothing more to send now",
            Does::Receives => "answers without end over links without delay: give the links a delay, or let the nodes stop",
            Does::Wakes => "wants to be woken again and again: after `handle_timeout`, `poll_timeout` must give a later instant, or `None`",
        };
        panic!(
            "time stands still at {} s after {} packets and timers: node `{}` {what}",
            Seconds(self.now()),
            self.patience,
            self.names[node.index()]
        );
    }
}
