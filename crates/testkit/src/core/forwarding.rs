//! Way of a packet through NATs and firewalls, from node to node, and by the interfaces of hosts with several.

#[cfg(feature = "tcp")]
use std::collections::VecDeque;
use std::net::{IpAddr, SocketAddr};
#[cfg(feature = "tcp")]
use std::time::Duration;

use cohaptic_units::{Ecn, Instant};
use cohaptic_wan::{NodeId, Path};

use super::{Core, Ends, Kind, Parcel};
use crate::address::Addresses;
use crate::middlebox::{Middlebox, Topology};
use crate::nat::{Behaviour, Endpoint, Flow, Listed, Protocol, Signs, Table};
use crate::settings::Settings;
use crate::trace::{Happening, Lost};
use crate::wire::Held;

/// NATs, firewalls and interfaces of a run.
pub(super) struct Forwarding {
    topology: Topology,
    /// State of each NAT and firewall, indexed by node; `None` for hosts.
    tables: Vec<Option<Table>>,
    /// Unexpected opening segments from outside, sorted by instant of the answer.
    #[cfg(feature = "tcp")]
    unexpected: VecDeque<Unexpected>,
}

/// Dropped opening segment of TCP from outside, with a later answer.
#[cfg(feature = "tcp")]
struct Unexpected {
    /// Instant of the answer.
    due: Instant,
    /// NAT or firewall.
    at: NodeId,
    flow: Flow,
    segment: cohaptic_tcp::Segment<'static>,
}

/// Span for which a NAT keeps silent about an unexpected opening segment (RFC 5382, requirement 4): the host inside may be about to open the same connection.
#[cfg(feature = "tcp")]
const SILENCE: Duration = Duration::from_secs(6);

impl Forwarding {
    /// Returns the state of a run, or `None` if the test bed has neither NATs nor firewalls nor hosts with several interfaces.
    pub(super) fn new(settings: &Settings, topology: Topology, names: &[String], seed: u64) -> Option<Box<Self>> {
        if settings.devices() == 0 {
            return None;
        }
        let mut tables: Vec<Option<Table>> = names.iter().map(|_| None).collect();
        for Middlebox { node, behaviour, translates, .. } in &settings.middleboxes {
            tables[node.index()] = Some(Table::new(behaviour.clone(), *translates, seed, &names[node.index()]));
        }
        Some(Box::new(Self {
            topology,
            tables,
            #[cfg(feature = "tcp")]
            unexpected: VecDeque::new(),
        }))
    }

    /// Returns whether a random port was drawn.
    pub(super) fn has_drawn(&self) -> bool {
        self.tables.iter().flatten().any(Table::has_drawn)
    }

    pub(super) fn topology_mut(&mut self) -> &mut Topology {
        &mut self.topology
    }
}

impl Core {
    /// Returns the path of a packet's first link, on the way from a host to another. `None` if no way leads there, or for a broadcast or multicast to another
    /// network.
    #[inline(always)]
    pub(super) fn first_hop(&self, path: Path, ends: &Ends) -> Option<Path> {
        // Most runs have no forwarding, and each segment of TCP asks.
        match &self.forwarding {
            None => Some(path),
            Some(forwarding) => self.first_hop_of(forwarding, path, ends),
        }
    }

    #[inline(never)]
    fn first_hop_of(&self, forwarding: &Forwarding, path: Path, ends: &Ends) -> Option<Path> {
        // A host with several interfaces sends by the interface with the source address of the packet, and receives by the interface with the destination.
        let from = self.plan.node_at(path.from, ends.from, ends.is_six)?;
        let to = if ends.is_broadcast() || ends.is_multicast() {
            // Broadcast and multicast stay in the network of the sender. NATs and hosts without links hear neither.
            let Path { to, .. } = path;
            let is_near = forwarding.topology.parent(from) == forwarding.topology.parent(to) && self.plan.host_of(to) != path.from;
            (is_near && forwarding.tables[to.index()].is_none() && self.plan.nodes_of(to).is_empty()).then_some(to)?
        } else {
            forwarding.topology.hop(from, self.plan.node_at(path.to, ends.to, ends.is_six)?, ends.is_six)?
        };
        Some(Path { from, to })
    }

