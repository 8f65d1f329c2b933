//! Networks whose driver asks for arrivals alone, and not for other events, or asks late.

use std::ops::ControlFlow;
use std::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant, Probability};
use cohaptic_wan::{Delay, LinkConfig, Loss, NodeId, PacketEvent};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::random_links::{Plan, any_config, cases, drain_network, plain_config, plan, sendings};

/// Returns a strategy for plans of three nodes whose links decide the arrival of a packet when it is offered.
fn direct() -> BoxedStrategy<Plan> {
    let nowhere = || vec![None; 3];
    vec(plain_config(), 9).prop_map(move |links| Plan { nodes: 3, links, uplinks: nowhere(), downlinks: nowhere() }).boxed()
}

properties! {
    #![proptest_config(cases(300))]

    /// Arrivals come in the same order and at the same instants, whether polled as mere arrivals, as far as the network gives those, or as events. A network
    /// that says that it has no events has none. The driver breaks after every event, or after a few.
    #[test]
    fn mere_arrivals_are_the_events_of_their_packets(
        plan in prop_oneof![3 => direct(), 1 => plan(3, 0.5)],
        script in sendings(3),
        general: bool,
        at_once in 1..4_usize,
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
                let mut take = |event: PacketEvent<_, _>| {
                    found.push(event);
                    if found.len().is_multiple_of(at_once) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                };
                while subject.take_mere_arrivals(&mut take).is_some() {}
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

/// Returns a strategy for links of few constant delays, of which some lose half of their packets.
fn lossy_config() -> BoxedStrategy<LinkConfig> {
    let loss = prop_oneof![Just(Loss::None), Just(Loss::Independent(Probability::new(0.5).unwrap()))];
    (0..4_u64, loss)
        .prop_map(|(micros, loss)| LinkConfig { delay: Delay::constant(Duration::from_micros(micros)), loss, ..LinkConfig::default() })
        .boxed()
}

/// What a driver does at an instant.
#[derive(Clone, Debug)]
struct Step {
    /// Time since the step before \[µs\].
    gap: u64,
    from: u16,
    /// Receiver, counted from the sender; 0 for all other nodes.
    ahead: u16,
    /// Number of events, at most, that one of two drivers polls.
    polls: usize,
    /// New model of the link from node 0 to node 1.
    model: Option<Box<LinkConfig>>,
}

fn steps() -> BoxedStrategy<Vec<Step>> {
    let model = proptest::option::weighted(0.05, prop_oneof![lossy_config(), any_config()].prop_map(Box::new));
    let step = (0..3_u64, 0..3_u16, 0..3_u16, 0..4_usize, model);
    vec(step.prop_map(|(gap, from, ahead, polls, model)| Step { gap, from, ahead, polls, model }), 1..60).boxed()
}

properties! {
    #![proptest_config(cases(400))]

    /// Arrivals and drops come in one order, whether the driver polls at each instant, some events at some instants, or only at the end.
    #[test]
    fn the_order_of_events_does_not_depend_on_the_polls(links in vec(lossy_config(), 9), steps in steps(), on_demand: bool) {
        let plan = Plan { nodes: 3, links, uplinks: vec![None; 3], downlinks: vec![None; 3] };
        let events = |polls: fn(&Step) -> usize| {
            let mut network = if on_demand { plan.build_on_demand(false) } else { plan.build(false) };
            let (mut now, mut events) = (Instant::ZERO, Vec::new());
            for (number, step) in (0..).zip(&steps) {
                now += Duration::from_micros(step.gap);
                if let Some(model) = &step.model {
                    network.set_link(now, NodeId(0), NodeId(1), LinkConfig::clone(model)).unwrap();
                }
                let (from, size) = (NodeId(step.from), Bytes::new(64));
                if step.ahead == 0 {
                    network.handle_broadcast(now, from, size, number).unwrap();
                } else {
                    network.handle_packet(now, from, NodeId((step.from + step.ahead) % 3), size, number).unwrap();
                }
                if polls(step) > 0 {
                    network.handle_timeout(now).unwrap();
                    events.extend(std::iter::from_fn(|| network.poll_event()).take(polls(step)));
                }
            }
            network.handle_timeout(Instant::MAX).unwrap();
            events.extend(drain_network(&mut network));
            events
        };
        let late = events(|_| 0);
        prop_assert_eq!(&events(|step| step.polls), &late);
        // A poll at each instant: arrivals at an instant may come before a later packet of the instant, and they do in the other runs.
        prop_assert_eq!(&events(|_| usize::MAX), &late);
    }
}

/// A driver that stops in the middle of a broadcast finds the other packets at the next poll.
#[test]
fn the_rest_of_a_broadcast_waits_for_the_next_poll() {
    let link = LinkConfig { delay: Delay::constant(Duration::from_micros(5)), ..LinkConfig::default() };
    let mut network = Plan { nodes: 4, links: vec![link; 16], uplinks: vec![None; 4], downlinks: vec![None; 4] }.build(false);
    for (from, number) in [(1, 0), (2, 1)] {
        network.handle_broadcast(Instant::ZERO, NodeId(from), Bytes::new(64), number).unwrap();
    }
    network.handle_timeout(Instant::from_nanos(5000)).unwrap();
    let mut next = || network.take_mere_arrivals(ControlFlow::Break).map(|event| (event.path.from.index(), event.path.to.index()));
    let found: Vec<_> = std::iter::from_fn(&mut next).collect();
    assert_eq!(found, [(1, 0), (1, 2), (1, 3), (2, 0), (2, 1), (2, 3)]);
    assert_eq!(network.poll_event(), None);
}
