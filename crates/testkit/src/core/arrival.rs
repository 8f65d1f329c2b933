//! The way of a packet from its link into the buffer of a socket.

use bytes::Bytes;
use cohaptic_wan::{NodeId, Path};

use super::{Addresses, Core, Datagram, Kind, Parcel, SocketId};
use crate::trace::Lost;
use crate::wire::Arrival;

impl Core {
    /// Deals with what has come out of the links.
    pub(super) fn take_arrivals(&mut self) {
        while let Some(Arrival { packet, at, parcel, marked, is_cut }) = self.wire.poll() {
            let Path { from, to } = packet.path;
            let end = if is_cut { Err(Lost::Cut) } else { self.arrive(to, at, parcel, marked, from) };
            self.wire.ends(packet, at, end);
        }
    }

    /// Hands a packet that does not leave its host to its socket.
    pub(super) fn hand_over(&mut self, host: NodeId, parcel: Parcel) {
        // Loopback tells of no end: it is not the network.
        let _ = self.arrive(host, self.now(), parcel, false, host);
    }

    fn arrive(&mut self, host: NodeId, at: cohaptic_units::Instant, parcel: Parcel, marked: bool, from: NodeId) -> Result<(), Lost> {
        let state = &self.hosts[host.index()];
        if state.is_down {
            return Err(Lost::HostDown);
        }
        let ip = parcel.addresses.to.ip();
        let is_for_all = ip == std::net::IpAddr::V4(std::net::Ipv4Addr::BROADCAST);
        if !(is_for_all || ip.is_loopback() || self.plan.of(host).has(ip)) {
            return Err(Lost::NoSuchAddress);
        }
        let Some(id) = self.socket_for(host, &parcel) else {
            if parcel.addresses.kind == Kind::Datagram && !is_for_all {
                self.tell_unreachable(host, from, &parcel);
            }
            return Err(Lost::NoSocket);
        };
        let socket = self.sockets.get_mut(id);
        match parcel.addresses.kind {
            // Only a connected socket is told, as with Linux: another one could not know of whom it speaks.
            Kind::Unreachable => {
                if socket.peer == Some(parcel.addresses.from) {
                    socket.refused = true;
                    socket.wake_readers(&mut self.woken);
                }
            }
            Kind::Datagram => {
                if socket.held + parcel.bytes.len() > self.settings.receive_buffer {
                    return Err(Lost::BufferFull);
                }
                socket.held += parcel.bytes.len();
                socket.inbox.push_back(Datagram {
                    from: parcel.addresses.from,
                    bytes: parcel.bytes,
                    at,
                    ecn_capable: parcel.ecn_capable,
                    marked,
                    to: ip,
                });
                socket.wake_readers(&mut self.woken);
            }
        }
        Ok(())
    }

    /// The socket of a host for which a packet is: one that is connected to its sender before one that is not, one that is bound to its address before one that
    /// is bound to all.
    fn socket_for(&self, host: NodeId, parcel: &Parcel) -> Option<SocketId> {
        let bound = self.hosts[host.index()].ports.get(&(parcel.addresses.to.is_ipv6(), parcel.addresses.to.port()))?;
        let rank = |id: &&SocketId| {
            let socket = self.sockets.get(**id);
            let at_address = socket.local.ip() == parcel.addresses.to.ip();
            let fits = at_address || socket.local.ip().is_unspecified();
            let hears = socket.peer.is_none_or(|peer| peer == parcel.addresses.from);
            (fits && hears).then_some((socket.peer.is_some(), at_address))
        };
        bound.iter().filter(|id| rank(id).is_some()).max_by_key(rank).copied()
    }

    /// Tells the sender that nobody is at that port.
    fn tell_unreachable(&mut self, host: NodeId, sender: NodeId, parcel: &Parcel) {
        // As long as that of ICMP (RFC 792): its header, and the header and the first eight bytes of what could not be delivered. The addresses say all that is
        // needed here.
        let addresses = Addresses { from: parcel.addresses.to, to: parcel.addresses.from, kind: Kind::Unreachable };
        let answer = Parcel { addresses, bytes: Bytes::from_static(&[0; 36]), ecn_capable: false };
        if host == sender { self.hand_over(host, answer) } else { self.offer(Path { from: host, to: sender }, answer) }
    }
}
