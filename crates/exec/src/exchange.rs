//! The network between hosts, without devices and without a clock. Packets of IP come in from a host at an instant, and leave to another host at the instant
//! that the link between both gives.

use core::net::IpAddr;
use core::time::Duration;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use cohaptic_router::{Content, Headers, Packet};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Fate, LinkModel, LinkStats, Network, NetworkConfig, NodeId, PacketEvent, PacketRecord, Path};

use crate::loopback::Loopback;

/// Hosts of a network, and the links between them.
#[derive(Debug)]
pub struct Exchange {
    network: Network<Arc<Packet>>,
    /// Names of the hosts, indexed by node.
    names: Vec<String>,
    /// Host of each address.
    routes: BTreeMap<IpAddr, NodeId>,
    /// Host that gets the packets to all other addresses, or `None` if these packets are dropped.
    gateway: Option<NodeId>,
    /// Way of the packets of a host to itself, or `None` if these packets are dropped.
    loopback: Option<Loopback>,
    /// Latest instant given by the driver.
    now: Instant,
    /// Instant up to which the cross packets of all links are computed.
    caught_up: Instant,
    /// Links with cross-traffic.
    with_cross: Vec<Path>,
    /// Packets inside the links, indexed by sender. Packets of both links of a loopback count at its node. Signed, because the end of a copy can be reported
    /// before the making of the copy.
    held: Vec<i64>,
    /// Bytes of IP inside the links.
    held_bytes: i64,
    departures: VecDeque<Departure>,
    /// Numbers of the first dropped packets of each link, in the order of their drops, indexed by sender and receiver. At most [`MOST_NAMED`] per link.
    dropped: BTreeMap<(NodeId, NodeId), Vec<u64>>,
    counts: Counts,
}

/// Host of an [`Exchange`].
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Node {
    /// Name, unique in the network. Part of the names of links and random streams.
    pub name: String,
    /// Addresses of the host.
    pub addresses: Vec<IpAddr>,
}

/// Packet at the end of its link.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Departure {
    /// Logical departure.
    pub at: Instant,
    /// Record of the way: sender and receiver, the number of the packet on its link, and marks.
    pub record: PacketRecord<Path>,
    /// Host that gets the packet: the receiver of the link, and on both links of a loopback the host itself.
    pub to: NodeId,
    /// Packet, with the marks and bit errors of its link.
    pub packet: Arc<Packet>,
}

/// Packets not taken by any link, by reason.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Counts {
    /// Packets other than IP, and packets with headers that contradict the length.
    pub malformed: u64,
    /// Packets to an address of no host, for example to a multicast group, as systems send by themselves.
    pub no_host: u64,
    /// Packets dropped because too much was inside the links.
    pub overload: u64,
}

/// Packets and bytes inside all links at most, as for `cohaptic router`: more than any real line holds, and little enough for the memory.
const MOST_PACKETS: i64 = 262_144;
const MOST_BYTES: i64 = 256 << 20;

/// Dropped packets of a link that are remembered by number. Enough for a test; the counters of the link count all.
const MOST_NAMED: usize = 1000;

/// Time after which cross packets are computed without a packet to meet the cross packets, as in [`cohaptic_router::Engine`].
const CATCH_UP: Duration = Duration::from_millis(10);

impl Exchange {
    /// Returns a network without packets. `link` gives the model of the link from one node to another, by their indices in `nodes`. Packets to addresses of no
    /// node go to the node `gateway`.
    #[must_use]
    pub fn new(seed: u64, nodes: &[Node], gateway: Option<usize>, mut link: impl FnMut(usize, usize) -> LinkModel) -> Self {
        let names: Vec<String> = nodes.iter().map(|node| node.name.clone()).collect();
        let mut with_cross = Vec::new();
        let config = NetworkConfig { seed, nodes: names.clone(), general: false };
        let network = Network::new(config, |from, to| {
            let model = link(usize::from(from.0), usize::from(to.0));
            with_cross.extend((from != to && model.has_cross_traffic()).then_some(Path { from, to }));
            model
        });
        let addresses = nodes.iter().enumerate().flat_map(|(index, node)| node.addresses.iter().map(move |address| (*address, NodeId::new(index))));
        Self {
            network: network.with_flows(|_, packet: &Arc<Packet>| packet.flow()),
            names,
            routes: addresses.collect(),
            gateway: gateway.map(NodeId::new),
            loopback: None,
            now: Instant::ZERO,
            caught_up: Instant::ZERO,
            with_cross,
            held: vec![0; nodes.len()],
            held_bytes: 0,
            departures: VecDeque::new(),
            dropped: BTreeMap::new(),
            counts: Counts::default(),
        }
    }

