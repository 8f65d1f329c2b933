//! Directed links and shared access lines between N nodes, over one event queue.
//!
//! ```text
//!   node a ── uplink ──┬── link a->b ──┬── downlink ── node b
//!             (shared) └── link a->c   └── (shared, also by c->b)
//! ```
//!
//! Every pair of nodes has a link in either direction, unless the network is one [of some](Network::of_some). Links are made at the beginning, or
//! [on demand](Network::on_demand). A node may have an *uplink*, one line that all it sends passes before the links, and a
//! *downlink*, one line that all it receives passes after them.

mod awaited;
mod config;
pub(crate) mod direct_links;
pub(crate) mod id;
mod lines;
mod on_demand;
mod passage;
mod paths;
mod pending;
mod relay;
pub(crate) mod stepped_links;
mod traffic;

use alloc::boxed::Box;
use alloc::vec::Vec;

use cohaptic_units::Instant;

use awaited::Awaited;
pub use config::{AccessLine, NetworkConfig, NetworkError};
use id::{LinkId, NodeId, Path};
use lines::Lines;
use on_demand::OnDemand;
use paths::Paths;
use pending::{InNetwork, LineId, Pending, SizeAndMarks};
use traffic::Traffic;

use crate::fates::fate::Fate;
use crate::fates::record::PacketEvent;
use crate::fates::stats::LinkStats;
use crate::line::Line;
use crate::line::filter::{Filter, Offered};
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::line::pipeline::{Outcome, TimeWentBack, check_time};
use crate::packet::{Outputs, PacketInfo};

/// The most nodes of a [`Network`] in which all have links to all: links are counted in 29 bits.
pub const MOST_NODES: usize = 23_170;

/// Number of receivers of a packet for which random words are drawn at once.
const DRAWN_AT_ONCE: u16 = 8;

/// A network of N nodes as a state machine.
///
/// The driver hands packets in with [`Network::handle_packet`], asks with [`Network::poll_timeout`] when to come back, calls
/// [`Network::handle_timeout`] then, and drains [`Network::poll_event`] until it gives `None`. Being late costs nothing but lateness.
///
/// Events come in the order of their instants. At equal instants what leaves an uplink enters its link before arrivals are reported, a departure
/// makes room before a packet is offered, arrivals come in the order of (sender, receiver, sequence), and packets that were dropped when they were
/// offered come after the arrivals that were due. With a delay of zero a packet is there at the instant at which it was sent.
///
/// Drain [`Network::poll_event`] after every call: a packet may be dropped at once, and that is not announced by [`Network::poll_timeout`].
#[derive(Clone, Debug)]
pub struct Network<P> {
    config: NetworkConfig,
    nodes: u16,
    now: Instant,
    lines: Lines<P>,
    places: Paths,
    /// How many packets each path has taken, by the place of its link; kept only where uplinks make it differ from what the link was offered.
    paths: Vec<u64>,
    has_uplinks: bool,
    traffic: Traffic<P>,
    outputs: Outputs<InNetwork<P>>,
    /// Whether anything but final arrivals can be pending.
    has_inner_events: bool,
    /// Whether any link has ever drawn random numbers.
    is_random: bool,
    has_filters: bool,
    /// Whether what a node sends to all passes its uplink once.
    has_relay: bool,
}

impl<P: Clone> Network<P> {
    /// A network whose links are what `link` gives for (sender, receiver).
    ///
    /// # Panics
    ///
    /// With more than [`MOST_NODES`].
    #[must_use]
    pub fn new<M: Into<LinkModel>>(config: NetworkConfig, link: impl FnMut(NodeId, NodeId) -> M) -> Self {
        Self::on(Paths::All { nodes: nodes_of_all(&config) }, config, link)
    }

    /// A network with links from each node to some others alone: `receivers` gives those of each node, in order. It takes memory for these links and no others.
    ///
    /// # Panics
    ///
    /// With more than 65,535 nodes or 2^29 links, with a receiver that is no other node, and with receivers that are not in order.
    #[must_use]
    pub fn of_some<M: Into<LinkModel>, R: IntoIterator<Item = NodeId>>(
        config: NetworkConfig,
        receivers: impl FnMut(NodeId) -> R,
        link: impl FnMut(NodeId, NodeId) -> M,
    ) -> Self {
        let nodes = u16::try_from(config.nodes.len()).expect("a network has at most 65,535 nodes");
        Self::on(Paths::some(nodes, receivers), config, link)
    }

