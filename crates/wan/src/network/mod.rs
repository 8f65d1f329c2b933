//! Directed links and shared access lines between N nodes, over one event queue.
//!
//! ```text
//!   node a ── uplink ──┬── link a->b ──┬── downlink ── node b
//!             (shared) └── link a->c   └── (shared, also by c->b)
//! ```
//!
//! Every pair of nodes has a link in either direction, unless the network is one [of some](Network::of_some). Links are made with the network, or [on
//! demand](Network::on_demand). A node may have an *uplink*, a line shared by all packets from the node before their links, and a *downlink*, a line shared by
//! all packets to the node after their links.
//!
//! The module takes packets with a size and an opaque payload, and gives one [`PacketEvent`] per fate of a packet. The module knows no clock and never reads
//! payloads: the driver gives the time.

mod arrivals;
mod awaited;
mod broadcast;
mod config;
pub(crate) mod direct_links;
mod finding;
mod groups;
pub(crate) mod id;
mod lines;
mod on_demand;
mod passage;
mod paths;
mod pending;
mod relay;
mod sendings;
pub(crate) mod stepped_links;
mod traffic;

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::ops::ControlFlow;

use cohaptic_units::Instant;

pub use arrivals::TakeArrival;
use awaited::Awaited;
pub use config::{AccessLine, NetworkConfig, NetworkError};
use groups::Group;
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

/// Number of nodes, at most, of a [`Network`] with links between all nodes. Link numbers have 29 bits, and the table of links has `MOST_NODES`² entries.
pub const MOST_NODES: usize = 23_170;

/// A network of N nodes as a state machine.
///
/// The driver hands packets in with [`Network::handle_packet`], asks [`Network::poll_timeout`] for the instant of its next call, calls
/// [`Network::handle_timeout`] at that instant, and drains [`Network::poll_event`] until `None` is returned. A late driver receives the same events, only
/// later.
///
/// Events come in the order of their instants. At equal instants, packets enter their links after an uplink before arrivals are reported, a departure makes
/// room before a packet is offered, arrivals come in the order of (sender, receiver, sequence), and packets dropped at their offer come after the arrivals due.
/// With a delay of zero, a packet arrives at the instant of its sending.
///
/// Drain [`Network::poll_event`] after every call: a packet may be dropped at once, and [`Network::poll_timeout`] does not announce such a drop.
#[derive(Clone, Debug)]
pub struct Network<P> {
    config: NetworkConfig,
    nodes: u16,
    now: Instant,
    lines: Lines<P>,
    places: Paths,
    /// Packets sent on each path so far, indexed by the place of the path's link. Empty without uplinks, because a link's own counter of offered packets is
    /// then the same number.
    paths: Vec<u64>,
    has_uplinks: bool,
    traffic: Traffic<P>,
    outputs: Outputs<InNetwork<P>>,
    /// Whether events apart from final arrivals can be pending: wakes of engines, or packets between two lines.
    has_inner_events: bool,
    /// Whether the model of any link draws random numbers, or did before it was changed.
    is_random: bool,
    has_filters: bool,
    /// `true` if a packet to all passes the uplink of its node once, instead of once per receiver.
    has_relay: bool,
    /// Number of the flow of a packet by its path and its payload. Under `None` each pair of sender and receiver is a flow.
    flows: Option<fn(Path, &P) -> u32>,
}

impl<P: Clone> Network<P> {
    /// Makes a network. `link` gives the model of the link for (sender, receiver).
    ///
    /// # Panics
    ///
    /// With more than [`MOST_NODES`] nodes.
    #[must_use]
    pub fn new<M: Into<LinkModel>>(config: NetworkConfig, link: impl FnMut(NodeId, NodeId) -> M) -> Self {
        Self::on(Paths::All { nodes: nodes_of_all(&config) }, config, link)
    }

