//! Sockets: where they are bound, what lies in their buffers, and the tasks that wait.

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::task::{Poll, Waker};

use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;
use cohaptic_wan::{NodeId, Ring};

use super::bound::{Port, SocketId};
use super::waking::{Waiters, Woken};
use super::{Core, Parcel, SocketName};
use crate::address::Addresses;
use crate::trace::Lost;
use crate::wire::{Held, Where};

/// A datagram, for its readers.
impl Parcel {
    #[inline]
    pub(crate) fn from(&self) -> SocketAddr {
        self.addresses.from()
    }

    /// The address to which it was sent.
    #[cfg(feature = "quinn")]
    pub(crate) fn to(&self) -> IpAddr {
        self.addresses.to().ip()
    }

    /// Copies what fits into a buffer; gives the length.
    #[inline]
    pub(crate) fn copy_to(&self, buffer: &mut [u8]) -> usize {
        let len = self.bytes.len().min(buffer.len());
        buffer[..len].copy_from_slice(&self.bytes[..len]);
        len
    }
}

#[derive(Debug)]
pub(crate) struct SocketState {
    pub(super) host: NodeId,
    /// The address at which it is bound, as [`Addresses::short`]; `None` if it hears all addresses of its host.
    pub(super) at: Option<u32>,
    pub(super) port: Port,
    pub(super) peer: Option<SocketAddr>,
    pub(super) inbox: Ring<Box<Parcel>>,
    /// The bytes of the datagrams in `inbox`.
    pub(super) held: usize,
    readers: Waiters,
    /// What IP told about something that was sent, until the program is told.
    pub(super) refused: bool,
    pub(super) may_broadcast: bool,
    pub(super) died: Option<Instant>,
}

impl SocketState {
    /// Takes a datagram into the buffer, which holds this number of bytes.
    #[inline(always)]
    pub(super) fn keep(&mut self, parcel: Box<Parcel>, (room, all): (usize, &mut Held), woken: &mut Woken) -> Result<(), Lost> {
        let len = parcel.bytes.len();
        let held = self.held + len;
        if held > room {
            return Err(Lost::BufferFull);
        }
        self.held = held;
        all.add(Where::Buffers, Held::cost(len));
        self.inbox.push(|| parcel);
        self.readers.wake(woken);
        Ok(())
    }

    /// Lets go of all datagrams in the buffer.
    fn clear(&mut self, all: &mut Held) {
        all.remove(Where::Buffers, self.held as u64 + self.inbox.len() as u64 * Held::cost(0));
        self.inbox.clear();
        self.held = 0;
    }

    pub(super) fn name(&self) -> SocketName {
        SocketName { kind: "UDP", host: self.host, local: self.local(), peer: None }
    }

    /// Whether the next call gives an error.
    #[inline]
    pub(super) const fn has_error(&self) -> bool {
        // Both are looked at, where a branch for each would cost more.
        self.died.is_some() | self.refused
    }

    /// The address at which it is bound.
    pub(super) fn local(&self) -> SocketAddr {
        let (is_six, number) = (self.port.is_six(), self.port.number());
        let ip = match self.at {
            Some(at) => Addresses::long(at, is_six),
            None if is_six => Ipv6Addr::UNSPECIFIED.into(),
            None => Ipv4Addr::UNSPECIFIED.into(),
        };
        SocketAddr::new(ip, number)
    }

    /// IP says that nobody is at a port of that address.
    #[inline(never)]
    pub(super) fn refuse(&mut self, by: SocketAddr, woken: &mut Woken) {
        if self.peer == Some(by) {
            self.refused = true;
            self.readers.wake(woken);
        }
    }

    pub(super) fn die(&mut self, at: Instant, all: &mut Held, woken: &mut Woken) {
        self.died = Some(at);
        self.clear(all);
        self.readers.wake(woken);
    }
}

/// All sockets that have not been closed.
#[derive(Debug, Default)]
pub(super) struct Sockets {
    /// In boxes, so that a place is found by a shift.
    places: Vec<Option<Box<SocketState>>>,
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

