//! The relay without sockets and without a clock.

mod clients;
mod datagram;
mod pool;
mod programs;
mod recent;

use core::time::Duration;
use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::Arc;

use cohaptic_realtime::Lateness;
use cohaptic_realtime::udp::Ecn;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Fate, LinkModel, LinkStats, Network, NetworkConfig, NetworkError, NodeId, PacketEvent, PacketInfo, PacketRecord, Path};

use crate::config::{Change, ConfigError, Form, Limits, RelayConfig};
use clients::Clients;
pub use datagram::{Arrival, Intake, IntakeCounts, LinkCounts, Port, Release};
use pool::{Packet, Pool};
use programs::Programs;
use recent::Recent;

/// A relay as a state machine: datagrams in with [`Engine::handle_datagram`], datagrams out with [`Engine::poll_release`].
///
/// The driver hands datagrams in with the instant at which they came, asks with [`Engine::poll_timeout`] when to come back, calls
/// [`Engine::handle_timeout`] then, and drains [`Engine::poll_release`] until it gives `None`. The fates are those of a [`Network`] to which the same
/// datagrams are offered at the same instants.
#[derive(Debug)]
pub struct Engine {
    network: Network<Arc<Packet>>,
    names: Vec<String>,
    routes: Routes,
    limits: Limits,
    pool: Pool,
    now: Instant,
    /// Admitted, and not offered yet.
    staged: Vec<Staged>,
    /// On their way or admitted. A copy is announced when it is made, which may be polled after its end: for a moment too few are counted.
    packets: i64,
    bytes: i64,
    changes: VecDeque<Change>,
    /// By sender, then receiver.
    links: Vec<LinkCounts>,
    /// By sender, then receiver.
    recent: Vec<Recent>,
    counts: IntakeCounts,
    clamped: Lateness,
    /// What the last release carries.
    released: Option<Arc<Packet>>,
}

/// The nodes of a proxy's network.
const CLIENT: NodeId = NodeId(0);
const SERVER: NodeId = NodeId(1);

#[derive(Debug)]
enum Routes {
    Programs(Programs),
    Clients { clients: Clients, server: SocketAddr },
}

#[derive(Debug)]
struct Staged {
    at: Instant,
    from: NodeId,
    to: NodeId,
    packet: Arc<Packet>,
}

impl Engine {
    /// A relay to which nothing has come yet.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] if there is no such relay.
    pub fn new(config: RelayConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let names = config.names();
        let nodes = names.len();
        let network = NetworkConfig { seed: config.seed, nodes: names.clone(), general: false };
        let network = Network::new(network, |from, to| config.link(from, to));
        let RelayConfig { form, limits, mut changes, .. } = config;
        // Stable: equal instants stay in their order.
        changes.sort_by_key(|change| change.at);
        let routes = match form {
            Form::Mesh(mesh) => Routes::Programs(Programs::new(&mesh.programs, limits.forget_after)),
            Form::Proxy(proxy) => Routes::Clients { clients: Clients::new(proxy.most_clients, limits.forget_after), server: proxy.to },
        };
        Ok(Self {
            network,
            names,
            routes,
            limits,
            pool: Pool::new(usize::try_from(limits.bytes.get()).unwrap_or(usize::MAX)),
            now: Instant::ZERO,
            staged: Vec::new(),
            packets: 0,
            bytes: 0,
            changes: changes.into(),
            links: vec![LinkCounts::default(); nodes * nodes],
            recent: vec![Recent::default(); nodes * nodes],
            counts: IntakeCounts::default(),
            clamped: Lateness::new(),
            released: None,
        })
    }

    /// Takes a datagram in.
    #[inline]
    pub fn handle_datagram(&mut self, arrival: Arrival<'_>) -> Intake {
        let intake = self.stage(arrival);
        self.offer_staged();
        intake
    }

