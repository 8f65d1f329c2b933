//! TCP: the connections and listeners of all hosts, around the state machines of [`cohaptic_tcp`].
//!
//! A packet touches one connection, and what may leave leaves within the call that permits it. At one instant packets arrive, then the timers of TCP go off,
//! by host and connection, then those of programs.

mod faults;
mod listeners;
mod passing;
mod ports;
mod program;
mod slots;
mod timers;
mod waits;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

use bytes::Bytes;
use cohaptic_tcp::{Connection, TcpConfig};
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use super::entropy::ByHost;
use super::waking::Waiters;
use super::{Core, SocketName};
use crate::wire::Where;
use slots::Slots;

pub(crate) use listeners::Inherited;
pub(crate) use ports::HoldId;

/// The label of the stream from which initial sequence numbers come.
const LABEL: &[u8] = b"initial sequence numbers of a test bed";

/// The greatest MTU, which the loopback interface has \[byte\].
const LOOPBACK_MTU: usize = 65_536;

/// A connection, until its stream is dropped and it is over.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct ConnId(usize);

/// A listener, until it is dropped.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct ListenId(usize);

/// By which a packet finds its connection: the host, its port and address, and the other end. The port comes first, so that those of one port lie together.
type Route = (NodeId, u16, IpAddr, SocketAddr);

/// All of TCP.
#[derive(Debug)]
pub(super) struct Tcp {
    /// By host.
    configs: Vec<TcpConfig>,
    entropy: ByHost,
    connections: Slots<Box<End>>,
    listeners: Slots<Listener>,
    routes: BTreeMap<Route, ConnId>,
    ports: ports::Ports,
    timers: BTreeSet<(Instant, NodeId, ConnId)>,
    /// Connections in TIME-WAIT, about in the order in which it ends. Nothing is seen of its end, so it is no event.
    time_waits: VecDeque<(Instant, ConnId)>,
    /// Packets that do not leave their host.
    loopback: VecDeque<(NodeId, Bytes)>,
    /// How often programs have called: an answer about a window counts until the next call.
    calls: u64,
}

/// One end of a connection, and the tasks that wait for it.
#[derive(Debug)]
struct End {
    host: NodeId,
    machine: Connection,
    readers: Waiters,
    writers: Waiters,
    /// A stream of a program is this end.
    is_held: bool,
    /// The last write found the buffer full, or the handshake is not over.
    is_write_blocked: bool,
    /// What the program has set, of which only zero acts.
    linger: Option<Duration>,
    /// The listener at which it waits.
    listener: Option<ListenId>,
    /// The port that its socket was bound to.
    hold: Option<HoldId>,
    /// Where it stands among the timers.
    timer: Option<Instant>,
    is_in_time_wait: bool,
    gone: Option<Gone>,
    /// How many bytes of it are in the count of what the run holds.
    counted: u64,
    /// The call at which it was looked at, and its deadline then: see [`Core::is_stuck`].
    looked_at: (u64, Option<Instant>),
}

/// When and why a socket went with its host.
#[derive(Clone, Copy, Debug)]
struct Gone {
    at: Instant,
    /// The program alone was killed, and not the host.
    is_killed: bool,
}

/// A listening socket.
#[derive(Debug)]
struct Listener {
    host: NodeId,
    local: SocketAddr,
    /// What its connections inherit.
    config: TcpConfig,
    linger: Option<Duration>,
    backlog: usize,
    half_open: BTreeSet<ConnId>,
    waiting: VecDeque<ConnId>,
    wakers: Waiters,
    hold: HoldId,
    gone: Option<Gone>,
}

impl Tcp {
    pub(super) fn new(seed: u64, hosts: usize) -> Self {
        Self {
            configs: vec![TcpConfig::default(); hosts],
            entropy: ByHost::labelled(seed, LABEL),
            connections: Slots::default(),
            listeners: Slots::default(),
            routes: BTreeMap::new(),
            ports: ports::Ports::new(hosts),
            timers: BTreeSet::new(),
            time_waits: VecDeque::new(),
            loopback: VecDeque::new(),
            calls: 0,
        }
    }

    fn end(&self, id: ConnId) -> &End {
        self.connections.get(id.0)
    }

    fn end_mut(&mut self, id: ConnId) -> &mut End {
        self.connections.get_mut(id.0)
    }

    /// Takes a connection in.
    fn insert(&mut self, host: NodeId, machine: Connection) -> ConnId {
        let route = route(host, machine.local_addr(), machine.peer_addr());
        let id = ConnId(self.connections.insert(Box::new(End {
            host,
            machine,
            readers: Waiters::default(),
            writers: Waiters::default(),
            is_held: false,
            is_write_blocked: true,
            linger: None,
            listener: None,
            hold: None,
            timer: None,
            is_in_time_wait: false,
            gone: None,
            counted: 0,
            looked_at: (u64::MAX, None),
        })));
        self.routes.insert(route, id);
        id
    }

    /// Packets find it no more.
    fn unroute(&mut self, id: ConnId) {
        let end = self.end(id);
        let route = route(end.host, end.machine.local_addr(), end.machine.peer_addr());
        if self.routes.get(&route) == Some(&id) {
            self.routes.remove(&route);
        }
    }

    fn initial_sequence(&mut self, host: NodeId, names: &[String]) -> u32 {
        u32::from_le_bytes(self.entropy.of(Some(host), names).bytes())
    }

    /// Returns whether any connection has drawn a number.
    pub(super) fn has_drawn(&self) -> bool {
        self.entropy.was_asked()
    }
}

const fn route(host: NodeId, local: SocketAddr, remote: SocketAddr) -> Route {
    (host, local.port(), local.ip(), remote)
}

impl End {
    fn name(&self) -> SocketName {
        SocketName { kind: "TCP", host: self.host, local: self.machine.local_addr(), peer: Some(self.machine.peer_addr()) }
    }
}

impl Listener {
    const fn name(&self) -> SocketName {
        SocketName { kind: "listening TCP", host: self.host, local: self.local, peer: None }
    }
}

impl Core {
    /// Forgets an end.
    fn remove_connection(&mut self, id: ConnId) {
        self.tcp.unroute(id);
        self.tcp.set_timer(id, None);
        let Some(end) = self.tcp.connections.remove(id.0) else { return };
        self.wire.held.remove(Where::Streams, end.counted);
        end.hold.into_iter().for_each(|hold| self.tcp.ports.release(hold));
    }

    /// Counts what an end holds now.
    fn recount(&mut self, id: ConnId) {
        let end = self.tcp.connections.get_mut(id.0);
        let held = end.machine.held() as u64;
        self.wire.held.add(Where::Streams, held);
        self.wire.held.remove(Where::Streams, std::mem::replace(&mut end.counted, held));
    }

    /// Sets the constants of the connections that a host opens or takes from now on.
    pub(crate) fn set_tcp(&mut self, host: NodeId, config: TcpConfig) {
        self.tcp.configs[host.index()] = config;
    }

    /// The constants of connections of a host.
    pub(crate) fn tcp_config(&self, host: NodeId) -> &TcpConfig {
        &self.tcp.configs[host.index()]
    }

    /// All ends that are not over, by host, address and peer.
    pub(crate) fn connections(&self) -> impl Iterator<Item = (NodeId, &Connection)> {
        self.tcp.routes.values().map(|id| self.tcp.end(*id)).map(|end| (end.host, &end.machine))
    }
}
