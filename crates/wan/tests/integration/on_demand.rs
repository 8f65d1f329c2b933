//! Links made at their first use, against links made at the beginning: all events are equal.

use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use cohaptic_wan::{Network, Path};
use proptest::prelude::*;

use crate::random_links::{Payload, Plan, any_config, cases, drain_network, plan, sendings};

/// Way of sending: to one node, to all other nodes, or to all other nodes through a relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Way {
    Single,
    Broadcast,
    Relay,
}

properties! {
    #![proptest_config(cases(300))]

    #[test]
    fn when_a_link_is_made_changes_nothing(
        plan in prop_oneof![plan(3, 0.5), plan(3, 0.01)],
        script in sendings(3),
        changed in proptest::option::of((any_config(), 0..80_usize)),
        way in prop_oneof![4 => Just(Way::Single), 1 => Just(Way::Broadcast), 1 => Just(Way::Relay)],
        general: bool,
    ) {
        let events = |mut network: Network<Payload>| {
            if way == Way::Relay {
                network = network.with_relay();
            }
            let (mut now, mut events) = (Instant::ZERO, Vec::new());
            for (number, sending) in (0..).zip(&script) {
                now += sending.gap;
                if let Some((config, _)) = changed.as_ref().filter(|(_, at)| *at == number) {
                    network.set_link(now, sending.to, sending.from, config.clone()).unwrap();
                }
                match way {
                    Way::Single => network.handle_packet(now, sending.from, sending.to, sending.size, number as u64).unwrap(),
                    Way::Broadcast | Way::Relay => network.handle_broadcast(now, sending.from, sending.size, number as u64).unwrap(),
                }
                if sending.poll {
                    events.extend(drain_network(&mut network));
                }
            }
            // Before all events are polled, what is due may lie in the past.
            events.extend(drain_network(&mut network));
            while let Some(next) = network.poll_timeout() {
                network.handle_timeout(next).unwrap();
                events.extend(drain_network(&mut network));
            }
            let stats: Vec<_> = paths(&plan).map(|Path { from, to }| (network.sent(from, to), network.link_stats(from, to))).collect();
            (events, stats)
        };
        let (at_the_beginning, on_demand) = (events(plan.build(general)), events(plan.build_on_demand(general)));
        prop_assert_eq!(at_the_beginning, on_demand);
    }
}

/// Returns all pairs of nodes, including the pairs of a node and itself, which have no link.
fn paths(plan: &Plan) -> impl Iterator<Item = Path> {
    plan.node_ids().flat_map(|from| plan.node_ids().map(move |to| Path { from, to }))
}
