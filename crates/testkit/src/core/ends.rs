//! The two ends of a packet, in as few bytes as they take: the event queue moves them.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use super::bound::Port;
use crate::address::Addresses;

/// The two ends of a packet, and its kind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ends {
    /// Of version 4 the address, of version 6 its number; 0 is the loopback address then.
    ips: [u32; 2],
    ports: [u16; 2],
    is_six: bool,
    pub(super) kind: Kind,
}

/// What a packet is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    Datagram,
    /// "There is no socket at that port", which IP tells a sender.
    Unreachable,
    /// A segment of TCP: the bytes are the whole IP packet.
    #[cfg(feature = "tcp")]
    Segment,
}

impl Ends {
    /// Both of one version of IP, and addresses of hosts, of loopback or for all.
    #[inline]
    pub(super) fn new(from: SocketAddr, to: SocketAddr, kind: Kind) -> Self {
        let short = |ip| match ip {
            IpAddr::V4(v4) => v4.to_bits(),
            IpAddr::V6(_) => Addresses::number(ip).unwrap_or(0),
        };
        Self { ips: [short(from.ip()), short(to.ip())], ports: [from.port(), to.port()], is_six: to.is_ipv6(), kind }
    }

    /// The version and the port of the receiver.
    #[inline]
    pub(super) const fn port(&self) -> Port {
        Port { is_six: self.is_six, number: self.ports[1] }
    }

    #[inline]
    pub(super) fn from(&self) -> SocketAddr {
        self.end(0)
    }

    #[inline]
    pub(super) fn to(&self) -> SocketAddr {
        self.end(1)
    }

    /// What goes back.
    pub(super) const fn back(self, kind: Kind) -> Self {
        let ([from, to], [from_port, to_port]) = (self.ips, self.ports);
        Self { ips: [to, from], ports: [to_port, from_port], kind, ..self }
    }

    #[inline]
    fn end(&self, which: usize) -> SocketAddr {
        let ip = match (self.is_six, self.ips[which]) {
            (false, bits) => Ipv4Addr::from_bits(bits).into(),
            (true, 0) => Ipv6Addr::LOCALHOST.into(),
            (true, number) => Addresses::numbered(number).v6.into(),
        };
        SocketAddr::new(ip, self.ports[which])
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
