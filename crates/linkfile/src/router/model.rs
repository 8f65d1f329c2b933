//! Checked content of a router file.

use std::path::PathBuf;

use cohaptic_units::Bytes;
use cohaptic_wan::LinkModel;

use super::Network;
use crate::mesh::LinkKeys;

/// Checked content of a router file. Every target of a rule refers to a link in `links`.
#[derive(Clone, PartialEq, Debug)]
pub struct RouterFile {
    /// Path of the router file, for messages.
    pub file: PathBuf,
    /// Seed of every random stream.
    pub seed: u64,
    /// Bound on packets and bytes inside all links together.
    pub memory: Memory,
    /// Attachment of the left side.
    pub left: Attachment,
    /// Attachment of the right side, of the same kind as the left side.
    pub right: Attachment,
    /// Links with distinct names, indexed by [`Target::Link`].
    pub links: Vec<NamedLink>,
    /// Rules, in the order of trial.
    pub rules: Vec<RuleSpec>,
    /// Targets of packets without a matching rule, indexed by the side of arrival: left, right.
    pub default: [Target; 2],
}

/// Bound on packets and bytes inside all links together. A packet beyond the bound is dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Memory {
    /// Maximum number of packets, copies included.
    pub packets: u64,
    /// Maximum number of bytes in packets, copies included.
    pub bytes: Bytes,
}

/// Named link.
#[derive(Clone, PartialEq, Debug)]
pub struct NamedLink {
    /// Name of the link.
    pub name: String,
    /// Keys of the link, to be shown and changed.
    pub keys: LinkKeys,
    /// Model of the two links of this name, a link in each direction. Each link has a queue, a state and random numbers of its own.
    pub model: LinkModel,
}

/// Side of a router.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Side {
    /// Left side.
    Left,
    /// Right side.
    Right,
}

impl Side {
    /// Both sides, in the order of arrays indexed by side.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// Returns the name of the side: `left` or `right`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// Returns the opposite side, the destination of packets from this side.
    #[must_use]
    pub const fn opposite(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// Returns the index of the side in [`Side::BOTH`].
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// Network device of a side.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Attachment {
    /// A TUN device. The host of the device is the end of the network on this side.
    Tun(TunSpec),
    /// An existing interface. The network behind the interface is the network on this side.
    Interface(InterfaceSpec),
}

impl Attachment {
    /// Returns the name of the device.
    #[must_use]
    pub fn device(&self) -> &str {
        match self {
            Self::Tun(tun) => &tun.name,
            Self::Interface(interface) => &interface.name,
        }
    }

    /// Returns the network namespace of the device, or `None` for the namespace of the program.
    #[must_use]
    pub fn namespace(&self) -> Option<&str> {
        match self {
            Self::Tun(tun) => tun.namespace.as_deref(),
            Self::Interface(interface) => interface.namespace.as_deref(),
        }
    }
}

/// TUN device of a side.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TunSpec {
    /// Name of the device.
    pub name: String,
    /// `true` if the device exists already. An existing device keeps all addresses and the MTU.
    pub existing: bool,
    /// Addresses for the device.
    pub addresses: Vec<Network>,
    /// Largest packet of the device \[bytes\], or `None` for the default of the system, 1500.
    pub mtu: Option<u16>,
    /// `true` if the kernel passes large segments without checksums to the router, and takes such segments back: fewer system calls for the same packets.
    pub offloads: bool,
    /// Network namespace of the device: a name as in `ip netns`, or a path. `None` for the namespace of the program.
    pub namespace: Option<String>,
}

/// Existing interface of a side.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct InterfaceSpec {
    /// Name of the interface.
    pub name: String,
    /// Network namespace of the interface: a name as in `ip netns`, or a path. `None` for the namespace of the program.
    pub namespace: Option<String>,
}

/// Target of a packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Target {
    /// Through the link with this index in [`RouterFile::links`].
    Link(usize),
    /// Directly to the other side, without a link.
    Pass,
    /// The packet is dropped.
    Drop,
}

/// Rule: conditions on a packet, and the target of packets that meet all conditions. A condition `None` holds for every packet.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct RuleSpec {
    /// Side of arrival of the packet.
    pub from: Option<Side>,
    /// Network that contains the source address.
    pub source: Option<Network>,
    /// Network that contains the destination address.
    pub destination: Option<Network>,
    /// Transport protocol of the packet.
    pub protocol: Option<Protocol>,
    /// Ports that contain the source port. A packet without ports never matches.
    pub source_port: Option<Ports>,
    /// Ports that contain the destination port. A packet without ports never matches.
    pub destination_port: Option<Ports>,
    /// Ports that contain the source port or the destination port. A packet without ports never matches.
    pub port: Option<Ports>,
    /// Target of matching packets.
    pub target: Target,
}

/// Range of ports, both ends included. `first` is at most `last`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Ports {
    /// Lowest port.
    pub first: u16,
    /// Highest port.
    pub last: u16,
}

impl Ports {
    /// Returns whether the range contains a port.
    #[must_use]
    pub const fn contain(self, port: u16) -> bool {
        self.first <= port && port <= self.last
    }
}

/// Number of a transport protocol, as in the header of IPv4.
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

    /// Protocols with a name in router files, each after the name.
    pub(crate) const NAMED: [(&'static str, Self); 4] = [("tcp", Self::TCP), ("udp", Self::UDP), ("icmp", Self::ICMP), ("icmpv6", Self::ICMPV6)];

    /// Returns whether the router can read the ports of packets of this protocol: TCP and UDP.
    #[must_use]
    pub const fn has_ports(self) -> bool {
        matches!(self, Self::TCP | Self::UDP)
    }
}
