//! Table of the connections of TCP beyond the link.

use core::net::SocketAddr;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::net::{TcpListener, TcpStream};

use cohaptic_linkfile::router::Protocol;
use cohaptic_router::{Packet, Unreachable};
use cohaptic_tcp::{Connection, Flags, Segment, TcpConfig};
use cohaptic_units::Instant;
use rustix::event::epoll::EventFlags;
use rustix::net::{AddressFamily, SocketFlags, SocketType, connect, socket_with};

use super::relay::Relay;
use super::{Ends, HOST, Owner, Sockets, address, unreachable};

/// Time to live of resets, as in Linux.
const TTL: u8 = 64;

/// Connections by their ends, and listeners with a way inside.
#[derive(Debug, Default)]
pub(super) struct TcpTable {
    flows: BTreeMap<Ends, Flow>,
    /// Deadlines of connections; a connection may have no deadline.
    deadlines: BTreeSet<(Instant, Ends)>,
    listeners: Vec<(TcpListener, u16)>,
}

#[derive(Debug)]
struct Flow {
    token: u64,
    /// Deadline in [`TcpTable::deadlines`].
    deadline: Option<Instant>,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    /// The socket outside connects. The SYN is answered when the real server has answered, so that the program inside sees a refusal as a refusal.
    Opening {
        syn: Segment<'static>,
        socket: TcpStream,
    },
    Open(Box<Relay>),
}

impl TcpTable {
    pub(super) fn listen(&mut self, sockets: &mut Sockets, address: SocketAddr) -> io::Result<()> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        sockets.watch(&listener, Owner::Listener(self.listeners.len()))?;
        self.listeners.push((listener, address.port()));
        Ok(())
    }

    /// Handles a packet of TCP from inside. Returns `false` for a damaged packet and for a fragment.
    pub(super) fn handle_packet(&mut self, sockets: &mut Sockets, now: Instant, packet: &[u8]) -> bool {
        let Ok(segment) = Segment::parse(packet) else { return false };
        let ends = Ends { inside: segment.source, outside: segment.destination };
        match self.flows.get_mut(&ends) {
            // A SYN may open a new connection with the ends of a connection in TIME-WAIT (RFC 6191). The arm for SYNs below then replaces the old connection.
            Some(Flow { stage: Stage::Open(relay), .. }) if !relay.connection.gives_way_to(&segment) => {
                relay.connection.handle_segment(now, &segment);
                self.settle(sockets, now, ends);
            }
            Some(Flow { stage: Stage::Opening { .. }, .. }) => {
                // The program has given up. Repeated SYNs have no effect: the answer is on its way already.
                if segment.flags.has(Flags::RST) {
                    self.remove(sockets, ends);
                }
            }
            _ if segment.flags.has(Flags::SYN) && !segment.flags.has(Flags::ACK) && !segment.flags.has(Flags::RST) => {
                self.remove(sockets, ends);
                self.open(sockets, now, ends, segment.into_owned());
            }
            // A host answers a segment of an unknown connection by a reset, so the gateway does the same for the real host.
            _ => refuse(sockets, &segment),
        }
        true
    }

    /// Begins to connect to the real server.
    fn open(&mut self, sockets: &mut Sockets, now: Instant, ends: Ends, syn: Segment<'static>) {
        let Some(real) = address::real(ends.outside, sockets.names) else { return refuse(sockets, &syn) };
        let opened = connecting(real).and_then(|socket| sockets.watch(&socket, Owner::Tcp(ends)).map(|token| (token, socket)));
        match opened {
            Ok((token, socket)) => {
                self.flows.insert(ends, Flow { token, deadline: None, stage: Stage::Opening { syn, socket } });
                // A connection within the machine is open at once.
                self.try_accept(sockets, now, ends);
            }
            Err(error) => fail(sockets, ends, &syn, &error),
        }
    }

    /// Accepts the connection inside if the socket outside is connected, and refuses the connection if the socket has failed.
    fn try_accept(&mut self, sockets: &mut Sockets, now: Instant, ends: Ends) {
        let Some(flow) = self.flows.get_mut(&ends) else { return };
        let Stage::Opening { syn, socket } = &flow.stage else { return };
        let failed = match socket.take_error() {
            // A socket without an error and without a peer still connects, and a later event comes here again.
            Ok(None) if socket.peer_addr().is_err() => return,
            Ok(error) => error,
            Err(error) => Some(error),
        };
        let accepted = match failed {
            Some(error) => Err(error),
            None => socket.try_clone().and_then(|socket| {
                socket.set_nodelay(true)?;
                Ok(Relay::new(Connection::accept(now, config(), syn, initial(now)).map_err(io::Error::other)?, socket))
            }),
        };
        match accepted {
            Ok(relay) => {
                flow.stage = Stage::Open(Box::new(relay));
                self.settle(sockets, now, ends);
            }
            Err(error) => {
                fail(sockets, ends, &syn.clone(), &error);
                self.remove(sockets, ends);
            }
        }
    }

    /// Handles an event of a socket outside.
    pub(super) fn handle_event(&mut self, sockets: &mut Sockets, now: Instant, ends: Ends, flags: EventFlags) {
        match self.flows.get_mut(&ends).map(|flow| &mut flow.stage) {
            Some(Stage::Open(relay)) => {
                // After an error or a hang-up a read and a write return at once, with data, the end or the reason. So both are tried.
                let is_over = flags.intersects(EventFlags::ERR | EventFlags::HUP);
                relay.may_read |= is_over || flags.intersects(EventFlags::IN | EventFlags::RDHUP);
                relay.may_write |= is_over || flags.contains(EventFlags::OUT);
                self.settle(sockets, now, ends);
            }
            Some(Stage::Opening { .. }) => self.try_accept(sockets, now, ends),
            None => {}
        }
    }

    /// Accepts the clients of a listener, and connects each to the host inside.
    pub(super) fn handle_clients(&mut self, sockets: &mut Sockets, now: Instant, place: usize) {
        while let Some((accepted, port)) = self.listeners.get(place).map(|(listener, port)| (listener.accept(), *port)) {
            let (socket, client) = match accepted {
                Ok(accepted) => accepted,
                // A client that has left before its turn. The clients after it make no further event.
                Err(error) if matches!(error.kind(), io::ErrorKind::ConnectionAborted | io::ErrorKind::Interrupted) => continue,
                // Nobody is left, or the system has no descriptor: clients then wait for the next one.
                Err(_) => return,
            };
            let inside = SocketAddr::new(HOST[0], port);
            let gateway = |port| Ends { inside, outside: SocketAddr::new(address::gateway(inside.ip()), port) };
            // The server sees the client's own port if the port is free here, and otherwise the next free port.
            let ports = (client.port()..=u16::MAX).chain(1..client.port());
            let Some(ends) = ports.map(gateway).find(|ends| !self.flows.contains_key(ends)) else { continue };
            let opened = socket.set_nonblocking(true).and_then(|()| socket.set_nodelay(true)).and_then(|()| {
                let connection = Connection::connect(now, config(), ends.outside, ends.inside, initial(now)).map_err(io::Error::other)?;
                Ok((sockets.watch(&socket, Owner::Tcp(ends))?, connection))
            });
            // The system may have no room for a client, and the client is closed again.
            let Ok((token, connection)) = opened else { continue };
            self.flows.insert(ends, Flow { token, deadline: None, stage: Stage::Open(Box::new(Relay::new(connection, socket))) });
            self.settle(sockets, now, ends);
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.deadlines.first().map(|(at, _)| *at)
    }

    pub(super) fn handle_timeout(&mut self, sockets: &mut Sockets, now: Instant) {
        while let Some((_, ends)) = self.deadlines.first().copied().filter(|(at, _)| *at <= now) {
            if let Some(Flow { stage: Stage::Open(relay), .. }) = self.flows.get_mut(&ends) {
                relay.connection.handle_timeout(now);
            }
            self.settle(sockets, now, ends);
        }
    }

    /// Passes data of a connection, sends segments, and notes the next deadline, or forgets an ended connection.
    fn settle(&mut self, sockets: &mut Sockets, now: Instant, ends: Ends) {
        let Some(flow) = self.flows.get_mut(&ends) else { return };
        let Stage::Open(relay) = &mut flow.stage else { return };
        relay.pass(now, &mut sockets.buffer);
        while let Some(segment) = relay.poll_transmit(now) {
            sockets.out.push_back(Packet::checked(segment.to_packet()));
        }
        let deadline = relay.connection.poll_timeout();
        if relay.is_over() {
            return self.remove(sockets, ends);
        }
        // The set holds one deadline per connection, so the former deadline leaves the set before the new deadline enters.
        if flow.deadline != deadline {
            if let Some(before) = core::mem::replace(&mut flow.deadline, deadline) {
                self.deadlines.remove(&(before, ends));
            }
            self.deadlines.extend(deadline.map(|at| (at, ends)));
        }
    }

    fn remove(&mut self, sockets: &mut Sockets, ends: Ends) {
        if let Some(flow) = self.flows.remove(&ends) {
            sockets.forget(flow.token);
            if let Some(at) = flow.deadline {
                self.deadlines.remove(&(at, ends));
            }
        }
    }

    pub(super) fn is_delivered(&self) -> bool {
        self.flows.values().all(|flow| match &flow.stage {
            Stage::Opening { .. } => true,
            Stage::Open(relay) => relay.is_delivered(),
        })
    }
}

