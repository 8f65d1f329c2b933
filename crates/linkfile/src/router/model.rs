//! A checked router file.

use std::path::PathBuf;

use cohaptic_units::Bytes;
use cohaptic_wan::LinkModel;

use super::Network;
use crate::mesh::LinkKeys;

/// A router, ready to be run: every link that a rule names is there.
#[derive(Clone, PartialEq, Debug)]
pub struct RouterFile {
    /// The file it was read from, for messages.
    pub file: PathBuf,
    /// The seed of every random stream.
    pub seed: u64,
    /// How much may be inside all links together.
    pub memory: Memory,
    /// The left side.
    pub left: Attachment,
    /// The right side: of the same kind as the left one.
    pub right: Attachment,
    /// The links, by the places that targets have. Their names differ.
    pub links: Vec<NamedLink>,
    /// The rules, in the order in which they are asked.
    pub rules: Vec<RuleSpec>,
    /// Where packets go to which no rule applies, by the side they come from: left, right.
    pub default: [Target; 2],
}

/// How much may be inside all links together. A packet beyond it is dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Memory {
    /// Packets, copies included.
    pub packets: u64,
    /// Their bytes, copies included.
    pub bytes: Bytes,
}

/// A link and what it is called.
#[derive(Clone, PartialEq, Debug)]
pub struct NamedLink {
    /// Its name.
    pub name: String,
    /// Its keys, to be shown and changed.
    pub keys: LinkKeys,
    /// What it does, in either direction. Each direction has a queue, a state and random numbers of its own.
    pub model: LinkModel,
}

/// One of the two ends of a router.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Side {
    /// The left one.
    Left,
    /// The right one.
    Right,
}

impl Side {
    /// Both, in the order of arrays that have a place for each.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// `left` or `right`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// The other one: where packets go that come from this one.
    #[must_use]
    pub const fn opposite(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// Its place in [`Side::BOTH`].
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// What a side is attached to.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Attachment {
    /// A TUN device: the host that has it is the end of the network on this side.
    Tun(TunSpec),
    /// An interface that is there: what lies behind it is the network on this side.
    Interface(InterfaceSpec),
}

impl Attachment {
    /// The name of the device.
    #[must_use]
    pub fn device(&self) -> &str {
        match self {
            Self::Tun(tun) => &tun.name,
            Self::Interface(interface) => &interface.name,
        }
    }

    /// The network namespace in which the device is; `None`: that of the program.
    #[must_use]
    pub fn namespace(&self) -> Option<&str> {
        match self {
            Self::Tun(tun) => tun.namespace.as_deref(),
            Self::Interface(interface) => interface.namespace.as_deref(),
        }
    }
}

/// A TUN device.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TunSpec {
    /// Its name.
    pub name: String,
    /// Whether it is there already, with its addresses: then it is left as it is.
    pub existing: bool,
    /// The addresses it is given.
    pub addresses: Vec<Network>,
    /// The largest packet it takes \[bytes\]; `None`: what the system chooses, 1500.
    pub mtu: Option<u16>,
    /// Whether the kernel leaves cutting of large segments and checksums to the router, and takes such segments: fewer system calls for the same packets.
    pub offloads: bool,
    /// The network namespace in which it is made: a name as `ip netns` gives it, or a path; `None`: that of the program.
    pub namespace: Option<String>,
}

/// An interface that is there.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct InterfaceSpec {
    /// Its name.
    pub name: String,
    /// The network namespace in which it is: a name as `ip netns` gives it, or a path; `None`: that of the program.
    pub namespace: Option<String>,
}

/// Where a packet goes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Target {
    /// Through the link in this place.
    Link(usize),
    /// To the other side at once.
    Pass,
    /// Nowhere.
    Drop,
}

/// Which packets go where. A condition that is `None` holds for every packet.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RuleSpec {
    /// The side from which the packet comes.
    pub from: Option<Side>,
    /// The network of its source.
    pub source: Option<Network>,
    /// The network of its destination.
    pub destination: Option<Network>,
    /// Its protocol.
    pub protocol: Option<Protocol>,
    /// The port of its source. A packet without ports has none that could match.
    pub source_port: Option<Ports>,
    /// The port of its destination.
    pub destination_port: Option<Ports>,
    /// The port of its source or that of its destination.
    pub port: Option<Ports>,
    /// Where it goes.
    pub target: Target,
}

/// A range of ports, both ends included; the first is not above the last.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Ports {
    /// The lowest.
    pub first: u16,
    /// The highest.
    pub last: u16,
}

impl Ports {
    /// Whether the port is one of them.
    #[must_use]
    pub const fn contain(self, port: u16) -> bool {
        self.first <= port && port <= self.last
    }
}

/// The number of a transport protocol, as in the header of IPv4.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Protocol(pub u8);

impl Protocol {
    /// ICMP.
    pub const ICMP: Self = Self(1);
    /// TCP.
    pub const TCP: Self = Self(6);
    /// UDP.
    pub const UDP: Self = Self(17);
    /// ICMP for IPv6.
    pub const ICMPV6: Self = Self(58);

    /// Those with a name, and the name.
    pub const NAMED: [(&'static str, Self); 4] = [("tcp", Self::TCP), ("udp", Self::UDP), ("icmp", Self::ICMP), ("icmpv6", Self::ICMPV6)];

    /// Whether it is known where its packets say their ports.
    #[must_use]
    pub const fn has_ports(self) -> bool {
        matches!(self, Self::TCP | Self::UDP)
    }
}
