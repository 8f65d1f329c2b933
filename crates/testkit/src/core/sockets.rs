//! UDP sockets: bound ports, datagrams in buffers, and the tasks that wait for datagrams.

use std::collections::VecDeque;
use std::io;
use std::net::{IpAddr, Ipv6Addr, SocketAddr};
use std::task::{Poll, Waker};

use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;
use cohaptic_wan::NodeId;

use super::bound::{Port, SocketId};
use super::multicast::Multicast;
use super::socket_state::SocketState;
use super::waking::Waiters;
use super::{Core, Parcel};
use crate::address::Addresses;
use crate::errno::Errno;
use crate::groups::Group;
use crate::wire::Held;

/// Sockets that have not been closed.
#[derive(Debug, Default)]
pub(super) struct Sockets {
    /// State of each socket, indexed by [`SocketId`]; `None` at free indices. Boxed, so that an index becomes an address by a shift.
    places: Vec<Option<Box<SocketState>>>,
    /// Indices of `places` that are free.
    free: Vec<usize>,
}

impl Sockets {
    fn insert(&mut self, state: SocketState) -> SocketId {
        if let Some(place) = self.free.pop() {
            self.places[place] = Some(Box::new(state));
            return SocketId(place);
        }
        self.places.push(Some(Box::new(state)));
        SocketId(self.places.len() - 1)
    }

    #[inline]
    pub(super) fn get(&self, id: SocketId) -> &SocketState {
        self.places[id.0].as_ref().expect("a socket is open as long as its number is held")
    }

    #[inline]
    pub(super) fn get_mut(&mut self, id: SocketId) -> &mut SocketState {
        self.places[id.0].as_mut().expect("a socket is open as long as its number is held")
    }

    /// Returns the bytes in the buffers of all sockets, as [`Held`] counts them.
    pub(super) fn held(&self) -> u64 {
        self.places.iter().flatten().map(|socket| socket.cost()).sum()
    }

    pub(super) fn all_of(&mut self, host: NodeId) -> impl Iterator<Item = &mut SocketState> {
        self.places.iter_mut().flatten().map(Box::as_mut).filter(move |socket| socket.host == host)
    }
}

/// First of the dynamic ports (RFC 6335), which are given to sockets that ask for no particular port.
pub(super) const FIRST_DYNAMIC: u16 = 49_152;

impl Core {
    /// Binds a socket of a host, which must be up. Port 0 of `wanted` stands for any free dynamic port.
    pub(crate) fn bind(&mut self, host: NodeId, wanted: SocketAddr) -> io::Result<SocketId> {
        let ip = wanted.ip();
        // As with Linux, a socket can be bound to the address of a group, and then hears this group alone.
        let group = Group::of(ip).filter(|group| group.scope.is_some());
        let zone = match (group, wanted) {
            (Some(group), SocketAddr::V6(wanted)) => self.zone_of(host, group, wanted.scope_id())?,
            _ => self.check_owned(host, ip).map(|()| 0)?,
        };
        let port = match wanted.port() {
            0 => self.free_port(host, ip)?,
            port if self.is_taken(host, ip, port) => return Errno::AddrInUse.fail(),
            port => port,
        };
        let short = group.map_or_else(|| Addresses::short(ip), |group| group.short);
        let (at, port) = ((!ip.is_unspecified()).then_some(short), Port::new(ip.is_ipv6(), port));
        let multicast = (zone != 0).then(|| Box::new(Multicast::of_zone(zone)));
        let (readers, inbox, room) = (Waiters::default(), VecDeque::new(), self.settings.receive_buffer);
        let state = SocketState {
            host,
            at,
            scope: group.and_then(|group| group.scope),
            port,
            peer: None,
            room,
            inbox,
            memory: 0,
            readers,
            refused: false,
            may_broadcast: false,
            multicast,
            died: None,
        };
        let bound = &mut self.hosts[host.index()].bound;
        // A dual socket is entered under both versions of IP, so that a packet of either version finds the socket by its port.
        let versions = state.versions();
        let id = self.sockets.insert(state);
        versions.for_each(|port| bound.add(port, id));
        Ok(id)
    }

    /// Checks that a socket of `host` can be bound to the address `ip`.
    pub(super) fn check_owned(&self, host: NodeId, ip: IpAddr) -> io::Result<()> {
        let is_group = ip.is_ipv4() && ip.is_multicast();
        if ip.is_unspecified() || is_group || self.plan.is_own(host, Addresses::short(ip), ip.is_ipv6()) {
            Ok(())
        } else {
            Errno::AddrNotAvailable.fail()
        }
    }

