//! Way of a TCP segment, from its connection to the link and from the link to a connection.

use cohaptic_tcp::{Ecn, Flags, Segment, State};
use cohaptic_wan::{NodeId, Path};

use super::trains::Leaving;
use super::{ConnId, Core};
use crate::core::{Ends, Kind, Parcel};
use crate::trace::{Happening, Lost, PacketName};
use crate::wire::{Held, Octets};

impl Core {
    /// Handles a segment that has arrived at `host` in a parcel of its own.
    pub(super) fn arrive_alone(&mut self, host: NodeId, mut parcel: Box<Parcel>) -> Result<(), Lost> {
        self.wire.held.remove(Held::cost(parcel.bytes.len()));
        let end = self.arrive_segment(host, &mut parcel.bytes, parcel.arrival.marked);
        self.spare.put(parcel);
        end
    }

    /// Handles a packet that has arrived at `host`. `marked` tells whether a queue marked the packet.
    fn arrive_segment(&mut self, host: NodeId, packet: &mut Octets, marked: bool) -> Result<(), Lost> {
        if !self.is_up(host) {
            return Err(Lost::HostDown);
        }
        match packet.segment_mut() {
            Some(segment) => self.arrive_whole(host, segment, marked),
            // A packet that a link has damaged.
            None => self.arrive_whole(host, &mut Segment::parse(packet).map_err(|_| Lost::Checksum)?, marked),
        }
    }

    /// Handles a segment that has arrived whole, whose connection takes the data.
    pub(super) fn arrive_whole(&mut self, host: NodeId, segment: &mut Segment<'_>, marked: bool) -> Result<(), Lost> {
        if !self.is_own(host, segment.destination.ip()) {
            return Err(Lost::NoSuchAddress);
        }
        if marked && segment.ecn != Ecn::NotCapable {
            segment.ecn = Ecn::Congestion;
        }
        self.route_segment(host, segment)
    }

    /// Hands a segment to its connection or listener, or refuses the segment.
    fn route_segment(&mut self, host: NodeId, segment: &mut Segment<'_>) -> Result<(), Lost> {
        self.forget_old();
        // Only an opening segment may find a listener.
        let listener = if is_first(segment) { self.listener_at(host, segment.destination) } else { None };
        let route = super::route(host, segment.destination, segment.source);
        if let Some(id) = self.tcp.routed(&route) {
            let (now, end) = (self.now(), self.tcp.end(id));
            // While the queue of the listener is full, the ACK that would complete a handshake is dropped, as in Linux. A reset needs no room in the queue.
            if let (Some(waited_at), State::SynReceived, false) = (end.listener, end.machine.state(), segment.flags.has(Flags::RST)) {
                self.check_backlog(waited_at)?;
            }
            let machine = &mut self.tcp.end_mut(id).machine;
            if listener.is_none() || !machine.gives_way_to(segment) {
                machine.take_segment(now, segment);
                self.settle(id);
                return Ok(());
            }
            // A connection in TIME-WAIT gives way to the new connection of the same addresses.
            self.tcp.unroute(id);
            self.settle(id);
        }
        if let Some(listener) = listener {
            return self.take_syn(listener, segment);
        }
        if let Some(reset) = segment.refusal(self.tcp_config(host).ttl) {
            self.emit(host, reset);
        }
        Err(Lost::NoSocket)
    }

    /// Sends a segment of no connection, such as a refusal. The segment arrives when [`Core::take_arrivals`] is next called, even over a link without delay.
    fn emit(&mut self, host: NodeId, segment: Segment<'static>) {
        let addresses = Ends::new(segment.source, segment.destination, Kind::Segment);
        match self.way(host, &addresses) {
            Way::Loopback => self.tcp.loopback.push_back((host, segment)),
            Way::Nowhere => {}
            Way::On(path) => {
                let parcel = self.spare.wrapped(addresses, segment);
                self.emit_on(path, None, parcel);
            }
        }
    }

    /// Returns the way of the segments of `host` with these addresses.
    pub(super) fn way(&self, host: NodeId, addresses: &Ends) -> Way {
        // Short addresses are compared by their number alone.
        let Ends { from, to, is_six, .. } = *addresses;
        if self.plan.is_own(host, to, is_six) {
            return self.loopback_of(host).map_or(Way::Loopback, Way::On);
        }
        // The segments are lost if the host has given the source address up, or if no host has the destination any more.
        let receiver = self.plan.owner_of(to, is_six).filter(|_| self.plan.has(host, from, is_six));
        receiver.and_then(|to| self.first_hop(Path { from: host, to }, addresses)).map_or(Way::Nowhere, Way::On)
    }

    /// Sends a segment of a NAT or a firewall, which may have the address of a host inside as its source.
    pub(in crate::core) fn emit_from(&mut self, node: NodeId, segment: Segment<'static>) {
        let addresses = Ends::new(segment.source, segment.destination, Kind::Segment);
        let owner = self.plan.owner_of(addresses.to, addresses.is_six);
        if let Some(path) = owner.and_then(|owner| self.first_hop(Path { from: node, to: owner }, &addresses)) {
            let parcel = self.spare.wrapped(addresses, segment);
            self.emit_on(path, None, parcel);
        }
    }

