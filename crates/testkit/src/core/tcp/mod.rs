//! TCP of a run: the connections and listeners of all hosts, around the state machines of [`cohaptic_tcp`].
//!
//! Each packet touches one connection, and a segment leaves within the call after which the connection may send. At one instant packets arrive first, then the
//! timers of TCP go off, sorted by host and connection, and then the timers of programs.

mod faults;
mod listeners;
mod passing;
mod ports;
mod program;
mod slots;
mod timers;
mod trains;
mod waits;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

use cohaptic_tcp::{Connection, Segment, TcpConfig};
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use super::entropy::ByHost;
use super::waking::Waiters;
use super::{Core, SocketName};
use slots::Slots;

pub(crate) use listeners::Inherited;
pub(crate) use ports::{HoldId, Sharing};

/// Label of the random stream of initial sequence numbers.
const LABEL: &[u8] = b"initial sequence numbers of a test bed";

/// Time after which Linux gives up to find the owner of an address in its own network: three questions, a second apart (`mcast_solicit`, `retrans_time_ms`).
const UNREACHABLE: Duration = Duration::from_secs(3);

/// MTU of the loopback interface, the greatest MTU \[byte\].
const LOOPBACK_MTU: usize = 65_536;

/// Index of an end of a connection. Valid until the stream is dropped and the connection is over.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct ConnId(usize);

/// Index of a listener. Valid until the listener is dropped.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct ListenId(usize);

/// Key by which a packet finds the connection: host, local port, local address, remote address. The port precedes the address, so that all connections of a
/// port are adjacent.
type Route = (NodeId, u16, IpAddr, SocketAddr);

/// State of TCP of all hosts.
#[derive(Debug)]
pub(super) struct Tcp {
    /// Constants of new connections, indexed by host.
    configs: Vec<TcpConfig>,
    /// Source of initial sequence numbers.
    entropy: ByHost,
    connections: Slots<Box<End>>,
    listeners: Slots<Listener>,
    /// Connections that receive packets, by route.
    routes: BTreeMap<Route, ConnId>,
    /// Entry of `routes` that was found last.
    latest: Option<(Route, ConnId)>,
    ports: ports::Ports,
    timers: timers::Timers,
    /// Connections in TIME-WAIT, roughly sorted by the end of TIME-WAIT. The end has no visible effect, and so is no event.
    time_waits: VecDeque<(Instant, ConnId)>,
    /// Packets from a host to itself, with the host, in the order of sending.
    loopback: VecDeque<(NodeId, Segment<'static>)>,
    /// Number of calls by programs so far. An answer to a probe of a window counts until the next call: see [`Core::is_stuck`].
    calls: u64,
}

/// Side of a connection, and the tasks that wait to read or to write.
#[derive(Debug)]
struct End {
    host: NodeId,
    machine: Connection,
    readers: Waiters,
    writers: Waiters,
    /// `true` if a stream of a program holds this end.
    is_held: bool,
    /// Whether the last write found the send buffer full, or the handshake is not complete.
    is_write_blocked: bool,
    /// `true` if the socket of the program is of IPv6 and the packets are of IPv4: the program sees `::ffff:10.0.0.1`.
    is_mapped: bool,
    /// End of the search for the owner of the peer's address, if nobody has the address; `None` if a host has the address.
    unreachable_at: Option<Instant>,
    /// Linger time set by the program. Only zero has an effect: the connection is reset when its stream is dropped.
    linger: Option<Duration>,
    /// Listener of a connection that waits to be accepted; `None` after the acceptance and for opened connections.
    listener: Option<ListenId>,
    /// Port to which the socket of the connection was bound.
    hold: Option<HoldId>,
    /// Next deadline of the connection.
    due: Option<Instant>,
    /// Instant of the entry in [`Tcp::timers`], if there is an entry: not after `due`.
    entry: Option<Instant>,
    is_in_time_wait: bool,
    gone: Option<Gone>,
    /// Bytes of this end in [`Held`](crate::wire::Held).
    counted: u64,
    /// Number of calls at the last look, and the deadline then: see [`Core::is_stuck`].
    looked_at: (u64, Option<Instant>),
}

/// Instant and cause of the end of a socket whose host crashed or whose program was killed.
#[derive(Clone, Copy, Debug)]
pub(in crate::core) struct Gone {
    pub(in crate::core) at: Instant,
    /// `true` if only the program was killed. If false, the host has crashed.
    pub(in crate::core) is_killed: bool,
}

/// A listening socket.
#[derive(Debug)]
struct Listener {
    host: NodeId,
    local: SocketAddr,
    /// Constants for the accepted connections.
    config: TcpConfig,
    linger: Option<Duration>,
    backlog: usize,
    /// Connections whose handshake is not complete.
    half_open: BTreeSet<ConnId>,
    /// Connections to accept, in the order of completed handshakes.
    waiting: VecDeque<ConnId>,
    wakers: Waiters,
    /// Port at which the listener listens.
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
            latest: None,
            ports: ports::Ports::new(hosts),
            timers: Default::default(),
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

