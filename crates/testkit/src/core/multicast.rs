//! Multicast: groups, memberships, outgoing interfaces, and the receivers of a datagram to a group.
//!
//! A datagram to a group reaches the hosts of the sender's network with a membership, a copy over each link. NATs and firewalls forward no
//! multicast, as home routers do not. As with Linux, memberships are those of a host: every socket of the port hears the group, also if only another socket has
//! joined, and every host is a member of the groups of all hosts.

use std::io;
use std::net::{IpAddr, Ipv4Addr};

use cohaptic_wan::{NodeId, Path};

use super::socket_state::SocketState;
use super::{Core, Ends, Parcel, SocketId};
use crate::address::Addresses;
use crate::errno::Errno;
use crate::groups::Group;

/// Number of the loopback interface. Further interfaces of a host have the numbers from 2 on, in the order of the configuration.
const LOOPBACK: u32 = 1;

/// Interface of a host, as a program names the interface.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Interface {
    /// By an address of IPv4. The unspecified address stands for the uplink.
    Address(Ipv4Addr),
    /// By the number. 0 stands for the uplink.
    Number(u32),
}

impl Interface {
    const fn is_any(self) -> bool {
        match self {
            Self::Address(address) => address.is_unspecified(),
            Self::Number(number) => number == 0,
        }
    }
}

/// Settings of a socket for multicast over one version of IP.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MulticastSettings {
    /// Time to live, or limit of hops, of sent datagrams. 0 keeps a datagram on its host. Without multicast routers every larger value means the own network.
    pub(crate) ttl: u32,
    /// `true` if sockets of the own host hear the datagrams.
    pub(crate) loops: bool,
    /// Number of the interface for sent datagrams; 0 for the uplink.
    pub(crate) interface: u32,
    /// Address by which the program has named the interface. Unspecified after a number.
    pub(crate) named: Ipv4Addr,
}

impl Default for MulticastSettings {
    /// Returns the defaults of Linux.
    fn default() -> Self {
        Self { ttl: 1, loops: true, interface: 0, named: Ipv4Addr::UNSPECIFIED }
    }
}

/// Multicast of a socket.
#[derive(Clone, Debug, Default)]
pub(crate) struct Multicast {
    /// Settings by version of IP: IPv4, IPv6.
    pub(crate) settings: [MulticastSettings; 2],
    /// Number of the interface in the address of a socket that is bound to a group of a link; 0 for other sockets.
    pub(super) zone: u32,
    joined: Vec<Joined>,
}

impl Multicast {
    /// Returns the defaults of a socket that is bound to a group of a link, by the interface with the number `zone`.
    pub(super) fn of_zone(zone: u32) -> Self {
        Self { zone, ..Self::default() }
    }
}

/// Membership of a socket.
#[derive(Clone, Copy, Debug)]
struct Joined {
    group: Group,
    /// Number of the interface.
    number: u32,
    /// Interface as named by the program.
    by: Interface,
}

impl SocketState {
    /// Returns the settings of the socket for multicast over a version of IP, by default those of Linux.
    pub(super) fn multicast_settings(&self, is_six: bool) -> MulticastSettings {
        self.multicast.as_deref().map(|multicast| multicast.settings[usize::from(is_six)]).unwrap_or_default()
    }
}

impl Core {
    /// Returns the settings of a socket for multicast.
    pub(crate) fn multicast(&mut self, id: SocketId) -> &mut Multicast {
        self.sockets.get_mut(id).multicast.get_or_insert_default()
    }

    /// Returns the settings of a socket for multicast over a version of IP.
    ///
    /// # Errors
    ///
    /// `ENOPROTOOPT`, as with Linux, for IPv6 and a socket of IPv4.
    pub(crate) fn multicast_settings(&mut self, id: SocketId, is_six: bool) -> io::Result<&mut MulticastSettings> {
        self.check_version(id, is_six)?;
        Ok(&mut self.multicast(id).settings[usize::from(is_six)])
    }