    /// A network as [`Network::new`] gives it, whose links are made when they are first used: it takes memory and time for the nodes and for the links that
    /// carry packets or are changed, and not for all pairs. No answer differs.
    ///
    /// # Panics
    ///
    /// With more than [`MOST_NODES`].
    #[must_use]
    pub fn on_demand<M: Into<LinkModel>>(config: NetworkConfig, link: impl Fn(NodeId, NodeId) -> M + Send + Sync + 'static) -> Self {
        let places = Paths::All { nodes: nodes_of_all(&config) };
        Self { lines: Lines::new(&config, Some(OnDemand::new(move |from, to| link(from, to).into()))), ..Self::without_links(places, config) }
    }

    fn on<M: Into<LinkModel>>(places: Paths, config: NetworkConfig, mut link: impl FnMut(NodeId, NodeId) -> M) -> Self {
        let nodes = places.nodes();
        let mut network = Self::without_links(places, config);
        network.lines.links.reserve_exact(network.places.lines());
        for from in (0..nodes).map(NodeId) {
            let mut place = 0;
            while let Some(to) = network.places.receiver(from, place) {
                let path = Path { from, to };
                let model = if from == to { LinkModel::default() } else { link(from, to).into() };
                network.is_random |= model.is_random();
                let line = network.line(&network.link_name(path), model);
                network.lines.links.push(line);
                place += 1;
            }
        }
        network
    }

    fn without_links(places: Paths, config: NetworkConfig) -> Self {
        Self {
            nodes: places.nodes(),
            now: Instant::ZERO,
            lines: Lines::new(&config, None),
            places,
            paths: Vec::new(),
            has_uplinks: false,
            traffic: Traffic::new(),
            outputs: Vec::new(),
            has_inner_events: false,
            is_random: false,
            has_filters: false,
            has_relay: false,
            config,
        }
    }

    /// Gives a node an access line, before the first packet is sent.
    ///
    /// # Errors
    ///
    /// [`NetworkError::NoLine`] if there is no such node.
    pub fn with_access_line(mut self, access: AccessLine, model: impl Into<LinkModel>) -> Result<Self, NetworkError> {
        let (AccessLine::Uplink(node) | AccessLine::Downlink(node)) = access;
        let name = self.config.nodes.get(node.index()).ok_or(NetworkError::NoLine(access))?;
        let name = match access {
            AccessLine::Uplink(_) => LinkName::uplink(name),
            AccessLine::Downlink(_) => LinkName::downlink(name),
        };
        let line = self.line(&name, model.into());
        match access {
            AccessLine::Uplink(_) => {
                (self.has_uplinks, self.paths) = (true, alloc::vec![0; self.lines.links.len()]);
                self.lines.uplinks[node.index()] = Some(line);
            }
            AccessLine::Downlink(_) => self.lines.downlinks[node.index()] = Some(line),
        }
        self.has_inner_events = true;
        Ok(self)
    }

    /// Puts a relay between uplinks and links, before the first packet is sent: what a node sends with [`Network::handle_broadcast`] passes its uplink once, as one
    /// packet of which the relay hands one on to each receiver at the instant at which it has come. If the uplink drops or copies it, each receiver has an event.
    ///
    /// A node sends all its packets to all, or none: their numbers are one sequence.
    #[must_use]
    pub fn with_relay(mut self) -> Self {
        self.has_relay = true;
        self
    }

