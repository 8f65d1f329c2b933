//! Networks whose driver asks for arrivals alone, and not for other events.

use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;
use proptest::prelude::*;

use crate::random_links::{Plan, cases, plain_config, plan, sendings};

/// Returns a strategy for plans of three nodes whose links decide the arrival of a packet when it is offered.
fn direct() -> BoxedStrategy<Plan> {
    let nowhere = || vec![None; 3];
    proptest::collection::vec(plain_config(), 9).prop_map(move |links| Plan { nodes: 3, links, uplinks: nowhere(), downlinks: nowhere() }).boxed()
}

properties! {
    #![proptest_config(cases(300))]

    /// Arrivals come in the same order and at the same instants, whether polled as mere arrivals, as far as the network gives those, or as events. A network
    /// that says that it has no events has none.
    #[test]
    fn mere_arrivals_are_the_events_of_their_packets(
        plan in prop_oneof![3 => direct(), 1 => plan(3, 0.5)],
        script in sendings(3),
        general: bool,
    ) {
        let (mut plain, mut subject) = (plan.build(general), plan.build(general));
        let mut now = Instant::ZERO;
        for (number, sending) in (0..).zip(&script) {
            now += sending.gap;
            let is_idle = !subject.may_have_events(now);
            for network in [&mut plain, &mut subject] {
                network.handle_timeout(now).unwrap();
            }
            let mut expected = Vec::new();
            while let Some(event) = plain.poll_event() {
                expected.push(event);
            }
            let mut found = Vec::new();
            loop {
                while let Some(event) = subject.take_mere_arrival(|event| event) {
                    found.push(event);
                }
                let Some(event) = subject.poll_event() else { break };
                found.push(event);
            }
            prop_assert!(!is_idle || found.is_empty());
            prop_assert_eq!(&found, &expected);
            for network in [&mut plain, &mut subject] {
                network.handle_packet(now, sending.from, sending.to, sending.size, number).unwrap();
            }
        }
        for from in 0..3 {
            for to in (0..3).filter(|to| *to != from) {
                let [from, to] = [from, to].map(NodeId::new);
                prop_assert_eq!(plain.link_stats(from, to), subject.link_stats(from, to));
            }
        }
    }
}
