//! NATs and firewalls as state machines: time and packets go in, translated addresses or causes of loss come out.
//!
//! The terms are those of RFC 4787 (Audet and Jennings 2007): a *mapping* is the external port of an endpoint inside, and the *filter* decides
//! whether an endpoint outside may send to a mapping. The machines know no hosts and no links: [`core`](crate::core) routes packets, and asks the machine of a
//! NAT on the way.

mod session;
mod table;
mod words;

use std::time::Duration;

pub(crate) use session::{Protocol, Signs};
pub(crate) use table::{Endpoint, Flow, Listed, Table};
pub(crate) use words::{parse, parse_words};

/// Behaviour of a NAT or a firewall.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Behaviour {
    /// Kind before the changes by further words, as an index of [`KINDS`].
    kind: usize,
    /// Remote endpoints with a common mapping.
    pub(crate) mapping: Dependence,
    /// Remote endpoints with permission to send to a mapping.
    pub(crate) filter: Dependence,
    pub(crate) ports: Ports,
    /// `true` if two hosts inside reach each other by their external addresses.
    pub(crate) hairpin: bool,
    pub(crate) timeouts: Timeouts,
}

/// Part of a remote endpoint with a meaning for a mapping or a filter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Dependence {
    Endpoint,
    Address,
    AddressAndPort,
}

/// Choice of the external port of a mapping.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Ports {
    /// The port inside, or a random port if another mapping has that port.
    Kept,
    Random,
}

/// Spans without an outbound packet until a session ends.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Timeouts {
    pub(crate) udp: Duration,
    /// Timeout of UDP before the first answer.
    pub(crate) udp_unanswered: Duration,
    /// Timeout of an established connection of TCP.
    pub(crate) tcp: Duration,
    /// Timeout of an opening or closing connection of TCP.
    pub(crate) tcp_transitory: Duration,
}

/// Kind of NAT: name, columns of the table, and whether the network inside is a carrier's (RFC 6598).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Kind {
    name: &'static str,
    is_carrier: bool,
    mapping: Dependence,
    filter: Dependence,
    ports: Ports,
    hairpin: bool,
    /// Timeouts of UDP \[s\]: after an answer, and before.
    udp: [u64; 2],
}

/// Kinds of NAT. `home` is the default, also of firewalls.
const KINDS: [Kind; 5] = {
    use Dependence::{Address, AddressAndPort, Endpoint};
    [
        Kind { name: "home", is_carrier: false, mapping: Endpoint, filter: AddressAndPort, ports: Ports::Kept, hairpin: false, udp: [300, 30] },
        Kind { name: "open", is_carrier: false, mapping: Endpoint, filter: Endpoint, ports: Ports::Kept, hairpin: true, udp: [300, 300] },
        Kind { name: "address", is_carrier: false, mapping: Endpoint, filter: Address, ports: Ports::Kept, hairpin: false, udp: [300, 300] },
        Kind {
            name: "strict",
            is_carrier: false,
            mapping: AddressAndPort,
            filter: AddressAndPort,
            ports: Ports::Random,
            hairpin: false,
            udp: [120, 120],
        },
        Kind { name: "cgnat", is_carrier: true, mapping: Endpoint, filter: Endpoint, ports: Ports::Random, hairpin: true, udp: [300, 300] },
    ]
};

impl Behaviour {
    fn of_kind(kind: usize) -> Self {
        let Kind { mapping, filter, ports, hairpin, udp: [udp, udp_unanswered], .. } = KINDS[kind];
        let timeouts = Timeouts {
            udp: Duration::from_secs(udp),
            udp_unanswered: Duration::from_secs(udp_unanswered),
            // RFC 5382, requirement 5: at least 2 hours and 4 minutes, and at least 4 minutes.
            tcp: Duration::from_secs(7440),
            tcp_transitory: Duration::from_secs(240),
        };
        Self { kind, mapping, filter, ports, hairpin, timeouts }
    }

    /// Returns the behaviour of a kind, counted from 0, the plainest: open, address, home, strict, and cgnat. `None` beyond the last.
    #[cfg(feature = "strategies")]
    pub(crate) fn nth(number: usize) -> Option<Self> {
        let name = *["open", "address", "home", "strict", "cgnat"].get(number)?;
        KINDS.iter().position(|kind| kind.name == name).map(Self::of_kind)
    }

    /// Returns a behaviour by which more packets pass: the kind without changed columns, or the next more open kind. `None` for the kind `open`.
    #[cfg(feature = "strategies")]
    pub(crate) fn plainer(&self) -> Option<Self> {
        let kind = Self::of_kind(self.kind);
        if *self != kind {
            return Some(kind);
        }
        let plainer = match KINDS[self.kind].name {
            "strict" => 2,
            "home" => 1,
            "address" | "cgnat" => 0,
            _ => return None,
        };
        Self::nth(plainer)
    }

    /// Returns whether the hosts inside have addresses of 100.64.0.0/10.
    pub(crate) const fn is_carrier(&self) -> bool {
        KINDS[self.kind].is_carrier
    }
}

impl Default for Behaviour {
    fn default() -> Self {
        Self::of_kind(0)
    }
}
