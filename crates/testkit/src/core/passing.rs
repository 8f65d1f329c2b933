//! Way of a datagram from the sending socket into its link, and from the link to the receiving socket.

use std::io;
use std::net::{IpAddr, SocketAddr};
use std::num::NonZeroU8;

use cohaptic_units::Ecn;
use cohaptic_wan::{NodeId, Path};

use super::socket_state::SocketState;
use super::{Core, Ends, Kind, Parcel, SocketId};
use crate::address::Addresses;
use crate::errno::Errno;
use crate::groups::Group;
use crate::trace::Lost;
use crate::wire::{Arrival, Held};

/// Longest datagram over IPv4 and over IPv6 \[bytes\].
const LONGEST: [usize; 2] = [65_507, 65_527];

#[cold]
const fn is_too_long(len: usize, is_six: bool) -> bool {
    len > LONGEST[is_six as usize]
}

/// Datagram that a socket sends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outgoing<'a> {
    /// Address of the receiver. `None` stands for the peer of a connected socket.
    pub(crate) to: Option<&'a SocketAddr>,
    /// Address of the host from which this datagram leaves. `None` stands for the address of the socket.
    pub(crate) from: Option<IpAddr>,
    pub(crate) bytes: &'a [u8],
    /// ECN codepoint of the datagram.
    pub(crate) ecn: Ecn,
}

/// Receivers of a datagram.
#[derive(Clone, Copy, Debug)]
enum Receivers {
    /// A single host, which may be the sender itself.
    One,
    /// All hosts, the sender included.
    All,
    /// The members of a multicast group in the network of the sender.
    Group,
    /// No host: the datagram is lost without an error, as in a real network.
    Nobody,
}

/// Way of a datagram through the network.
#[derive(Clone, Copy, Debug)]
pub(super) struct Route {
    /// Address of the sender, as [`Addresses::short`].
    from: u32,
    /// Address on the packet, as [`Addresses::short`]. Differs from the address of the program's call if the latter is unspecified.
    pub(super) to: u32,
    /// Flags and scope, if the receivers are a group of IPv6.
    scope: Option<NonZeroU8>,
    receivers: Receivers,
}

impl Core {
    /// Sends a datagram at the present instant.
    #[inline(always)]
    pub(crate) fn send(&mut self, id: SocketId, Outgoing { to, from, bytes, ecn }: Outgoing<'_>) -> io::Result<()> {
        self.note_call(|core| core.sockets.get(id).name());
        let socket = self.sockets.get(id);
        if socket.has_error() {
            return Err(self.error_of(id));
        }
        let Some(to) = to.or(socket.peer.as_ref()) else { return Errno::NoDestination.fail() };
        // The address is read in its place: copies of an address take more instructions than the search of the receiver.
        let other_form;
        let to = if socket.is_wire_form(to) {
            to
        } else {
            other_form = socket.wire_form(*to)?;
            &other_form
        };
        let (number, to_port, is_six) = match to {
            SocketAddr::V4(to) => (Addresses::short(IpAddr::V4(*to.ip())), to.port(), false),
            SocketAddr::V6(to) => (Addresses::short(IpAddr::V6(*to.ip())), to.port(), true),
        };
        if to_port == 0 {
            return Errno::InvalidInput.fail();
        }
        if bytes.len() > LONGEST[0] && is_too_long(bytes.len(), is_six) {
            return Errno::TooLong.fail();
        }
        let (host, from_port) = (socket.host, socket.port.number());
        let at = match from {
            None => socket.source_at(),
            Some(from) => Some(self.named_source(host, from, is_six)?),
        };
        match self.plan.owner_of(number, is_six) {
            Some(receiver) if receiver != host => {
                let from = self.source_to_host(host, at, number, to)?;
                let parcel = self.spare.copied(Ends::of([from, number], [from_port, to_port], is_six, Kind::Datagram), bytes, ecn);
                self.offer(Path { from: host, to: receiver }, parcel);
            }
            _ => {
                let route = self.route(socket, at, to)?;
                self.send_within(id, route, [from_port, to_port], is_six, bytes, ecn);
            }
        }
        // The check comes after the sending: a packet that arrives at once and is read or lost is not held any more.
        if self.wire.held.is_too_much() {
            self.fail_for(self.sockets.get(id).name());
        }
        Ok(())
    }