    pub(super) fn all_of(&mut self, host: NodeId) -> impl Iterator<Item = &mut SocketState> {
        self.places.iter_mut().flatten().map(Box::as_mut).filter(move |socket| socket.host == host)
    }
}

/// The first of the ports that are given to sockets that ask for none (RFC 6335).
pub(super) const FIRST_DYNAMIC: u16 = 49_152;

impl Core {
    /// Binds a socket of a host that is up.
    pub(crate) fn bind(&mut self, host: NodeId, wanted: SocketAddr) -> io::Result<SocketId> {
        let ip = wanted.ip();
        self.check_owned(host, ip)?;
        let port = match wanted.port() {
            0 => self.free_port(host, ip)?,
            port if self.is_taken(host, ip, port) => {
                let text = format!("{wanted} is taken on host `{}`", self.plan.names()[host.index()]);
                return Err(io::Error::new(io::ErrorKind::AddrInUse, text));
            }
            port => port,
        };
        let (at, port) = ((!ip.is_unspecified()).then(|| Addresses::short(ip)), Port::new(ip.is_ipv6(), port));
        let (readers, inbox) = (Waiters::default(), Ring::new());
        let state = SocketState { host, at, port, peer: None, inbox, held: 0, readers, refused: false, may_broadcast: false, died: None };
        let id = self.sockets.insert(state);
        self.hosts[host.index()].bound.add(port, id);
        Ok(id)
    }

    /// Fails if a socket of the host cannot be bound to that address.
    pub(super) fn check_owned(&self, host: NodeId, ip: IpAddr) -> io::Result<()> {
        if !ip.is_unspecified() && !ip.is_loopback() && !self.plan.of(host).has(ip) {
            let text = format!("{ip} is no address of host `{}`, which has {}", self.plan.names()[host.index()], self.plan.of(host).like(ip));
            return Err(io::Error::new(io::ErrorKind::AddrNotAvailable, text));
        }
        Ok(())
    }

    fn is_taken(&self, host: NodeId, ip: IpAddr, port: u16) -> bool {
        let mut bound = self.hosts[host.index()].bound.at(Port::new(ip.is_ipv6(), port));
        bound.any(|id| ip.is_unspecified() || self.sockets.get(id).at.is_none_or(|other| other == Addresses::short(ip)))
    }

    fn free_port(&mut self, host: NodeId, ip: IpAddr) -> io::Result<u16> {
        let count = u16::MAX - FIRST_DYNAMIC + 1;
        for _ in 0..count {
            let port = FIRST_DYNAMIC + self.hosts[host.index()].next_port;
            self.hosts[host.index()].next_port = (self.hosts[host.index()].next_port + 1) % count;
            if !self.is_taken(host, ip, port) {
                return Ok(port);
            }
        }
        let text = format!("all {count} dynamic ports of host `{}` are taken", self.plan.names()[host.index()]);
        Err(io::Error::new(io::ErrorKind::AddrInUse, text))
    }

    /// The socket is closed: its port is free.
    pub(crate) fn close(&mut self, id: SocketId) {
        let Some(mut state) = self.sockets.places[id.0].take() else { return };
        state.clear(&mut self.wire.held);
        self.sockets.free.push(id.0);
        self.hosts[state.host.index()].bound.remove(state.port, id);
    }

    /// Fails if the socket died with its host.
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

    pub(crate) fn local_of(&self, id: SocketId) -> SocketAddr {
        self.sockets.get(id).local()
    }

    pub(crate) fn peer_of(&self, id: SocketId) -> Option<SocketAddr> {
        self.sockets.get(id).peer
    }

    /// From now on the socket hears that peer only. What lies in its buffer already stays, as it does with Linux.
    pub(crate) fn connect(&mut self, id: SocketId, peer: SocketAddr) -> io::Result<()> {
        self.check_alive(id)?;
        let local = self.sockets.get(id).local();
        if local.is_ipv6() != peer.is_ipv6() {
            return Err(io::Error::new(
                io::ErrorKind::InvalidInput,
                format!("a socket at {local} cannot reach {peer}, which is of the other version of IP"),
            ));
        }
        self.sockets.get_mut(id).peer = Some(peer);
        Ok(())
    }