    /// Takes a datagram in, but lets it wait until [`Engine::offer_staged`]: datagrams that were read from several sockets are offered in the order
    /// in which they came.
    #[inline]
    pub fn stage(&mut self, arrival: Arrival<'_>) -> Intake {
        let Arrival { at, port, from, bytes, ecn } = arrival;
        let mut opened = None;
        let (sender, to, client) = match (&mut self.routes, port) {
            (Routes::Programs(programs), Port::Program(to)) => match programs.sender(from, to, at) {
                None => return self.refuse(Intake::Stranger),
                Some(sender) if sender == to => return self.refuse(Intake::ToItself),
                Some(sender) => (sender, to, None),
            },
            (Routes::Clients { clients, .. }, Port::Listen) => match clients.client(from, at) {
                None => return self.refuse(Intake::NoRoom),
                Some((client, is_new)) => {
                    opened = is_new.then_some(client.slot);
                    (CLIENT, SERVER, Some(client))
                }
            },
            (Routes::Clients { clients, server }, Port::Client(slot)) if from == *server => match clients.at_port(slot, at) {
                None => return self.refuse(Intake::Stranger),
                client => (SERVER, CLIENT, client),
            },
            (Routes::Programs(_) | Routes::Clients { .. }, _) => return self.refuse(Intake::Stranger),
        };
        let length = i64::try_from(bytes.len()).unwrap_or(i64::MAX);
        let is_full = |held: i64, more: i64, most: u64| u64::try_from(held.saturating_add(more)).is_ok_and(|sum| sum > most);
        if is_full(self.packets, 1, self.limits.packets) || is_full(self.bytes, length, self.limits.bytes.get()) {
            let link = self.link(sender, to);
            self.links[link].overload += 1;
            self.refuse(Intake::Overload);
            // A new client is one all the same.
            return opened.map_or(Intake::Overload, Intake::FromNewClient);
        }
        self.packets += 1;
        self.bytes += length;
        let packet = self.pool.take(bytes, ecn, client);
        self.staged.push(Staged { at, from: sender, to, packet });
        opened.map_or(Intake::Offered, Intake::FromNewClient)
    }

    /// Offers to their links what waits, in the order of the instants. What came before an instant that has been let pass is offered at that
    /// instant, and counted.
    pub fn offer_staged(&mut self) {
        if !self.staged.is_sorted_by_key(|staged| staged.at) {
            self.staged.sort_by_key(|staged| staged.at);
        }
        let mut staged = core::mem::take(&mut self.staged);
        for Staged { at, from, to, mut packet } in staged.drain(..) {
            if let Some(late) = self.now.checked_duration_since(at).filter(|late| !late.is_zero()) {
                self.counts.clamped += 1;
                self.clamped.record(late);
                // Nobody else holds it yet.
                if let Some(packet) = Arc::get_mut(&mut packet) {
                    packet.late = late;
                }
            }
            self.pass(at);
            let info = PacketInfo { size: Bytes::new(packet.bytes.len() as u64), ecn_capable: packet.ecn.is_some() };
            self.counts.offered += 1;
            let offered = self.network.handle_packet(self.now, from, to, info, packet);
            debug_assert_eq!(offered, Ok(()), "time has not gone back, and the routes name no other links");
        }
        self.staged = staged;
    }

    /// Lets time pass until `now`; an instant that has passed already changes nothing.
    #[inline]
    pub fn handle_timeout(&mut self, now: Instant) {
        self.pass(now);
        if let Routes::Clients { clients, .. } = &mut self.routes {
            clients.handle_timeout(self.now);
        }
    }