    /// Makes a network with links from each node to some nodes only. `receivers` gives the receivers of each node, in ascending order, and `link` the model for
    /// (sender, receiver). Memory is taken for these links only.
    ///
    /// # Panics
    ///
    /// With more than 65,535 nodes or 2^29 links, with a missing receiver or a node as its own receiver, and with receivers out of strictly ascending order.
    #[must_use]
    pub fn of_some<M: Into<LinkModel>, R: IntoIterator<Item = NodeId>>(
        config: NetworkConfig,
        receivers: impl FnMut(NodeId) -> R,
        link: impl FnMut(NodeId, NodeId) -> M,
    ) -> Self {
        let nodes = u16::try_from(config.nodes.len()).expect("a network has at most 65,535 nodes");
        Self::on(Paths::some(nodes, receivers), config, link)
    }

    /// Makes a network like [`Network::new`], but makes each link at the first use of the link. Memory and time are taken for the nodes and for the used or
    /// changed links, not for all pairs. Every answer is the same as the answer of [`Network::new`].
    ///
    /// # Panics
    ///
    /// With more than [`MOST_NODES`] nodes.
    #[must_use]
    pub fn on_demand<M: Into<LinkModel>>(config: NetworkConfig, link: impl Fn(NodeId, NodeId) -> M + Send + Sync + 'static) -> Self {
        let places = Paths::All { nodes: nodes_of_all(&config) };
        // Only the list of links differs from a network without links: the models come from `link` later.
        Self { lines: Lines::new(&config, Some(OnDemand::new(move |from, to| link(from, to).into()))), ..Self::without_links(places, config) }
    }