    /// A line for each socket that a task waits for.
    pub(crate) fn waits(&self) -> Vec<String> {
        let waiting = self.sockets.places.iter().flatten().filter(|socket| !socket.readers.is_empty());
        let lines = waiting.map(|socket| format!("host `{}`: UDP {} waits for a datagram", self.plan.names()[socket.host.index()], socket.local()));
        #[cfg(feature = "tcp")]
        let lines = lines.chain(self.tcp_waits());
        lines.collect()
    }

    /// Returns the things that a task with that waker waits for, in words; empty if sockets and timers do not know the task.
    pub(crate) fn awaited_by(&self, waker: &Waker) -> Vec<String> {
        let sockets = self.sockets.places.iter().flatten().filter(|socket| socket.readers.has(waker));
        let mut awaited: Vec<String> = sockets.map(|socket| format!("a datagram at UDP {}", socket.local())).collect();
        #[cfg(feature = "tcp")]
        awaited.extend(self.tcp_awaited_by(waker));
        awaited.extend(self.timers.deadline_of(waker).map(|deadline| format!("{} s of the run", Seconds(deadline))));
        awaited
    }

    pub(crate) fn may_broadcast(&mut self, id: SocketId) -> &mut bool {
        &mut self.sockets.get_mut(id).may_broadcast
    }

    /// Looks at the next datagram, which is taken out unless it is only peeked at. If there is none, the waker is woken when there is one.
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
        if PEEK && let Some(datagram) = socket.inbox.front() {
            return Poll::Ready(Ok(look(datagram)));
        }
        let Some(datagram) = socket.inbox.pop() else {
            if let Some(waker) = waker {
                socket.readers.wait(waker);
            }
            return Poll::Pending;
        };
        let len = datagram.bytes.len();
        socket.held -= len;
        self.wire.held.remove(Where::Buffers, Held::cost(len));
        let seen = look(&datagram);
        self.spare.put(datagram);
        Poll::Ready(Ok(seen))
    }

    /// As [`Core::receive`], for a program that does not wait.
    pub(crate) fn try_receive<const PEEK: bool, T>(&mut self, id: SocketId, look: impl FnOnce(&Parcel) -> T) -> io::Result<T> {
        self.note_call(|core| core.sockets.get(id).name());
        match self.receive::<PEEK, _>(id, None, look) {
            Poll::Ready(seen) => seen,
            Poll::Pending => Err(io::ErrorKind::WouldBlock.into()),
        }
    }

    /// The error that a socket has, which is taken out.
    #[cold]
    pub(super) fn error_of(&mut self, id: SocketId) -> io::Error {
        if let Err(died) = self.check_alive(id) {
            return died;
        }
        self.sockets.get_mut(id).refused = false;
        io::Error::new(io::ErrorKind::ConnectionRefused, "connection refused: no socket at the port of the peer")
    }

    /// Whether [`Core::receive`] has something to say.
    pub(crate) fn is_readable(&self, id: SocketId) -> bool {
        let socket = self.sockets.get(id);
        socket.has_error() || !socket.inbox.is_empty()
    }

    /// Takes an error out.
    pub(crate) fn take_error(&mut self, id: SocketId) -> Option<io::Error> {
        std::mem::take(&mut self.sockets.get_mut(id).refused).then(|| io::ErrorKind::ConnectionRefused.into())
    }

    /// Ready when [`Core::receive`] has something to say; else the waker is woken when it has.
    pub(crate) fn poll_readable(&mut self, id: SocketId, waker: &Waker) -> Poll<()> {
        if self.is_readable(id) {
            return Poll::Ready(());
        }
        self.sockets.get_mut(id).readers.wait(waker);
        Poll::Pending
    }
}
