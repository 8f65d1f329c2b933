//! Directed links and shared access lines between N nodes, over one event queue.
//!
//! ```text
//!   node a ── uplink ──┬── link a->b ──┬── downlink ── node b
//!             (shared) └── link a->c   └── (shared, also by c->b)
//! ```
//!
//! Every pair of nodes has a link in either direction. A node may have an *uplink*, one line that all it sends passes before the links, and a
//! *downlink*, one line that all it receives passes after them.

use alloc::collections::VecDeque;
use alloc::string::String;
use alloc::vec::Vec;

use cohaptic_units::{Bytes, Instant};

use crate::bottleneck::Departure;
use crate::event_queue::Event;
use crate::pipeline::{Enqueued, Outcome, Pipeline, Words, check_time};
use crate::{DropCause, EventQueue, Fate, LinkConfig, LinkName, LinkStats, TimeWentBack};

/// A node of a network, by its place from 0.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct NodeId(pub u32);

/// A line that a node shares between all its paths.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum AccessLine {
    /// All that the node sends.
    Uplink(NodeId),
    /// All that the node receives.
    Downlink(NodeId),
}

/// What a network is made of.
#[derive(Clone, Debug, Default)]
pub struct NetworkConfig {
    /// The seed of all random streams.
    pub seed: u64,
    /// The names of the nodes. They are the addresses of the links' random numbers: equal names, equal draws.
    pub nodes: Vec<String>,
    /// Whether links whose only impairment is a constant delay take the general path too. It changes no answer, only the speed.
    pub general: bool,
}

/// Why a call failed. Nothing was changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkError {
    /// An earlier call had a later instant.
    #[error(transparent)]
    TimeWentBack(#[from] TimeWentBack),
    /// There is no such node, or sender and receiver are the same.
    #[error("there is no link from node {} to node {}", from.0, to.0)]
    NoLink {
        /// The sender.
        from: NodeId,
        /// The receiver.
        to: NodeId,
    },
    /// There is no such access line.
    #[error("there is no {0:?}")]
    NoLine(AccessLine),
}

/// What became of one packet, end to end.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct NetworkEvent<P> {
    /// Who sent it.
    pub from: NodeId,
    /// To whom.
    pub to: NodeId,
    /// The number of the packet on its path, from 0.
    pub sequence: u64,
    /// When the network took it.
    pub sent: Instant,
    /// When it arrived or was dropped.
    pub at: Instant,
    /// Its size.
    pub size: Bytes,
    /// What it carries.
    pub payload: P,
    /// What became of it.
    pub fate: Fate,
}

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
    /// By sender, then receiver; the diagonal is never used.
    links: Vec<Line<P>>,
    uplinks: Vec<Option<Line<P>>>,
    downlinks: Vec<Option<Line<P>>>,
    /// How many packets each path has taken; kept only where uplinks make it differ from what the link was offered.
    paths: Vec<u64>,
    pending: EventQueue<Pending<P>>,
    happened: VecDeque<NetworkEvent<P>>,
    /// Whether anything but final arrivals can be pending.
    has_inner_events: bool,
    /// Whether any link has ever drawn random numbers.
    is_random: bool,
}

/// A link or an access line with its counters.
#[derive(Clone, Debug)]
struct Line<P> {
    stats: LinkStats,
    pipeline: Pipeline<InNetwork<P>>,
}

/// A packet on its way.
#[derive(Clone, Debug)]
struct InNetwork<P> {
    sequence: u64,
    sent: Instant,
    /// When it entered the line that it is in.
    entered: Instant,
    path: Path,
    size: u32,
    payload: P,
}

/// From whom to whom.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Path {
    from: u16,
    to: u16,
}

/// Something that will happen on a line.
#[derive(Clone, Debug)]
struct Pending<P> {
    at: Instant,
    /// The packet's sequence on its path, or the ticket of a departure.
    sequence: u64,
    sent: Instant,
    entered: Instant,
    place: Place,
    path: Path,
    size: u32,
    /// `None`: a departure from a bottleneck.
    payload: Option<P>,
}

/// Stage and line in one number: what breaks ties between simultaneous events. All departures come before all arrivals, so that what leaves one
/// line finds the room that a departure from the next line makes at the same instant.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Place(u32);

/// Which of its three lines a packet is in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Hop {
    Uplink,
    Link,
    Downlink,
}

/// For so many receivers of a packet, random words are drawn in one go.
const DRAWN_AT_ONCE: u16 = 8;

/// Lines are counted in the lower bits of a [`Place`].
const LINE_BITS: u32 = 29;

impl Place {
    fn departure(hop: Hop, line: u32) -> Self {
        Self((hop as u32) << LINE_BITS | line)
    }

    fn arrival(hop: Hop, line: u32) -> Self {
        Self((hop as u32 + 3) << LINE_BITS | line)
    }