    /// Lets the packets of a host to itself pass links: packets of clients the link from `host` to `node`, and packets of servers the link from `node` to
    /// `host`. Packets to itself are those to 127.0.0.0/8, to `::1`, and to an address of the host. The sender of the first packet of a flow is the client.
    #[must_use]
    pub fn with_loopback(self, host: usize, node: usize) -> Self {
        Self { loopback: Some(Loopback::new(NodeId::new(host), NodeId::new(node))), ..self }
    }

    /// Passes a packet from a host. An instant before the latest instant counts as the latest instant.
    pub fn handle_packet(&mut self, now: Instant, from: NodeId, packet: Packet) {
        self.handle_timeout(now);
        let Content::Ip { headers, .. } = packet.content() else {
            self.counts.malformed += 1;
            return;
        };
        let Some(path) = self.path(from, &packet, headers) else {
            self.counts.no_host += 1;
            return;
        };
        let (info, bytes) = (packet.info(), i64::try_from(headers.length).unwrap_or(i64::MAX));
        if self.held.iter().sum::<i64>() >= MOST_PACKETS || self.held_bytes + bytes > MOST_BYTES {
            self.counts.overload += 1;
            return;
        }
        let holder = self.holder(path);
        self.held[holder] += 1;
        self.held_bytes += bytes;
        let offered = self.network.handle_packet(self.now, path.from, path.to, info, Arc::new(packet));
        debug_assert_eq!(offered, Ok(()), "time has not gone back, and every pair of hosts has a link");
        self.drain();
    }

    /// Returns the link for a packet of a host, or `None` if no other host has the destination.
    fn path(&mut self, from: NodeId, packet: &Packet, headers: &Headers) -> Option<Path> {
        let to = headers.destination;
        let is_to_itself = to.is_loopback() || self.routes.get(&to) == Some(&from);
        if let Some(loopback) = self.loopback.as_mut().filter(|loopback| is_to_itself && loopback.host == from) {
            return Some(loopback.link(packet, headers));
        }
        self.receiver(to).filter(|to| *to != from).map(|to| Path { from, to })
    }

    /// Returns the place of a link in the list of held packets. Packets of a host to itself are not those of the host, because nothing outside waits for
    /// such packets.
    fn holder(&self, path: Path) -> usize {
        let node = self.loopback.as_ref().filter(|loopback| loopback.has(path)).map_or(path.from, |loopback| loopback.node);
        usize::from(node.0)
    }

    /// Returns the host that gets the packets to an address.
    fn receiver(&self, address: IpAddr) -> Option<NodeId> {
        // A gateway leads to single hosts, so packets to many receivers are not for the gateway.
        let is_to_all = address.is_multicast() || address.is_unspecified() || address == IpAddr::V4(core::net::Ipv4Addr::BROADCAST);
        self.routes.get(&address).copied().or_else(|| self.gateway.filter(|_| !is_to_all))
    }

