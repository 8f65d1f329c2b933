//! The relay without sockets and without a clock. Datagrams with instants come in; releases with instants go out. The engine knows addresses and links, but
//! neither sockets nor the present time.

mod clients;
mod datagram;
mod pool;
mod programs;

use core::time::Duration;
use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::Arc;

use cohaptic_realtime::udp::Ecn;
use cohaptic_realtime::{Lateness, Recent};
use cohaptic_units::{self as units, Bytes, Instant};
use cohaptic_wan::{Fate, LinkModel, LinkStats, Network, NetworkConfig, NetworkError, NodeId, PacketEvent, PacketInfo, PacketRecord, Path};

use crate::config::{Change, ConfigError, Form, Limits, RelayConfig};
use clients::Clients;
pub use datagram::{Arrival, Intake, IntakeCounts, LinkCounts, Port, Release};
use pool::{Packet, Pool};
use programs::Programs;

/// State machine of a relay: datagrams go in with [`Engine::handle_datagram`] and come out with [`Engine::poll_release`].
///
/// The driver passes each datagram with the instant of arrival, and asks [`Engine::poll_timeout`] for the next deadline. At the deadline, the driver calls
/// [`Engine::handle_timeout`] and drains [`Engine::poll_release`] until `None` is returned. The fates of the datagrams equal the fates in a [`Network`] that
/// gets the same datagrams at the same instants.
#[derive(Debug)]
pub struct Engine {
    network: Network<Arc<Packet>>,
    /// Names of the nodes, indexed by node.
    names: Vec<String>,
    routes: Routes,
    limits: Limits,
    pool: Pool,
    /// Latest instant of logical time. Never decreases.
    now: Instant,
    /// Admitted datagrams before the offer to a link.
    staged: Vec<Staged>,
    /// Datagrams in flight or staged. Signed, because the network can report the end of a copy before the making of the copy: the number is then too low until
    /// all events are polled.
    packets: i64,
    /// Payload bytes of the same datagrams.
    bytes: i64,
    /// Changes of links still to come, in order of time.
    changes: VecDeque<Change>,
    /// Links that have cross-traffic, or had it before a change.
    with_cross: Vec<(NodeId, NodeId)>,
    /// Latest instant up to which the cross packets of all links are computed.
    caught_up: Instant,
    /// Counters of each link, at the index [`Engine::link`].
    links: Vec<LinkCounts>,
    /// Latest delays of each link, at the index [`Engine::link`].
    recent: Vec<Recent>,
    counts: IntakeCounts,
    /// Time from arrival to offer, of the datagrams offered late.
    clamped: Lateness,
    /// Payload of the release returned last. The caller borrows the payload until the next poll.
    released: Option<Arc<Packet>>,
}

/// Node of a proxy's network standing for all clients.
const CLIENT: NodeId = NodeId(0);
/// Node of a proxy's network standing for the server.
const SERVER: NodeId = NodeId(1);

/// Time after which the cross packets that no datagram has met are computed. The loop of the relay turns at least every 50 ms, also in a silence. So the first
/// datagram after any silence waits for the cross packets of 50 ms at most, 0.1 ms at 10,000 packets a second.
const CATCH_UP: Duration = Duration::from_millis(10);

/// Senders and receivers of a topology, by address.
#[derive(Debug)]
enum Routes {
    Programs(Programs),
    Clients { clients: Clients, server: SocketAddr },
}

/// Admitted datagram with the instant of arrival and the link.
#[derive(Debug)]
struct Staged {
    at: Instant,
    from: NodeId,
    to: NodeId,
    packet: Arc<Packet>,
}