    fn on<M: Into<LinkModel>>(places: Paths, config: NetworkConfig, mut link: impl FnMut(NodeId, NodeId) -> M) -> Self {
        let nodes = places.nodes();
        let mut network = Self::without_links(places, config);
        network.lines.links.reserve_exact(network.places.lines());
        for from in (0..nodes).map(NodeId) {
            // The list of receivers may be shorter than the number of nodes, so the list itself says when it ends.
            let mut place = 0;
            while let Some(to) = network.places.receiver(from, place) {
                let path = Path { from, to };
                let model = if from == to { LinkModel::default() } else { link(from, to).into() };
                network.is_random |= model.is_random();
                // The diagonal of a full table has an unused link too, so a link's number is `from * nodes + to` without a correction.
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
            flows: None,
            config,
        }
    }

    /// Gives a node an access line. Call this function before the first packet is sent.
    ///
    /// # Errors
    ///
    /// [`NetworkError::NoLine`] if the node does not exist.
    pub fn with_access_line(mut self, access: AccessLine, model: impl Into<LinkModel>) -> Result<Self, NetworkError> {
        let (AccessLine::Uplink(node) | AccessLine::Downlink(node)) = access;
        let name = self.config.nodes.get(node.index()).ok_or(NetworkError::NoLine(access))?;
        let name = match access {
            AccessLine::Uplink(_) => LinkName::uplink(name),
            AccessLine::Downlink(_) => LinkName::downlink(name),
        };
        let line = self.line(&name, model.into());
        match access {
            // The counters of paths begin at zero for the links made so far. A later link on demand appends a counter.
            AccessLine::Uplink(_) => {
                (self.has_uplinks, self.paths) = (true, alloc::vec![0; self.lines.links.len()]);
                self.lines.uplinks[node.index()] = Some(line);
            }
            AccessLine::Downlink(_) => self.lines.downlinks[node.index()] = Some(line),
        }
        // The departure from an access line is an event inside the network, even over a line of constant delay.
        self.has_inner_events = true;
        Ok(self)
    }

    /// Puts a relay between uplinks and links. Call this function before the first packet is sent. A packet sent with [`Network::handle_broadcast`] then passes
    /// the uplink of its sender once, and the relay hands one packet to the link of each receiver at the instant of departure from the uplink. If the uplink
    /// drops or copies the packet, each receiver gets an event.
    ///
    /// A node sends either all packets or no packet with [`Network::handle_broadcast`], because the numbers of its packets are one sequence.
    #[must_use]
    pub fn with_relay(mut self) -> Self {
        self.has_relay = true;
        self
    }

    /// Drops every packet between two nodes with `drops` true for the packet, before anything else happens to the packet on the link.
    ///
    /// # Errors
    ///
    /// [`NetworkError::NoLink`] if there is no link from `from` to `to`.
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

    /// Sets the function from a path and a payload to the number of the packet's flow, for queues with [`FqCoDel`](crate::FqCoDel). Packets with different
    /// numbers are packets of different flows. Without this function each pair of sender and receiver is a flow.
    #[must_use]
    pub fn with_flows(mut self, flow: fn(Path, &P) -> u32) -> Self {
        self.flows = Some(flow);
        self
    }

    /// Makes [`Network::poll_awaited`] announce events for these receivers. Call this function before the first packet is sent. Missing nodes are ignored.
    #[must_use]
    pub fn awaiting(mut self, receivers: impl IntoIterator<Item = NodeId>) -> Self {
        self.traffic.awaited = Some(Box::new(Awaited::new(&self.places, receivers)));
        self
    }

    /// Takes a packet between two nodes at `now`. A plain size means a packet without ECN; a size above 4,194,303 bytes counts as 4,194,303 bytes.
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if `now` is before an earlier call's instant or the link is missing; the network is unchanged then.
    #[inline(always)]
    pub fn handle_packet(&mut self, now: Instant, from: NodeId, to: NodeId, info: impl Into<PacketInfo>, payload: P) -> Result<(), NetworkError> {
        self.handle_packet_timed(now, Path { from, to }, info, payload).map(|_| ())
    }

    /// Takes a packet like [`Network::handle_packet`], and returns the instant of the packet's arrival if this arrival is already certain. Returns `None` if
    /// the packet was dropped or the arrival is not certain yet; an event may then wait to be polled.
    ///
    /// # Errors
    ///
    /// Like [`Network::handle_packet`].
    #[inline(always)]
    pub fn handle_packet_timed(
        &mut self,
        now: Instant,
        path: Path,
        info: impl Into<PacketInfo>,
        payload: P,
    ) -> Result<Option<Instant>, NetworkError> {
        let link = self.existing_link(path)?;
        check_time(&mut self.now, now)?;
        let place = self.place(path, link);
        let size = SizeAndMarks::new(info.into());
        if self.has_inner_events || self.has_filters {
            self.send_through(now, path, (link, place), size, payload);
            return Ok(None);
        }
        // Neither an access line nor a filter exists, so the link alone decides the fate of the packet.
        let line = &mut self.lines.links[place];
        // The number is taken before the offer, because the offer counts the packet.
        let sequence = line.offered();
        let packet = InNetwork { sequence, offered: now, entered: now, path, size, payload };
        match line.offer(now, None) {
            Outcome::Arrives(at) => {
                // An arrival at `now` itself must come after everything due at `now`.
                self.settle_before(at, now);
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

    /// Takes `packets` packets between two nodes at `now` as one train: the packets travel as one event with one payload, are counted one by one, and have
    /// successive sequence numbers. The event has the number of the first packet, and the number of packets as its size.
    ///
    /// The train arrives when and where its packets would arrive: packets that enter a link of constant delay at one instant are adjacent among all events. A
    /// train is taken only over such a link, with a delay above zero, in a network without access lines, filters, and links with more than delay, loss and
    /// order.
    ///
    /// # Errors
    ///
    /// The payload, if the network takes no train on the path at present, if `now` is before an earlier call's instant, or if `packets` is not from 1 to
    /// 4,194,303. No packet is taken then, and the packets can be handed in one by one.
    pub fn handle_train(&mut self, now: Instant, path: Path, packets: u32, payload: P) -> Result<Instant, P> {
        let Ok(link) = self.existing_link(path) else { return Err(payload) };
        let place = self.place(path, link);
        // Asked after the search for the link: a link that is made on demand may bring inner events.
        let may = !self.has_inner_events && !self.has_filters && self.lines.links[place].is_constant();
        if !may || !(1..=SizeAndMarks::MOST).contains(&packets) || check_time(&mut self.now, now).is_err() {
            return Err(payload);
        }
        let line = &mut self.lines.links[place];
        let sequence = line.offered();
        let at = line.offer_train(now, packets);
        let packet = InNetwork { sequence, offered: now, entered: now, path, size: SizeAndMarks::of_train(packets), payload };
        self.traffic.schedule(at, LineId::Link(link), packet);
        Ok(at)
    }

    /// Takes a packet in a network with access lines, engines or filters.
    #[inline(never)]
    fn send_through(&mut self, now: Instant, path: Path, (link, place): (LinkId, usize), size: SizeAndMarks, payload: P) {
        // Departures due by `now` make room in queues before the packet is offered.
        if self.has_inner_events {
            self.let_happen(now);
        }
        // Without uplinks `paths` is empty, and the link's own counter numbers the packet.
        let sequence = match self.paths.get_mut(place) {
            None => self.lines.links[place].offered(),
            Some(count) => {
                *count += 1;
                *count - 1
            }
        };
        // A packet with an uplink meets its link only after the uplink, and the link then counts the packet.
        let line = if self.lines.uplinks[path.from.index()].is_some() { LineId::Uplink(path.from) } else { LineId::Link(link) };
        self.offer(now, line, || InNetwork { sequence, offered: now, entered: now, path, size, payload });
    }

    /// Lets time pass until `now`. All events due become pollable.
    ///
    /// # Errors
    ///
    /// [`TimeWentBack`] if an earlier call had a later instant; the network is unchanged then.
    #[inline]
    pub fn handle_timeout(&mut self, now: Instant) -> Result<(), TimeWentBack> {
        self.let_pass(now)
    }

    /// Lets time pass until `now`, and computes the packets of cross-traffic of a link up to `now`: see [`crate::Link::catch_up`].
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if `now` is before an earlier call's instant or the link is missing; the network is unchanged then.
    pub fn catch_up(&mut self, now: Instant, from: NodeId, to: NodeId) -> Result<(), NetworkError> {
        let path = self.path(from, to)?;
        self.let_pass(now)?;
        let (link, _) = self.link_and_place(path);
        self.with_engine(LineId::Link(link), |line, outputs, exits| line.catch_up(now, outputs, exits));
        Ok(())
    }

    /// Returns the instant of the next necessary call of [`Network::handle_timeout`], or `None` if no packet is on the way. The instant is never before the
    /// last instant given, once all events are polled. After a change of rate nothing may happen at the instant.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.traffic.next_at()
    }

    /// Returns whether an event may happen up to `now`, or has happened and was not polled. `false` is certain: calls of [`Network::handle_timeout`] and
    /// [`Network::poll_event`] can wait then.
    #[must_use]
    #[inline(always)]
    pub fn may_have_events(&self, now: Instant) -> bool {
        self.quiet_until() <= now
    }

    /// Returns an instant before which no event happens, as long as nothing is handed in and all events that have happened are polled: a driver can wait until
    /// then. No event need happen at the instant. Unlike [`Network::poll_timeout`] the method does not search. An event that waits to be polled gives
    /// [`Instant::ZERO`], and no packet on the way gives [`Instant::MAX`].
    #[must_use]
    #[inline(always)]
    pub fn quiet_until(&self) -> Instant {
        self.traffic.quiet_until()
    }

    /// Returns the instant of the next call of [`Network::handle_timeout`] necessary for a packet to reach one of the receivers of [`Network::awaiting`] in
    /// time, or `None` if no packet is on the way to these receivers. The instant is never before the last instant given, once all events are polled. At some
    /// instants no packet reaches a receiver, for example when an uplink wakes for packets to further nodes.
    #[must_use]
    pub fn poll_awaited(&self) -> Option<Instant> {
        self.traffic.awaited.as_ref()?.next_at()
    }

    /// Returns the next arrived or dropped packet up to the last instant given, or `None` when all events have been polled.
    #[must_use]
    #[inline(always)]
    pub fn poll_event(&mut self) -> Option<PacketEvent<P, Path>> {
        if self.has_relay {
            // The driver sees receivers only: an event before the relay becomes one event per receiver before it is given.
            self.tell_each_receiver();
        }
        if let Some(event) = self.traffic.happened.pop_front() {
            return Some(event);
        }
        while let Some(pending) = self.traffic.pop_due(self.now) {
            if let Some(event) = self.happen(pending) {
                return Some(event);
            }
            if self.has_relay {
                self.tell_each_receiver();
            }
            // `happen` gives final arrivals only. A packet dropped between two lines waits in `happened` instead.
            if let Some(event) = self.traffic.happened.pop_front() {
                return Some(event);
            }
        }
        if let Some(event) = self.traffic.pop_dropped() {
            return Some(event);
        }
        // Everything due has happened, so the awaited instants up to now are over.
        if let Some(awaited) = &mut self.traffic.awaited {
            awaited.pass(self.now);
        }
        None
    }

    /// Polls like [`Network::poll_event`] as long as the next event is an arrival in a network of direct links, and gives each event to `take`. Ends after the
    /// first break of `take`, and returns its value. `None` says nothing about further events: call [`Network::poll_event`] then. The call is inlined, so unused
    /// parts of an event need not be computed.
    #[inline(always)]
    pub fn take_mere_arrivals<T: TakeArrival<P>>(&mut self, mut take: T) -> Option<T::Break> {
        if self.has_inner_events || !self.traffic.happened.is_empty() {
            return None;
        }
        let Self { now, traffic, lines, .. } = self;
        // An arrival drops no packet, so one instant holds for all arrivals.
        let until = traffic.until(*now);
        loop {
            let ended = if traffic.has_only_singles(until) {
                if !traffic.has_singles_due(until) {
                    return None;
                }
                arrive_one_by_one(until, traffic, lines, &mut take)
            } else if let Some(group) = traffic.pop_group(until) {
                arrive_together(group, traffic, lines, &mut take)
            } else {
                let Pending { at, sequence, offered, entered, turn, path, size, payload } = traffic.pop_until(until)?;
                arrive(InNetwork { sequence, offered, entered, path, size, payload: payload? }, turn.link(), at, lines, &mut take)
            };
            if let ControlFlow::Break(value) = ended {
                return Some(value);
            }
        }
    }

    /// Changes the model of a link from `now` on: see [`crate::Link::set_model`].
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if `now` is before an earlier call's instant or the link is missing; the network is unchanged then.
    pub fn set_link(&mut self, now: Instant, from: NodeId, to: NodeId, model: impl Into<LinkModel>) -> Result<(), NetworkError> {
        let path = self.path(from, to)?;
        self.let_pass(now)?;
        let (link, _) = self.link_and_place(path);
        let model = model.into();
        self.settle(now);
        // A link may leave the direct way, so the network looks for inner events from now on.
        self.has_inner_events |= !model.is_direct();
        self.is_random |= model.is_random();
        let name = self.link_name(path);
        let seed = self.config.seed;
        self.with_engine(LineId::Link(link), |line, outputs, exits| line.reconfigure(now, seed, &name, model, outputs, exits));
        Ok(())
    }

    /// Returns the number of packets sent on a path so far, which is the sequence number of the next packet. `None` if the link is missing. Packets that an
    /// uplink has lost count, unlike in [`Network::link_stats`].
    #[must_use]
    pub fn sent(&self, from: NodeId, to: NodeId) -> Option<u64> {
        let path = self.path(from, to).ok()?;
        // No packet was sent on a link that was not made yet.
        let Some(place) = self.lines.place(self.link(path)) else { return Some(0) };
        // Without uplinks `paths` is empty, and the link's own counter is the same number.
        Some(self.paths.get(place).copied().unwrap_or_else(|| self.lines.links[place].offered()))
    }

    /// Returns the counters of a link, or `None` if the link is missing.
    #[must_use]
    pub fn link_stats(&self, from: NodeId, to: NodeId) -> Option<LinkStats> {
        let path = self.path(from, to).ok()?;
        Some(self.lines.find_link(self.link(path)).map_or_else(LinkStats::default, Line::stats))
    }

    /// Returns the counters of an access line, or `None` without such a line.
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

    /// Lets time pass. Inner events happen now, so the next packet finds their result. Mere arrivals wait to be polled.
    #[inline]
    fn let_pass(&mut self, now: Instant) -> Result<(), TimeWentBack> {
        check_time(&mut self.now, now)?;
        if self.has_inner_events {
            self.let_happen(now);
        }
        Ok(())
    }
}

/// Returns the number of nodes of a network with links between all nodes. Panics with more than [`MOST_NODES`] nodes.
fn nodes_of_all(config: &NetworkConfig) -> u16 {
    u16::try_from(config.nodes.len()).ok().filter(|nodes| usize::from(*nodes) <= MOST_NODES).expect("a network has at most 23,170 nodes")
}

/// Hands over the packets of a group, which have arrived at one instant, until `take` breaks. Not inlined, so that the loop over single packets has the registers
/// for itself (`benches/peers`, datagrams all the time).
#[inline(never)]
fn arrive_together<P: Clone, T: TakeArrival<P>>(
    group: Group<P>,
    traffic: &mut Traffic<P>,
    lines: &mut Lines<P>,
    take: &mut T,
) -> ControlFlow<T::Break> {
    // Kept in registers, and written back only for a break.
    let Group { at, offered, sequence, from, next: NodeId(mut to), end, first, size, payload } = group;
    while to < end {
        let packet = InNetwork { sequence, offered, entered: offered, path: Path { from, to: NodeId(to) }, size, payload: payload.clone() };
        let ended = arrive(packet, LinkId(first.0 + u32::from(to)), at, lines, take);
        to = Group::<P>::after(from, to);
        if ended.is_break() {
            if to < end {
                traffic.put_back(Group { at, offered, sequence, from, next: NodeId(to), end, first, size, payload });
            }
            return ended;
        }
    }
    ControlFlow::Continue(())
}

/// Hands over packets that [are due](Traffic::has_singles_due), in one loop, until `take` breaks.
#[inline(never)]
fn arrive_one_by_one<P: Clone, T: TakeArrival<P>>(
    until: Instant,
    traffic: &mut Traffic<P>,
    lines: &mut Lines<P>,
    take: &mut T,
) -> ControlFlow<T::Break> {
    let ended = traffic.take_some(until, |pending| {
        let Pending { at, sequence, offered, entered, turn, path, size, payload } = pending;
        let Some(payload) = payload else { return ControlFlow::Continue(()) };
        arrive(InNetwork { sequence, offered, entered, path, size, payload }, turn.link(), at, lines, take)
    });
    ended.map_or(ControlFlow::Continue(()), ControlFlow::Break)
}

/// Hands over a packet that has arrived at `at`. Without inner events, no engine is woken, no packet has passed another line before its link, and no packet is
/// damaged.
#[inline(always)]
fn arrive<P: Clone, T: TakeArrival<P>>(packet: InNetwork<P>, link: LinkId, at: Instant, lines: &mut Lines<P>, take: &mut T) -> ControlFlow<T::Break> {
    let line = lines.link_mut(link);
    if packet.size.has(SizeAndMarks::TRAIN) {
        line.deliver_further(packet.size.further_packets(), packet.entered, at);
    }
    line.deliver(packet.entered, at);
    take.take(packet.event(LineId::Link(link), at, Fate::Delivered(at), None))
}
