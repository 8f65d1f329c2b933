//! A packet to all receivers, against one packet to each receiver: all events are equal and in the same order. The filter drops nothing, and changes nothing.

use cohaptic_units::Instant;
use cohaptic_wan::NodeId;
use proptest::collection::vec;
use proptest::prelude::*;

use crate::random_links::{Plan, cases, drain_network, plain_config, plan, sendings};

/// Links that only delay. Nothing happens inside of such a network, so that arrivals wait to be polled.
fn plain_plan() -> impl Strategy<Value = Plan> {
    vec(plain_config(), 9).prop_map(|links| Plan { nodes: 3, links, uplinks: vec![None; 3], downlinks: vec![None; 3] })
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn a_broadcast_is_a_packet_to_each_receiver(
        plan in prop_oneof![plan(3, 0.5), plan(3, 0.01), plain_plan()],
        script in sendings(3),
        on_demand: bool,
        general: bool,
        has_filter: bool,
    ) {
        let events = |is_broadcast: bool| {
            let mut network = if on_demand { plan.build_on_demand(general) } else { plan.build(general) };
            if is_broadcast && has_filter {
                network = network.with_filter(NodeId(0), NodeId(1), |_| false).unwrap();
            }
            let (mut now, mut events) = (Instant::ZERO, Vec::new());
            for (number, sending) in (0..).zip(&script) {
                now += sending.gap;
                if is_broadcast {
                    network.handle_broadcast(now, sending.from, sending.size, number).unwrap();
                } else {
                    for to in (0..3).map(NodeId).filter(|to| *to != sending.from) {
                        network.handle_packet(now, sending.from, to, sending.size, number).unwrap();
                    }
                }
                if sending.poll {
                    events.extend(drain_network(&mut network));
                }
            }
            network.handle_timeout(Instant::MAX).unwrap();
            events.extend(drain_network(&mut network));
            events
        };
        prop_assert_eq!(events(true), events(false));
    }
}
