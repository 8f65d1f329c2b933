//! Sockets of a relay. Arrived datagrams go from the sockets to the engine, releases go from the engine to the sockets. The fates of datagrams are decided in
//! the engine alone.

use core::fmt;
use core::mem::MaybeUninit;
use std::collections::VecDeque;
use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};

use cohaptic_realtime::udp::{BindError, EndpointConfig, EndpointCounts, ReceiveBuffers, UdpEndpoint};
use cohaptic_realtime::{Clock as _, Lateness, MonotonicClock, Received};
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;
use rustix::event::{Timespec, epoll};
use rustix::io::Errno;

use super::PortReport;
use crate::config::{Form, RelayConfig};
use crate::engine::{Arrival, Engine, Intake, Port};

/// All sockets of a relay.
pub(super) struct Ports {
    /// Sockets, indexed by program in a mesh. In a proxy, index 0 is the listening socket and index n + 1 the socket of the client in slot n. `None`: no client
    /// has this slot.
    ports: Vec<Option<OpenPort>>,
    /// Names of the ports, and the address for new sockets of clients.
    layout: Layout,
    /// Options of every socket.
    config: EndpointConfig,
    /// Epoll instance, readable when at least one socket is readable.
    epoll: OwnedFd,
    /// Receive buffers, shared by all sockets: sockets are read one at a time.
    buffers: ReceiveBuffers,
    /// Slots of new clients whose sockets are still to be opened.
    opened: Vec<u32>,
    /// Indices of sockets with queued datagrams. An index is listed at most once: see [`OpenPort::is_dirty`].
    dirty: Vec<usize>,
    /// Counts of the sockets of former clients.
    left: Tally,
    /// Clients sent away because no socket could be opened.
    without_socket: u64,
}

/// Open socket with the queue.
#[derive(Debug)]
struct OpenPort {
    socket: UdpEndpoint,
    /// Instants at which the queued datagrams should have left, one per datagram in the socket's outbox, in the same order.
    departures: VecDeque<Instant>,
    /// `true` if the socket's index is in [`Ports::dirty`].
    is_dirty: bool,
}

/// Kind of topology.
#[derive(Debug)]
enum Layout {
    /// Names of the programs, indexed by program.
    Mesh(Vec<String>),
    /// Local address for the sockets of clients, with port number 0.
    Proxy { clients: SocketAddr },
}

/// Sums of the counters of several sockets.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    counts: EndpointCounts,
    kernel_drops: u64,
}

/// Batches read from a socket before further sockets, and due departures, get their turn.
const BATCHES: usize = 8;

/// Datagrams taken from the engine before arrivals get their turn.
const RELEASES: usize = 1024;

