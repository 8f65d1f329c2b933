//! Changes of a UDP socket for multicast.

use std::io;

use cohaptic_sockets::{Datagrams, Interface, Membership, Version};

/// Change of a UDP socket for multicast. A placeholder cannot keep the change: the system has other interfaces than the hosts of a test bed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MulticastChange {
    /// Joins or leaves a group.
    Membership(Membership),
    /// Selects the interface for sent datagrams over a version of IP.
    Interface(Version, Interface),
}

impl MulticastChange {
    /// Changes a socket of a test bed.
    pub(crate) fn apply(self, socket: &dyn Datagrams) -> io::Result<()> {
        match self {
            Self::Membership(membership) => socket.change_membership(membership),
            Self::Interface(version, interface) => socket.select_interface(version, interface),
        }
    }
}