    /// Drops every packet from one node to another of which the filter says so, before anything else happens to it.
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if there is no such link.
    pub fn with_filter(
        mut self,
        from: NodeId,
        to: NodeId,
        drops: impl Fn(&Offered<'_, P>) -> bool + Send + Sync + 'static,
    ) -> Result<Self, NetworkError> {
        let path = self.path(from, to)?;
        let (_, place) = self.link_and_place(path);
        self.lines.links[place].set_filter(Filter::new(drops));
        self.has_filters = true;
        Ok(self)
    }

    /// From now on [`Network::poll_awaited`] tells when something happens for these receivers, before the first packet is sent. Nodes that do not exist receive nothing.
    #[must_use]
    pub fn awaiting(mut self, receivers: impl IntoIterator<Item = NodeId>) -> Self {
        self.traffic.awaited = Some(Box::new(Awaited::new(self.nodes, receivers)));
        self
    }

    /// Takes a packet from one node to another. A size alone is a packet without ECN; one beyond 16,777,215 bytes counts as that.
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if time went back or there is no such link; nothing was changed.
    #[inline(always)]
    pub fn handle_packet(&mut self, now: Instant, from: NodeId, to: NodeId, info: impl Into<PacketInfo>, payload: P) -> Result<(), NetworkError> {
        self.handle_packet_timed(now, Path { from, to }, info, payload).map(|_| ())
    }

    /// As [`Network::handle_packet`]. Gives when the packet arrives, if nothing but the time until then can happen to it; else an event may wait to be polled.
    ///
    /// # Errors
    ///
    /// As [`Network::handle_packet`].
    #[inline(always)]
    pub fn handle_packet_timed(
        &mut self,
        now: Instant,
        path: Path,
        info: impl Into<PacketInfo>,
        payload: P,
    ) -> Result<Option<Instant>, NetworkError> {
        let Path { from, to } = path;
        let path = self.path(from, to)?;
        check_time(&mut self.now, now)?;
        let (link, place) = self.link_and_place(path);
        let size = SizeAndMarks::new(info.into());
        if self.has_inner_events || self.has_filters {
            self.send_through(now, path, (link, place), size, payload);
            return Ok(None);
        }
        // Nothing is before this link or after it: only the link is asked.
        let line = &mut self.lines.links[place];
        let sequence = line.offered();
        let packet = InNetwork { sequence, offered: now, entered: now, path, size, payload };
        match line.offer(now, None) {
            Outcome::Arrives(at) => {
                self.traffic.schedule(at, LineId::Link(link), packet);
                Ok(Some(at))
            }
            Outcome::Dropped(cause) => {
                self.drop(now, LineId::Link(link), cause, packet);
                Ok(None)
            }
            Outcome::Enters => {
                self.enter_engine(now, LineId::Link(link), packet);
                Ok(None)
            }
        }
    }

    /// Takes a packet that may pass more than its link.
    #[inline(never)]
    fn send_through(&mut self, now: Instant, path: Path, (link, place): (LinkId, usize), size: SizeAndMarks, payload: P) {
        if self.has_inner_events {
            self.let_happen(now);
        }
        let sequence = match self.paths.get_mut(place) {
            None => self.lines.links[place].offered(),
            Some(count) => {
                *count += 1;
                *count - 1
            }
        };
        let line = if self.lines.uplinks[path.from.index()].is_some() { LineId::Uplink(path.from) } else { LineId::Link(link) };
        self.offer(now, line, None, || InNetwork { sequence, offered: now, entered: now, path, size, payload });
    }

    /// Takes a packet from one node to each of the others that it has a link to, in their order: the same as [`Network::handle_packet`] for each, with what they share
    /// done once. Where no node has an uplink this took a third off the time of a packet.
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if time went back or there is no such node; nothing was changed.
    pub fn handle_broadcast(&mut self, now: Instant, from: NodeId, info: impl Into<PacketInfo>, payload: P) -> Result<(), NetworkError> {
        let info = info.into();
        if from.0 >= self.nodes {
            return Err(NetworkError::NoLink { from, to: from });
        }
        if self.has_relay && self.lines.uplinks[from.index()].is_some() {
            self.let_pass(now)?;
            self.send_to_relay(now, from, SizeAndMarks::new(info), payload);
            return Ok(());
        }
        if self.has_uplinks {
            let mut place = 0;
            while let Some(to) = self.places.receiver(from, place) {
                if to != from {
                    self.handle_packet(now, from, to, info, payload.clone())?;
                }
                place += 1;
            }
            return Ok(());
        }
        self.let_pass(now)?;
        let size = SizeAndMarks::new(info);
        if self.lines.on_demand.is_some() || matches!(self.places, Paths::Some(_)) {
            let mut place = 0;
            while let Some(to) = self.places.receiver(from, place) {
                if to != from {
                    self.send(now, Path { from, to }, size, payload.clone(), None);
                }
                place += 1;
            }
            return Ok(());
        }
        if !self.is_random {
            for to in (0..self.nodes).map(NodeId).filter(|to| *to != from) {
                self.send(now, Path { from, to }, size, payload.clone(), None);
            }
            return Ok(());
        }
        for begin in (0..self.nodes).step_by(usize::from(DRAWN_AT_ONCE)) {
            // All draws of some packets before any other work: so a processor computes several at once. It took 10 % off a packet with jitter.
            let receivers = (begin..self.nodes.min(begin + DRAWN_AT_ONCE)).map(NodeId);
            let mut words = [[0; 2]; DRAWN_AT_ONCE as usize];
            for (words, to) in words.iter_mut().zip(receivers.clone()) {
                *words = self.lines.links[self.link(Path { from, to }).index()].words();
            }
            for (words, to) in words.into_iter().zip(receivers).filter(|(_, to)| *to != from) {
                self.send(now, Path { from, to }, size, payload.clone(), Some(words));
            }
        }
        Ok(())
    }

    /// Lets time pass until `now`.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant; nothing was changed.
    #[inline]
    pub fn handle_timeout(&mut self, now: Instant) -> Result<(), TimeWentBack> {
        self.let_pass(now)
    }

    /// When [`Network::handle_timeout`] must be called next; `None` if nothing is on the way. Never before the last instant given, once all events are
    /// polled. After a change of rate it may name an instant at which nothing happens.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.traffic.pending.next_at()
    }