impl Ports {
    /// Opens the ports of the beginning: the ports of all programs, or the listening port of a proxy.
    pub(super) fn open(config: &RelayConfig, endpoint: EndpointConfig) -> Result<Self, BindError> {
        let layout = match &config.form {
            Form::Mesh(mesh) => Layout::Mesh(mesh.programs.iter().map(|program| program.name.clone()).collect()),
            Form::Proxy(proxy) => Layout::Proxy { clients: beside(proxy.to) },
        };
        let nowhere = SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0));
        let failed = |address: SocketAddr| move |error: Errno| BindError { address, source: error.into() };
        // `BindError` needs an address, but the epoll instance belongs to all sockets.
        let epoll = epoll::create(epoll::CreateFlags::CLOEXEC).map_err(failed(nowhere))?;
        let mut ports = Self {
            ports: Vec::new(),
            layout,
            config: endpoint,
            epoll,
            buffers: ReceiveBuffers::new(),
            opened: Vec::new(),
            dirty: Vec::new(),
            left: Tally::default(),
            without_socket: 0,
        };
        for (place, address) in config.ports().into_iter().enumerate() {
            ports.open_at(place, address)?;
        }
        Ok(ports)
    }

    /// Returns a file descriptor, readable when a datagram waits at any socket.
    pub(super) fn readable(&self) -> BorrowedFd<'_> {
        self.epoll.as_fd()
    }

    /// Hands the datagrams to the engine that have arrived by `now`, the present time of `clock`, and possibly later datagrams. Returns an instant: every
    /// datagram up to the instant was handed on. The caller must not let logical time pass the instant, because an unread datagram would be offered late.
    pub(super) fn receive(&mut self, engine: &mut Engine, clock: &MonotonicClock, now: Instant) -> io::Result<Received> {
        let mut heard = Received { count: 0, until: now };
        // A proxy has a single socket until the first client comes, and needs no call of epoll until then.
        if self.ports.len() == 1 {
            self.receive_at(0, engine, clock, &mut heard)?;
        } else {
            // A call of epoll tells the readable sockets. Without epoll, every socket would need a call of its own.
            let mut events = [MaybeUninit::uninit(); 64];
            let ready = match epoll::wait(&self.epoll, &mut events, Some(&Timespec::default())) {
                Ok((ready, _)) => &*ready,
                Err(Errno::INTR) => &[],
                Err(error) => return Err(error.into()),
            };
            for event in ready {
                let place = usize::try_from(event.data.u64()).unwrap_or(usize::MAX);
                self.receive_at(place, engine, clock, &mut heard)?;
            }
        }
        // Datagrams of several sockets are offered together, because the engine sorts the datagrams by arrival.
        if heard.count > 0 {
            engine.offer_staged();
        }
        Ok(heard)
    }

    /// Reads up to [`BATCHES`] batches from a socket and stages the datagrams in the engine. Reads nothing at an index without a socket: a client may have
    /// left.
    fn receive_at(&mut self, place: usize, engine: &mut Engine, clock: &MonotonicClock, heard: &mut Received) -> io::Result<()> {
        let Some(Some(open)) = self.ports.get_mut(place) else { return Ok(()) };
        let port = match (&self.layout, u32::try_from(place).unwrap_or(u32::MAX)) {
            (Layout::Mesh(_), _) => Port::Program(NodeId::new(place)),
            (Layout::Proxy { .. }, 0) => Port::Listen,
            (Layout::Proxy { .. }, place) => Port::Client(place - 1),
        };
        let (opened, mut last) = (&mut self.opened, None);
        for batch in 1..=BATCHES {
            let count = open.socket.receive(&mut self.buffers, clock, |datagram| {
                last = Some(datagram.at);
                let intake = engine.stage(Arrival { at: datagram.at, port, from: datagram.from, bytes: datagram.bytes, ecn: datagram.ecn });
                if let Intake::FromNewClient(slot) = intake {
                    opened.push(slot);
                }
            })?;
            heard.count += count;
            // A batch with room left has emptied the socket.
            if count < UdpEndpoint::BATCH {
                break;
            }
            if batch == BATCHES {
                // The bound ended the reading, not an empty socket. Unread datagrams of this socket arrived no earlier than `last`.
                heard.until = last.map_or(heard.until, |last| last.min(heard.until));
            }
        }
        Ok(())
    }

    /// Closes the sockets of former clients, then opens sockets for new clients.
    pub(super) fn follow_clients(&mut self, engine: &mut Engine) {
        if let Layout::Proxy { clients } = self.layout {
            self.follow(engine, clients);
        }
    }

    /// Does the work of [`Ports::follow_clients`] for a proxy.
    fn follow(&mut self, engine: &mut Engine, clients: SocketAddr) {
        // Closing comes first: a slot that was freed and given to a new client at once is in both lists.
        while let Some(slot) = engine.poll_closed() {
            if let Some(port) = self.ports.get_mut(slot as usize + 1).and_then(Option::take) {
                self.left.add(&port.socket);
            }
        }
        while let Some(slot) = self.opened.pop() {
            if self.open_at(slot as usize + 1, clients).is_err() {
                // Usually the limit of file descriptors is reached. The relay goes on with the remaining clients.
                self.without_socket += 1;
                engine.close_client(slot);
            }
        }
    }

    /// Opens a socket at the index `place`. The index is also the socket's number in epoll.
    fn open_at(&mut self, place: usize, address: SocketAddr) -> Result<(), BindError> {
        let socket = UdpEndpoint::bind(address, self.config)?;
        epoll::add(&self.epoll, &socket, epoll::EventData::new_u64(place as u64), epoll::EventFlags::IN)
            .map_err(|error| BindError { address, source: error.into() })?;
        // Slots of clients without a socket so far stay empty.
        while self.ports.len() <= place {
            self.ports.push(None);
        }
        self.ports[place] = Some(OpenPort { socket, departures: VecDeque::new(), is_dirty: false });
        Ok(())
    }

    /// Queues the datagrams due now in the sockets. Returns whether the bound [`RELEASES`] ended the taking, so that more datagrams may be left.
    pub(super) fn take_releases(&mut self, engine: &mut Engine) -> bool {
        for _ in 0..RELEASES {
            let Some(release) = engine.poll_release() else { return false };
            let place = match release.port {
                Port::Program(program) => program.index(),
                Port::Listen => 0,
                Port::Client(slot) => slot as usize + 1,
            };
            // The socket exists: the engine forgets a client without a socket, and releases nothing for a forgotten client.
            let Some(Some(port)) = self.ports.get_mut(place) else { continue };
            // A full outbox drops and counts the datagram: a dropped datagram has no departure either.
            if port.socket.queue(release.to, release.bytes, release.ecn) {
                // The datagram should have left at this instant, had the offer come with the arrival.
                let late = u64::try_from(release.late.as_nanos()).unwrap_or(u64::MAX);
                port.departures.push_back(Instant::from_nanos(release.at.as_nanos().saturating_sub(late)));
                if !core::mem::replace(&mut port.is_dirty, true) {
                    self.dirty.push(place);
                }
            }
        }
        true
    }

    /// Sends the queued datagrams and records the lateness of each datagram: the time of the clock before the call of the kernel, less the instant when the
    /// datagram should have left. A late offer to the link counts as lateness, too.
    pub(super) fn send(&mut self, clock: &MonotonicClock, lateness: &mut Lateness) {
        let ports = &mut self.ports;
        self.dirty.retain(|place| {
            // The socket of a former client is missing; datagrams still queued there were dropped with the socket.
            let Some(Some(OpenPort { socket, departures, is_dirty })) = ports.get_mut(*place) else { return false };
            // `count` datagrams were sent or given up, in the order of the queue, so the first `count` instants belong to these datagrams.
            socket.flush_with(
                || clock.now(),
                |before, count| departures.drain(..count.min(departures.len())).for_each(|at| lateness.record(before.saturating_duration_since(at))),
            );
            *is_dirty = socket.has_waiting();
            *is_dirty
        });
    }

    /// Returns whether queued datagrams wait because the kernel had no room.
    pub(super) fn has_waiting(&self) -> bool {
        !self.dirty.is_empty()
    }

    /// Returns name and address of each port standing for a program, or of the listening port.
    pub(super) fn addresses(&self) -> impl Iterator<Item = (&str, SocketAddr)> {
        let count = match &self.layout {
            Layout::Mesh(names) => names.len(),
            Layout::Proxy { .. } => 1,
        };
        let name = |place: usize| match &self.layout {
            Layout::Mesh(names) => names.get(place).map_or("", String::as_str),
            Layout::Proxy { .. } => "listen",
        };
        let ports = self.ports.iter().take(count).enumerate();
        ports.filter_map(move |(place, port)| Some((name(place), port.as_ref()?.socket.local_address())))
    }

    /// Returns the number of clients sent away because no socket could be opened.
    pub(super) const fn without_socket(&self) -> u64 {
        self.without_socket
    }

    /// Returns the counts of each port. The ports of all clients, past and present, are a single entry.
    pub(super) fn report(&self) -> Vec<PortReport> {
        let mut ports: Vec<PortReport> = Vec::new();
        for (place, (name, address)) in self.addresses().enumerate() {
            if let Some(Some(OpenPort { socket, .. })) = self.ports.get(place) {
                ports.push(PortReport {
                    name: name.to_owned(),
                    address: Some(address),
                    counts: *socket.counts(),
                    receive_buffer: socket.granted_receive_buffer(),
                    kernel_drops: socket.kernel_drops().ok().flatten(),
                });
            }
        }
        if let Layout::Proxy { .. } = self.layout {
            // Former clients are in the sums already; the socket at index 0 is the listening socket.
            let mut tally = self.left;
            self.ports.iter().skip(1).flatten().for_each(|port| tally.add(&port.socket));
            let granted = self.ports.iter().skip(1).flatten().map(|port| port.socket.granted_receive_buffer()).min();
            ports.push(PortReport {
                name: "clients".to_owned(),
                address: None,
                counts: tally.counts,
                receive_buffer: granted.unwrap_or(0),
                kernel_drops: Some(tally.kernel_drops),
            });
        }
        ports
    }
}

