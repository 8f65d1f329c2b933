//! The way of a datagram: from a socket into its link, and from the link to a socket.

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, SocketAddrV4};

use cohaptic_wan::{NodeId, Path};

use super::sockets::SocketState;
use super::{Core, Ends, HostState, Kind, Parcel, SocketId};
use crate::trace::Lost;
use crate::wire::Arrival;

/// The longest datagram over IPv4 and over IPv6 \[bytes\].
const LONGEST: [usize; 2] = [65_507, 65_527];

/// What a socket sends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outgoing<'a> {
    /// The receiver; `None`: the peer to which the socket is connected.
    pub(crate) to: Option<&'a SocketAddr>,
    pub(crate) bytes: &'a [u8],
    pub(crate) ecn_capable: bool,
}

#[cold]
fn refuse<T>(kind: io::ErrorKind, text: String) -> io::Result<T> {
    Err(io::Error::new(kind, text))
}

impl Core {
    /// Sends a datagram, now.
    #[inline]
    pub(crate) fn send(&mut self, id: SocketId, outgoing: Outgoing<'_>) -> io::Result<()> {
        self.note_call(|core| core.sockets.get(id).name());
        let Outgoing { to, bytes, ecn_capable } = outgoing;
        // By its parts, so that nothing is written to memory for it.
        if let Some((path, addresses)) = self.plainly(id, to, bytes.len()) {
            let parcel = self.spare.copied(addresses, bytes, ecn_capable);
            self.offer(path, parcel);
        } else {
            self.send_any(id, to, bytes, ecn_capable)?;
        }
        // A packet that arrives at once and is read or lost counts no more.
        if self.wire.held.is_too_much() {
            self.fail_for(self.sockets.get(id).name());
        }
        Ok(())
    }

    /// The way and the ends of a datagram with which nothing is special: over IPv4, from a socket without an error that is bound to all addresses, to another host.
    /// What else may be said of a datagram need not be asked then: it took more time than all the rest of sending.
    #[inline(always)]
    fn plainly(&self, id: SocketId, to: Option<&SocketAddr>, len: usize) -> Option<(Path, Ends)> {
        let socket = self.sockets.get(id);
        let (SocketAddr::V4(local), SocketAddr::V4(to)) = (&socket.local, to.or(socket.peer.as_ref())?) else { return None };
        let receiver = self.plan.owner_of_v4(*to.ip())?;
        let is_special = !local.ip().is_unspecified() || receiver == socket.host || to.port() == 0 || len > LONGEST[0] || socket.has_error();
        if is_special {
            return None;
        }
        let from = SocketAddrV4::new(self.plan.of(socket.host).v4, local.port());
        Some((Path { from: socket.host, to: receiver }, Ends::of_v4(from, *to, Kind::Datagram)))
    }

    #[inline(never)]
    fn send_any(&mut self, id: SocketId, to: Option<&SocketAddr>, bytes: &[u8], ecn_capable: bool) -> io::Result<()> {
        let socket = self.sockets.get(id);
        if socket.has_error() {
            return Err(self.error_of(id));
        }
        let (host, local, may_broadcast) = (socket.host, socket.local, socket.may_broadcast);
        let Some(mut to) = to.copied().or(socket.peer) else {
            return refuse(io::ErrorKind::NotConnected, "the socket is not connected; use `send_to`, or `connect` before".into());
        };
        let len = bytes.len();
        if to.is_ipv6() != local.is_ipv6() {
            return refuse(io::ErrorKind::InvalidInput, format!("a socket at {local} cannot reach {to}, which is of the other version of IP"));
        }
        if to.port() == 0 {
            return refuse(io::ErrorKind::InvalidInput, format!("nothing can be sent to port 0 ({to})"));
        }
        if len > LONGEST[usize::from(to.is_ipv6())] {
            let text = format!("message too long: {len} bytes, where a datagram has {} at most", LONGEST[usize::from(to.is_ipv6())]);
            return refuse(io::ErrorKind::InvalidInput, text);
        }
        if to.ip().is_multicast() {
            return refuse(io::ErrorKind::Unsupported, format!("{to} is a multicast address, and a test bed has no groups"));
        }
        if to.ip().is_unspecified() {
            let loopback = if to.is_ipv6() { Ipv6Addr::LOCALHOST.into() } else { IpAddr::V4(Ipv4Addr::LOCALHOST) };
            to.set_ip(loopback);
        }
        let from = SocketAddr::new(self.source(host, local.ip(), to.ip())?, local.port());
        let addresses = Ends::new(from, to, Kind::Datagram);
        let parcel = self.spare.copied(addresses, bytes, ecn_capable);
        if to.ip() == IpAddr::V4(Ipv4Addr::BROADCAST) {
            if !may_broadcast {
                return refuse(io::ErrorKind::PermissionDenied, "this socket may not broadcast; `set_broadcast(true)` allows it".into());
            }
            for other in (0..self.hosts.len()).map(NodeId::new).filter(|other| *other != host) {
                self.offer(Path { from: host, to: other }, parcel.clone());
            }
            return Ok(());
        }
        let receiver = if to.ip().is_loopback() { Some(host) } else { self.plan.owner_node(to.ip()) };
        if receiver == Some(host) {
            self.hand_over(host, parcel);
        } else if let Some(receiver) = receiver {
            self.offer(Path { from: host, to: receiver }, parcel);
        } else if !self.plan.was_given(to.ip()) {
            return refuse(io::ErrorKind::HostUnreachable, self.plan.unknown(to.ip()));
        }
        Ok(())
    }

