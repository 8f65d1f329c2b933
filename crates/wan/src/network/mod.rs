//! Directed links and shared access lines between N nodes, over one event queue.
//!
//! ```text
//!   node a ── uplink ──┬── link a->b ──┬── downlink ── node b
//!             (shared) └── link a->c   └── (shared, also by c->b)
//! ```
//!
//! Every pair of nodes has a link in either direction. A node may have an *uplink*, one line that all it sends passes before the links, and a
//! *downlink*, one line that all it receives passes after them.

mod config;
pub(crate) mod direct_links;
mod pending;

use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;

use cohaptic_units::Instant;

pub use config::{AccessLine, NetworkConfig, NetworkError, NetworkEvent, NodeId};
use pending::{Hop, InNetwork, Path, Pending, Place, SizeAndMarks};

use crate::event_queue::EventQueue;
use crate::fates::fate::{DropCause, Fate};
use crate::fates::stats::{Flow, LinkStats, Seldom};
use crate::line::direct::Words;
use crate::line::filter::{Filter, Offered};
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::line::pipeline::{Outcome, Pipeline, TimeWentBack, check_time};
use crate::packet::damage::Damage;
use crate::packet::{Exit, Marks, Outputs, Packet, PacketInfo};

/// For so many receivers of a packet, random words are drawn in one go.
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
    /// By sender, then receiver; the diagonal is never used.
    links: Vec<Line<P>>,
    uplinks: Vec<Option<Line<P>>>,
    downlinks: Vec<Option<Line<P>>>,
    /// How many packets each path has taken; kept only where uplinks make it differ from what the link was offered.
    paths: Vec<u64>,
    pending: EventQueue<Pending<P>>,
    happened: VecDeque<NetworkEvent<P>>,
    /// Counters that few packets touch, in the order of links, uplinks and downlinks.
    seldom: Vec<Seldom>,
    filters: BTreeMap<Path, Filter<P>>,
    /// The damage to packets on their way that are flagged as damaged.
    damages: BTreeMap<(Path, u64, u8), Damage>,
    outputs: Outputs<InNetwork<P>>,
    /// Whether anything but final arrivals can be pending.
    has_inner_events: bool,
    /// Whether any link has ever drawn random numbers.
    is_random: bool,
}

/// A link or an access line with the counters that every packet touches.
#[derive(Clone, Debug)]
struct Line<P> {
    flow: Flow,
    pipeline: Pipeline<InNetwork<P>>,
}

