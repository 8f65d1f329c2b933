//! Addresses and ports of both ends of a packet, packed into 16 bytes because the event queue moves them with the packet.

use std::net::{IpAddr, SocketAddr, SocketAddrV6};
use std::num::NonZeroU8;

use cohaptic_wan::{Path, flow_number};

use super::bound::Port;
use crate::address::Addresses;
use crate::groups::Group;
use crate::wire::{Form, HasFlow};

/// Returns the address of IPv4 as a socket of IPv6 shows it; an address of IPv6 as it is.
pub(crate) fn mapped(address: SocketAddr) -> SocketAddr {
    match address.ip() {
        IpAddr::V4(v4) => SocketAddr::new(v4.to_ipv6_mapped().into(), address.port()),
        IpAddr::V6(_) => address,
    }
}

/// Returns the address of IPv4 for an address such as `::ffff:10.0.0.1`. Other addresses of IPv6 lose their flow label, and all addresses but those of groups
/// lose the number of the interface.
#[inline]
pub(crate) fn unmapped(address: SocketAddr) -> SocketAddr {
    match address {
        SocketAddr::V4(_) => address,
        SocketAddr::V6(six) if six.ip().is_multicast() => SocketAddrV6::new(*six.ip(), six.port(), 0, six.scope_id()).into(),
        SocketAddr::V6(six) => SocketAddr::new(six.ip().to_canonical(), six.port()),
    }
}

/// Both ends of a packet, and the kind of the packet.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Ends {
    /// Address of the sender, as [`Addresses::short`].
    pub(super) from: u32,
    /// Address of the receiver, as [`Addresses::short`].
    pub(super) to: u32,
    pub(super) from_port: u16,
    pub(super) to_port: u16,
    /// `true` if both addresses are of IPv6.
    pub(super) is_six: bool,
    /// `true` if a socket of IPv6 has received the packet over IPv4, so that its program sees the addresses as `::ffff:10.0.0.1` (RFC 4291, section 2.5.5.2).
    pub(super) is_mapped: bool,
    pub(super) kind: Kind,
    /// Flags and scope of the group of IPv6 to which the packet goes; `None` for all other receivers. See [`Group`].
    pub(super) scope: Option<NonZeroU8>,
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
        Self { from, to, from_port, to_port, is_six, is_mapped: false, kind, scope: None }
    }

    /// Returns the port of the receiver, with the version of IP.
    #[inline]
    pub(super) const fn port(&self) -> Port {
        Port::new(self.is_six, self.to_port)
    }

    /// Returns the address of the sender, as the receiving program sees it.
    #[inline]
    pub(super) fn from(&self) -> SocketAddr {
        self.shown(SocketAddr::new(Addresses::long(self.from, self.is_six), self.from_port))
    }

    /// Returns the address of the receiver, as the receiving program sees it.
    #[inline]
    pub(super) fn to(&self) -> SocketAddr {
        let ip = if self.scope.is_some() { self.group().map(Group::address) } else { None };
        self.shown(SocketAddr::new(ip.unwrap_or_else(|| Addresses::long(self.to, self.is_six)), self.to_port))
    }

    #[inline]
    fn shown(&self, address: SocketAddr) -> SocketAddr {
        if self.is_mapped { mapped(address) } else { address }
    }

    /// Returns whether the packet goes to an address that every host has: an address of loopback, or broadcast.
    #[inline(never)]
    pub(super) fn is_to_any_host(&self) -> bool {
        self.is_broadcast() || Addresses::is_loopback(self.to, self.is_six)
    }

    /// Returns whether the packet goes to a multicast group.
    pub(super) const fn is_multicast(&self) -> bool {
        self.scope.is_some() || !self.is_six && Addresses::is_multicast(self.to)
    }

    /// Returns the multicast group to which the packet goes.
    pub(super) fn group(&self) -> Option<Group> {
        self.is_multicast().then_some(Group { short: self.to, scope: self.scope })
    }

    /// Returns whether the packet goes to a broadcast address.
    pub(super) fn is_broadcast(&self) -> bool {
        !self.is_six && Addresses::is_broadcast(self.to)
    }

    /// Returns the ends of an answer of kind `kind`: sender and receiver are swapped.
    pub(super) const fn back(self, kind: Kind) -> Self {
        let Self { from, to, from_port, to_port, is_six, .. } = self;
        Self::of([to, from], [to_port, from_port], is_six, kind)
    }
}

impl HasFlow for Ends {
    /// Protocol, addresses and ports: what a router knows of a packet.
    fn flow(&self, _path: Path) -> u32 {
        let addresses = u64::from(self.from) << 32 | u64::from(self.to);
        let ports = u64::from(self.from_port) << 16 | u64::from(self.to_port);
        let scope = self.scope.map_or(0, |scope| u64::from(scope.get()));
        flow_number(&[addresses, scope << 40 | (self.kind as u64) << 33 | u64::from(self.is_six) << 32 | ports])
    }

    fn form(&self) -> Form {
        match self.kind {
            Kind::Datagram => Form::Datagram([self.from(), self.to()]),
            Kind::Unreachable => Form::Content,
            #[cfg(feature = "tcp")]
            Kind::Segment => Form::Packet,
        }
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
        let group = Group::of("ff02::fb".parse().unwrap()).unwrap();
        let ends = Ends::of([1, group.short], [1, 5353], true, Kind::Datagram);
        // The identifier of the group is the number of a host, too.
        assert_eq!((ends.to().to_string(), ends.group()), ("[fd00::fb]:5353".to_owned(), None));
        let ends = Ends { scope: group.scope, ..ends };
        assert_eq!((ends.to().to_string(), ends.group()), ("[ff02::fb]:5353".to_owned(), Some(group)));
        assert_eq!(size_of::<Ends>(), 16);
    }
}