impl Engine {
    /// Returns a relay before the first datagram.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] if the configuration is refused.
    pub fn new(config: RelayConfig) -> Result<Self, ConfigError> {
        config.check()?;
        let names = config.names();
        let nodes = names.len();
        let network = NetworkConfig { seed: config.seed, nodes: names.clone(), general: false };
        let mut with_cross = Vec::new();
        let network = Network::new(network, |from, to| {
            let model = config.link(from, to);
            with_cross.extend((from != to && model.has_cross_traffic()).then_some((from, to)));
            model
        });
        let RelayConfig { form, limits, mut changes, .. } = config;
        // The sort is stable: changes at the same instant keep their order.
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
            with_cross,
            caught_up: Instant::ZERO,
            links: vec![LinkCounts::default(); nodes * nodes],
            recent: vec![Recent::default(); nodes * nodes],
            counts: IntakeCounts::default(),
            clamped: Lateness::new(),
            released: None,
        })
    }

    /// Offers a datagram to its link, or drops and counts the datagram.
    pub fn handle_datagram(&mut self, arrival: Arrival<'_>) -> Intake {
        let intake = self.stage(arrival);
        self.offer_staged();
        intake
    }

    /// Admits a datagram like [`Engine::handle_datagram`], but leaves the offer to [`Engine::offer_staged`]. Datagrams read from several sockets are thus
    /// offered in the order of arrival.
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
            // Only the server may answer at a client's port. Answers of strangers fall through to the last arm.
            (Routes::Clients { clients, server }, Port::Client(slot)) if from == *server => match clients.at_port(slot, at) {
                None => return self.refuse(Intake::Stranger),
                client => (SERVER, CLIENT, client),
            },
            (Routes::Programs(_) | Routes::Clients { .. }, _) => return self.refuse(Intake::Stranger),
        };
        let length = i64::try_from(bytes.len()).unwrap_or(i64::MAX);
        // A sum below zero, in the moment when the sum lacks copies, is within every limit.
        let is_full = |held: i64, more: i64, most: u64| u64::try_from(held.saturating_add(more)).is_ok_and(|sum| sum > most);
        if is_full(self.packets, 1, self.limits.packets) || is_full(self.bytes, length, self.limits.bytes.get()) {
            // Sender and receiver are different nodes here, so there is a link between them.
            let link = self.link(sender, to);
            self.links[link].overload += 1;
            self.refuse(Intake::Overload);
            // The caller must learn of the new client even if this datagram is dropped: the client's next datagram no longer reports a new client.
            return opened.map_or(Intake::Overload, Intake::FromNewClient);
        }
        self.packets += 1;
        self.bytes += length;
        let packet = self.pool.take(bytes, ecn, client);
        self.staged.push(Staged { at, from: sender, to, packet });
        opened.map_or(Intake::Offered, Intake::FromNewClient)
    }

    /// Offers the staged datagrams to the links, in the order of arrival. A datagram that arrived before logical time as it stands is offered at the present
    /// logical time, and counted as clamped.
    pub fn offer_staged(&mut self) {
        // Datagrams of one socket are staged in order, so sorting is needed only after reading several sockets.
        if !self.staged.is_sorted_by_key(|staged| staged.at) {
            self.staged.sort_by_key(|staged| staged.at);
        }
        // Taken out for the loop, because the loop changes the rest of `self`. Put back empty to keep the memory.
        let mut staged = core::mem::take(&mut self.staged);
        for Staged { at, from, to, mut packet } in staged.drain(..) {
            if let Some(late) = self.now.checked_duration_since(at).filter(|late| !late.is_zero()) {
                self.counts.clamped += 1;
                self.clamped.record(late);
                // A staged packet has no copies yet, so `packet` is the only owner.
                if let Some(packet) = Arc::get_mut(&mut packet) {
                    packet.late = late;
                }
            }
            // Datagrams and changes of links due before the arrival come first.
            self.pass(at);
            let info = PacketInfo {
                size: Bytes::new(packet.bytes.len() as u64),
                ecn: packet.ecn.map_or(units::Ecn::NotCapable, |ecn| units::Ecn::from_bits(ecn as u8)),
            };
            self.counts.offered += 1;
            let offered = self.network.handle_packet(self.now, from, to, info, packet);
            debug_assert_eq!(offered, Ok(()), "time has not gone back, and the routes name no other links");
        }
        self.staged = staged;
    }

    /// Lets logical time pass until `now`. An instant in the past changes nothing.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.pass(now);
        if !self.with_cross.is_empty() && self.now.saturating_duration_since(self.caught_up) >= CATCH_UP {
            self.caught_up = self.now;
            for (from, to) in &self.with_cross {
                let caught_up = self.network.catch_up(self.now, *from, *to);
                debug_assert_eq!(caught_up, Ok(()), "the links exist, and time has not gone back");
            }
        }
        if let Routes::Clients { clients, .. } = &mut self.routes {
            clients.handle_timeout(self.now);
        }
    }

    /// Returns the instant of the next necessary call of [`Engine::handle_timeout`], or `None` if no datagram, no change of a link and no client waits for
    /// time.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let clients = match &self.routes {
            Routes::Programs(_) => None,
            Routes::Clients { clients, .. } => clients.poll_timeout(),
        };
        let change = self.changes.front().map(|change| change.at);
        [self.network.poll_timeout(), change, clients].into_iter().flatten().min()
    }

    /// Returns the next datagram to leave, up to the present logical time, or `None` when all have been polled. Drops and counts datagrams for receivers
    /// without a known address.
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
                    let PacketEvent { record: PacketRecord { marked, .. }, mut payload, damage, part: _ } = event;
                    if let Some(damage) = damage {
                        // A copy still in flight may share these bytes, undamaged; `make_mut` then clones the bytes.
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
                // The copy gets an event of its own, `Delivered` or `Dropped`. The arm of that event subtracts the copy again.
                Fate::Duplicated => {
                    self.packets += 1;
                    self.bytes += length;
                }
            }
        }
    }

    /// Returns the slot of the next former client. The port of the slot can be closed.
    pub fn poll_closed(&mut self) -> Option<u32> {
        match &mut self.routes {
            Routes::Programs(_) => None,
            Routes::Clients { clients, .. } => clients.poll_closed(),
        }
    }

    /// Forgets the client in a slot, for example because no port could be opened.
    pub fn close_client(&mut self, slot: u32) {
        if let Routes::Clients { clients, .. } = &mut self.routes {
            clients.close(slot);
        }
    }

    /// Changes the model of a link from `now` on, or from the present logical time if `now` has passed: see [`Network::set_link`].
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if no such link exists; nothing was changed except the time.
    pub fn set_link(&mut self, now: Instant, from: NodeId, to: NodeId, model: LinkModel) -> Result<(), NetworkError> {
        self.pass(now);
        self.change(Change { at: self.now, from, to, model })
    }

    /// Returns the names of the nodes of the network, indexed by node.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the counters of a link, or `None` if no such link exists.
    #[must_use]
    pub fn link_stats(&self, from: NodeId, to: NodeId) -> Option<(LinkStats, LinkCounts)> {
        Some((self.network.link_stats(from, to)?, self.links[self.link(from, to)]))
    }

    /// Returns the delays of the latest datagrams delivered by a link, at most 128, in no particular order.
    #[must_use]
    pub fn recent_delays(&self, from: NodeId, to: NodeId) -> &[Duration] {
        self.recent.get(self.link(from, to)).map_or(&[], Recent::delays)
    }

    /// Returns the counters of arrived datagrams.
    #[must_use]
    pub const fn counts(&self) -> &IntakeCounts {
        &self.counts
    }

    /// Returns the distribution of the times from arrival to offer, of the datagrams offered late: see [`IntakeCounts::clamped`].
    #[must_use]
    pub const fn clamped(&self) -> &Lateness {
        &self.clamped
    }

    /// Returns the number and the payload bytes of the datagrams in flight. Exact as soon as [`Engine::poll_release`] has returned `None`.
    #[must_use]
    pub fn held(&self) -> (u64, Bytes) {
        (u64::try_from(self.packets).unwrap_or(0), Bytes::new(u64::try_from(self.bytes).unwrap_or(0)))
    }

    /// Returns the number of clients; zero for a mesh.
    #[must_use]
    pub fn clients(&self) -> usize {
        match &self.routes {
            Routes::Programs(_) => 0,
            Routes::Clients { clients, .. } => clients.count(),
        }
    }

    /// Returns the address of a program, or `None` if the address is not known or the relay is a proxy.
    #[must_use]
    pub fn program_address(&self, program: NodeId) -> Option<SocketAddr> {
        match &self.routes {
            Routes::Programs(programs) => programs.address(program),
            Routes::Clients { .. } => None,
        }
    }

    /// Returns the port and the receiver for a datagram delivered by a link, or `None` if the receiver's address is not known. The port is the port standing
    /// for the sender.
    fn way_out(&self, event: &PacketEvent<Arc<Packet>, Path>) -> Option<(Port, SocketAddr)> {
        match &self.routes {
            Routes::Programs(programs) => Some((Port::Program(event.path.from), programs.address(event.path.to)?)),
            Routes::Clients { clients, server } => {
                // Every datagram of a proxy has a client; a client that has left has no address.
                let client = event.payload.client?;
                let address = clients.address(client)?;
                Some(if event.path.to == CLIENT { (Port::Listen, address) } else { (Port::Client(client.slot), *server) })
            }
        }
    }

    /// Lets logical time pass until `now`, and makes the changes of links that are due on the way. Never goes back.
    fn pass(&mut self, now: Instant) {
        // A change must be made at its own instant, before later datagrams leave the link.
        while self.changes.front().is_some_and(|change| change.at <= now) {
            let Some(change) = self.changes.pop_front() else { return };
            self.now = self.now.max(change.at);
            let changed = self.change(change);
            debug_assert_eq!(changed, Ok(()), "the changes were checked, and time has not gone back");
        }
        self.now = self.now.max(now);
        let passed = self.network.handle_timeout(self.now);
        debug_assert_eq!(passed, Ok(()), "time has not gone back");
    }

    /// Makes a change of a link at the present logical time.
    fn change(&mut self, Change { from, to, model, .. }: Change) -> Result<(), NetworkError> {
        let has_cross_traffic = model.has_cross_traffic();
        self.network.set_link(self.now, from, to, model)?;
        if has_cross_traffic && !self.with_cross.contains(&(from, to)) {
            self.with_cross.push((from, to));
        }
        Ok(())
    }

    /// Returns the index of a link in `links` and `recent`: row of the sender, column of the receiver.
    fn link(&self, from: NodeId, to: NodeId) -> usize {
        from.index() * self.names.len() + to.index()
    }

    /// Counts a datagram that was not admitted, and returns the reason.
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
