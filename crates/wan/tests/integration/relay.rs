//! A relay between uplinks and links: one packet up, one down to each receiver.

use std::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{AccessLine, Delay, DropCause, Fate, Link, LinkConfig, LinkName, Network, NetworkConfig, NodeId, PacketEvent, PacketRecord, Path};
use proptest::prelude::*;

use crate::any_link::any_stages;
use crate::random_links::cases;

const NODES: usize = 4;
const DOWN: Duration = Duration::from_millis(3);
const LATE: Instant = Instant::from_nanos(1 << 60);

fn network(seed: u64, uplink: &LinkConfig) -> Network<u64> {
    let config = NetworkConfig { seed, nodes: (0..NODES).map(|node| format!("n{node}")).collect(), general: false };
    let link = LinkConfig { delay: Delay::constant(DOWN), ..LinkConfig::default() };
    let network = Network::new(config, |_, _| link.clone());
    network.with_access_line(AccessLine::Uplink(NodeId::new(0)), uplink.clone()).unwrap().with_relay()
}

/// Returns the events of packets that a node broadcasts with the given gaps before them \[ns\].
fn sent(network: &mut Network<u64>, from: usize, gaps: &[u64]) -> Vec<PacketEvent<u64, Path>> {
    let (mut events, mut now) = (Vec::new(), Instant::ZERO);
    for (packet, gap) in (0..).zip(gaps) {
        now += Duration::from_nanos(*gap);
        network.handle_broadcast(now, NodeId::new(from), Bytes::new(64), packet).unwrap();
        events.extend(std::iter::from_fn(|| network.poll_event()));
    }
    network.handle_timeout(LATE).unwrap();
    events.extend(std::iter::from_fn(|| network.poll_event()));
    events
}

/// An event without its path and copy: number, sending, end, fate, mark and damage.
type Told = (u64, Instant, Instant, &'static str, bool, bool);

fn told<L>(record: &PacketRecord<L>, later: Duration) -> Told {
    // What arrives damaged is found out where it arrives last.
    let reaches_the_end = matches!(record.fate, Fate::Delivered(_) | Fate::Dropped(DropCause::Checksum));
    let at = if reaches_the_end { record.at + later } else { record.at };
    (record.sequence, record.offered, at, record.fate.name(), record.marked, record.damaged)
}

properties! {
    #![proptest_config(cases(300))]

    /// The uplink does with one packet what it does by itself, and each receiver sees that: a loss, delay, copy, mark or damage is one for all.
    #[test]
    fn every_receiver_sees_what_one_link_does(seed: u64, uplink in any_stages(), gaps in proptest::collection::vec(0..20_000_u64, 1..60)) {
        let mut network = network(seed, &uplink);
        let events = sent(&mut network, 0, &gaps);
        let mut link = Link::new(seed, &LinkName::uplink("n0"), uplink);
        let (mut alone, mut now) = (Vec::new(), Instant::ZERO);
        for (packet, gap) in (0..).zip(&gaps) {
            now += Duration::from_nanos(*gap);
            link.handle_packet(now, Bytes::new(64), packet).unwrap();
            alone.extend(std::iter::from_fn(|| link.poll_event()));
        }
        link.handle_timeout(LATE).unwrap();
        alone.extend(std::iter::from_fn(|| link.poll_event()));
        let mut expected: Vec<(Told, u64)> = alone.iter().map(|event| (told(&event.record, DOWN), event.payload)).collect();
        expected.sort();
        for to in 1..NODES {
            let own = events.iter().filter(|event| event.path == Path { from: NodeId::new(0), to: NodeId::new(to) });
            let mut found: Vec<(Told, u64)> = own.map(|event| (told(&event.record, Duration::ZERO), event.payload)).collect();
            found.sort();
            prop_assert_eq!(&found, &expected, "to {}", to);
        }
        prop_assert_eq!(events.len(), (NODES - 1) * alone.len());
        let stats = network.access_stats(AccessLine::Uplink(NodeId::new(0))).unwrap();
        prop_assert_eq!((stats.offered(), stats.duplicated(), stats.in_flight()), (gaps.len() as u64, link.stats().duplicated(), 0));
    }
}

/// A node without an uplink is at the relay, and a packet to one receiver is one packet.
#[test]
fn what_needs_no_relay_is_as_without() {
    let slow = LinkConfig { delay: Delay::constant(Duration::from_millis(7)), ..LinkConfig::default() };
    let mut with = network(1, &slow);
    let at: Vec<Instant> = sent(&mut with, 1, &[0]).iter().map(|event| event.at).collect();
    assert_eq!(at, [Instant::ZERO + DOWN; NODES - 1]);
    let mut with = network(1, &slow);
    with.handle_packet(Instant::ZERO, NodeId::new(0), NodeId::new(2), Bytes::new(64), 9).unwrap();
    with.handle_timeout(LATE).unwrap();
    let events: Vec<_> = std::iter::from_fn(|| with.poll_event()).map(|event| (event.path.to.index(), event.at)).collect();
    assert_eq!(events, [(2, Instant::ZERO + DOWN + Duration::from_millis(7))]);
}

/// A driver that waits for one receiver is also woken for packets that a relay forwards to that receiver.
#[test]
fn a_receiver_behind_a_relay_is_awaited() {
    for uplink in [Delay::constant(Duration::from_millis(7)), Delay::default()] {
        let up = uplink.mean();
        let mut network = network(1, &LinkConfig { delay: uplink, ..LinkConfig::default() }).awaiting([NodeId::new(2)]);
        network.handle_broadcast(Instant::ZERO, NodeId::new(0), Bytes::new(64), 5).unwrap();
        let mut arrived = Vec::new();
        while let Some(at) = network.poll_awaited() {
            network.handle_timeout(at).unwrap();
            arrived.extend(std::iter::from_fn(|| network.poll_event()).filter(|event| event.path.to.index() == 2).map(|event| (at, event.at)));
        }
        let due = Instant::ZERO + up + DOWN;
        assert_eq!(arrived, [(due, due)]);
    }
}