    /// Sends a datagram that does not go to another host alone: to its own host, to all hosts, or to nobody.
    #[inline(never)]
    fn send_within(&mut self, id: SocketId, route: Route, ports: [u16; 2], is_six: bool, bytes: &[u8], ecn: Ecn) {
        let Route { from, to, scope, receivers } = route;
        let host = self.sockets.get(id).host;
        let ends = Ends { scope, ..Ends::of([from, to], ports, is_six, Kind::Datagram) };
        let parcel = self.spare.copied(ends, bytes, ecn);
        match receivers {
            Receivers::One => self.hand_over(host, parcel),
            Receivers::All => {
                // The receiver of the link of a loopback is the sender.
                let paths = (0..self.hosts.len()).map(|other| Path { from: host, to: NodeId::new(other) });
                // The paths are collected first, because an offer changes the state that the filter reads.
                for path in paths.filter(|path| self.receiver(*path) != host).collect::<Vec<_>>() {
                    self.offer(path, parcel.clone());
                }
                // Sockets of the sender hear a broadcast as well, over loopback.
                self.hand_over(host, parcel);
            }
            Receivers::Group => self.send_to_group(id, host, parcel),
            Receivers::Nobody => self.spare.put(parcel),
        }
    }

    /// Returns the source address that a program names for one datagram, as [`Addresses::short`].
    ///
    /// # Errors
    ///
    /// `EINVAL`, as with Linux, for an address that the host does not have, and for the other version of IP.
    #[cold]
    fn named_source(&self, host: NodeId, from: IpAddr, is_six: bool) -> io::Result<u32> {
        let short = Addresses::short(from);
        if from.is_ipv6() == is_six && self.plan.is_own(host, short, is_six) { Ok(short) } else { Errno::InvalidInput.fail() }
    }

    /// Returns the way of a datagram of `socket`, sent from `at`, to the address `to`, which the socket can send to. `at` is as in [`Core::source`].
    ///
    /// # Errors
    ///
    /// If the network cannot be reached from the address of the socket, or the socket may not broadcast.
    #[inline(never)]
    pub(super) fn route(&self, socket: &SocketState, at: Option<u32>, to: &SocketAddr) -> io::Result<Route> {
        // An address of a host belongs to no other kind of address. Most datagrams go to such an address, so the other kinds are tried only afterwards.
        let mut number = Addresses::short(to.ip());
        if self.plan.owner_of(number, to.is_ipv6()).is_some() {
            return Ok(Route { from: self.source_to_host(socket.host, at, number, to)?, to: number, scope: None, receivers: Receivers::One });
        }
        if to.ip().is_multicast() {
            let group = Group::parse(to.ip())?;
            let zone = if let SocketAddr::V6(to) = to { to.scope_id() } else { 0 };
            let from = self.source_to_group(socket, at, group, zone)?;
            return Ok(Route { from, to: group.short, scope: group.scope, receivers: Receivers::Group });
        }
        let receivers = self.other_receivers(socket.host, to, &mut number)?;
        let from = self.source(socket.host, at, number, to)?;
        if matches!(receivers, Receivers::All) && !socket.may_broadcast {
            return Errno::PermissionDenied.fail();
        }
        Ok(Route { from, to: number, scope: None, receivers })
    }

