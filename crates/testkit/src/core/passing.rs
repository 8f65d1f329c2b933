//! The way of a datagram: from a socket into its link, and from the link to a socket.

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use bytes::Bytes;
use cohaptic_wan::{NodeId, Path};

use super::{Core, Datagram, Ends, Kind, Parcel, SocketId};
use crate::trace::Lost;
use crate::wire::Arrival;

/// The longest datagram over IPv4 and over IPv6 \[bytes\].
const LONGEST: [usize; 2] = [65_507, 65_527];

/// What a socket sends.
#[derive(Clone, Debug)]
pub(crate) struct Outgoing {
    /// The receiver; `None`: the peer to which the socket is connected.
    pub(crate) to: Option<SocketAddr>,
    pub(crate) bytes: Bytes,
    pub(crate) ecn_capable: bool,
}

fn refuse<T>(kind: io::ErrorKind, text: String) -> io::Result<T> {
    Err(io::Error::new(kind, text))
}

impl Core {
    /// Sends a datagram, now.
    pub(crate) fn send(&mut self, id: SocketId, outgoing: Outgoing) -> io::Result<()> {
        self.note_call();
        self.check_alive(id)?;
        let socket = self.sockets.get_mut(id);
        if std::mem::take(&mut socket.refused) {
            return refuse(io::ErrorKind::ConnectionRefused, "connection refused: no socket at the port of the peer".into());
        }
        let (host, local, may_broadcast) = (socket.host, socket.local, socket.may_broadcast);
        let Some(mut to) = outgoing.to.or(socket.peer) else {
            return refuse(io::ErrorKind::NotConnected, "the socket is not connected; use `send_to`, or `connect` before".into());
        };
        let len = outgoing.bytes.len();
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
        let parcel = Parcel { addresses, bytes: outgoing.bytes, ecn_capable: outgoing.ecn_capable };
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
            let text = format!("no host has the address {}; the hosts are\n{}", to.ip(), self.plan);
            return refuse(io::ErrorKind::HostUnreachable, text);
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
    pub(super) fn offer(&mut self, path: Path, parcel: Parcel) {
        if self.wire.offer(path, parcel).is_ok() {
            self.take_arrivals();
        }
    }
}

impl Core {
    /// Deals with what has come out of the links.
    pub(super) fn take_arrivals(&mut self) {
        loop {
            while let Some(Arrival { packet, at, parcel, marked, is_cut }) = self.wire.poll() {
                let Path { from, to } = packet.path;
                let end = if is_cut { Err(Lost::Cut) } else { self.arrive(to, at, parcel, marked, from) };
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
    pub(super) fn hand_over(&mut self, host: NodeId, parcel: Parcel) {
        // Loopback tells of no end: it is not the network.
        let _ = self.arrive(host, self.now(), parcel, false, host);
    }

    fn arrive(&mut self, host: NodeId, at: cohaptic_units::Instant, parcel: Parcel, marked: bool, from: NodeId) -> Result<(), Lost> {
        #[cfg(feature = "tcp")]
        if parcel.addresses.kind == Kind::Segment {
            return self.arrive_segment(host, &parcel.bytes, marked);
        }
        let state = &self.hosts[host.index()];
        if state.is_down {
            return Err(Lost::HostDown);
        }
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
        let socket = self.sockets.get_mut(id);
        match parcel.addresses.kind {
            #[cfg(feature = "tcp")]
            Kind::Segment => {}
            // Only a connected socket is told, as with Linux: another one could not know of whom it speaks.
            Kind::Unreachable => {
                if socket.peer == Some(from_address) {
                    socket.refused = true;
                    socket.wake_readers(&mut self.woken);
                }
            }
            Kind::Datagram => {
                if socket.held + parcel.bytes.len() > self.settings.receive_buffer {
                    return Err(Lost::BufferFull);
                }
                socket.held += parcel.bytes.len();
                socket.inbox.push_back(Datagram { from: from_address, bytes: parcel.bytes, at, ecn_capable: parcel.ecn_capable, marked, to: ip });
                socket.wake_readers(&mut self.woken);
            }
        }
        Ok(())
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
        let answer = Parcel { addresses, bytes: Bytes::from_static(&[0; 36]), ecn_capable: false };
        if host == sender { self.hand_over(host, answer) } else { self.offer(Path { from: host, to: sender }, answer) }
    }
}