    fn hop(self) -> Hop {
        match self.0 >> LINE_BITS {
            0 | 3 => Hop::Uplink,
            1 | 4 => Hop::Link,
            _ => Hop::Downlink,
        }
    }

    fn line(self) -> u32 {
        self.0 & ((1 << LINE_BITS) - 1)
    }
}

impl<P> Event for Pending<P> {
    type Key = (Instant, Place, u64, Path);

    #[inline]
    fn at(&self) -> Instant {
        self.at
    }

    #[inline]
    fn key(&self) -> Self::Key {
        (self.at, self.place, self.sequence, self.path)
    }
}

impl<P> Network<P> {
    /// A network whose links have the configurations that `link` gives for (sender, receiver).
    ///
    /// # Panics
    ///
    /// With more than 23,170 nodes: links are counted in 29 bits, nodes in 16.
    #[must_use]
    pub fn new(config: NetworkConfig, mut link: impl FnMut(NodeId, NodeId) -> LinkConfig) -> Self {
        let nodes = u16::try_from(config.nodes.len()).ok().filter(|nodes| *nodes <= 23_170).expect("a network has at most 23,170 nodes");
        let mut network = Self {
            nodes,
            now: Instant::ZERO,
            links: Vec::with_capacity(config.nodes.len() * config.nodes.len()),
            uplinks: config.nodes.iter().map(|_| None).collect(),
            downlinks: config.nodes.iter().map(|_| None).collect(),
            paths: Vec::new(),
            pending: EventQueue::new(),
            happened: VecDeque::new(),
            has_inner_events: false,
            is_random: false,
            config,
        };
        for from in 0..nodes {
            for to in 0..nodes {
                let config = if from == to { LinkConfig::default() } else { link(NodeId(from.into()), NodeId(to.into())) };
                network.has_inner_events |= config.bottleneck.is_some();
                network.is_random |= config.is_random();
                let line = network.line(&network.link_name(Path { from, to }), config);
                network.links.push(line);
            }
        }
        network
    }

    /// Gives a node an access line, before the first packet is sent.
    ///
    /// # Errors
    ///
    /// [`NetworkError::NoLine`] if there is no such node.
    pub fn with_access_line(mut self, access: AccessLine, config: LinkConfig) -> Result<Self, NetworkError> {
        let (AccessLine::Uplink(node) | AccessLine::Downlink(node)) = access;
        let name = self.config.nodes.get(node.0 as usize).ok_or(NetworkError::NoLine(access))?;
        let name = match access {
            AccessLine::Uplink(_) => LinkName::uplink(name),
            AccessLine::Downlink(_) => LinkName::downlink(name),
        };
        let line = self.line(&name, config);
        match access {
            AccessLine::Uplink(_) => {
                self.paths = alloc::vec![0; self.links.len()];
                self.uplinks[node.0 as usize] = Some(line);
            }
            AccessLine::Downlink(_) => self.downlinks[node.0 as usize] = Some(line),
        }
        self.has_inner_events = true;
        Ok(self)
    }

    /// Takes a packet from one node to another. A size beyond 4,294,967,295 bytes counts as that.
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if time went back or there is no such link; nothing was changed.
    #[inline]
    pub fn handle_packet(&mut self, now: Instant, from: NodeId, to: NodeId, size: Bytes, payload: P) -> Result<(), NetworkError> {
        let path = self.path(from, to)?;
        let link = self.link(path);
        self.let_pass(now)?;
        let sequence = match self.paths.get_mut(link as usize) {
            None => self.links[link as usize].stats.offered,
            Some(count) => {
                *count += 1;
                *count - 1
            }
        };
        let size = u32::try_from(size.get()).unwrap_or(u32::MAX);
        let packet = InNetwork { sequence, sent: now, entered: now, path, size, payload };
        if self.uplinks[from.0 as usize].is_some() {
            self.enter(now, Hop::Uplink, from.0, packet);
        } else {
            self.enter(now, Hop::Link, link, packet);
        }
        Ok(())
    }

