//! The bug shows only when an acknowledgement is reordered behind a retransmission.

use std::cell::Cell;
use std::collections::BTreeMap;

use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::proptest::test_runner::TestRunner;
use cohaptic_testkit::strategies::{LinkBounds, Stage, any_network, networks_like};
use reliable_udp::Event;

use crate::transfer::transfer;

fn runner(cases: u32) -> TestRunner {
    TestRunner::new(ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() })
}

/// Returns whether a transmission was acknowledged after its message had been sent again.
fn is_acknowledged_behind_a_retransmission(events: &[Event]) -> bool {
    let (mut message_of, mut last_of) = (BTreeMap::new(), BTreeMap::new());
    events.iter().any(|event| match event {
        Event::Sent { transmission, message } => {
            message_of.insert(*transmission, *message);
            last_of.insert(*message, *transmission);
            false
        }
        Event::Acknowledged { transmission } => last_of[&message_of[transmission]] > *transmission,
    })
}

#[test]
fn whenever_messages_are_missing_an_acknowledgement_came_behind_a_retransmission() {
    let (failed, passed) = (Cell::new(0), Cell::new(0));
    let ran = runner(1000).run(&any_network(2), |network| {
        let outcome = transfer::<false>(&network);
        let count = if outcome.missing.is_empty() { &passed } else { &failed };
        count.set(count.get() + 1);
        prop_assert!(outcome.missing.is_empty() || is_acknowledged_behind_a_retransmission(&outcome.events));
        Ok(())
    });
    ran.unwrap();
    assert!(failed.get() > 100 && passed.get() > 100, "{} failed, {} passed", failed.get(), passed.get());
}

#[test]
fn no_impairment_that_keeps_the_order_of_packets_shows_it() {
    for stage in Stage::ALL.into_iter().filter(|stage| !matches!(stage, Stage::Jitter | Stage::Reorder)) {
        let ran = runner(100).run(&networks_like(2, LinkBounds::ideal().always(stage)), |network| {
            prop_assert_eq!(transfer::<false>(&network).missing, []);
            Ok(())
        });
        assert!(ran.is_ok(), "{stage}: {ran:?}");
    }
    // Nor do all of them together.
    let all = LinkBounds::any().never(Stage::Jitter).never(Stage::Reorder);
    let ran = runner(500).run(&networks_like(2, all), |network| {
        prop_assert_eq!(transfer::<false>(&network).missing, []);
        Ok(())
    });
    ran.unwrap();
}
