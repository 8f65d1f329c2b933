//! Instants at which a network must be called so that packets to awaited receivers come out in time.

use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use cohaptic_wan::{Bottleneck, Fate, LinkConfig, Network, NetworkConfig, NodeId, PacketEvent, Path};
use proptest::prelude::*;

use crate::random_links::{Payload, Plan, Sending, cases, drain_network, plan, sendings};

const AWAITED: usize = 1;

/// An event, preceded by the instant of the call after which the network gave it.
type Called = (Instant, PacketEvent<Payload, Path>);

/// Returns the events of a network that is called at each sending, and in between whenever a packet may reach the awaited node. Also returns the instants of
/// the calls in between.
fn driven(plan: &Plan, general: bool, script: &[Sending]) -> (Vec<Called>, Vec<Instant>) {
    let mut network = plan.build(general).awaiting([NodeId::new(AWAITED), NodeId::new(77)]);
    let (mut events, mut wakes) = (Vec::new(), Vec::new());
    let mut now = Instant::ZERO;
    let last = Sending { gap: std::time::Duration::from_secs(1_000_000), ..script[0] };
    for (number, sending) in (0..).zip(script.iter().chain([&last])) {
        now += sending.gap;
        while let Some(at) = network.poll_awaited().filter(|at| *at <= now) {
            network.handle_timeout(at).unwrap();
            wakes.push(at);
            events.extend(drain_network(&mut network).into_iter().map(|event| (at, event)));
        }
        network.handle_packet(now, sending.from, sending.to, sending.size, number).unwrap();
        events.extend(drain_network(&mut network).into_iter().map(|event| (now, event)));
    }
    (events, wakes)
}

fn reaches(event: &PacketEvent<Payload, Path>) -> bool {
    event.path.to.index() == AWAITED && matches!(event.fate, Fate::Delivered(_))
}

properties! {
    #![proptest_config(cases(300))]

    /// Arrivals at the awaited node are reported at their instants, through queues, access lines and copies. All other events are those of a network without
    /// awaited nodes.
    #[test]
    fn packets_to_awaited_receivers_come_out_at_their_instant(
        plan in prop_oneof![plan(3, 0.5), plan(3, 0.01)],
        script in sendings(3),
        general: bool,
    ) {
        prop_assume!(!script.is_empty());
        let (events, _) = driven(&plan, general, &script);
        for (called, event) in events.iter().filter(|(_, event)| reaches(event)) {
            prop_assert_eq!(*called, event.at);
        }
        let mut plain = plan.build(general);
        let mut now = Instant::ZERO;
        let mut expected = Vec::new();
        for (number, sending) in (0..).zip(&script) {
            now += sending.gap;
            plain.handle_packet(now, sending.from, sending.to, sending.size, number).unwrap();
            expected.extend(drain_network(&mut plain));
        }
        let found: Vec<_> = events.into_iter().map(|(_, event)| event).filter(|event| event.at <= now).take(expected.len()).collect();
        prop_assert_eq!(found, expected);
    }
}

/// On links that only delay by a constant, a network asks for no call for the sake of nodes that are not awaited.
#[test]
fn nothing_else_wakes_where_links_decide_at_once() {
    let link = |delay: u64| LinkConfig { delay: cohaptic_wan::Delay::constant(std::time::Duration::from_millis(delay)), ..LinkConfig::default() };
    let plan = Plan { nodes: 3, links: (0..9).map(|place| link(3 + place)).collect(), uplinks: vec![None; 3], downlinks: vec![None; 3] };
    let pairs = [(0, 1), (0, 2), (1, 0), (1, 2), (2, 1), (2, 0)];
    let gap = std::time::Duration::from_millis(1);
    let sending = |(from, to): (usize, usize)| {
        let (from, to) = (NodeId::new(from), NodeId::new(to));
        Sending { gap, from, to, size: cohaptic_units::Bytes::new(64), poll: true }
    };
    let script: Vec<Sending> = pairs.into_iter().cycle().take(60).map(sending).collect();
    let (events, wakes) = driven(&plan, false, &script);
    let reached: Vec<Instant> = events.iter().filter(|(_, event)| reaches(event)).map(|(_, event)| event.at).collect();
    assert_eq!((reached.len(), wakes), (20, reached));
}

/// Links of a network in which not all nodes have links to all are numbered by their place in the lists of receivers.
#[test]
fn a_queue_of_some_links_wakes_for_its_own_receiver() {
    let rate = cohaptic_units::Rate::bits_per_sec(8_000_000).unwrap();
    let queue = LinkConfig { bottleneck: Some(Bottleneck::at_rate(rate)), ..LinkConfig::default() };
    let config = NetworkConfig { seed: 1, nodes: ["a", "b", "c"].map(String::from).to_vec(), general: true };
    let receivers = [vec![1], vec![0], vec![1]];
    let to = |from: NodeId| receivers[from.index()].iter().copied().map(NodeId::new).collect::<Vec<_>>();
    let mut network: Network<u64> = Network::of_some(config, to, |_, _| queue.clone()).awaiting([NodeId::new(1)]);
    for number in 0..3 {
        network.handle_packet(Instant::ZERO, NodeId::new(2), NodeId::new(1), cohaptic_units::Bytes::new(1000), number).unwrap();
    }
    let mut arrived = Vec::new();
    while let Some(at) = network.poll_awaited() {
        network.handle_timeout(at).unwrap();
        while let Some(event) = network.poll_event() {
            assert_eq!(event.at, at);
            arrived.push(event.at.as_nanos());
        }
    }
    // A packet of 1000 bytes is on the line for a millisecond.
    assert_eq!(arrived, [1_000_000, 2_000_000, 3_000_000]);
}