    /// Takes a packet from one node to each of the others, in their order: the same as [`Network::handle_packet`] for each, with what they share
    /// done once. Where no node has an uplink this took a third off the time of a packet.
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if time went back or there is no such node; nothing was changed.
    pub fn handle_broadcast(&mut self, now: Instant, from: NodeId, size: Bytes, payload: P) -> Result<(), NetworkError>
    where
        P: Clone,
    {
        let sender = self.place(from).ok_or(NetworkError::NoLink { from, to: from })?;
        if !self.paths.is_empty() {
            for to in (0..self.nodes).filter(|to| *to != sender) {
                self.handle_packet(now, from, NodeId(to.into()), size, payload.clone())?;
            }
            return Ok(());
        }
        self.let_pass(now)?;
        let size = u32::try_from(size.get()).unwrap_or(u32::MAX);
        if !self.is_random {
            for to in (0..self.nodes).filter(|to| *to != sender) {
                let path = Path { from: sender, to };
                let link = self.link(path);
                let sequence = self.links[link as usize].stats.offered;
                let packet = InNetwork { sequence, sent: now, entered: now, path, size, payload: payload.clone() };
                self.offer(now, Hop::Link, link, packet, [0; 2]);
            }
            return Ok(());
        }
        let first = self.link(Path { from: sender, to: 0 });
        let mut begin = 0;
        while begin < self.nodes {
            // All draws of some packets before any other work: so a processor computes several at once. It took 10 % off a packet with jitter.
            let end = self.nodes.min(begin + DRAWN_AT_ONCE);
            let mut words = [[0; 2]; DRAWN_AT_ONCE as usize];
            for (words, to) in words.iter_mut().zip(begin..end) {
                let Line { stats, pipeline } = &self.links[(first + u32::from(to)) as usize];
                *words = pipeline.words(stats.offered);
            }
            for (words, to) in words.into_iter().zip(begin..end).filter(|(_, to)| *to != sender) {
                let path = Path { from: sender, to };
                let link = first + u32::from(to);
                let sequence = self.links[link as usize].stats.offered;
                let packet = InNetwork { sequence, sent: now, entered: now, path, size, payload: payload.clone() };
                self.offer(now, Hop::Link, link, packet, words);
            }
            begin = end;
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
        self.pending.next_at()
    }

    /// The next packet that has arrived or was dropped, up to the last instant given; `None` when all have been polled.
    #[must_use]
    #[inline(always)]
    pub fn poll_event(&mut self) -> Option<NetworkEvent<P>> {
        if let Some(event) = self.happened.pop_front() {
            return Some(event);
        }
        while let Some(pending) = self.pending.pop_due(self.now) {
            if let Some(event) = self.happen(pending) {
                return Some(event);
            }
            // A packet that was dropped between two lines is waiting there.
            if let Some(event) = self.happened.pop_front() {
                return Some(event);
            }
        }
        None
    }

    /// Changes the configuration of a link from `now` on: see [`crate::Link::set_config`].
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if time went back or there is no such link; nothing was changed.
    pub fn set_link(&mut self, now: Instant, from: NodeId, to: NodeId, config: LinkConfig) -> Result<(), NetworkError> {
        let path = self.path(from, to)?;
        let line = self.link(path);
        self.let_pass(now)?;
        self.has_inner_events |= config.bottleneck.is_some();
        self.is_random |= config.is_random();
        let name = self.link_name(path);
        let (departure, released) = self.links[line as usize].pipeline.reconfigure(now, self.config.seed, &name, config);
        if let Some(departure) = departure {
            self.announce(Hop::Link, line, departure);
        }
        for (packet, at) in released {
            self.schedule(at, Hop::Link, line, packet);
        }
        Ok(())
    }

    /// The counters of a link; `None` if there is none.
    #[must_use]
    pub fn link_stats(&self, from: NodeId, to: NodeId) -> Option<&LinkStats> {
        let path = self.path(from, to).ok()?;
        self.links.get(self.link(path) as usize).map(|line| &line.stats)
    }

    /// The counters of an access line; `None` if the node has none.
    #[must_use]
    pub fn access_stats(&self, access: AccessLine) -> Option<&LinkStats> {
        let line = match access {
            AccessLine::Uplink(node) => self.uplinks.get(node.0 as usize),
            AccessLine::Downlink(node) => self.downlinks.get(node.0 as usize),
        };
        line?.as_ref().map(|line| &line.stats)
    }

    fn line(&self, name: &LinkName, config: LinkConfig) -> Line<P> {
        Line { stats: LinkStats::default(), pipeline: Pipeline::new(self.config.seed, name, config, self.config.general) }
    }

    fn link_name(&self, path: Path) -> LinkName {
        LinkName::between(&self.config.nodes[usize::from(path.from)], &self.config.nodes[usize::from(path.to)])
    }

    #[inline]
    fn place(&self, node: NodeId) -> Option<u16> {
        u16::try_from(node.0).ok().filter(|place| *place < self.nodes)
    }

    #[inline]
    fn path(&self, from: NodeId, to: NodeId) -> Result<Path, NetworkError> {
        match (self.place(from), self.place(to)) {
            (Some(sender), Some(receiver)) if sender != receiver => Ok(Path { from: sender, to: receiver }),
            _ => Err(NetworkError::NoLink { from, to }),
        }
    }

    /// The number of a path's link.
    #[inline]
    fn link(&self, path: Path) -> u32 {
        u32::from(path.from) * u32::from(self.nodes) + u32::from(path.to)
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

    /// Lets all that is due happen, and keeps the arrivals until they are polled.
    #[inline]
    fn let_happen(&mut self, now: Instant) {
        while let Some(pending) = self.pending.pop_due(now) {
            if let Some(event) = self.happen(pending) {
                self.happened.push_back(event);
            }
        }
    }

    /// Lets one pending event happen, and gives the arrival if it is a packet's last.
    #[inline(always)]
    fn happen(&mut self, pending: Pending<P>) -> Option<NetworkEvent<P>> {
        let Pending { at, sequence, sent, entered, place, path, size, payload } = pending;
        let hop = place.hop();
        let Some(payload) = payload else {
            self.depart(hop, place.line(), Departure { at, ticket: sequence });
            return None;
        };
        let stats = &mut self.line_mut(hop, place.line()).stats;
        stats.delivered += 1;
        stats.delay_nanos += u128::from(at.as_nanos() - entered.as_nanos());
        let packet = InNetwork { sequence, sent, entered: at, path, size, payload };
        match hop {
            Hop::Uplink => self.enter(at, Hop::Link, self.link(path), packet),
            Hop::Link if self.has_inner_events && self.downlinks[usize::from(path.to)].is_some() => {
                self.enter(at, Hop::Downlink, path.to.into(), packet);
            }
            Hop::Link | Hop::Downlink => return Some(packet.event(at, Fate::Delivered(at))),
        }
        None
    }

    fn depart(&mut self, hop: Hop, line: u32, departure: Departure) {
        if let Some((packet, arrival, next)) = self.line_mut(hop, line).pipeline.depart(departure) {
            self.schedule(arrival, hop, line, packet);
            if let Some(next) = next {
                self.announce(hop, line, next);
            }
        }
    }

    /// Hands a packet to a line.
    fn enter(&mut self, now: Instant, hop: Hop, line: u32, packet: InNetwork<P>) {
        let Line { stats, pipeline } = self.line_mut(hop, line);
        let words = pipeline.words(stats.offered);
        self.offer(now, hop, line, packet, words);
    }

    /// The same, with the packet's first random words.
    #[inline(always)]
    fn offer(&mut self, now: Instant, hop: Hop, line: u32, packet: InNetwork<P>, words: Words) {
        let Line { stats, pipeline } = self.line_mut(hop, line);
        let number = stats.offered;
        stats.offered += 1;
        match pipeline.offer(now, number, words) {
            Outcome::Arrives(at) => self.schedule(at, hop, line, packet),
            Outcome::Dropped(cause) => self.drop(now, hop, line, cause, packet),
            Outcome::Queues => match pipeline.enqueue(now, number, Bytes::new(packet.size.into()), packet) {
                Enqueued::Served(departure) => self.announce(hop, line, departure),
                Enqueued::Waits => {}
                Enqueued::Dropped(cause, packet) => self.drop(now, hop, line, cause, packet),
            },
        }
    }

    fn drop(&mut self, now: Instant, hop: Hop, line: u32, cause: DropCause, packet: InNetwork<P>) {
        if !self.has_inner_events {
            // Arrivals that wait to be polled came before this drop.
            self.let_happen(now);
        }
        self.line_mut(hop, line).stats.dropped[cause.index()] += 1;
        self.happened.push_back(packet.event(now, Fate::Dropped(cause)));
    }

    #[inline(always)]
    fn schedule(&mut self, at: Instant, hop: Hop, line: u32, packet: InNetwork<P>) {
        let InNetwork { sequence, sent, entered, path, size, payload } = packet;
        self.pending.push(Pending { at, sequence, sent, entered, place: Place::arrival(hop, line), path, size, payload: Some(payload) });
    }

    fn announce(&mut self, hop: Hop, line: u32, Departure { at, ticket }: Departure) {
        let place = Place::departure(hop, line);
        self.pending.push(Pending { at, sequence: ticket, sent: at, entered: at, place, path: Path { from: 0, to: 0 }, size: 0, payload: None });
    }

    #[inline(always)]
    fn line_mut(&mut self, hop: Hop, line: u32) -> &mut Line<P> {
        let access = match hop {
            Hop::Link => return &mut self.links[line as usize],
            Hop::Uplink => &mut self.uplinks[line as usize],
            Hop::Downlink => &mut self.downlinks[line as usize],
        };
        access.as_mut().expect("a packet is in an access line only where there is one")
    }
}

impl<P> InNetwork<P> {
    #[inline]
    fn event(self, at: Instant, fate: Fate) -> NetworkEvent<P> {
        let Self { sequence, sent, path, size, payload, .. } = self;
        NetworkEvent { from: NodeId(path.from.into()), to: NodeId(path.to.into()), sequence, sent, at, size: Bytes::new(size.into()), payload, fate }
    }
}