/// Returns the constants of the end inside: as in Linux, but without Nagle's algorithm, because the real sender has already waited for acknowledgements.
fn config() -> TcpConfig {
    TcpConfig { nodelay: true, ..TcpConfig::default() }
}

/// Returns the first sequence number of a connection: a counter of steps of 4 µs (RFC 9293, section 3.4.1). The numbers may be easy to guess, because only the
/// host itself can send to its device.
fn initial(now: Instant) -> u32 {
    u32::try_from((now.as_nanos() / 4000) % (1 << 32)).unwrap_or(0)
}

/// Returns a socket that connects without waiting.
fn connecting(to: SocketAddr) -> io::Result<TcpStream> {
    let family = if to.is_ipv4() { AddressFamily::INET } else { AddressFamily::INET6 };
    let socket = socket_with(family, SocketType::STREAM, SocketFlags::NONBLOCK | SocketFlags::CLOEXEC, None)?;
    match connect(&socket, &to) {
        Ok(()) | Err(rustix::io::Errno::INPROGRESS) => Ok(TcpStream::from(socket)),
        Err(error) => Err(error.into()),
    }
}

/// Answers a segment by a reset.
fn refuse(sockets: &mut Sockets, segment: &Segment<'_>) {
    sockets.out.extend(segment.refusal(TTL).map(|reset| Packet::checked(reset.to_packet())));
}

/// Tells the program inside why its connection could not be opened, as the network would.
fn fail(sockets: &mut Sockets, ends: Ends, syn: &Segment<'_>, error: &io::Error) {
    if error.kind() == io::ErrorKind::TimedOut {
        // No answer: the program inside repeats the SYN until its own time-out.
        return;
    }
    // A port where nobody listens answers by a reset.
    let Some(why) = unreachable(error).filter(|why| *why != Unreachable::Port) else { return refuse(sockets, syn) };
    let by = address::gateway(ends.inside.ip());
    sockets.out.extend(Packet::unreachable(by, Protocol::TCP, [ends.inside, ends.outside], syn.sequence, why));
}
