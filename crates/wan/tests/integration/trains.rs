//! Trains: packets that are handed in together and travel as one event.

use std::ops::ControlFlow;
use std::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Delay, LinkConfig, Network, NetworkConfig, NodeId, PacketEvent, PacketRecord, Path};
use proptest::prelude::*;

use crate::random_links::{Plan, any_config, cases, plain_config, plan, sendings};

/// Returns a strategy for plans of three nodes, most of whose links are of constant delay.
fn partly_constant() -> impl Strategy<Value = Plan> {
    let nowhere = || vec![None; 3];
    let link = prop_oneof![9 => plain_config(), 1 => any_config()];
    proptest::collection::vec(link, 9).prop_map(move |links| Plan { nodes: 3, links, uplinks: nowhere(), downlinks: nowhere() })
}

/// Payload of the packets here: size of each packet, and number of packets that were handed in.
type Payload = u64;

const fn payload(size: u64, packets: u32) -> Payload {
    size << 8 | packets as u64
}

/// Returns the records of the packets of an event.
fn packets(event: PacketEvent<Payload, Path>) -> impl Iterator<Item = PacketRecord<Path>> {
    let PacketRecord { sequence, .. } = event.record;
    let size = Bytes::new(event.payload >> 8);
    // The size of a train is the number of its packets. Packets handed in one by one are no longer than 1500 bytes, and no shorter than 100.
    let count = if event.size == size { 1 } else { event.size.get() };
    (0..count).map(move |number| PacketRecord { sequence: sequence + number, size, ..event.record })
}

fn poll(network: &mut Network<Payload>, now: Instant) -> Vec<PacketRecord<Path>> {
    network.handle_timeout(now).unwrap();
    let mut found = Vec::new();
    loop {
        while let Some(event) = network.take_mere_arrivals(ControlFlow::Break) {
            found.extend(packets(event));
        }
        let Some(event) = network.poll_event() else { return found };
        found.extend(packets(event));
    }
}

properties! {
    #![proptest_config(cases(300))]

    /// Packets of trains have the numbers, the instants and the order of packets that are handed in one by one, and are counted like them.
    #[test]
    fn a_train_is_its_packets(
        plan in prop_oneof![3 => partly_constant(), 1 => plan(3, 0.5)],
        script in sendings(3),
        lengths in proptest::collection::vec(1u32..6, 1..20),
        general: bool,
        change in proptest::option::of((0usize..40, any_config())),
    ) {
        let (mut plain, mut subject) = (plan.build(general), plan.build_on_demand(general));
        let mut now = Instant::ZERO;
        let paths = || (0..3).flat_map(|from| (0..3).filter(move |to| *to != from).map(move |to| [from, to].map(NodeId::new)));
        for (number, sending) in script.iter().enumerate() {
            now += sending.gap;
            prop_assert_eq!(poll(&mut subject, now), poll(&mut plain, now));
            if let Some((at, link)) = &change && *at == number {
                for network in [&mut plain, &mut subject] {
                    network.set_link(now, sending.from, sending.to, link.clone()).unwrap();
                }
            }
            let (count, path) = (lengths[number % lengths.len()], Path { from: sending.from, to: sending.to });
            let size = sending.size.get().clamp(100, 1500);
            for _ in 0..count {
                plain.handle_packet(now, path.from, path.to, Bytes::new(size), payload(size, 1)).unwrap();
            }
            if let Err(payload) = subject.handle_train(now, path, count, payload(size, count)) {
                for _ in 0..count {
                    subject.handle_packet(now, path.from, path.to, Bytes::new(size), payload).unwrap();
                }
            }
            for [from, to] in paths() {
                prop_assert_eq!(plain.link_stats(from, to), subject.link_stats(from, to));
                prop_assert_eq!(plain.sent(from, to), subject.sent(from, to));
            }
        }
    }
}

#[test]
fn a_link_of_constant_delay_takes_trains_and_others_do_not() {
    let delay = Duration::from_millis(5);
    let constant = || LinkConfig { delay: Delay::constant(delay), ..LinkConfig::default() };
    let config = || NetworkConfig { seed: 1, nodes: ["a".into(), "b".into()].into(), general: false };
    let path = Path { from: NodeId::new(0), to: NodeId::new(1) };
    let network = |link: LinkConfig| Network::new(config(), move |_, _| link.clone());
    let taken = |mut network: Network<Payload>, packets| network.handle_train(Instant::ZERO, path, packets, 7);
    for packets in [1, 2, 4_194_303] {
        assert_eq!(taken(network(constant()), packets), Ok(Instant::ZERO + delay));
    }
    for packets in [0, 4_194_304] {
        assert_eq!(taken(network(constant()), packets), Err(7));
    }
    assert_eq!(taken(network(LinkConfig::default()), 2), Err(7));
    let nowhere = Path { from: path.to, to: path.to };
    assert_eq!(network(constant()).handle_train(Instant::ZERO, nowhere, 2, 7), Err(7));
    // An instant before that of an earlier call is refused.
    let mut late = network(constant());
    late.handle_timeout(Instant::ZERO + delay).unwrap();
    assert_eq!(late.handle_train(Instant::ZERO, path, 2, 7), Err(7));
    let filtered = network(constant()).with_filter(path.from, path.to, |_| false).unwrap();
    assert_eq!(taken(filtered, 2), Err(7));
}
