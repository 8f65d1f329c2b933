//! Addresses and ports of both ends of a packet, packed into 16 bytes because the event queue moves them with the packet.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use super::bound::Port;
use crate::address::Addresses;

/// Both ends of a packet, and the kind of the packet.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Ends {
    /// Address of the sender, as [`Addresses::short`].
    pub(super) from: u32,
    /// Address of the receiver, as [`Addresses::short`].
    pub(super) to: u32,
    from_port: u16,
    to_port: u16,
    /// `true` if both addresses are of IPv6.
    is_six: bool,
    pub(super) kind: Kind,
}

/// Kind of a packet.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(super) enum Kind {
    #[default]
    Datagram,
    /// Message of IP to the sender of a datagram: no socket is bound to the port.
    Unreachable,
    /// Segment of TCP. The bytes of the packet are the whole IP packet.
    #[cfg(feature = "tcp")]
    Segment,
}

impl Ends {
    /// Packs two addresses. Both must be of the same version of IP, and each must be an address of a host, of loopback, or broadcast.
    #[cfg(any(test, feature = "tcp"))]
    pub(super) fn new(from: SocketAddr, to: SocketAddr, kind: Kind) -> Self {
        Self::of([from, to].map(|end| Addresses::short(end.ip())), [from, to].map(|end| end.port()), to.is_ipv6(), kind)
    }

    /// Like [`Ends::new`], but takes short addresses.
    pub(super) const fn of([from, to]: [u32; 2], [from_port, to_port]: [u16; 2], is_six: bool, kind: Kind) -> Self {
        Self { from, to, from_port, to_port, is_six, kind }
    }

    /// Returns the port of the receiver, with the version of IP.
    #[inline]
    pub(super) const fn port(&self) -> Port {
        Port::new(self.is_six, self.to_port)
    }

    #[inline]
    pub(super) fn from(&self) -> SocketAddr {
        SocketAddr::new(Addresses::long(self.from, self.is_six), self.from_port)
    }

    #[inline]
    pub(super) fn to(&self) -> SocketAddr {
        SocketAddr::new(Addresses::long(self.to, self.is_six), self.to_port)
    }

    /// Returns whether the packet goes to an address that every host has: an address of loopback, or broadcast.
    #[inline(never)]
    pub(super) fn is_to_any_host(&self) -> bool {
        self.is_broadcast() || Addresses::is_loopback(self.to, self.is_six)
    }

    /// Returns whether the packet goes to the broadcast address 255.255.255.255.
    pub(super) fn is_broadcast(&self) -> bool {
        self.to().ip() == IpAddr::V4(Ipv4Addr::BROADCAST)
    }

    /// Returns the ends of an answer of kind `kind`: sender and receiver are swapped.
    pub(super) const fn back(self, kind: Kind) -> Self {
        let Self { from, to, from_port, to_port, is_six, .. } = self;
        Self { from: to, to: from, from_port: to_port, to_port: from_port, is_six, kind }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_come_back_as_they_were() {
        for [from, to] in [
            ["10.0.0.1:1", "255.255.255.255:65535"],
            ["10.0.1.0:1", "127.0.0.5:2"],
            ["[fd00::1]:1", "[fd00::1:2]:2"],
            ["[::1]:3", "[::1]:4"],
            ["[fd00::7]:3", "[::1]:4"],
        ] {
            let [from, to] = [from, to].map(|end| end.parse().unwrap());
            let ends = Ends::new(from, to, Kind::Datagram);
            assert_eq!((ends.from(), ends.to()), (from, to));
            let back = ends.back(Kind::Unreachable);
            assert_eq!((back.from(), back.to(), back.kind), (to, from, Kind::Unreachable));
        }
        assert_eq!(size_of::<Ends>(), 16);
    }
}