    /// Adds a connection of `host`.
    fn insert(&mut self, host: NodeId, machine: Connection) -> ConnId {
        let route = route(host, machine.local_addr(), machine.peer_addr());
        let id = ConnId(self.connections.insert(Box::new(End {
            host,
            machine,
            readers: Waiters::default(),
            writers: Waiters::default(),
            is_held: false,
            // The handshake blocks writing. `settle` wakes the writers when the connection is established.
            is_write_blocked: true,
            is_mapped: false,
            unreachable_at: None,
            linger: None,
            listener: None,
            hold: None,
            due: None,
            entry: None,
            is_in_time_wait: false,
            gone: None,
            counted: 0,
            // No number of calls equals the maximum, so the first look never takes the connection for stuck.
            looked_at: (u64::MAX, None),
        })));
        // The new connection may take the route of an old connection, which may be the latest answer.
        self.routes.insert(route, id);
        self.latest = None;
        id
    }

    /// Returns the connection of `route`. Packets mostly arrive in flights of one connection, so the latest answer is tried first.
    fn routed(&mut self, route: &Route) -> Option<ConnId> {
        if let Some((_, id)) = self.latest.filter(|(latest, _)| latest == route) {
            return Some(id);
        }
        let id = *self.routes.get(route)?;
        self.latest = Some((*route, id));
        Some(id)
    }

    /// Removes the route of a connection, so that packets no longer find the connection.
    fn unroute(&mut self, id: ConnId) {
        let end = self.end(id);
        let route = route(end.host, end.machine.local_addr(), end.machine.peer_addr());
        // The route may belong to a newer connection with the same addresses by now.
        if self.routes.get(&route) == Some(&id) {
            self.routes.remove(&route);
            self.latest = None;
        }
    }

    fn initial_sequence(&mut self, host: NodeId, names: &[String]) -> u32 {
        u32::from_le_bytes(self.entropy.of(Some(host), names).bytes())
    }

    /// Returns whether any connection has drawn an initial sequence number.
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
    /// Removes an end with its route, timer and port.
    fn remove_connection(&mut self, id: ConnId) {
        // Route and timer are found through the end, which is removed last.
        self.tcp.unroute(id);
        self.tcp.remove_timer(id);
        let Some(end) = self.tcp.connections.remove(id.0) else { return };
        self.wire.held.recount_stream(end.counted, 0);
        end.hold.into_iter().for_each(|hold| self.tcp.ports.release(hold));
    }

    /// Updates the count of bytes held by an end.
    fn recount(&mut self, id: ConnId) {
        let end = self.tcp.connections.get_mut(id.0);
        let held = end.machine.held() as u64;
        // `counted` holds the share of this end in the sum, so the call replaces exactly this share.
        self.wire.held.recount_stream(std::mem::replace(&mut end.counted, held), held);
    }

    /// Sets the constants of the connections that `host` opens or accepts from now on.
    pub(crate) fn set_tcp(&mut self, host: NodeId, config: TcpConfig) {
        self.tcp.configs[host.index()] = config;
    }

    /// Returns the constants of connections of `host`.
    pub(crate) fn tcp_config(&self, host: NodeId) -> &TcpConfig {
        &self.tcp.configs[host.index()]
    }

    /// Returns all ends with a route, sorted by host, port, address and peer.
    pub(crate) fn connections(&self) -> impl Iterator<Item = (NodeId, &Connection)> {
        self.tcp.routes.values().map(|id| self.tcp.end(*id)).map(|end| (end.host, &end.machine))
    }
}