    /// Lets logical time pass until `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.now = self.now.max(now);
        let passed = self.network.handle_timeout(self.now);
        debug_assert_eq!(passed, Ok(()), "time has not gone back");
        self.drain();
        if !self.with_cross.is_empty() && self.now.saturating_duration_since(self.caught_up) >= CATCH_UP {
            self.caught_up = self.now;
            for Path { from, to } in &self.with_cross {
                let caught_up = self.network.catch_up(self.now, *from, *to);
                debug_assert_eq!(caught_up, Ok(()), "the links exist, and time has not gone back");
            }
        }
    }

    /// Returns the instant of the next necessary call of [`Exchange::handle_timeout`], or `None` if no packet is inside a link.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.network.poll_timeout()
    }

    /// Returns the next departing packet, in the order of instants, or `None` when all have been polled.
    #[must_use]
    pub fn poll_departure(&mut self) -> Option<Departure> {
        self.departures.pop_front()
    }

    /// Collects the events of the links: deliveries become departures, and each end of a packet frees room.
    fn drain(&mut self) {
        while let Some(event) = self.network.poll_event() {
            let (holder, bytes) = (self.holder(event.path), i64::try_from(event.size.get()).unwrap_or(i64::MAX));
            let sign = if event.fate.is_end() { -1 } else { 1 };
            self.held[holder] += sign;
            self.held_bytes += sign * bytes;
            // The copies of a packet have the number of the packet, so that a dropped copy has no number of its own.
            if matches!(event.fate, Fate::Dropped(_)) && event.copy == 0 {
                let dropped = self.dropped.entry((event.path.from, event.path.to)).or_default();
                if dropped.len() < MOST_NAMED {
                    dropped.push(event.sequence);
                }
            }
            let Fate::Delivered(at) = event.fate else { continue };
            let PacketEvent { record, payload: mut packet, damage, part: _ } = event;
            if record.marked || damage.is_some() {
                // A copy may share the packet. `make_mut` then clones the packet, so that each copy has separate marks and bits.
                let packet = Arc::make_mut(&mut packet);
                if record.marked {
                    packet.mark_congestion();
                }
                if let Some(damage) = &damage {
                    packet.damage(damage);
                }
            }
            let path = record.path;
            let to = self.loopback.as_ref().filter(|loopback| loopback.has(path)).map_or(path.to, |loopback| loopback.host);
            self.departures.push_back(Departure { at, record, to, packet });
        }
    }

    /// Returns the number of packets of a host inside links, without packets to itself.
    #[must_use]
    pub fn in_flight(&self, from: NodeId) -> u64 {
        self.held.get(usize::from(from.0)).map_or(0, |held| u64::try_from(*held).unwrap_or(0))
    }

    /// Returns the names of the hosts, indexed by node.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the counters of the link from one host to another, or `None` if the hosts are one or do not exist.
    #[must_use]
    pub fn link_stats(&self, from: NodeId, to: NodeId) -> Option<LinkStats> {
        self.network.link_stats(from, to)
    }

    /// Returns the numbers of the packets that the link from one host to another dropped, in the order of the drops: the first 1000 of them. Packets are numbered
    /// from 0 on each link, as by the key `loss.packets`.
    #[must_use]
    pub fn dropped(&self, from: NodeId, to: NodeId) -> &[u64] {
        self.dropped.get(&(from, to)).map_or(&[], Vec::as_slice)
    }

    /// Returns the numbers of packets not taken by any link.
    #[must_use]
    pub const fn counts(&self) -> Counts {
        self.counts
    }

    /// Returns the bytes of IP inside the links.
    #[must_use]
    pub fn held_bytes(&self) -> Bytes {
        Bytes::new(u64::try_from(self.held_bytes).unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_linkfile::link_from_keys;
    use etherparse::PacketBuilder;

    use super::*;

    fn exchange(keys: &[&str]) -> Exchange {
        let model = link_from_keys(&keys.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>()).unwrap();
        let node = |name: &str, address: [u8; 4]| Node { name: name.to_owned(), addresses: vec![address.into()] };
        let nodes = [node("a", [10, 0, 0, 1]), node("b", [10, 0, 0, 2]), node("world", [10, 0, 0, 3])];
        Exchange::new(1, &nodes, Some(2), |_, _| model.clone())
    }

    fn datagram(to: [u8; 4]) -> Packet {
        let mut bytes = Vec::new();
        PacketBuilder::ipv4([10, 0, 0, 1], to, 64).udp(1, 2).write(&mut bytes, b"data").unwrap();
        Packet::checked(bytes)
    }

    /// A packet goes to the host of its address, and otherwise to the gateway. A packet to a multicast or broadcast address, or to its sender, goes nowhere.
    #[test]
    fn the_address_chooses_the_host() {
        let mut exchange = exchange(&["delay=10ms"]);
        for to in [[10, 0, 0, 2], [192, 0, 2, 7], [224, 0, 0, 1], [255, 255, 255, 255], [10, 0, 0, 1]] {
            exchange.handle_packet(Instant::ZERO, NodeId(0), datagram(to));
        }
        assert_eq!((exchange.in_flight(NodeId(0)), exchange.counts().no_host), (2, 3));
        let due = exchange.poll_timeout().unwrap();
        exchange.handle_timeout(due);
        let departures: Vec<_> =
            std::iter::from_fn(|| exchange.poll_departure()).map(|departure| (departure.at.as_nanos(), departure.record.path.to.0)).collect();
        assert_eq!(departures, [(10_000_000, 1), (10_000_000, 2)]);
        assert_eq!((exchange.in_flight(NodeId(0)), exchange.held_bytes()), (0, Bytes::new(0)));
    }

    /// Packets of a host to itself take a link for each direction, and arrive at the host. The host does not count as their sender.
    #[test]
    fn a_loopback_has_a_link_for_each_direction() {
        let model = |from, to| link_from_keys(&[format!("delay={}ms", 10 * from + to)]).unwrap();
        let node = |name: &str, addresses: &[[u8; 4]]| Node {
            name: name.to_owned(),
            addresses: addresses.iter().map(|address| (*address).into()).collect(),
        };
        let nodes = [node("a", &[[10, 0, 0, 1]]), node("world", &[]), node("loopback", &[])];
        let mut exchange = Exchange::new(1, &nodes, Some(1), model).with_loopback(0, 2);
        let ends = |text: &str| text.parse().unwrap();
        let packets = [
            ["127.0.0.1:5", "127.0.0.1:4"],
            ["127.0.0.1:4", "127.0.0.1:5"],
            ["10.0.0.1:5", "10.0.0.1:4"],
            ["127.0.0.1:4", "127.0.0.2:4"],
            ["10.0.0.1:5", "192.0.2.1:4"],
        ];
        for [from, to] in packets {
            exchange.handle_packet(Instant::ZERO, NodeId(0), Packet::datagram(ends(from), ends(to), b"data").unwrap());
        }
        // The world has no loopback here.
        exchange.handle_packet(Instant::ZERO, NodeId(1), Packet::datagram(ends("192.0.2.1:1"), ends("127.0.0.1:1"), b"data").unwrap());
        assert_eq!((exchange.in_flight(NodeId(0)), exchange.in_flight(NodeId(2)), exchange.counts().no_host), (1, 4, 1));
        exchange.handle_timeout(Instant::from_nanos(30_000_000));
        let way =
            |departure: Departure| (departure.at.as_nanos() / 1_000_000, departure.record.path.from.0, departure.record.path.to.0, departure.to.0);
        let departures: Vec<_> = std::iter::from_fn(|| exchange.poll_departure()).map(way).collect();
        assert_eq!(departures, [(1, 0, 1, 1), (2, 0, 2, 0), (2, 0, 2, 0), (2, 0, 2, 0), (20, 2, 0, 0)]);
        assert_eq!((exchange.in_flight(NodeId(2)), exchange.held_bytes()), (0, Bytes::new(0)));
    }

    /// The link names the packets that it dropped, but not all packets of a long run.
    #[test]
    fn dropped_packets_are_named() {
        let mut some = exchange(&["loss={packets=[1,3]}", "delay=1ms"]);
        let mut all = exchange(&["loss=100%"]);
        for exchange in [&mut some, &mut all] {
            for _ in 0..1040 {
                exchange.handle_packet(Instant::ZERO, NodeId(0), datagram([10, 0, 0, 2]));
            }
        }
        assert_eq!((some.dropped(NodeId(0), NodeId(1)), some.dropped(NodeId(1), NodeId(0))), (&[1, 3][..], &[][..]));
        assert_eq!(all.dropped(NodeId(0), NodeId(1)), (0..1000).collect::<Vec<_>>());
    }

    #[test]
    fn a_lost_packet_and_a_copy_leave_nothing_behind() {
        for keys in [&["loss=100%"][..], &["delay=1ms", "duplicate=100%"]] {
            let mut exchange = exchange(keys);
            exchange.handle_packet(Instant::ZERO, NodeId(0), datagram([10, 0, 0, 2]));
            exchange.handle_timeout(Instant::from_nanos(2_000_000));
            assert_eq!((exchange.in_flight(NodeId(0)), exchange.held_bytes()), (0, Bytes::new(0)), "{keys:?}");
        }
    }

    /// A packet and its copy share their bytes until one of the two is damaged.
    #[test]
    fn damage_changes_one_copy_alone() {
        let mut exchange = exchange(&["duplicate=100%", "corrupt={ probability = \"50%\", checksum = \"passes\", bytes = \"28-31\" }"]);
        let sent = datagram([10, 0, 0, 2]);
        for _ in 0..200 {
            exchange.handle_packet(Instant::ZERO, NodeId(0), sent.clone());
        }
        let departed: Vec<_> = std::iter::from_fn(|| exchange.poll_departure()).collect();
        let changed = departed.iter().filter(|departure| departure.packet.bytes() != sent.bytes()).count() as u64;
        assert_eq!((departed.len(), changed), (400, exchange.link_stats(NodeId(0), NodeId(1)).unwrap().damaged()));
        // 200 ± 10, by the binomial law; five standard deviations.
        assert!((150..=250).contains(&changed), "{changed}");
    }

    #[test]
    fn congestion_is_marked_where_the_sender_understands_marks() {
        let mut exchange = exchange(&["loss=100%", "mark-instead-of-loss=true"]);
        let mut bytes = datagram([10, 0, 0, 2]).bytes().to_vec();
        exchange.handle_packet(Instant::ZERO, NodeId(0), Packet::checked(bytes.clone()));
        assert!(exchange.poll_departure().is_none());
        // ECT(0) of RFC 3168. The checksum of the header becomes smaller by as much.
        bytes[1] |= 2;
        let checksum = u16::from_be_bytes([bytes[10], bytes[11]]) - 2;
        bytes[10..12].copy_from_slice(&checksum.to_be_bytes());
        exchange.handle_packet(Instant::ZERO, NodeId(0), Packet::checked(bytes));
        let marked = exchange.poll_departure().unwrap();
        assert!(marked.record.marked && marked.packet.bytes()[1] & 3 == 3, "{marked:?}");
    }
}