    /// Offers a segment to its link.
    #[inline]
    pub(super) fn emit_on(&mut self, path: Path, connection: Option<ConnId>, parcel: Box<Parcel>) {
        let segment = parcel.bytes.segment().filter(|_| self.wire.recording().traces);
        // The entry is made before the offer, which takes the segment, and noted after the offer, so that the trace has the sending first.
        let happening = segment.map(|segment| self.described(self.wire.next_packet(path), connection, segment));
        // A segment over a path that is cut is lost like any other packet.
        let _ = self.wire.offer(path, parcel);
        happening.into_iter().for_each(|happening| self.wire.note(happening));
    }

    /// Returns the entry of a segment in the trace, with relative numbers. The numbers count from the initial sequence numbers as the connection knows them, or
    /// the connection of the peer if there is no own one; without either the numbers count from zero.
    fn described(&self, packet: PacketName, connection: Option<ConnId>, segment: &Segment<'_>) -> Happening {
        let (first, peers_first, shift) = if let Some(id) = connection {
            let machine = &self.tcp.end(id).machine;
            let (own, peers) = machine.initial_sequences();
            (own, peers.unwrap_or(0), machine.window_shift())
        } else {
            let peer = self.tcp.routes.get(&super::route(self.plan.host_of(self.receiver(packet.path)), segment.destination, segment.source));
            let (peers, own) = peer.map_or((0, None), |id| self.tcp.end(*id).machine.initial_sequences());
            (own.unwrap_or(0), peers, 0)
        };
        // The window of a SYN is never scaled (RFC 7323, section 2.2).
        let shift = if segment.flags.has(Flags::SYN) { 0 } else { shift };
        Happening::Segment {
            packet,
            ports: [segment.source.port(), segment.destination.port()],
            flags: segment.flags,
            sequence: segment.sequence.wrapping_sub(first),
            octets: u32::try_from(segment.payload.len()).unwrap_or(u32::MAX),
            acknowledges: segment.flags.has(Flags::ACK).then(|| segment.acknowledgement.wrapping_sub(peers_first)),
            window: u32::from(segment.window) << shift,
        }
    }

    /// Delivers the next packet of loopback. Returns whether a packet was waiting.
    pub(in crate::core) fn take_from_loopback(&mut self) -> bool {
        let Some((host, mut segment)) = self.tcp.loopback.pop_front() else { return false };
        // Fates of packets are recorded for links only. Loopback is not part of the network.
        let _ = self.arrive_whole(host, &mut segment, false);
        true
    }

    /// Follows up any change of a connection: segments leave, tasks are woken if the change lets them go on, and the timer of the connection is set.
    pub(super) fn settle(&mut self, id: ConnId) {
        let mut leaving = Leaving::default();
        self.transmit(id, &mut leaving);
        self.wake_ends(id);
        self.depart(id, leaving);
        self.follow_up(id);
    }

    /// Wakes the tasks that wait for the connection, if the connection lets them go on.
    #[inline]
    pub(super) fn wake_ends(&mut self, id: ConnId) {
        let end = self.tcp.connections.get_mut(id.0);
        if !end.readers.is_empty() && end.machine.is_readable() {
            end.readers.wake(&mut self.woken);
        }
        if end.is_write_blocked && end.machine.is_writable() {
            end.is_write_blocked = false;
            end.writers.wake(&mut self.woken);
        }
    }

    /// Follows up the new state of a connection: sets its timer, and removes the connection if it is over.
    pub(super) fn follow_up(&mut self, id: ConnId) {
        let now = self.now();
        self.recount(id);
        let end = self.tcp.connections.get_mut(id.0);
        let (state, listener) = (end.machine.state(), end.listener);
        // The end of TIME-WAIT has no visible effect, so TIME-WAIT has no timer.
        let due = if state == State::TimeWait { None } else { end.machine.poll_timeout() };
        // If nobody has the address, the attempt ends with the search for the owner, earlier than by the retransmissions of the SYN.
        let due = if state == State::SynSent { crate::wire::earlier(due, end.unreachable_at) } else { due };
        if state == State::TimeWait && !end.is_in_time_wait {
            end.is_in_time_wait = true;
            let ends = end.machine.time_wait_ends().unwrap_or(now);
            self.tcp.time_waits.push_back((ends, id));
        }
        self.tcp.set_timer(id, due);
        if let Some(listener) = listener {
            if state.is_synchronised() {
                self.wait_to_be_taken(listener, id);
            } else if state == State::Closed && self.tcp.listeners.get_mut(listener.0).half_open.remove(&id) {
                // A connection whose handshake has failed belongs to no listener any more. A connection in the queue of the listener stays there even if it is
                // closed by now.
                self.tcp.end_mut(id).listener = None;
            }
        }
        self.forget_if_over(id);
    }

    /// Takes a connection that is over out of the routes, and removes the connection when neither a stream nor a listener holds it.
    pub(super) fn forget_if_over(&mut self, id: ConnId) {
        let end = self.tcp.end(id);
        if !end.machine.is_finished() {
            return;
        }
        if end.is_held || end.listener.is_some() { self.tcp.unroute(id) } else { self.remove_connection(id) }
    }
}

/// Way of the segments from one address to another.
#[derive(Clone, Copy, Debug)]
pub(super) enum Way {
    /// Over the loopback of the host, without a link.
    Loopback,
    /// The segments are lost.
    Nowhere,
    On(Path),
}

/// Returns whether a segment opens a connection.
fn is_first(segment: &Segment<'_>) -> bool {
    segment.flags.has(Flags::SYN) && !segment.flags.has(Flags::ACK) && !segment.flags.has(Flags::RST)
}