    /// The address from which a socket that is bound to `bound` reaches `to`.
    pub(super) fn source(&self, host: NodeId, bound: IpAddr, to: IpAddr) -> io::Result<IpAddr> {
        let addresses = self.plan.of(host);
        if bound.is_unspecified() {
            return Ok(if to.is_loopback() { to } else { addresses.like(to) });
        }
        if bound.is_loopback() && !to.is_loopback() {
            return refuse(io::ErrorKind::InvalidInput, format!("a socket at {bound} reaches no other host, and so not {to}"));
        }
        if !bound.is_loopback() && !addresses.has(bound) {
            let text =
                format!("host `{}` does not have the address {bound} any more; it has {}", self.plan.names()[host.index()], addresses.like(bound));
            return refuse(io::ErrorKind::AddrNotAvailable, text);
        }
        Ok(bound)
    }

    /// Hands a packet to its link.
    #[inline(always)]
    pub(super) fn offer(&mut self, path: Path, parcel: Box<Parcel>) {
        if self.wire.offer(path, parcel) == Ok(true) {
            self.take_arrivals();
        }
    }
}

impl HostState {
    /// The socket for which a datagram is with which nothing is special: over IPv4, to the only socket of its port, which hears all addresses and everybody.
    #[inline]
    fn plain_socket_for(&self, ends: &Ends) -> Option<SocketId> {
        let (address, port, id) = self.plain?;
        (ends.receiver_v4() == Some((address, port))).then_some(id)
    }
}

impl Core {
    /// Deals with what has come out of the links.
    #[cfg_attr(not(feature = "tcp"), expect(clippy::never_loop, reason = "only TCP has packets that do not leave their host"))]
    pub(super) fn take_arrivals(&mut self) {
        loop {
            let mut other = None;
            while self.take_plain(&mut other) {
                if let Some((path, at, parcel)) = other.take() {
                    self.arrive_untold(path, at, parcel);
                }
            }
            if self.wire.may_have_arrivals() {
                self.take_others();
            }
            #[cfg(feature = "tcp")]
            if self.take_from_loopback() {
                continue;
            }
            return;
        }
    }

    /// Takes the next packet that has come out of its link, if nobody asks for more than its arrival: into the buffer of its socket, if it is a datagram with which nothing
    /// is special, and else into `other`. One that is lost in a cut is gone. Says whether there was one.
    #[inline(always)]
    fn take_plain(&mut self, other: &mut Option<(Path, cohaptic_units::Instant, Box<Parcel>)>) -> bool {
        let Self { wire, hosts, sockets, settings, woken, .. } = self;
        let taken = wire.take_plain(|path, at, is_cut, parcel, held| {
            if is_cut {
                return;
            }
            let Some(id) = hosts[path.to.index()].plain_socket_for(&parcel.addresses).filter(|_| parcel.addresses.kind == Kind::Datagram) else {
                *other = Some((path, at, parcel));
                return;
            };
            // Nobody is told that a buffer was full.
            let _ = sockets.get_mut(id).keep(at, parcel, false, (settings.receive_buffer, held), woken);
        });
        taken.is_some()
    }

    /// A packet arrives, of whose end nobody is told.
    #[inline(never)]
    fn arrive_untold(&mut self, path: Path, at: cohaptic_units::Instant, parcel: Box<Parcel>) {
        let _ = self.arrive(path.to, at, parcel, false, path.from);
    }

    /// What has come out of the links and is more than an arrival, or asked for.
    #[inline(never)]
    fn take_others(&mut self) {
        while let Some(Arrival { packet, at, parcel, marked, is_cut }) = self.wire.poll() {
            let Path { from, to } = packet.path;
            let end = if is_cut { Err(Lost::Cut) } else { self.arrive(to, at, parcel, marked, from) };
            self.wire.ends(packet, at, end);
        }
    }

    /// Hands a packet that does not leave its host to its socket.
    pub(super) fn hand_over(&mut self, host: NodeId, parcel: Box<Parcel>) {
        // Loopback tells of no end: it is not the network.
        let _ = self.arrive(host, self.now(), parcel, false, host);
    }