    /// When [`Engine::handle_timeout`] must be called next; `None` if nothing is on its way.
    #[must_use]
    #[inline]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let clients = match &self.routes {
            Routes::Programs(_) => None,
            Routes::Clients { clients, .. } => clients.poll_timeout(),
        };
        let change = self.changes.front().map(|change| change.at);
        [self.network.poll_timeout(), change, clients].into_iter().flatten().min()
    }

    /// The next datagram that leaves, up to the last instant given; `None` when all have been polled.
    #[inline]
    pub fn poll_release(&mut self) -> Option<Release<'_>> {
        if let Some(packet) = self.released.take() {
            self.pool.put(packet);
        }
        loop {
            let event = self.network.poll_event()?;
            let length = i64::try_from(event.payload.bytes.len()).unwrap_or(i64::MAX);
            match event.fate {
                Fate::Delivered(at) => {
                    self.packets -= 1;
                    self.bytes -= length;
                    let link = self.link(event.path.from, event.path.to);
                    self.links[link].delivered_bytes += event.payload.bytes.len() as u64;
                    self.recent[link].record(at.saturating_duration_since(event.offered));
                    let Some((port, to)) = self.way_out(&event) else {
                        self.links[link].undeliverable += 1;
                        self.pool.put(event.payload);
                        continue;
                    };
                    let PacketEvent { record: PacketRecord { marked, .. }, mut payload, damage } = event;
                    if let Some(damage) = damage {
                        // A copy of it may be on its way still, undamaged.
                        damage.apply(&mut Arc::make_mut(&mut payload).bytes);
                    }
                    let packet = self.released.insert(payload);
                    let ecn = if marked { Some(Ecn::Ce) } else { packet.ecn };
                    return Some(Release { at, late: packet.late, port, to, bytes: &packet.bytes, ecn });
                }
                Fate::Dropped(_) => {
                    self.packets -= 1;
                    self.bytes -= length;
                    self.pool.put(event.payload);
                }
                // The copy, which has an end of its own.
                Fate::Duplicated => {
                    self.packets += 1;
                    self.bytes += length;
                }
            }
        }
    }

    /// The next client that has left: its port is not needed any more.
    pub fn poll_closed(&mut self) -> Option<u32> {
        match &mut self.routes {
            Routes::Programs(_) => None,
            Routes::Clients { clients, .. } => clients.poll_closed(),
        }
    }

    /// Forgets a client, for which no port could be had.
    pub fn close_client(&mut self, slot: u32) {
        if let Routes::Clients { clients, .. } = &mut self.routes {
            clients.close(slot);
        }
    }

    /// Changes the model of a link from `now` on, or from the last instant given if that is later: see [`Network::set_link`].
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if there is no such link; nothing was changed.
    pub fn set_link(&mut self, now: Instant, from: NodeId, to: NodeId, model: LinkModel) -> Result<(), NetworkError> {
        self.pass(now);
        self.network.set_link(self.now, from, to, model)
    }

    /// The names of the nodes of the network.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// What a link did; `None` if there is none.
    #[must_use]
    pub fn link_stats(&self, from: NodeId, to: NodeId) -> Option<(LinkStats, LinkCounts)> {
        Some((self.network.link_stats(from, to)?, self.links[self.link(from, to)]))
    }

    /// The delays of the latest datagrams that came out of a link, in no order: of 128 at most.
    #[must_use]
    pub fn recent_delays(&self, from: NodeId, to: NodeId) -> &[Duration] {
        self.recent.get(self.link(from, to)).map_or(&[], Recent::delays)
    }

    /// What came in.
    #[must_use]
    pub const fn counts(&self) -> &IntakeCounts {
        &self.counts
    }

    /// By how much datagrams were offered later than they came: see [`IntakeCounts::clamped`].
    #[must_use]
    pub const fn clamped(&self) -> &Lateness {
        &self.clamped
    }

    /// How many datagrams are on their way, and how many bytes; exact when [`Engine::poll_release`] has given `None`.
    #[must_use]
    pub fn held(&self) -> (u64, Bytes) {
        (u64::try_from(self.packets).unwrap_or(0), Bytes::new(u64::try_from(self.bytes).unwrap_or(0)))
    }

    /// How many clients there are; for a mesh, none.
    #[must_use]
    pub fn clients(&self) -> usize {
        match &self.routes {
            Routes::Programs(_) => 0,
            Routes::Clients { clients, .. } => clients.count(),
        }
    }

    /// Where a program is, if that is known; `None` for a proxy.
    #[must_use]
    pub fn program_address(&self, program: NodeId) -> Option<SocketAddr> {
        match &self.routes {
            Routes::Programs(programs) => programs.address(program),
            Routes::Clients { .. } => None,
        }
    }

    /// Where a datagram that has come out of its link goes, and from which port: that which stands for its sender.
    #[inline]
    fn way_out(&self, event: &PacketEvent<Arc<Packet>, Path>) -> Option<(Port, SocketAddr)> {
        match &self.routes {
            Routes::Programs(programs) => Some((Port::Program(event.path.from), programs.address(event.path.to)?)),
            Routes::Clients { clients, server } => {
                let client = event.payload.client?;
                let address = clients.address(client)?;
                Some(if event.path.to == CLIENT { (Port::Listen, address) } else { (Port::Client(client.slot), *server) })
            }
        }
    }

    /// Lets time pass, with the changes on the way.
    #[inline]
    fn pass(&mut self, now: Instant) {
        while self.changes.front().is_some_and(|change| change.at <= now) {
            let Some(change) = self.changes.pop_front() else { return };
            self.now = self.now.max(change.at);
            let changed = self.network.set_link(self.now, change.from, change.to, change.model);
            debug_assert_eq!(changed, Ok(()), "the changes were checked, and time has not gone back");
        }
        self.now = self.now.max(now);
        let passed = self.network.handle_timeout(self.now);
        debug_assert_eq!(passed, Ok(()), "time has not gone back");
    }

    fn link(&self, from: NodeId, to: NodeId) -> usize {
        from.index() * self.names.len() + to.index()
    }

    #[cold]
    const fn refuse(&mut self, why: Intake) -> Intake {
        let counter = match why {
            Intake::Offered | Intake::FromNewClient(_) => &mut self.counts.offered,
            Intake::Overload => &mut self.counts.overload,
            Intake::Stranger => &mut self.counts.strangers,
            Intake::ToItself => &mut self.counts.to_itself,
            Intake::NoRoom => &mut self.counts.no_room,
        };
        *counter += 1;
        why
    }
}
