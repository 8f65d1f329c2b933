//! Multicast over IPv4: groups, memberships, and the receivers of a datagram to a group.
//!
//! A datagram to a group reaches the hosts of the sender's network with a membership, a copy over each link. NATs and firewalls forward no
//! multicast, as home routers do not. As with Linux, memberships are those of a host: every socket of the port hears the group, also if only another socket has
//! joined.

use std::io;
use std::net::Ipv4Addr;

use cohaptic_wan::{NodeId, Path};

use super::socket_state::SocketState;
use super::{Core, Ends, Parcel, SocketId};
use crate::address::Addresses;
use crate::errno::Errno;

/// Multicast of a socket.
#[derive(Clone, Debug)]
pub(crate) struct Multicast {
    /// Time to live of sent datagrams. 0 keeps a datagram on its host. Without multicast routers every larger value means the own network.
    pub(crate) ttl: u32,
    /// `true` if sockets of the own host hear the datagrams.
    pub(crate) loops: bool,
    /// Joined groups, in short form.
    groups: Vec<u32>,
}

impl Default for Multicast {
    /// Returns the defaults of Linux.
    fn default() -> Self {
        Self { ttl: 1, loops: true, groups: Vec::new() }
    }
}

impl SocketState {
    /// Returns the settings of the socket for multicast, by default those of Linux.
    pub(super) fn multicast_or_default(&self) -> Multicast {
        self.multicast.as_deref().cloned().unwrap_or_default()
    }
}

impl Core {
    /// Returns the settings of a socket for multicast.
    pub(crate) fn multicast(&mut self, id: SocketId) -> &mut Multicast {
        self.sockets.get_mut(id).multicast.get_or_insert_default()
    }

    /// Joins a group by the interface with the address `interface`, where the unspecified address stands for the uplink.
    pub(crate) fn join_group(&mut self, id: SocketId, group: Ipv4Addr, interface: Ipv4Addr) -> io::Result<()> {
        let (host, group) = self.check_group(id, group, interface)?;
        let groups = &mut self.multicast(id).groups;
        if groups.contains(&group) {
            return Errno::AddrInUse.fail();
        }
        groups.push(group);
        self.hosts[host.index()].groups.push(group);
        Ok(())
    }

    /// Leaves a joined group.
    pub(crate) fn leave_group(&mut self, id: SocketId, group: Ipv4Addr, interface: Ipv4Addr) -> io::Result<()> {
        let (host, group) = self.check_group(id, group, interface)?;
        let groups = &mut self.multicast(id).groups;
        let Some(place) = groups.iter().position(|other| *other == group) else { return Errno::AddrNotAvailable.fail() };
        groups.remove(place);
        self.forget_membership(host, group);
        Ok(())
    }

    /// Checks the address of a group, and that the host of the socket has the address of the interface. Returns the host, and the group in short form.
    fn check_group(&self, id: SocketId, group: Ipv4Addr, interface: Ipv4Addr) -> io::Result<(NodeId, u32)> {
        self.check_alive(id)?;
        let host = self.sockets.get(id).host;
        if !group.is_multicast() {
            return Errno::InvalidInput.fail();
        }
        if !interface.is_unspecified() && !self.plan.is_own(host, Addresses::short(interface.into()), false) {
            return Errno::NoDevice.fail();
        }
        Ok((host, Addresses::short(group.into())))
    }

    /// Leaves all groups of a closed socket.
    pub(super) fn leave_all(&mut self, state: &SocketState) {
        // A crash of the host ends all memberships. New sockets may have joined the same groups since.
        for group in state.multicast.iter().filter(|_| state.died.is_none()).flat_map(|multicast| &multicast.groups) {
            self.forget_membership(state.host, *group);
        }
    }

    /// Removes a membership of a host.
    fn forget_membership(&mut self, host: NodeId, group: u32) {
        let groups = &mut self.hosts[host.index()].groups;
        if let Some(place) = groups.iter().position(|other| *other == group) {
            groups.swap_remove(place);
        }
    }

    /// Returns whether a packet goes to a group of `host`.
    #[cold]
    pub(super) fn is_member(&self, host: NodeId, ends: &Ends) -> bool {
        ends.is_multicast() && self.hosts[host.index()].groups.contains(&ends.to)
    }

    /// Sends a datagram to the members of the group.
    pub(super) fn send_to_group(&mut self, id: SocketId, host: NodeId, parcel: Box<Parcel>) {
        let Multicast { ttl, loops, .. } = self.sockets.get(id).multicast_or_default();
        let ends = parcel.addresses;
        if ttl > 0 {
            // The nodes of hosts with several interfaces are looked up by their host. Each copy takes a different link.
            let paths = (0..self.hosts.len()).map(|other| Path { from: host, to: NodeId::new(other) });
            let is_receiver = |path: &Path| {
                let receiver = self.plan.host_of(self.receiver(*path));
                receiver != host && self.hosts[receiver.index()].groups.contains(&ends.to)
            };
            for path in paths.filter(is_receiver).collect::<Vec<_>>() {
                self.offer(path, parcel.clone());
            }
        }
        if loops && self.is_member(host, &ends) { self.hand_over(host, parcel) } else { self.spare.put(parcel) }
    }
}