    #[inline(always)]
    #[cfg_attr(not(feature = "tcp"), expect(unused_mut, reason = "only a segment is taken out of its parcel"))]
    fn arrive(&mut self, host: NodeId, at: cohaptic_units::Instant, mut parcel: Box<Parcel>, marked: bool, from: NodeId) -> Result<(), Lost> {
        #[cfg(feature = "tcp")]
        if parcel.addresses.kind == Kind::Segment {
            let bytes = std::mem::take(&mut parcel.bytes);
            self.spare.put(parcel);
            return self.arrive_segment(host, &bytes.into(), marked);
        }
        if self.hosts[host.index()].is_down {
            return Err(Lost::HostDown);
        }
        let Some(id) = self.hosts[host.index()].plain_socket_for(&parcel.addresses) else {
            return self.arrive_anywhere(host, at, parcel, marked, from);
        };
        self.arrive_at(id, at, parcel, marked)
    }

    #[inline(never)]
    fn arrive_anywhere(&mut self, host: NodeId, at: cohaptic_units::Instant, parcel: Box<Parcel>, marked: bool, from: NodeId) -> Result<(), Lost> {
        let (from_address, to_address) = (parcel.addresses.from(), parcel.addresses.to());
        let ip = to_address.ip();
        let is_for_all = ip == IpAddr::V4(Ipv4Addr::BROADCAST);
        if !(is_for_all || ip.is_loopback() || self.plan.of(host).has(ip)) {
            return Err(Lost::NoSuchAddress);
        }
        let Some(id) = self.socket_for(host, from_address, to_address) else {
            if parcel.addresses.kind == Kind::Datagram && !is_for_all {
                self.tell_unreachable(host, from, &parcel);
            }
            return Err(Lost::NoSocket);
        };
        self.note_plain(host, id);
        self.arrive_at(id, at, parcel, marked)
    }

    /// Hands a packet to its socket.
    #[inline(always)]
    fn arrive_at(&mut self, id: SocketId, at: cohaptic_units::Instant, parcel: Box<Parcel>, marked: bool) -> Result<(), Lost> {
        let socket = self.sockets.get_mut(id);
        match parcel.addresses.kind {
            #[cfg(feature = "tcp")]
            Kind::Segment => {}
            // Only a connected socket is told, as with Linux: another one could not know of whom it speaks.
            Kind::Unreachable => {
                if socket.peer == Some(parcel.addresses.from()) {
                    socket.refused = true;
                    socket.wake_readers(&mut self.woken);
                }
            }
            Kind::Datagram => return socket.keep(at, parcel, marked, (self.settings.receive_buffer, &mut self.wire.held), &mut self.woken),
        }
        Ok(())
    }

    /// Remembers the socket for which a packet was, if all plain datagrams to its port are for it.
    fn note_plain(&mut self, host: NodeId, id: SocketId) {
        let SocketState { local: SocketAddr::V4(local), peer: None, .. } = self.sockets.get(id) else { return };
        let (state, own) = (&mut self.hosts[host.index()], self.plan.of(host).v4);
        let is_only = state.ports.get(&(false, local.port())).is_some_and(|bound| bound.len() == 1);
        if is_only && local.ip().is_unspecified() {
            state.plain = Some((own, local.port(), id));
        }
    }

    /// The socket of a host for which a packet is: one that is connected to its sender before one that is not, one that is bound to its address before one that
    /// is bound to all.
    fn socket_for(&self, host: NodeId, from: SocketAddr, to: SocketAddr) -> Option<SocketId> {
        let bound = self.hosts[host.index()].ports.get(&(to.is_ipv6(), to.port()))?;
        let rank = |id: &&SocketId| {
            let socket = self.sockets.get(**id);
            let at_address = socket.local.ip() == to.ip();
            let fits = at_address || socket.local.ip().is_unspecified();
            let hears = socket.peer.is_none_or(|peer| peer == from);
            (fits && hears).then_some((socket.peer.is_some(), at_address))
        };
        if let [id] = bound.as_slice() {
            return rank(&id).map(|_| *id);
        }
        bound.iter().filter(|id| rank(id).is_some()).max_by_key(rank).copied()
    }

    /// Tells the sender that nobody is at that port.
    fn tell_unreachable(&mut self, host: NodeId, sender: NodeId, parcel: &Parcel) {
        // As long as that of ICMP (RFC 792): its header, and the header and the first eight bytes of what could not be delivered. The addresses say all that is
        // needed here.
        let addresses = parcel.addresses.back(Kind::Unreachable);
        let answer = self.spare.copied(addresses, &[0; 36], false);
        if host == sender { self.hand_over(host, answer) } else { self.offer(Path { from: host, to: sender }, answer) }
    }
}