    /// Returns the source address of a socket at `at` that sends to the address `number` of a host, given by the program as `to`. Unlike with [`Core::source`], the
    /// address is no address of loopback.
    #[inline(always)]
    fn source_to_host(&self, host: NodeId, at: Option<u32>, number: u32, to: &SocketAddr) -> io::Result<u32> {
        match at {
            None => Ok(self.plan.short(host, to.is_ipv6())),
            // As with Linux, the address of a group is no source.
            Some(at) if !to.is_ipv6() && Addresses::is_multicast(at) => Ok(self.plan.short(host, false)),
            Some(at) => self.check_source(host, at, number, to.is_ipv6()).map(|()| at),
        }
    }

    /// Returns the receivers of a datagram to an address that no host has. Sets `number` to the address on the packet, which differs for the
    /// unspecified address.
    fn other_receivers(&self, host: NodeId, to: &SocketAddr, number: &mut u32) -> io::Result<Receivers> {
        let ip = to.ip();
        if ip.is_unspecified() {
            *number = Addresses::LOOPBACK[usize::from(ip.is_ipv6())];
            return Ok(Receivers::One);
        }
        if ip.is_loopback() {
            return Ok(Receivers::One);
        }
        if ip.is_ipv4() && Addresses::is_broadcast(*number) {
            return Ok(Receivers::All);
        }
        // The network of the hosts swallows a datagram to an address without a host, as a real network does. To other networks there is no route.
        if self.is_reachable(host, ip) { Ok(Receivers::Nobody) } else { Errno::NetworkUnreachable.fail() }
    }

    /// Returns the source address of a socket that sends to the address `number`, given by the program as `to`. `at` is the address at which the socket is
    /// bound, `None` for all addresses. `at`, `number` and the result are as [`Addresses::short`].
    pub(super) fn source(&self, host: NodeId, at: Option<u32>, number: u32, to: &SocketAddr) -> io::Result<u32> {
        match at {
            None => Ok(self.source_to(host, number, to.is_ipv6())),
            Some(at) if !to.is_ipv6() && Addresses::is_multicast(at) => Ok(self.source_to(host, number, false)),
            Some(at) => self.check_source(host, at, number, to.is_ipv6()).map(|()| at),
        }
    }

    /// Returns the source address of a socket that is bound to no address and sends to the address `number`. As with Linux, 127.0.0.1 is the source also for
    /// the other addresses of loopback.
    pub(super) fn source_to(&self, host: NodeId, number: u32, is_six: bool) -> u32 {
        if Addresses::is_loopback(number, is_six) { Addresses::LOOPBACK[usize::from(is_six)] } else { self.plan.short(host, is_six) }
    }

    /// Checks that a socket bound to the address `at` can send to the address `number`.
    #[inline(never)]
    pub(super) fn check_source(&self, host: NodeId, at: u32, number: u32, is_six: bool) -> io::Result<()> {
        let (addresses, bound) = (self.plan.of(host), Addresses::long(at, is_six));
        let is_owned = self.plan.has(host, at, is_six);
        // As with Linux, a socket at 127.0.0.1 or `::1` reaches its own host alone.
        let stays = Addresses::is_loopback(number, is_six) || self.plan.has(host, number, is_six);
        if bound.is_loopback() && !stays {
            return Errno::InvalidInput.fail();
        }
        if !bound.is_loopback() && !is_owned {
            let text = format!(
                "host `{}` no longer has the address {bound}; it has {}. Bind a new socket",
                self.plan.names()[host.index()],
                addresses.like(bound)
            );
            return Err(io::Error::new(io::ErrorKind::AddrNotAvailable, text));
        }
        Ok(())
    }

    /// Hands a packet to its link, and delivers the packets that arrive at once.
    #[inline(always)]
    pub(super) fn offer(&mut self, path: Path, parcel: Box<Parcel>) {
        if self.wire.is_watched() {
            return self.offer_watched(path, parcel);
        }
        if self.wire.offer(path, parcel) == Ok(true) {
            self.take_arrivals();
        }
    }