    /// Whether something may happen up to `now`, or has happened and was not polled. `false` is certain: then [`Network::handle_timeout`] and [`Network::poll_event`] can
    /// wait.
    #[must_use]
    #[inline(always)]
    pub fn may_have_events(&self, now: Instant) -> bool {
        !self.traffic.happened.is_empty() || self.traffic.pending.may_be_due(now)
    }

    /// When [`Network::handle_timeout`] must be called next for a packet to reach one of the receivers of [`Network::awaiting`] in time; `None` if none is on
    /// the way to them. Never before the last instant given, once all events are polled. It may name an instant at which nothing reaches them: where an
    /// uplink wakes for packets to other nodes.
    #[must_use]
    pub fn poll_awaited(&self) -> Option<Instant> {
        self.traffic.awaited.as_ref()?.next_at()
    }

    /// The next packet that has arrived or was dropped, up to the last instant given; `None` when all have been polled.
    #[must_use]
    #[inline(always)]
    pub fn poll_event(&mut self) -> Option<PacketEvent<P, Path>> {
        if self.has_relay {
            self.tell_each_receiver();
        }
        if let Some(event) = self.traffic.happened.pop_front() {
            return Some(event);
        }
        while let Some(pending) = self.traffic.pending.pop_due(self.now) {
            if let Some(event) = self.happen(pending) {
                return Some(event);
            }
            if self.has_relay {
                self.tell_each_receiver();
            }
            // A packet that was dropped between two lines is waiting there.
            if let Some(event) = self.traffic.happened.pop_front() {
                return Some(event);
            }
        }
        if let Some(awaited) = &mut self.traffic.awaited {
            awaited.pass(self.now);
        }
        None
    }

    /// As [`Network::poll_event`], if the next event is an arrival and nothing but the time until then could happen to packets on their way: `take` is given the event. `None` says
    /// nothing about other events: ask [`Network::poll_event`] then. Parts of the event that `take` does not use are not made, which takes a tenth off the time of a packet.
    #[inline(always)]
    pub fn take_mere_arrival<T>(&mut self, take: impl FnOnce(PacketEvent<P, Path>) -> T) -> Option<T> {
        if self.has_inner_events || !self.traffic.happened.is_empty() {
            return None;
        }
        let Self { now, traffic, lines, .. } = self;
        // Without inner events nobody is woken, and no packet has another line before it, nor damage.
        let taken = traffic.pending.take_due(*now, |Pending { at, sequence, offered, entered, turn, path, size, payload }| {
            lines.link_mut(turn.link()).deliver(entered, at);
            payload.map(|payload| take(InNetwork { sequence, offered, entered, path, size, payload }.event(at, Fate::Delivered(at), None)))
        });
        taken.flatten()
    }

    /// Changes the model of a link from `now` on: see [`crate::Link::set_model`].
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if time went back or there is no such link; nothing was changed.
    pub fn set_link(&mut self, now: Instant, from: NodeId, to: NodeId, model: impl Into<LinkModel>) -> Result<(), NetworkError> {
        let path = self.path(from, to)?;
        self.let_pass(now)?;
        let (link, _) = self.link_and_place(path);
        let model = model.into();
        self.has_inner_events |= !model.is_direct();
        self.is_random |= model.is_random();
        let name = self.link_name(path);
        let seed = self.config.seed;
        self.with_engine(LineId::Link(link), |line, outputs, exits| line.reconfigure(now, seed, &name, model, outputs, exits));
        Ok(())
    }