impl<P: Clone> Network<P> {
    /// A network whose links are what `link` gives for (sender, receiver).
    ///
    /// # Panics
    ///
    /// With more than 23,170 nodes: links are counted in 29 bits, nodes in 16.
    #[must_use]
    pub fn new<M: Into<LinkModel>>(config: NetworkConfig, mut link: impl FnMut(NodeId, NodeId) -> M) -> Self {
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
            seldom: alloc::vec![Seldom::default(); config.nodes.len() * (config.nodes.len() + 2)],
            filters: BTreeMap::new(),
            damages: BTreeMap::new(),
            outputs: Vec::new(),
            has_inner_events: false,
            is_random: false,
            config,
        };
        for from in 0..nodes {
            for to in 0..nodes {
                let model = if from == to { LinkModel::default() } else { link(NodeId(from.into()), NodeId(to.into())).into() };
                network.is_random |= model.is_random();
                let line = network.line(&network.link_name(Path { from, to }), model);
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
    pub fn with_access_line(mut self, access: AccessLine, model: impl Into<LinkModel>) -> Result<Self, NetworkError> {
        let (AccessLine::Uplink(node) | AccessLine::Downlink(node)) = access;
        let name = self.config.nodes.get(node.0 as usize).ok_or(NetworkError::NoLine(access))?;
        let name = match access {
            AccessLine::Uplink(_) => LinkName::uplink(name),
            AccessLine::Downlink(_) => LinkName::downlink(name),
        };
        let line = self.line(&name, model.into());
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
        self.filters.insert(path, Filter::new(drops));
        Ok(self)
    }

    /// Takes a packet from one node to another. A size alone is a packet without ECN; one beyond 16,777,215 bytes counts as that.
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if time went back or there is no such link; nothing was changed.
    #[inline]
    pub fn handle_packet(&mut self, now: Instant, from: NodeId, to: NodeId, info: impl Into<PacketInfo>, payload: P) -> Result<(), NetworkError> {
        let path = self.path(from, to)?;
        let link = self.link(path);
        self.let_pass(now)?;
        let sequence = match self.paths.get_mut(link as usize) {
            None => self.links[link as usize].flow.offered,
            Some(count) => {
                *count += 1;
                *count - 1
            }
        };
        let info = info.into();
        let packet = InNetwork { sequence, sent: now, entered: now, path, size: SizeAndMarks::new(info), payload };
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
    pub fn handle_broadcast(&mut self, now: Instant, from: NodeId, info: impl Into<PacketInfo>, payload: P) -> Result<(), NetworkError> {
        let info = info.into();
        let sender = self.place(from).ok_or(NetworkError::NoLink { from, to: from })?;
        if !self.paths.is_empty() {
            for to in (0..self.nodes).filter(|to| *to != sender) {
                self.handle_packet(now, from, NodeId(to.into()), info, payload.clone())?;
            }
            return Ok(());
        }
        self.let_pass(now)?;
        let size = SizeAndMarks::new(info);
        if !self.is_random {
            for to in (0..self.nodes).filter(|to| *to != sender) {
                let path = Path { from: sender, to };
                let link = self.link(path);
                let sequence = self.links[link as usize].flow.offered;
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
                let Line { flow, pipeline } = &self.links[(first + u32::from(to)) as usize];
                *words = pipeline.words(flow.offered);
            }
            for (words, to) in words.into_iter().zip(begin..end).filter(|(_, to)| *to != sender) {
                let path = Path { from: sender, to };
                let link = first + u32::from(to);
                let sequence = self.links[link as usize].flow.offered;
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

    /// Changes the model of a link from `now` on: see [`crate::Link::set_model`].
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if time went back or there is no such link; nothing was changed.
    pub fn set_link(&mut self, now: Instant, from: NodeId, to: NodeId, model: impl Into<LinkModel>) -> Result<(), NetworkError> {
        let path = self.path(from, to)?;
        let line = self.link(path);
        self.let_pass(now)?;
        let model = model.into();
        self.has_inner_events |= !model.is_direct();
        self.is_random |= model.is_random();
        let name = self.link_name(path);
        let mut outputs = core::mem::take(&mut self.outputs);
        self.links[line as usize].pipeline.reconfigure(now, self.config.seed, &name, model, &mut outputs);
        self.come_out(Hop::Link, line, outputs);
        Ok(())
    }

    /// The counters of a link; `None` if there is none.
    #[must_use]
    pub fn link_stats(&self, from: NodeId, to: NodeId) -> Option<LinkStats> {
        let path = self.path(from, to).ok()?;
        let line = self.link(path);
        Some(LinkStats { flow: self.links.get(line as usize)?.flow, seldom: self.seldom[self.seldom_place(Hop::Link, line)] })
    }

    /// The counters of an access line; `None` if the node has none.
    #[must_use]
    pub fn access_stats(&self, access: AccessLine) -> Option<LinkStats> {
        let (hop, line, place) = match access {
            AccessLine::Uplink(node) => (Hop::Uplink, self.uplinks.get(node.0 as usize)?.as_ref()?, node.0),
            AccessLine::Downlink(node) => (Hop::Downlink, self.downlinks.get(node.0 as usize)?.as_ref()?, node.0),
        };
        Some(LinkStats { flow: line.flow, seldom: self.seldom[self.seldom_place(hop, place)] })
    }

    fn line(&mut self, name: &LinkName, model: LinkModel) -> Line<P> {
        self.has_inner_events |= !model.is_direct();
        Line { flow: Flow::default(), pipeline: Pipeline::new(self.config.seed, name, model, self.config.general) }
    }

    fn seldom_place(&self, hop: Hop, line: u32) -> usize {
        let nodes = usize::from(self.nodes);
        line as usize
            + match hop {
                Hop::Link => 0,
                Hop::Uplink => nodes * nodes,
                Hop::Downlink => nodes * (nodes + 1),
            }
    }

    fn seldom_mut(&mut self, hop: Hop, line: u32) -> &mut Seldom {
        let place = self.seldom_place(hop, line);
        &mut self.seldom[place]
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
            self.wake(at, hop, place.line());
            return None;
        };
        let packet = InNetwork { sequence, sent, entered, path, size, payload };
        if size.has(SizeAndMarks::DISCARDED_ON_ARRIVAL)
            && (hop == Hop::Downlink || self.downlinks[usize::from(path.to)].is_none())
            && hop != Hop::Uplink
        {
            return Some(self.discard(at, hop, place.line(), packet));
        }
        let flow = &mut self.line_mut(hop, place.line()).flow;
        flow.delivered += 1;
        flow.delay_nanos += u128::from(at.as_nanos() - entered.as_nanos());
        let packet = InNetwork { entered: at, ..packet };
        match hop {
            Hop::Uplink => self.enter(at, Hop::Link, self.link(path), packet),
            Hop::Link if self.has_inner_events && self.downlinks[usize::from(path.to)].is_some() => {
                self.enter(at, Hop::Downlink, path.to.into(), packet);
            }
            Hop::Link | Hop::Downlink => return Some(self.event(packet, at, Fate::Delivered(at))),
        }
        None
    }

    /// The receiver's checksum finds the damage.
    #[cold]
    fn discard(&mut self, at: Instant, hop: Hop, line: u32, packet: InNetwork<P>) -> NetworkEvent<P> {
        self.seldom_mut(hop, line).dropped[DropCause::Checksum.index()] += 1;
        self.event(packet, at, Fate::Dropped(DropCause::Checksum))
    }

    #[cold]
    fn wake(&mut self, at: Instant, hop: Hop, line: u32) {
        let mut outputs = core::mem::take(&mut self.outputs);
        if let Some(engine) = self.line_mut(hop, line).pipeline.engine() {
            engine.woken(at);
            engine.pass(at, &mut outputs);
        }
        self.come_out(hop, line, outputs);
    }

    /// Hands a packet to a line.
    fn enter(&mut self, now: Instant, hop: Hop, line: u32, packet: InNetwork<P>) {
        let Line { flow, pipeline } = self.line_mut(hop, line);
        let words = pipeline.words(flow.offered);
        self.offer(now, hop, line, packet, words);
    }

    /// The same, with the packet's first random words.
    #[inline(always)]
    fn offer(&mut self, now: Instant, hop: Hop, line: u32, packet: InNetwork<P>, words: Words) {
        if !self.filters.is_empty() && self.is_filtered(now, hop, &packet) {
            self.line_mut(hop, line).flow.offered += 1;
            return self.drop(now, hop, line, DropCause::Filter, packet);
        }
        let Line { flow, pipeline } = self.line_mut(hop, line);
        let number = flow.offered;
        flow.offered += 1;
        match pipeline.offer(now, number, words) {
            Outcome::Arrives(at) => self.schedule(at, hop, line, packet),
            Outcome::Dropped(cause) => self.drop(now, hop, line, cause, packet),
            Outcome::Enters => self.enter_engine(now, hop, line, number, packet),
        }
    }

    /// Whether a filter takes the packet, which it sees when it enters its link.
    #[inline(never)]
    fn is_filtered(&self, now: Instant, hop: Hop, packet: &InNetwork<P>) -> bool {
        let info = PacketInfo { size: packet.size.size(), ecn_capable: packet.size.has(SizeAndMarks::ECN_CAPABLE) };
        let offered = Offered { sequence: packet.sequence, now, info, payload: &packet.payload };
        hop == Hop::Link && self.filters.get(&packet.path).is_some_and(|filter| filter.drops(&offered))
    }

    #[inline(never)]
    fn enter_engine(&mut self, now: Instant, hop: Hop, line: u32, number: u64, packet: InNetwork<P>) {
        let seldom = *self.seldom_mut(hop, line);
        let flow = self.line_mut(hop, line).flow;
        // The packet itself is counted already.
        let inside = LinkStats { flow, seldom }.in_flight() - 1;
        let info = PacketInfo { size: packet.size.size(), ecn_capable: packet.size.has(SizeAndMarks::ECN_CAPABLE) };
        let marks = Marks {
            congestion: packet.size.has(SizeAndMarks::MARKED),
            damage: self.take_damage(&packet),
            discarded_on_arrival: packet.size.has(SizeAndMarks::DISCARDED_ON_ARRIVAL),
        };
        let mut outputs = core::mem::take(&mut self.outputs);
        if let Some(engine) = self.line_mut(hop, line).pipeline.engine() {
            engine.offer(now, Packet::new(number, info, marks, packet), inside, &mut outputs);
        }
        self.come_out(hop, line, outputs);
    }

    #[inline(always)]
    fn take_damage(&mut self, packet: &InNetwork<P>) -> Option<Damage> {
        if packet.size.has(SizeAndMarks::DAMAGED) { self.find_damage(packet.path, packet.sequence, packet.size) } else { None }
    }

    #[cold]
    fn find_damage(&mut self, path: Path, sequence: u64, size: SizeAndMarks) -> Option<Damage> {
        self.damages.remove(&(path, sequence, size.copy()))
    }

    /// Deals with what has come out of a line's engine, and asks it when to be woken.
    fn come_out(&mut self, hop: Hop, line: u32, mut outputs: Outputs<InNetwork<P>>) {
        for output in outputs.drain(..) {
            let Packet { copy, marks, item: mut packet, .. } = *output.packet;
            let before = packet.size;
            packet.size = packet
                .size
                .with(1 << hop as u32, copy == 1)
                .with(SizeAndMarks::MARKED, marks.congestion)
                .with(SizeAndMarks::DAMAGED, marks.damage.is_some())
                .with(SizeAndMarks::DISCARDED_ON_ARRIVAL, marks.discarded_on_arrival);
            let seldom = self.seldom_mut(hop, line);
            match output.exit {
                Exit::Arrives(at) => {
                    seldom.marked += u64::from(marks.congestion && !before.has(SizeAndMarks::MARKED));
                    if let Some(damage) = marks.damage {
                        seldom.damaged += u64::from(!before.has(SizeAndMarks::DAMAGED));
                        self.damages.insert((packet.path, packet.sequence, packet.size.copy()), damage);
                    }
                    self.schedule(at, hop, line, packet);
                }
                Exit::Dropped(at, cause) => {
                    if let Some(damage) = marks.damage {
                        self.damages.insert((packet.path, packet.sequence, packet.size.copy()), damage);
                    }
                    self.drop(at, hop, line, cause, packet);
                }
                Exit::Copied(at) => {
                    seldom.duplicated += 1;
                    packet.size = packet.size.with(SizeAndMarks::DAMAGED, false);
                    let event = self.event(packet, at, Fate::Duplicated);
                    self.happened.push_back(event);
                }
            }
        }
        self.outputs = outputs;
        if let Some(at) = self.line_mut(hop, line).pipeline.engine().and_then(crate::line::engine::Engine::announce) {
            self.announce(hop, line, at);
        }
    }

    #[inline(never)]
    fn drop(&mut self, now: Instant, hop: Hop, line: u32, cause: DropCause, packet: InNetwork<P>) {
        if !self.has_inner_events {
            // Arrivals that wait to be polled came before this drop.
            self.let_happen(now);
        }
        self.seldom_mut(hop, line).dropped[cause.index()] += 1;
        let event = self.event(packet, now, Fate::Dropped(cause));
        self.happened.push_back(event);
    }

    #[inline(always)]
    fn event(&mut self, packet: InNetwork<P>, at: Instant, fate: Fate) -> NetworkEvent<P> {
        let damage = self.take_damage(&packet);
        let InNetwork { sequence, sent, path, size, payload, .. } = packet;
        let (from, to) = (NodeId(path.from.into()), NodeId(path.to.into()));
        let (copy, marked, size) = (size.copy(), size.has(SizeAndMarks::MARKED), size.size());
        NetworkEvent { from, to, sequence, copy, sent, at, size, payload, fate, marked, damage }
    }

    #[inline(always)]
    fn schedule(&mut self, at: Instant, hop: Hop, line: u32, packet: InNetwork<P>) {
        let InNetwork { sequence, sent, entered, path, size, payload } = packet;
        self.pending.push(Pending { at, sequence, sent, entered, place: Place::arrival(hop, line), path, size, payload: Some(payload) });
    }

    fn announce(&mut self, hop: Hop, line: u32, at: Instant) {
        let place = Place::waking(hop, line);
        let (path, size) = (Path { from: 0, to: 0 }, SizeAndMarks::NOTHING);
        self.pending.push(Pending { at, sequence: 0, sent: at, entered: at, place, path, size, payload: None });
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