    /// Returns whether a packet of `host` to an address without an owner is lost on the way, and not refused at once: a host behind a NAT sends whatever it
    /// does not know to the NAT.
    pub(super) fn is_reachable(&self, host: NodeId, address: IpAddr) -> bool {
        let is_inside = || self.forwarding.as_ref().is_some_and(|forwarding| forwarding.topology.is_inside(self.plan.uplink(host)));
        self.plan.is_reachable(address) || address.is_ipv4() && is_inside()
    }

    /// Returns the NAT between `from` and the name and address of `to`: see [`Topology::hides`].
    pub(crate) fn hides(&self, from: NodeId, to: NodeId) -> Option<NodeId> {
        let topology = &self.forwarding.as_ref()?.topology;
        let to = self.plan.uplink(to);
        // A host knows the names in the networks of all interfaces.
        match self.plan.nodes_of(from) {
            [] => topology.hides(from, to),
            nodes => nodes.iter().map(|node| topology.hides(*node, to)).min()?,
        }
    }

    /// Returns whether there is a link between two nodes.
    pub(crate) fn is_link(&self, path: Path) -> bool {
        let has_links = |node: NodeId| self.plan.nodes_of(node).is_empty();
        self.forwarding
            .as_ref()
            .is_none_or(|forwarding| forwarding.topology.is_link(path.from, path.to) && has_links(path.from) && has_links(path.to))
    }

    /// Returns whether a node is a NAT or a firewall.
    pub(crate) fn is_middlebox(&self, node: NodeId) -> bool {
        self.forwarding.as_ref().is_some_and(|forwarding| forwarding.tables[node.index()].is_some())
    }

    /// Passes an arrived packet of a NAT or a firewall on, or returns why the packet is lost.
    pub(super) fn forward(&mut self, mut parcel: Box<Parcel>) -> Result<(), Lost> {
        let packet = parcel.arrival.packet;
        let Path { from, to: node } = packet.path;
        self.wire.held.remove(Held::cost(parcel.bytes.len()));
        #[cfg(feature = "tcp")]
        // As with Linux, a wrong checksum is found before the translation.
        if parcel.addresses.kind == Kind::Segment && parcel.bytes.segment().is_none() {
            return Err(Lost::Checksum);
        }
        let before = [parcel.addresses.from(), parcel.addresses.to()];
        self.translate(from, node, &mut parcel)?;
        let after = [parcel.addresses.from(), parcel.addresses.to()];
        let Ends { to, is_six, .. } = parcel.addresses;
        let owner = self.plan.owner_of(to, is_six).ok_or(Lost::NoSuchAddress)?;
        let next = self.first_hop(Path { from: node, to: owner }, &parcel.addresses).ok_or(Lost::NoSuchAddress)?;
        // A mark stays on the packet: the next link reports only new marks.
        if parcel.arrival.marked && parcel.ecn.is_capable() {
            parcel.ecn = Ecn::Congestion;
        }
        #[cfg(feature = "tcp")]
        if let Some(segment) = parcel.bytes.segment_mut().filter(|_| after != before || parcel.arrival.marked) {
            [segment.source, segment.destination] = after;
            segment.ecn = parcel.ecn;
        }
        self.wire.note(Happening::Forwarded { packet, before, after });
        // The caller polls the wire after each packet, and so delivers a packet of a link without delay.
        let _ = self.wire.offer(next, parcel);
        Ok(())
    }

    /// Writes the translated addresses on a packet from the node `from`.
    fn translate(&mut self, from: NodeId, node: NodeId, parcel: &mut Parcel) -> Result<(), Lost> {
        let (now, outer) = (self.now(), self.plan.short(node, false));
        let Some(forwarding) = &mut self.forwarding else { return Ok(()) };
        let is_from_inside = forwarding.topology.parent(from) == Some(node);
        let Some(table) = &mut forwarding.tables[node.index()] else { return Ok(()) };
        let ends = &mut parcel.addresses;
        #[cfg(feature = "tcp")]
        let (protocol, signs) = parcel.bytes.segment().map_or_else(|| (Protocol::Udp, Signs::default()), signs);
        #[cfg(not(feature = "tcp"))]
        let (protocol, signs) = (Protocol::Udp, Signs::default());
        let is_error = ends.kind == Kind::Unreachable;
        let mut flow = Flow { protocol, is_six: ends.is_six, source: ends.source(), destination: ends.destination(), signs };
        let translates = table.translates(ends.is_six);
        if is_from_inside {
            let is_hairpin = translates && flow.destination.address == outer;
            if is_hairpin && !table.behaviour.hairpin {
                return Err(Lost::NoHairpin);
            }
            flow.source = if is_error { table.error_out(now, &flow)? } else { table.outbound(now, &flow, outer)? };
            ends.set_source(flow.source);
            if !is_hairpin {
                return Ok(());
            }
        } else if translates && flow.destination.address != outer {
            return Err(Lost::NoSuchAddress);
        }
        let inside = if is_error { table.error_in(now, &flow) } else { table.inbound(now, &flow) };
        #[cfg(feature = "tcp")]
        if let (Err(_), Some(segment)) = (&inside, parcel.bytes.segment().filter(|_| !is_from_inside && signs.syn && !signs.ack && !signs.rst)) {
            let unexpected = Unexpected { due: now.saturating_add(SILENCE), at: node, flow, segment: segment.clone() };
            forwarding.unexpected.push_back(unexpected);
        }
        parcel.addresses.set_destination(inside?);
        Ok(())
    }