    /// How many packets a link was offered; `None` if there is none.
    #[must_use]
    pub fn offered(&self, from: NodeId, to: NodeId) -> Option<u64> {
        let path = self.path(from, to).ok()?;
        // A link that was not made yet was offered nothing.
        Some(self.lines.find_link(self.link(path)).map_or(0, Line::offered))
    }

    /// The counters of a link; `None` if there is none.
    #[must_use]
    pub fn link_stats(&self, from: NodeId, to: NodeId) -> Option<LinkStats> {
        let path = self.path(from, to).ok()?;
        Some(self.lines.find_link(self.link(path)).map_or_else(LinkStats::default, Line::stats))
    }

    /// The counters of an access line; `None` if the node has none.
    #[must_use]
    pub fn access_stats(&self, access: AccessLine) -> Option<LinkStats> {
        let line = match access {
            AccessLine::Uplink(node) => self.lines.uplinks.get(node.index()),
            AccessLine::Downlink(node) => self.lines.downlinks.get(node.index()),
        };
        Some(line?.as_ref()?.stats())
    }

    fn line(&mut self, name: &LinkName, model: LinkModel) -> Line<P, InNetwork<P>> {
        self.has_inner_events |= !model.is_direct();
        Line::new(self.config.seed, name, model, self.config.general)
    }

    fn link_name(&self, path: Path) -> LinkName {
        LinkName::between(&self.config.nodes[path.from.index()], &self.config.nodes[path.to.index()])
    }

    #[inline]
    fn path(&self, from: NodeId, to: NodeId) -> Result<Path, NetworkError> {
        let exists = from.0 < self.nodes && to.0 < self.nodes && from != to && self.places.has(Path { from, to });
        if exists { Ok(Path { from, to }) } else { Err(NetworkError::NoLink { from, to }) }
    }

    /// The link of a path.
    #[inline]
    fn link(&self, path: Path) -> LinkId {
        match &self.places {
            Paths::All { nodes } => LinkId(u32::from(path.from.0) * u32::from(*nodes) + u32::from(path.to.0)),
            Paths::Some(some) => some.link(path),
        }
    }

    /// The link of a path, which is made if it is to be made on demand, and its place.
    #[inline(always)]
    fn link_and_place(&mut self, path: Path) -> (LinkId, usize) {
        let link = self.link(path);
        let place = match &self.lines.on_demand {
            None => Some(link.index()),
            Some(on_demand) => on_demand.place(link),
        };
        (link, place.unwrap_or_else(|| self.make(path, link)))
    }

    /// Makes a link on demand, and gives its place. A link that nothing was offered to is as it was at the beginning, whenever it is made: its model begins at
    /// [`Instant::ZERO`], and its random numbers have the address of its name.
    #[cold]
    #[inline(never)]
    fn make(&mut self, path: Path, link: LinkId) -> usize {
        let name = self.link_name(path);
        let place = self.lines.links.len();
        let on_demand = self.lines.on_demand.as_mut().expect("links are missing only where they are made on demand");
        let model = on_demand.model(path);
        on_demand.made(link, place);
        if !model.is_direct() && !self.has_inner_events {
            // From now on all that is due has happened before a packet is offered.
            self.let_happen(self.now);
        }
        self.is_random |= model.is_random();
        let line = self.line(&name, model);
        self.lines.links.push(line);
        if self.has_uplinks {
            self.paths.push(0);
        }
        place
    }

    /// Lets time pass. Inner events happen now, so that what they leave behind is there for the next packet; mere arrivals wait to be polled.
    #[inline]
    fn let_pass(&mut self, now: Instant) -> Result<(), TimeWentBack> {
        check_time(&mut self.now, now)?;
        if self.has_inner_events {
            self.let_happen(now);
        }
        Ok(())
    }
}

/// How many nodes a network has in which all have links to all.
fn nodes_of_all(config: &NetworkConfig) -> u16 {
    u16::try_from(config.nodes.len()).ok().filter(|nodes| usize::from(*nodes) <= MOST_NODES).expect("a network has at most 23,170 nodes")
}