    /// Selects the interface for sent datagrams.
    ///
    /// # Errors
    ///
    /// `EADDRNOTAVAIL` with IPv4 and `ENODEV` with IPv6, as with Linux, if the host does not have the interface.
    pub(crate) fn select_interface(&mut self, id: SocketId, is_six: bool, interface: Interface) -> io::Result<()> {
        let host = self.sockets.get(id).host;
        let number = self.number_of(host, interface);
        let settings = self.multicast_settings(id, is_six)?;
        let Some(number) = number else { return if is_six { Errno::NoDevice.fail() } else { Errno::AddrNotAvailable.fail() } };
        settings.interface = if interface.is_any() { 0 } else { number };
        settings.named = if let Interface::Address(address) = interface { address } else { Ipv4Addr::UNSPECIFIED };
        Ok(())
    }

    /// Joins a group by an interface.
    pub(crate) fn join_group(&mut self, id: SocketId, group: IpAddr, by: Interface) -> io::Result<()> {
        let (host, group) = self.check_group(id, group)?;
        let Some(number) = self.number_of(host, by) else { return Errno::NoDevice.fail() };
        let joined = &mut self.multicast(id).joined;
        if joined.iter().any(|other| (other.group, other.number) == (group, number)) {
            return Errno::AddrInUse.fail();
        }
        joined.push(Joined { group, number, by });
        self.hosts[host.index()].groups.push(group);
        Ok(())
    }

    /// Leaves a joined group. Without an interface the first membership in the group ends.
    pub(crate) fn leave_group(&mut self, id: SocketId, group: IpAddr, by: Interface) -> io::Result<()> {
        let (host, group) = self.check_group(id, group)?;
        let joined = &mut self.multicast(id).joined;
        let is_by = |joined: &Joined| match by {
            _ if by.is_any() => true,
            Interface::Number(number) => joined.number == number,
            // As with Linux, the address is compared with the address of the call that has joined.
            Interface::Address(_) => joined.by == by,
        };
        let Some(place) = joined.iter().position(|joined| joined.group == group && is_by(joined)) else { return Errno::AddrNotAvailable.fail() };
        joined.remove(place);
        self.forget_membership(host, group);
        Ok(())
    }

    /// Checks the address of a group. Returns the host of the socket, and the group.
    fn check_group(&self, id: SocketId, group: IpAddr) -> io::Result<(NodeId, Group)> {
        self.check_alive(id)?;
        self.check_version(id, group.is_ipv6())?;
        Ok((self.sockets.get(id).host, Group::parse(group)?))
    }

    /// Checks that a socket has options of a version of IP. A socket of IPv6 has the options of IPv4 as well.
    fn check_version(&self, id: SocketId, is_six: bool) -> io::Result<()> {
        if is_six && !self.sockets.get(id).port.is_six() { Errno::NoSuchOption.fail() } else { Ok(()) }
    }

    /// Returns the number of an interface of a host, or `None` if the host does not have the interface.
    fn number_of(&self, host: NodeId, interface: Interface) -> Option<u32> {
        // A host without configured interfaces has a single interface beside loopback.
        let nodes = self.plan.nodes_of(host);
        let numbered = |is_it: &dyn Fn(NodeId) -> bool| (LOOPBACK + 1..).zip(nodes).find(|(_, node)| is_it(**node)).map(|(number, _)| number);
        match interface {
            _ if interface.is_any() && nodes.is_empty() => Some(LOOPBACK + 1),
            _ if interface.is_any() => numbered(&|node| node == self.plan.uplink(host)),
            Interface::Number(number) => (number == LOOPBACK || self.node_of(host, number).is_some()).then_some(number),
            Interface::Address(address) => match Addresses::short(address.into()) {
                short if Addresses::is_loopback(short, false) => Some(LOOPBACK),
                short if nodes.is_empty() => (self.plan.short(host, false) == short).then_some(LOOPBACK + 1),
                short => numbered(&|node| self.plan.short(node, false) == short),
            },
        }
    }

    /// Returns the node of the interface with the number `number`; `None` for loopback, and for numbers of no interface.
    fn node_of(&self, host: NodeId, number: u32) -> Option<NodeId> {
        let place = number.checked_sub(LOOPBACK + 1)? as usize;
        match self.plan.nodes_of(host) {
            [] => (place == 0).then_some(host),
            nodes => nodes.get(place).copied(),
        }
    }

