//! The two ends of a packet, in as few bytes as they take: the event queue moves them.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use super::bound::Port;
use crate::address::Addresses;

/// The two ends of a packet, and its kind.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Ends {
    /// Sender and receiver, as [`Addresses::short`].
    pub(super) from: u32,
    pub(super) to: u32,
    from_port: u16,
    to_port: u16,
    is_six: bool,
    pub(super) kind: Kind,
}

/// What a packet is.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(super) enum Kind {
    #[default]
    Datagram,
    /// "There is no socket at that port", which IP tells a sender.
    Unreachable,
    /// A segment of TCP: the bytes are the whole IP packet.
    #[cfg(feature = "tcp")]
    Segment,
}

impl Ends {
    /// Both of one version of IP, and addresses of hosts, of loopback or for all.
    #[cfg(any(test, feature = "tcp"))]
    pub(super) fn new(from: SocketAddr, to: SocketAddr, kind: Kind) -> Self {
        Self::of([from, to].map(|end| Addresses::short(end.ip())), [from, to].map(|end| end.port()), to.is_ipv6(), kind)
    }

    /// As [`Ends::new`], of short addresses.
    #[inline]
    pub(super) const fn of([from, to]: [u32; 2], [from_port, to_port]: [u16; 2], is_six: bool, kind: Kind) -> Self {
        Self { from, to, from_port, to_port, is_six, kind }
    }

    /// The version and the port of the receiver.
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

    /// Whether it goes to an address that every host has: of loopback, or for all.
    #[inline(never)]
    pub(super) fn is_to_any_host(&self) -> bool {
        self.is_broadcast() || Addresses::is_loopback(self.to, self.is_six)
    }

    /// Whether it goes to all hosts.
    pub(super) fn is_broadcast(&self) -> bool {
        self.to().ip() == IpAddr::V4(Ipv4Addr::BROADCAST)
    }

    /// What goes back.
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
