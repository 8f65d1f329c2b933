//! Opening and accepting of TCP connections.

use std::collections::{BTreeSet, VecDeque};
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::task::Waker;
use std::time::Duration;

use cohaptic_tcp::{Connection, Segment, TcpConfig};
use cohaptic_wan::NodeId;

use super::super::waking::Waiters;
use super::{ConnId, Core, HoldId, LOOPBACK_MTU, ListenId, Listener, SocketName, UNREACHABLE};
use crate::address::Addresses;
use crate::core::unmapped;
use crate::errno::Errno;
use crate::trace::Lost;

/// Settings that connections inherit from their listener: the constants of TCP, and the time to linger when the stream is dropped.
pub(crate) type Inherited = (TcpConfig, Option<Duration>);

impl Core {
    /// Listens at a port that is held. Up to `backlog` + 1 connections may wait to be accepted.
    pub(crate) fn listen(
        &mut self,
        host: NodeId,
        (hold, local): (HoldId, SocketAddr),
        backlog: usize,
        (config, linger): Inherited,
    ) -> io::Result<ListenId> {
        // The port was bound without listening, so another socket that shares the port may have begun to listen in between.
        self.check_alone(host, local, hold)?;
        let id = ListenId(self.tcp.listeners.insert(Listener {
            host,
            local,
            config,
            linger,
            backlog,
            half_open: BTreeSet::new(),
            waiting: VecDeque::new(),
            wakers: Waiters::default(),
            hold,
            gone: None,
        }));
        self.listen_at(hold, id);
        Ok(id)
    }

    /// Opens a connection: its SYN leaves. `bound` is the held port with the local address, or `None` for any free port. After an error the port is still held.
    pub(crate) fn connect_tcp(
        &mut self,
        host: NodeId,
        bound: Option<(HoldId, SocketAddr)>,
        mut remote: SocketAddr,
        mut config: TcpConfig,
    ) -> io::Result<ConnId> {
        let local = bound.map(|(_, local)| local);
        let any = if remote.is_ipv6() { Ipv6Addr::UNSPECIFIED.into() } else { Ipv4Addr::UNSPECIFIED.into() };
        self.note_call(|_| SocketName { kind: "TCP", host, local: local.unwrap_or_else(|| SocketAddr::new(any, 0)), peer: Some(remote) });
        // A connection whose TIME-WAIT has ended by now must not occupy the route that this connection needs.
        self.forget_old();
        let is_six = remote.is_ipv6();
        remote = unmapped(remote);
        let is_mapped = remote.is_ipv6() != is_six;
        if is_mapped && local.is_some_and(|local| !local.ip().is_unspecified()) {
            // A socket that is bound to an address of IPv6 has no address of IPv4 to send from.
            return Errno::NetworkUnreachable.fail();
        }
        // A connection has two ends, so that it cannot go to an address of several hosts.
        if remote.ip().is_multicast() || remote.is_ipv4() && Addresses::is_broadcast(Addresses::short(remote.ip())) {
            return Errno::NetworkUnreachable.fail();
        }
        let loopback: IpAddr = if remote.is_ipv6() { Ipv6Addr::LOCALHOST.into() } else { Ipv4Addr::LOCALHOST.into() };
        if remote.ip().is_unspecified() {
            remote.set_ip(loopback);
        }
        let at = local.map(|local| local.ip()).filter(|ip| !ip.is_unspecified()).map(Addresses::short);
        let from = Addresses::long(self.source(host, at, Addresses::short(remote.ip()), &remote)?, remote.is_ipv6());
        let is_nobodys = !remote.ip().is_loopback() && self.plan.owner_node(remote.ip()).is_none();
        if is_nobodys && !self.is_reachable(host, remote.ip()) {
            return Errno::NetworkUnreachable.fail();
        }
        let port = match local {
            Some(local) => local.port(),
            None => self.port_to(host, from, remote)?,
        };
        let local = SocketAddr::new(from, port);
        if self.tcp.routes.contains_key(&super::route(host, local, remote)) {
            return Errno::AddrNotAvailable.fail();
        }
        // A segment on loopback may be as long as the loopback interface permits.
        if self.is_own(host, remote.ip()) {
            config.mtu = LOOPBACK_MTU;
        }
        let (now, sequence) = (self.now(), self.tcp.initial_sequence(host, self.plan.names()));
        let machine =
            Connection::connect(now, config, local, remote, sequence).map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
        let id = self.tcp.insert(host, machine);
        let end = self.tcp.end_mut(id);
        (end.is_held, end.hold, end.is_mapped) = (true, bound.map(|(hold, _)| hold), is_mapped);
        // No host has the address, but the network reaches the address: as in Linux, the attempt fails after the search for the owner, not at once.
        end.unreachable_at = is_nobodys.then(|| now + UNREACHABLE);
        self.after_call(id);
        Ok(id)
    }

    /// Returns whether `ip` is an address of the host, loopback included.
    pub(super) fn is_own(&self, host: NodeId, ip: IpAddr) -> bool {
        self.plan.is_own(host, Addresses::short(ip), ip.is_ipv6())
    }