    /// Checks the interface in the address of a socket that is to be bound to a group of a link. Returns the number of the interface, or 0 for other groups.
    ///
    /// # Errors
    ///
    /// As with Linux, `EINVAL` without an interface, and `ENODEV` if the host does not have the interface.
    pub(super) fn zone_of(&self, host: NodeId, group: Group, zone: u32) -> io::Result<u32> {
        match zone {
            _ if !group.needs_interface() => Ok(0),
            0 => Errno::InvalidInput.fail(),
            zone if self.number_of(host, Interface::Number(zone)).is_none() => Errno::NoDevice.fail(),
            zone => Ok(zone),
        }
    }

    /// Returns the source address of a datagram of `socket`, sent from `at`, to a group. `zone` is the number of the interface in the address of the group; 0
    /// for none. All addresses are as [`Addresses::short`]. The source decides about the interface: a datagram from loopback stays on its host.
    ///
    /// # Errors
    ///
    /// As with Linux, `ENETUNREACH` if the address of the group names an interface that has no way to the group.
    pub(super) fn source_to_group(&self, socket: &SocketState, at: Option<u32>, group: Group, zone: u32) -> io::Result<u32> {
        let (host, is_six) = (socket.host, group.scope.is_some());
        let zone = if group.needs_interface() { zone } else { 0 };
        if zone != 0 && self.node_of(host, zone).is_none() {
            return Errno::NetworkUnreachable.fail();
        }
        match (at, if zone == 0 { socket.multicast_settings(is_six).interface } else { zone }) {
            (Some(at), _) if Addresses::is_loopback(at, is_six) => Ok(at),
            (Some(at), _) => self.check_source(host, at, group.short, is_six).map(|()| at),
            (None, LOOPBACK) => Ok(Addresses::LOOPBACK[usize::from(is_six)]),
            (None, number) => Ok(self.plan.short(self.node_of(host, number).unwrap_or(host), is_six)),
        }
    }

    /// Leaves all groups of a closed socket.
    pub(super) fn leave_all(&mut self, state: &SocketState) {
        // A crash of the host ends all memberships. New sockets may have joined the same groups since.
        for joined in state.multicast.iter().filter(|_| state.died.is_none()).flat_map(|multicast| &multicast.joined) {
            self.forget_membership(state.host, joined.group);
        }
    }

    /// Removes a membership of a host.
    fn forget_membership(&mut self, host: NodeId, group: Group) {
        let groups = &mut self.hosts[host.index()].groups;
        if let Some(place) = groups.iter().position(|other| *other == group) {
            groups.swap_remove(place);
        }
    }

    /// Returns whether a packet goes to a group of `host`.
    #[cold]
    pub(super) fn is_member(&self, host: NodeId, ends: &Ends) -> bool {
        ends.group().is_some_and(|group| group.is_of_all_hosts() || self.hosts[host.index()].groups.contains(&group))
    }

    /// Sends a datagram to the members of the group.
    pub(super) fn send_to_group(&mut self, id: SocketId, host: NodeId, parcel: Box<Parcel>) {
        let ends = parcel.addresses;
        let MulticastSettings { ttl, loops, .. } = self.sockets.get(id).multicast_settings(ends.is_six);
        let stays = ends.group().is_some_and(Group::stays_on_host) || Addresses::is_loopback(ends.from, ends.is_six);
        if ttl > 0 && !stays {
            // The nodes of hosts with several interfaces are looked up by their host. Each copy takes a different link.
            let paths = (0..self.hosts.len()).map(|other| Path { from: host, to: NodeId::new(other) });
            let is_receiver = |path: &Path| {
                let receiver = self.plan.host_of(self.receiver(*path));
                receiver != host && self.is_member(receiver, &ends)
            };
            for path in paths.filter(is_receiver).collect::<Vec<_>>() {
                self.offer(path, parcel.clone());
            }
        }
        if loops && self.is_member(host, &ends) { self.hand_over(host, parcel) } else { self.spare.put(parcel) }
    }
}