    /// Like [`Core::offer`], in a run that may have NATs: the packet goes to the first node on the way. A packet to an address to which no way leads is lost
    /// without an error, as in a real network.
    #[inline(never)]
    fn offer_watched(&mut self, path: Path, parcel: Box<Parcel>) {
        let Some(path) = self.first_hop(path, &parcel.addresses) else { return self.spare.put(parcel) };
        if self.wire.offer(path, parcel) == Ok(true) {
            self.take_arrivals();
        }
    }
}

impl Core {
    /// Delivers all packets that have come out of the links.
    #[cfg_attr(not(feature = "tcp"), expect(clippy::never_loop, reason = "only TCP has packets that do not leave their host"))]
    pub(super) fn take_arrivals(&mut self) {
        loop {
            while let Some(parcel) = self.wire.poll() {
                if self.wire.is_watched() {
                    self.take_watched(parcel);
                } else {
                    let path = parcel.arrival.packet.path;
                    let _ = self.arrive(Path { to: self.receiver(path), ..path }, parcel);
                }
            }
            #[cfg(feature = "tcp")]
            // A packet of loopback may let packets leave over links without delay, so the links are polled again.
            if self.take_from_loopback() {
                continue;
            }
            return;
        }
    }

    /// Delivers a packet that has come out of a link, and records its end.
    #[inline(never)]
    fn take_watched(&mut self, parcel: Box<Parcel>) {
        #[cfg(feature = "tcp")]
        if parcel.followers.is_some() {
            // The train was sent before anything in the run watched packets.
            return self.split(parcel, |core, parcel| core.take_watched(parcel));
        }
        if let Some(parcel) = self.wire.keep_back(parcel) {
            self.take_released(parcel);
        }
    }

    /// Like [`Core::take_watched`], for a packet whose path is not on hold.
    fn take_released(&mut self, parcel: Box<Parcel>) {
        let Arrival { packet, at, is_cut, .. } = parcel.arrival;
        let end = if is_cut {
            self.wire.held.remove(Held::cost(parcel.bytes.len()));
            Err(Lost::Cut)
        } else if self.is_middlebox(packet.path.to) {
            match self.forward(parcel) {
                // The packet has not ended: the trace has it again on the next link.
                Ok(()) => return,
                Err(why) => Err(why),
            }
        } else {
            let host = self.plan.host_of(self.receiver(packet.path));
            self.arrive(Path { to: host, ..packet.path }, parcel)
        };
        self.wire.ends(packet, at, end);
    }

    /// Ends the hold of a path: the packets that have waited arrive now, in the order in which they have come out of the link.
    pub(crate) fn release(&mut self, path: Path) {
        for parcel in self.wire.release(path) {
            self.take_released(parcel);
        }
        // Packets that have gone on through a NAT, and answers over links without delay, arrive before the caller continues.
        self.take_arrivals();
    }

    /// Returns the host at which the packets of a link arrive.
    #[inline]
    pub(super) fn receiver(&self, path: Path) -> NodeId {
        if self.settings.loopback == Some(path) { path.from } else { path.to }
    }

    /// Returns the link for packets of `host` to itself, or `None` if such packets arrive at once.
    pub(super) fn loopback_of(&self, host: NodeId) -> Option<Path> {
        self.settings.loopback.filter(|path| path.from == host)
    }

    /// Delivers a packet that does not leave its host: at the present instant, unless the loopback of the host is a link.
    pub(super) fn hand_over(&mut self, host: NodeId, mut parcel: Box<Parcel>) {
        if let Some(path) = self.loopback_of(host) {
            return self.offer(path, parcel);
        }
        (parcel.arrival.at, parcel.arrival.marked) = (self.now(), false);
        self.wire.held.add(Held::cost(parcel.bytes.len()));
        // Fates of packets are recorded for links only. Loopback is not part of the network.
        let _ = self.arrive(Path { from: host, to: host }, parcel);
    }

