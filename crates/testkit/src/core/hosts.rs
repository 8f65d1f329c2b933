//! Hosts: up or down, with their ports.

use std::collections::BTreeMap;

use cohaptic_wan::NodeId;

use super::{Core, SocketId};
use crate::address::Addresses;
use crate::trace::Happening;

/// A host.
#[derive(Debug, Default)]
pub(super) struct HostState {
    pub(super) is_down: bool,
    /// The sockets of a port, by version (6 or not) and port.
    pub(super) ports: BTreeMap<(bool, u16), Vec<SocketId>>,
    /// The port that is given next to a socket that asks for none.
    pub(super) next_port: u16,
}

impl Core {
    pub(crate) fn is_up(&self, host: NodeId) -> bool {
        !self.hosts[host.index()].is_down
    }

    /// The host is gone with all its sockets. What it has sent is on its way still.
    pub(crate) fn crash(&mut self, host: NodeId) {
        let state = &mut self.hosts[host.index()];
        if std::mem::replace(&mut state.is_down, true) {
            return;
        }
        state.ports.clear();
        let now = self.now();
        for socket in self.sockets.all_of(host) {
            socket.die(now, &mut self.woken);
        }
        self.wire.note(Happening::Crashed(host));
    }

    pub(crate) fn restart(&mut self, host: NodeId) {
        if std::mem::replace(&mut self.hosts[host.index()].is_down, false) {
            self.wire.note(Happening::Restarted(host));
        }
    }

    /// The host has other addresses from now on.
    pub(crate) fn change_addresses(&mut self, host: NodeId) -> Addresses {
        self.wire.note(Happening::Readdressed(host));
        self.plan.change(host)
    }
}