impl fmt::Debug for Ports {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Ports").field("layout", &self.layout).field("config", &self.config).finish_non_exhaustive()
    }
}

impl Tally {
    fn add(&mut self, socket: &UdpEndpoint) {
        let (sum, more) = (&mut self.counts, socket.counts());
        sum.received += more.received;
        sum.oversized += more.oversized;
        sum.receive_errors += more.receive_errors;
        sum.sent += more.sent;
        sum.send_calls += more.send_calls;
        let (sum, more) = (&mut sum.failures, more.failures);
        sum.full += more.full;
        sum.refused += more.refused;
        sum.unreachable += more.unreachable;
        sum.too_large += more.too_large;
        sum.forbidden += more.forbidden;
        sum.other += more.other;
        self.kernel_drops += socket.kernel_drops().ok().flatten().unwrap_or(0);
    }
}

/// Returns a local address, with port number 0, from which `to` can be reached. For a loopback target the address is a loopback address, out of reach for other
/// machines.
fn beside(to: SocketAddr) -> SocketAddr {
    match (to.is_ipv6(), to.ip().is_loopback()) {
        (true, true) => (Ipv6Addr::LOCALHOST, 0).into(),
        (true, false) => (Ipv6Addr::UNSPECIFIED, 0).into(),
        (false, true) => (Ipv4Addr::LOCALHOST, 0).into(),
        (false, false) => (Ipv4Addr::UNSPECIFIED, 0).into(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::time::Duration;

    use cohaptic_linkfile::{LinkTable, link_from_keys};

    use super::*;
    use crate::{Limits, Mesh, Program, Proxy};

    /// A client whose port cannot be opened is forgotten and counted; the next client is not harmed.
    #[test]
    fn a_client_without_a_port_is_sent_away_and_counted() {
        let here = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let link = link_from_keys(&[]).unwrap();
        let proxy = Proxy { listen: here, to: SocketAddr::from((Ipv4Addr::LOCALHOST, 9)), forth: link.clone(), back: link, most_clients: 2 };
        let config = RelayConfig { seed: 0, form: Form::Proxy(proxy), limits: Limits::default(), changes: Vec::new() };
        let (mut ports, mut engine) = (Ports::open(&config, EndpointConfig::default()).unwrap(), Engine::new(config).unwrap());
        // The address of this socket is taken, so that opening a port there fails.
        let taken = std::net::UdpSocket::bind(here).unwrap();
        for (clients, expected) in [(taken.local_addr().unwrap(), (0, 1)), (here, (1, 1))] {
            ports.layout = Layout::Proxy { clients };
            let from = SocketAddr::from((Ipv4Addr::LOCALHOST, 10));
            let intake = engine.handle_datagram(Arrival { at: Instant::ZERO, port: Port::Listen, from, bytes: b"ask", ecn: None });
            let Intake::FromNewClient(slot) = intake else { panic!("{intake:?}") };
            ports.opened.push(slot);
            ports.follow_clients(&mut engine);
            assert_eq!((engine.clients(), ports.without_socket()), expected);
        }
    }

    /// A datagram offered to its link later than it arrived is recorded as late by the same time, even if it is sent at once.
    #[test]
    fn what_was_offered_late_is_released_late() {
        let [left, right] = [SocketAddr::from((Ipv4Addr::LOCALHOST, 9)), SocketAddr::from((Ipv4Addr::LOCALHOST, 10))];
        let port = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let program = |name: &str, address| Program { name: name.to_owned(), port, address: Some(address) };
        let links = LinkTable::new(2, Arc::new(link_from_keys(&[]).unwrap()), []);
        let form = Form::Mesh(Mesh { programs: vec![program("left", left), program("right", right)], links });
        let config = RelayConfig { seed: 0, form, limits: Limits::default(), changes: Vec::new() };
        let clock = MonotonicClock::start();
        let (mut ports, mut engine) = (Ports::open(&config, EndpointConfig::default()).unwrap(), Engine::new(config).unwrap());
        let late = Duration::from_millis(5);
        let passed = Instant::ZERO.saturating_add(late);
        while clock.now() < passed {
            std::hint::spin_loop();
        }
        engine.handle_timeout(passed);
        engine.handle_datagram(Arrival { at: Instant::ZERO, port: Port::Program(NodeId(1)), from: left, bytes: b"late", ecn: None });
        assert!(!ports.take_releases(&mut engine));
        let mut lateness = Lateness::new();
        ports.send(&clock, &mut lateness);
        assert_eq!(lateness.count(), 1);
        assert!(lateness.summary().max >= late, "{:?}", lateness.summary());
    }
}