    /// Delivers an arrived packet to its socket, or returns why the packet is lost.
    #[inline(always)]
    fn arrive(&mut self, path: Path, parcel: Box<Parcel>) -> Result<(), Lost> {
        if parcel.addresses.kind != Kind::Datagram {
            return self.arrive_other(path, parcel);
        }
        if let Some(id) = self.socket_for(path.to, &parcel.addresses) {
            let socket = self.sockets.get_mut(id);
            if socket.hears(&parcel.addresses) {
                return socket.keep(parcel, &mut self.wire.held, &mut self.woken);
            }
        }
        Err(self.lose(path, &parcel))
    }

    /// Like [`Core::arrive`], for a packet that is no datagram.
    #[inline(never)]
    fn arrive_other(&mut self, path: Path, parcel: Box<Parcel>) -> Result<(), Lost> {
        #[cfg(feature = "tcp")]
        if parcel.addresses.kind == Kind::Segment {
            return self.arrive_segments(path.to, parcel);
        }
        // As with Linux, only a connected socket gets the error. An unconnected socket could not tell which of its peers refused.
        if let Some(id) = self.socket_for(path.to, &parcel.addresses) {
            let socket = self.sockets.get_mut(id);
            if socket.hears(&parcel.addresses) {
                self.wire.held.remove(Held::cost(parcel.bytes.len()));
                socket.refuse(parcel.addresses.from(), &mut self.woken);
                return Ok(());
            }
        }
        Err(self.lose(path, &parcel))
    }

    /// Returns the socket of `host` for the packet. The only socket of a port is returned unseen: the caller asks whether the socket
    /// [hears](SocketState::hears) the packet.
    #[inline(always)]
    fn socket_for(&self, host: NodeId, ends: &Ends) -> Option<SocketId> {
        if !self.has_address(host, ends) {
            return None;
        }
        let bound = self.hosts[host.index()].bound.at(ends.port())?;
        if bound.others.is_empty() {
            return Some(bound.first);
        }
        // Several sockets of a port are bound to different addresses, so at most one socket hears the packet.
        bound.all().find(|id| self.sockets.get(*id).hears(ends))
    }

    /// Returns whether `host` has the address to which the packet goes.
    #[inline(always)]
    fn has_address(&self, host: NodeId, ends: &Ends) -> bool {
        // The identifier of a group of IPv6 may equal the short form of a host's address.
        if ends.scope.is_some() {
            return self.is_member(host, ends);
        }
        self.plan.short(host, ends.is_six) == ends.to
            || ends.is_to_any_host()
            || self.plan.is_of_interface(host, ends.to, ends.is_six)
            || self.is_member(host, ends)
    }

    /// Returns why a packet without a receiving socket is lost. A host that is down has no sockets. If the host is up, the sender of a datagram is told.
    #[inline(never)]
    fn lose(&mut self, path: Path, parcel: &Parcel) -> Lost {
        self.wire.held.remove(Held::cost(parcel.bytes.len()));
        let ends = &parcel.addresses;
        if !self.is_up(path.to) {
            return Lost::HostDown;
        }
        if !self.has_address(path.to, ends) {
            return Lost::NoSuchAddress;
        }
        if ends.kind == Kind::Datagram && !ends.is_broadcast() && !ends.is_multicast() {
            self.tell_unreachable(path, parcel);
        }
        Lost::NoSocket
    }

    /// Tells the sender of a datagram that no socket is bound to the port.
    fn tell_unreachable(&mut self, path: Path, parcel: &Parcel) {
        // The length is that of an ICMP message (RFC 792): IP header, ICMP header, and the header and the first eight bytes of the datagram. The content is not
        // needed, because the receiver of the message looks at the addresses only.
        let addresses = parcel.addresses.back(Kind::Unreachable);
        let answer = self.spare.copied(addresses, &[0; 36], Ecn::NotCapable);
        let Path { from: sender, to: host } = path;
        if host == sender { self.hand_over(host, answer) } else { self.offer(Path { from: host, to: sender }, answer) }
    }
}
