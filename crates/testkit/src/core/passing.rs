//! The way of a datagram: from a socket into its link, and from the link to a socket.

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use cohaptic_units::Instant;
use cohaptic_wan::{NodeId, Path};

use super::{Core, Ends, Kind, Parcel, SocketId};
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

/// Who gets a datagram.
#[derive(Clone, Copy, Debug)]
enum Receivers {
    /// A host, which may be the one that sends.
    One(NodeId),
    /// All other hosts.
    All,
    /// Nobody; a host may have had the address.
    Nobody,
}

#[cold]
fn refuse<T>(kind: io::ErrorKind, text: String) -> io::Result<T> {
    Err(io::Error::new(kind, text))
}

/// Says why a socket at `local` cannot send a datagram of that length to that address.
#[cold]
fn refuse_datagram(local: SocketAddr, to: SocketAddr, len: usize) -> io::Result<()> {
    let longest = LONGEST[usize::from(to.is_ipv6())];
    let text = if to.is_ipv6() != local.is_ipv6() {
        format!("a socket at {local} cannot reach {to}, which is of the other version of IP")
    } else if to.port() == 0 {
        format!("nothing can be sent to port 0 ({to})")
    } else {
        format!("message too long: {len} bytes, where a datagram has {longest} at most")
    };
    refuse(io::ErrorKind::InvalidInput, text)
}

impl Core {
    /// Sends a datagram, now.
    pub(crate) fn send(&mut self, id: SocketId, outgoing: Outgoing<'_>) -> io::Result<()> {
        self.note_call(|core| core.sockets.get(id).name());
        let Outgoing { to, bytes, ecn_capable } = outgoing;
        let socket = self.sockets.get(id);
        if socket.has_error() {
            return Err(self.error_of(id));
        }
        let host = socket.host;
        let Some(to) = to.or(socket.peer.as_ref()) else {
            return refuse(io::ErrorKind::NotConnected, "the socket is not connected; use `send_to`, or `connect` before".into());
        };
        if to.is_ipv6() != socket.local.is_ipv6() || to.port() == 0 || bytes.len() > LONGEST[usize::from(to.is_ipv6())] {
            return refuse_datagram(socket.local, *to, bytes.len());
        }
        // An address that a host has is no other kind of address: most often this is all that is asked.
        let (ip, receivers) = match self.plan.owner_node(to.ip()) {
            Some(owner) => (to.ip(), Receivers::One(owner)),
            None => self.other_receivers(host, to)?,
        };
        let from = self.source(host, socket.local.ip(), ip)?;
        let addresses = Ends::new((from, socket.local.port()).into(), (ip, to.port()).into(), Kind::Datagram);
        if matches!(receivers, Receivers::All) && !socket.may_broadcast {
            return refuse(io::ErrorKind::PermissionDenied, "this socket may not broadcast; `set_broadcast(true)` allows it".into());
        }
        let parcel = self.spare.copied(addresses, bytes, ecn_capable);
        match receivers {
            Receivers::One(receiver) if receiver == host => self.hand_over(host, parcel),
            Receivers::One(receiver) => self.offer(Path { from: host, to: receiver }, parcel),
            Receivers::All => {
                for other in (0..self.hosts.len()).map(NodeId::new).filter(|other| *other != host) {
                    self.offer(Path { from: host, to: other }, parcel.clone());
                }
            }
            Receivers::Nobody if self.plan.was_given(ip) => {}
            Receivers::Nobody => return refuse(io::ErrorKind::HostUnreachable, self.plan.unknown(ip)),
        }
        // A packet that arrives at once and is read or lost counts no more.
        if self.wire.held.is_too_much() {
            self.fail_for(self.sockets.get(id).name());
        }
        Ok(())
    }

