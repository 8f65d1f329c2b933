//! The way of a packet from its link into the buffer of a socket.

use bytes::Bytes;
use cohaptic_wan::Fate;

use super::{Core, Datagram, Kind, Parcel, SocketId, seen};
use crate::trace::{Happening, Lost, PacketName};

impl Core {
    /// Deals with what has come out of the links.
    pub(super) fn take_arrivals(&mut self) {
        while let Some(event) = self.network.poll_event() {
            let (from, to) = (event.path.from.index(), event.path.to.index());
            let packet = PacketName { from, to, sequence: event.sequence, copy: event.copy >> 1 };
            self.recording.keep(|| seen(&event, event.payload.bytes.clone()));
            match event.fate {
                Fate::Delivered(at) => {
                    // A copy of it may be on its way still, undamaged.
                    let marked = event.marked;
                    let mut parcel = event.payload;
                    if let Some(damage) = &event.damage {
                        let mut bytes = Vec::from(parcel.bytes);
                        damage.apply(&mut bytes);
                        parcel.bytes = bytes.into();
                    }
                    let arrived = if self.is_cut(from, to) { Err(Lost::Cut) } else { self.arrive(to, at, parcel, marked, from) };
                    let what = match arrived {
                        Ok(()) => Happening::Arrived { packet },
                        Err(why) => Happening::Lost { packet, why },
                    };
                    self.recording.note(at, what);
                }
                Fate::Dropped(cause) => self.recording.note(event.at, Happening::Lost { packet, why: Lost::Link(cause) }),
                Fate::Duplicated => self.recording.note(event.at, Happening::Copied { packet }),
            }
        }
    }

    /// Hands a packet that does not leave its host to its socket.
    pub(super) fn hand_over(&mut self, host: usize, from: usize, parcel: Parcel, marked: bool) {
        // Loopback tells of no end: it is not the network.
        let _ = self.arrive(host, self.now, parcel, marked, from);
    }

    fn arrive(&mut self, host: usize, at: cohaptic_units::Instant, parcel: Parcel, marked: bool, from: usize) -> Result<(), Lost> {
        let state = &self.hosts[host];
        if state.is_down {
            return Err(Lost::HostDown);
        }
        let ip = parcel.to.ip();
        let is_for_all = ip == std::net::IpAddr::V4(std::net::Ipv4Addr::BROADCAST);
        if !(is_for_all || ip.is_loopback() || self.plan.of(host).has(ip)) {
            return Err(Lost::NoSuchAddress);
        }
        let Some(id) = self.socket_for(host, &parcel) else {
            if parcel.kind == Kind::Datagram && !is_for_all {
                self.tell_unreachable(host, from, &parcel);
            }
            return Err(Lost::NoSocket);
        };
        let socket = self.sockets.get_mut(id);
        match parcel.kind {
            // Only a connected socket is told, as with Linux: another one could not know of whom it speaks.
            Kind::Unreachable => {
                if socket.peer == Some(parcel.from) {
                    socket.refused = true;
                    socket.wake_readers(&mut self.woken);
                }
            }
            Kind::Datagram => {
                if socket.held + parcel.bytes.len() > self.settings.receive_buffer {
                    return Err(Lost::BufferFull);
                }
                socket.held += parcel.bytes.len();
                socket.inbox.push_back(Datagram { from: parcel.from, bytes: parcel.bytes, at, ecn_capable: parcel.ecn_capable, marked, to: ip });
                socket.wake_readers(&mut self.woken);
            }
        }
        Ok(())
    }

    /// The socket of a host for which a packet is: one that is connected to its sender before one that is not, one that is bound to its address before one that
    /// is bound to all.
    fn socket_for(&self, host: usize, parcel: &Parcel) -> Option<SocketId> {
        let bound = self.hosts[host].ports.get(&(parcel.to.is_ipv6(), parcel.to.port()))?;
        let rank = |id: &&SocketId| {
            let socket = self.sockets.get(**id);
            let at_address = socket.local.ip() == parcel.to.ip();
            let fits = at_address || socket.local.ip().is_unspecified();
            let hears = socket.peer.is_none_or(|peer| peer == parcel.from);
            (fits && hears).then_some((socket.peer.is_some(), at_address))
        };
        bound.iter().filter(|id| rank(id).is_some()).max_by_key(rank).copied()
    }

    /// Tells the sender that nobody is at that port.
    fn tell_unreachable(&mut self, host: usize, sender: usize, parcel: &Parcel) {
        // As long as that of ICMP (RFC 792): its header, and the header and the first eight bytes of what could not be delivered. The addresses say all that is
        // needed here.
        let answer = Parcel { from: parcel.to, to: parcel.from, bytes: Bytes::from_static(&[0; 36]), ecn_capable: false, kind: Kind::Unreachable };
        if host == sender { self.hand_over(host, host, answer, false) } else { self.offer(host, sender, answer) }
    }
}