    fn is_taken(&self, host: NodeId, ip: IpAddr, port: u16) -> bool {
        let bound = &self.hosts[host.index()].bound;
        // A socket bound to all addresses conflicts with every socket of the port. At `[::]` these are the sockets of both versions of IP.
        let is_taken =
            bound.at(Port::new(ip.is_ipv6(), port)).is_some_and(|at| at.all().any(|id| ip.is_unspecified() || self.sockets.get(id).is_at(ip)));
        is_taken || ip == IpAddr::V6(Ipv6Addr::UNSPECIFIED) && bound.at(Port::new(false, port)).is_some()
    }

    fn free_port(&mut self, host: NodeId, ip: IpAddr) -> io::Result<u16> {
        let count = u16::MAX - FIRST_DYNAMIC + 1;
        // Ports are given in turn, so that a port is not reused soon after its socket was closed.
        for _ in 0..count {
            let port = FIRST_DYNAMIC + self.hosts[host.index()].next_port;
            self.hosts[host.index()].next_port = (self.hosts[host.index()].next_port + 1) % count;
            if !self.is_taken(host, ip, port) {
                return Ok(port);
            }
        }
        let text = format!("all {count} dynamic ports of host `{}` are taken; drop sockets that are no longer used", self.plan.names()[host.index()]);
        Err(io::Error::new(io::ErrorKind::AddrInUse, text))
    }

    /// Closes the socket, and frees the port of the socket.
    pub(crate) fn close(&mut self, id: SocketId) {
        let Some(mut state) = self.sockets.places[id.0].take() else { return };
        state.clear(&mut self.wire.held);
        self.leave_all(&state);
        self.sockets.free.push(id.0);
        // After a crash the host has forgotten its sockets, and the removal does nothing.
        state.versions().for_each(|port| self.hosts[state.host.index()].bound.remove(port, id));
    }

    /// Checks that the socket lives. A socket dies when its host crashes, or when the program of the host is killed.
    #[inline]
    pub(crate) fn check_alive(&self, id: SocketId) -> io::Result<()> {
        let socket = self.sockets.get(id);
        socket.died.map_or(Ok(()), |at| self.refuse_dead(socket, at))
    }

    #[cold]
    fn refuse_dead(&self, socket: &SocketState, at: Instant) -> io::Result<()> {
        let name = &self.plan.names()[socket.host.index()];
        let text = format!(
            "host `{name}` crashed at {} s, and this socket ({}) with it; after `Host::restart`, bind a new one",
            Seconds(at),
            socket.local()
        );
        Err(io::Error::new(io::ErrorKind::ConnectionAborted, text))
    }

    /// Returns the local address of the socket. A connected socket that is bound to all addresses has the address from which the socket sends.
    pub(crate) fn local_of(&self, id: SocketId) -> SocketAddr {
        let socket = self.sockets.get(id);
        let local = socket.local();
        match socket.peer {
            Some(peer) if socket.at.is_none() => {
                let source = Addresses::long(self.source_to(socket.host, Addresses::short(peer.ip()), peer.is_ipv6()), peer.is_ipv6());
                socket.shown(SocketAddr::new(source, local.port()))
            }
            _ => local,
        }
    }

    pub(crate) fn peer_of(&self, id: SocketId) -> Option<SocketAddr> {
        let socket = self.sockets.get(id);
        socket.peer.map(|peer| socket.shown(peer))
    }

    /// Connects the socket, which from now on receives datagrams of `peer` only. As with Linux, datagrams already in the buffer stay, and an unreachable peer
    /// is refused.
    pub(crate) fn connect(&mut self, id: SocketId, peer: SocketAddr) -> io::Result<()> {
        self.check_alive(id)?;
        let socket = self.sockets.get(id);
        let to = socket.wire_form(peer)?;
        // The route is asked for its errors: a peer to which no datagram could be sent is refused here, and not at the first send.
        // As with Linux, a group of a link needs an interface in its address, or in the settings of the socket.
        if let SocketAddr::V6(to) = to
            && to.scope_id() == 0
            && socket.multicast_settings(true).interface == 0
            && Group::of(IpAddr::V6(*to.ip())).is_some_and(Group::needs_interface)
        {
            return Errno::InvalidInput.fail();
        }
        let route = self.route(socket, socket.source_at(), &to)?;
        // As with Linux, the unspecified address stands for loopback. Datagrams of the peer come from there.
        let ip = if to.ip().is_unspecified() { Addresses::long(route.to, to.is_ipv6()) } else { to.ip() };
        let mut peer = SocketAddr::new(ip, to.port());
        if let (SocketAddr::V6(peer), SocketAddr::V6(to)) = (&mut peer, to) {
            // Each datagram to a group looks up the interface again.
            peer.set_scope_id(if ip.is_multicast() { to.scope_id() } else { 0 });
        }
        self.sockets.get_mut(id).peer = Some(peer);
        Ok(())
    }