    /// Who gets a datagram of that host to an address that no host has, and the address that is written on it.
    #[inline(never)]
    fn other_receivers(&self, host: NodeId, to: &SocketAddr) -> io::Result<(IpAddr, Receivers)> {
        let ip = to.ip();
        if ip.is_multicast() {
            return refuse(io::ErrorKind::Unsupported, format!("{to} is a multicast address, and a test bed has no groups"));
        }
        if ip.is_unspecified() {
            let loopback = if ip.is_ipv6() { Ipv6Addr::LOCALHOST.into() } else { IpAddr::V4(Ipv4Addr::LOCALHOST) };
            return Ok((loopback, Receivers::One(host)));
        }
        if ip.is_loopback() {
            return Ok((ip, Receivers::One(host)));
        }
        if ip == IpAddr::V4(Ipv4Addr::BROADCAST) {
            return Ok((ip, Receivers::All));
        }
        Ok((ip, Receivers::Nobody))
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

impl Core {
    /// Deals with what has come out of the links.
    #[cfg_attr(not(feature = "tcp"), expect(clippy::never_loop, reason = "only TCP has packets that do not leave their host"))]
    pub(super) fn take_arrivals(&mut self) {
        loop {
            while let Some(Arrival { packet, at, parcel, marked, is_cut }) = self.wire.poll() {
                let end = if is_cut { Err(Lost::Cut) } else { self.arrive(packet.path, at, parcel, marked) };
                self.wire.ends(packet, at, end);
            }
            #[cfg(feature = "tcp")]
            if self.take_from_loopback() {
                continue;
            }
            return;
        }
    }

    /// Hands a packet that does not leave its host to its socket.
    pub(super) fn hand_over(&mut self, host: NodeId, parcel: Box<Parcel>) {
        // Loopback tells of no end: it is not the network.
        let _ = self.arrive(Path { from: host, to: host }, self.now(), parcel, false);
    }

    /// Hands a packet that has arrived to its socket.
    #[cfg_attr(not(feature = "tcp"), expect(unused_mut, reason = "only a segment is taken out of its parcel"))]
    fn arrive(&mut self, path: Path, at: Instant, mut parcel: Box<Parcel>, marked: bool) -> Result<(), Lost> {
        let host = path.to;
        #[cfg(feature = "tcp")]
        if parcel.addresses.kind == Kind::Segment {
            let bytes = std::mem::take(&mut parcel.bytes);
            self.spare.put(parcel);
            return self.arrive_segment(host, &bytes.into(), marked);
        }
        if self.hosts[host.index()].is_down {
            return Err(Lost::HostDown);
        }
        let to = parcel.addresses.to().ip();
        if !(self.plan.of(host).has(to) || to.is_loopback() || to == IpAddr::V4(Ipv4Addr::BROADCAST)) {
            return Err(Lost::NoSuchAddress);
        }
        let Some(id) = self.socket_for(host, &parcel.addresses) else {
            if parcel.addresses.kind == Kind::Datagram && to != IpAddr::V4(Ipv4Addr::BROADCAST) {
                self.tell_unreachable(path, &parcel);
            }
            return Err(Lost::NoSocket);
        };
        let socket = self.sockets.get_mut(id);
        match parcel.addresses.kind {
            #[cfg(feature = "tcp")]
            Kind::Segment => Ok(()),
            // Only a connected socket is told, as with Linux: another one could not know of whom it speaks.
            Kind::Unreachable => {
                if socket.peer == Some(parcel.addresses.from()) {
                    socket.refused = true;
                    socket.readers.wake(&mut self.woken);
                }
                Ok(())
            }
            Kind::Datagram => socket.keep(at, parcel, marked, (self.settings.receive_buffer, &mut self.wire.held), &mut self.woken),
        }
    }

    /// The socket of a host for which a packet is: one that is connected to its sender before one that is not, one that is bound to its address before one that
    /// is bound to all.
    fn socket_for(&self, host: NodeId, ends: &Ends) -> Option<SocketId> {
        let rank = |id: SocketId| {
            let (socket, to) = (self.sockets.get(id), ends.to().ip());
            let at_address = socket.local.ip() == to;
            let fits = at_address || socket.local.ip().is_unspecified();
            let hears = socket.peer.is_none_or(|peer| peer == ends.from());
            (fits && hears).then_some((socket.peer.is_some(), at_address))
        };
        match self.hosts[host.index()].bound.at(ends.port()) {
            [(_, only)] => rank(*only).map(|_| *only),
            several => several.iter().map(|(_, id)| *id).filter(|id| rank(*id).is_some()).max_by_key(|id| rank(*id)),
        }
    }

    /// Tells the sender of a datagram that nobody is at that port.
    fn tell_unreachable(&mut self, path: Path, parcel: &Parcel) {
        // As long as that of ICMP (RFC 792): its header, and the header and the first eight bytes of what could not be delivered. The addresses say all that is
        // needed here.
        let addresses = parcel.addresses.back(Kind::Unreachable);
        let answer = self.spare.copied(addresses, &[0; 36], false);
        let Path { from: sender, to: host } = path;
        if host == sender { self.hand_over(host, answer) } else { self.offer(Path { from: host, to: sender }, answer) }
    }
}