    /// Returns the instant at which the next unexpected opening segment is answered.
    pub(super) fn next_answer(&self) -> Option<Instant> {
        #[cfg(feature = "tcp")]
        return self.forwarding.as_ref()?.unexpected.front().map(|unexpected| unexpected.due);
        #[cfg(not(feature = "tcp"))]
        None
    }

    /// Answers the due unexpected opening segments by a reset, unless the host inside has opened the same connection meanwhile.
    #[cfg(feature = "tcp")]
    pub(super) fn answer_unexpected(&mut self) {
        let now = self.now();
        while let Some(forwarding) = &mut self.forwarding {
            if forwarding.unexpected.front().is_none_or(|unexpected| unexpected.due > now) {
                return;
            }
            let Some(Unexpected { at, flow, segment, .. }) = forwarding.unexpected.pop_front() else { return };
            let is_expected = forwarding.tables[at.index()].as_ref().is_some_and(|table| table.is_permitted(now, &flow));
            if !is_expected && let Some(reset) = segment.refusal(self.tcp_config(at).ttl) {
                self.emit_from(at, reset);
            }
        }
    }
}

/// Returns the protocol of a segment, and the flags with a meaning for a NAT.
#[cfg(feature = "tcp")]
fn signs(segment: &cohaptic_tcp::Segment<'static>) -> (Protocol, Signs) {
    use cohaptic_tcp::Flags;

    let has = |flag| segment.flags.has(flag);
    (Protocol::Tcp, Signs { syn: has(Flags::SYN), ack: has(Flags::ACK), fin: has(Flags::FIN), rst: has(Flags::RST) })
}

/// Requests of the handle of a NAT.
impl Core {
    fn table(&mut self, node: NodeId) -> &mut Table {
        let tables = &mut self.forwarding.as_mut().expect("the handle was given for a NAT").tables;
        tables[node.index()].as_mut().expect("the handle was given for a NAT")
    }

    pub(crate) fn forget_mappings(&mut self, node: NodeId) {
        self.table(node).forget();
        self.wire.note(Happening::Forgotten(node));
    }

    pub(crate) fn behaviour_of(&mut self, node: NodeId) -> &mut Behaviour {
        &mut self.table(node).behaviour
    }

    /// Returns whether a node is a NAT, and not a firewall.
    pub(crate) fn is_nat(&mut self, node: NodeId) -> bool {
        self.table(node).translates(false)
    }

    pub(crate) fn mappings_of(&mut self, node: NodeId) -> Vec<Listed> {
        let now = self.now();
        self.table(node).listed(now)
    }

    pub(crate) fn filtered_of(&mut self, node: NodeId) -> u64 {
        self.table(node).filtered
    }
}

impl Ends {
    const fn source(&self) -> Endpoint {
        Endpoint { address: self.from, port: self.from_port }
    }

    const fn destination(&self) -> Endpoint {
        Endpoint { address: self.to, port: self.to_port }
    }

    const fn set_source(&mut self, Endpoint { address, port }: Endpoint) {
        (self.from, self.from_port) = (address, port);
    }

    const fn set_destination(&mut self, Endpoint { address, port }: Endpoint) {
        (self.to, self.to_port) = (address, port);
    }
}

/// Returns an endpoint in the form for programs.
pub(crate) fn shown(Endpoint { address, port }: Endpoint, is_six: bool) -> SocketAddr {
    (Addresses::long(address, is_six), port).into()
}
