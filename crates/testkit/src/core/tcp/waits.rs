//! Descriptions of the waits of tasks at TCP sockets. Reported when programs wait for ever.

use std::task::Waker;

use cohaptic_tcp::State;

use super::Core;

impl Core {
    /// Returns descriptions of the TCP sockets for which the task with the waker `waker` waits.
    pub(in crate::core) fn tcp_awaited_by(&self, waker: &Waker) -> impl Iterator<Item = String> {
        let listeners = self.tcp.listeners.iter().map(|(_, listener)| listener).filter(|listener| listener.wakers.has(waker));
        let listeners = listeners.map(|listener| format!("a connection at the TCP listener {}", listener.local));
        let ends = self.tcp.connections.iter().filter(|(_, end)| end.readers.has(waker) || end.writers.has(waker));
        let ends = ends.map(|(_, end)| format!("TCP {} to {} ({:?})", end.machine.local_addr(), end.machine.peer_addr(), end.machine.info().state));
        listeners.chain(ends)
    }

    /// Returns a line for each TCP socket with a waiting task, or with data that the program of the peer does not read.
    pub(in crate::core) fn tcp_waits(&self) -> impl Iterator<Item = String> {
        let names = self.plan.names();
        let listeners = self.tcp.listeners.iter().map(|(_, listener)| listener).filter(|listener| !listener.wakers.is_empty());
        let listeners = listeners
            .map(|listener| format!("host `{}`: the TCP listener at {} waits for a connection", names[listener.host.index()], listener.local));
        let connections = self.tcp.connections.iter().filter_map(|(_, end)| {
            let is_held_back = end.machine.is_held_by_window();
            let waits = match (end.readers.is_empty(), end.writers.is_empty()) {
                // Also without a waiting task, held-back data explains why a run never ends.
                (true, true) if !is_held_back => return None,
                (true, true) => "holds data",
                (false, true) => "waits to read",
                (true, false) if matches!(end.machine.state(), State::SynSent | State::SynReceived) => "waits for the handshake",
                (true, false) => "waits to write",
                (false, false) => "waits to read and to write",
            };
            let info = end.machine.info();
            let (local, peer) = (end.machine.local_addr(), end.machine.peer_addr());
            let mut text = format!("host `{}`: TCP {local} to {peer} ({:?}) {waits}", names[end.host.index()], info.state);
            if is_held_back {
                // Each host has its own loopback, so the reader is a task of the same host.
                let reader = if peer.ip().is_loopback() { Some(end.host) } else { self.plan.owner_node(peer.ip()) };
                let reader = reader.map_or("?", |host| &names[host.index()]);
                text.push_str(&format!("; {} octets wait, because the program of host `{reader}` does not read", info.unacknowledged));
            }
            if info.unread > 0 {
                text.push_str(&format!("; {} octets are there to be read", info.unread));
            }
            Some(text)
        });
        listeners.chain(connections)
    }
}