    /// Returns the size of the receive buffer of a socket \[byte\].
    pub(crate) fn room(&mut self, id: SocketId) -> &mut usize {
        &mut self.sockets.get_mut(id).room
    }

    /// Returns a line for each socket for which a task waits.
    pub(crate) fn waits(&self) -> Vec<String> {
        let waiting = self.sockets.places.iter().flatten().filter(|socket| !socket.readers.is_empty());
        let lines = waiting.map(|socket| format!("host `{}`: UDP {} waits for a datagram", self.plan.names()[socket.host.index()], socket.local()));
        #[cfg(feature = "tcp")]
        let lines = lines.chain(self.tcp_waits());
        #[cfg(feature = "facade")]
        let lines = lines.chain(self.unix_waits());
        lines.collect()
    }

    /// Returns descriptions of the sockets and timers for which the task with the waker `waker` waits. Empty if no socket or timer knows the task.
    pub(crate) fn awaited_by(&self, waker: &Waker) -> Vec<String> {
        let sockets = self.sockets.places.iter().flatten().filter(|socket| socket.readers.has(waker));
        let mut awaited: Vec<String> = sockets.map(|socket| format!("a datagram at UDP {}", socket.local())).collect();
        #[cfg(feature = "tcp")]
        awaited.extend(self.tcp_awaited_by(waker));
        #[cfg(feature = "facade")]
        awaited.extend(self.unix_awaited_by(waker));
        awaited.extend(self.timers.deadline_of(waker).map(|deadline| format!("{} s of the run", Seconds(deadline))));
        awaited
    }

    pub(crate) fn may_broadcast(&mut self, id: SocketId) -> &mut bool {
        &mut self.sockets.get_mut(id).may_broadcast
    }

    /// Calls `look` on the next datagram, and removes the datagram unless `PEEK`. If there is no datagram, `waker` is woken when one arrives.
    #[inline]
    pub(crate) fn receive<const PEEK: bool, T>(
        &mut self,
        id: SocketId,
        waker: Option<&Waker>,
        look: impl FnOnce(&Parcel) -> T,
    ) -> Poll<io::Result<T>> {
        let socket = self.sockets.get_mut(id);
        if socket.has_error() {
            return Poll::Ready(Err(self.error_of(id)));
        }
        // A peek without a datagram falls through to the wait below, where the empty inbox has nothing to pop.
        if PEEK && let Some(datagram) = socket.inbox.front() {
            return Poll::Ready(Ok(look(datagram)));
        }
        let Some(datagram) = socket.inbox.pop_front() else {
            if let Some(waker) = waker {
                socket.readers.wait(waker);
            }
            return Poll::Pending;
        };
        let len = datagram.bytes.len();
        socket.memory -= datagram.memory;
        self.wire.held.remove(Held::cost(len));
        // `look` returns no reference into the datagram, so the memory of the datagram is used again at once.
        let seen = look(&datagram);
        self.spare.put(datagram);
        Poll::Ready(Ok(seen))
    }

    /// Like [`Core::receive`], but returns [`io::ErrorKind::WouldBlock`] in place of waiting.
    pub(crate) fn try_receive<const PEEK: bool, T>(&mut self, id: SocketId, look: impl FnOnce(&Parcel) -> T) -> io::Result<T> {
        self.note_call(|core| core.sockets.get(id).name());
        match self.receive::<PEEK, _>(id, None, look) {
            Poll::Ready(seen) => seen,
            Poll::Pending => Err(io::ErrorKind::WouldBlock.into()),
        }
    }

    /// Returns the pending error of the socket. A refusal is reported once; the death of the socket is reported by every call.
    #[cold]
    pub(super) fn error_of(&mut self, id: SocketId) -> io::Error {
        if let Err(died) = self.check_alive(id) {
            return died;
        }
        self.sockets.get_mut(id).refused = false;
        Errno::ConnectionRefused.into()
    }

    /// Returns whether [`Core::receive`] would return a datagram or an error.
    pub(crate) fn is_readable(&self, id: SocketId) -> bool {
        let socket = self.sockets.get(id);
        socket.has_error() || !socket.inbox.is_empty()
    }

    /// Takes the pending refusal out of the socket.
    pub(crate) fn take_error(&mut self, id: SocketId) -> Option<io::Error> {
        std::mem::take(&mut self.sockets.get_mut(id).refused).then(|| Errno::ConnectionRefused.into())
    }

    /// Returns whether [`Core::receive`] would return a datagram or an error. If not, `waker` is woken when it would.
    pub(crate) fn poll_readable(&mut self, id: SocketId, waker: &Waker) -> Poll<()> {
        if self.is_readable(id) {
            return Poll::Ready(());
        }
        self.sockets.get_mut(id).readers.wait(waker);
        Poll::Pending
    }
}