    /// Fails if more connections wait than the backlog permits. Linux then drops a SYN, and the ACK that would complete a handshake.
    pub(super) fn check_backlog(&self, id: ListenId) -> Result<(), Lost> {
        let listener = self.tcp.listeners.get(id.0);
        if listener.waiting.len() > listener.backlog { Err(Lost::BacklogFull) } else { Ok(()) }
    }

    /// Handles a SYN that has arrived at a listener: a connection is created whose handshake has begun.
    pub(super) fn take_syn(&mut self, id: ListenId, syn: &Segment<'_>) -> Result<(), Lost> {
        self.check_backlog(id)?;
        let listener = self.tcp.listeners.get(id.0);
        let (host, mut config, linger) = (listener.host, listener.config.clone(), listener.linger);
        let is_mapped = listener.local.is_ipv6() && syn.source.is_ipv4();
        if self.is_own(host, syn.source.ip()) {
            config.mtu = LOOPBACK_MTU;
        }
        let (now, sequence) = (self.now(), self.tcp.initial_sequence(host, self.plan.names()));
        let machine = Connection::accept(now, config, syn, sequence).expect("the constants were checked when they were set");
        let conn = self.tcp.insert(host, machine);
        let end = self.tcp.end_mut(conn);
        (end.listener, end.linger, end.is_mapped) = (Some(id), linger, is_mapped);
        // Half-open connections do not count against the backlog, which limits complete connections.
        self.tcp.listeners.get_mut(id.0).half_open.insert(conn);
        self.settle(conn);
        Ok(())
    }

    /// Moves a connection whose handshake is complete to the queue of the listener. Does nothing for a connection that is in the queue already.
    pub(super) fn wait_to_be_taken(&mut self, id: ListenId, conn: ConnId) {
        let listener = self.tcp.listeners.get_mut(id.0);
        if listener.half_open.remove(&conn) {
            listener.waiting.push_back(conn);
            listener.wakers.wake(&mut self.woken);
        }
    }

    /// Accepts the connection with the longest wait. Returns `None` if no connection waits.
    pub(crate) fn accept(&mut self, id: ListenId) -> io::Result<Option<(ConnId, SocketAddr)>> {
        self.note_call(|core| core.tcp.listeners.get(id.0).name());
        self.check_listener(id)?;
        let Some(conn) = self.tcp.listeners.get_mut(id.0).waiting.pop_front() else { return Ok(None) };
        self.tcp.calls += 1;
        let end = self.tcp.end_mut(conn);
        (end.is_held, end.listener) = (true, None);
        Ok(Some((conn, end.shown(end.machine.peer_addr()))))
    }

    /// Returns whether a connection waits to be accepted.
    #[cfg(feature = "facade")]
    pub(crate) fn has_waiting(&self, id: ListenId) -> bool {
        !self.tcp.listeners.get(id.0).waiting.is_empty()
    }

    /// Registers a task that waits for a connection to accept.
    pub(crate) fn wait_to_accept(&mut self, id: ListenId, waker: &Waker) {
        self.tcp.listeners.get_mut(id.0).wakers.wait(waker);
    }

    pub(crate) fn listener_address(&self, id: ListenId) -> SocketAddr {
        self.tcp.listeners.get(id.0).local
    }

    /// Returns the constants of the connections that the listener will accept.
    pub(crate) fn listener_config(&mut self, id: ListenId) -> &mut TcpConfig {
        &mut self.tcp.listeners.get_mut(id.0).config
    }

    /// Returns the constants and the time to linger of the connections that the listener will accept.
    #[cfg(feature = "facade")]
    pub(crate) fn listener_inherited(&mut self, id: ListenId) -> (&mut TcpConfig, &mut Option<Duration>) {
        let listener = self.tcp.listeners.get_mut(id.0);
        (&mut listener.config, &mut listener.linger)
    }

    pub(crate) fn check_listener(&self, id: ListenId) -> io::Result<()> {
        let listener = self.tcp.listeners.get(id.0);
        self.check_gone(listener.gone, listener.host, listener.local)
    }

    /// Closes a listener that the program has dropped.
    pub(crate) fn close_listener(&mut self, id: ListenId) {
        self.stop_listening(id);
        self.tcp.listeners.remove(id.0);
    }

    /// Ends the acceptance of connections. Waiting connections are reset. Connections whose handshake is not complete are forgotten, so that the next segment
    /// of the peer is refused.
    pub(super) fn stop_listening(&mut self, id: ListenId) {
        let listener = self.tcp.listeners.get_mut(id.0);
        let (half_open, waiting) = (std::mem::take(&mut listener.half_open), std::mem::take(&mut listener.waiting));
        self.tcp.ports.release(listener.hold);
        for conn in half_open {
            self.remove_connection(conn);
        }
        for conn in waiting {
            let end = self.tcp.end_mut(conn);
            // Without a listener nothing holds the connection, so `settle` removes it after the reset.
            end.listener = None;
            end.machine.abort();
            self.settle(conn);
        }
        self.take_arrivals();
    }
}
