//! A packet to all receivers, against one packet to each receiver: all events are equal and in the same order. The filter drops nothing, and changes nothing.

use std::ops::ControlFlow;
use std::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant, Probability};
use cohaptic_wan::{Delay, Distribution, Jitter, LinkConfig, Loss, NodeId};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::random_links::{Plan, any_config, cases, drain_network, plain_config, plan, sendings};

/// Links that only delay. Nothing happens inside of such a network, so that arrivals wait to be polled.
fn plain_plan() -> BoxedStrategy<Plan> {
    vec(plain_config(), 9).prop_map(|links| Plan { nodes: 3, links, uplinks: vec![None; 3], downlinks: vec![None; 3] }).boxed()
}

properties! {
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

/// Four nodes, and links with few different constant delays: many packets of a broadcast arrive together, some of them with packets of other broadcasts, and
/// some at the instant of their sending.
fn even_plan() -> BoxedStrategy<Plan> {
    vec(even_config(), 16).prop_map(|links| Plan { nodes: 4, links, uplinks: vec![None; 4], downlinks: vec![None; 4] }).boxed()
}

fn even_config() -> BoxedStrategy<LinkConfig> {
    let micros = prop_oneof![1 => Just(0), 8 => Just(10), 2 => Just(13)];
    micros.prop_map(|micros| LinkConfig { delay: Delay::constant(Duration::from_micros(micros)), ..LinkConfig::default() }).boxed()
}

/// Four nodes, and links of which most draw losses and delays of few different nanoseconds: packets of a broadcast arrive one by one, many of them at the instant
/// of another packet.
fn uneven_plan() -> BoxedStrategy<Plan> {
    let jitter = Jitter::new(Duration::from_nanos(2), Distribution::Normal);
    let delay = Delay::with_jitter(Duration::from_micros(10), jitter).unwrap();
    let drawn = LinkConfig { delay, loss: Loss::Independent(Probability::new(0.1).unwrap()), ..LinkConfig::default() };
    let config = prop_oneof![3 => Just(drawn), 1 => even_config()];
    vec(config, 16).prop_map(|links| Plan { nodes: 4, links, uplinks: vec![None; 4], downlinks: vec![None; 4] }).boxed()
}

/// Action of a driver.
#[derive(Clone, Debug)]
enum Act {
    /// Sends a packet to all others.
    ToAll(u16),
    /// Sends a packet to one other node.
    ToOne(u16, u16),
    /// Polls events, at most that many, as a driver that is interrupted.
    Poll(usize),
    /// Changes a link, to another constant delay or to any configuration.
    Change(u16, u16, Box<LinkConfig>),
}

fn acts() -> BoxedStrategy<Vec<(u64, Act)>> {
    let ends = || (0..4_u16, 1..4_u16).prop_map(|(from, ahead)| (from, (from + ahead) % 4));
    let act = prop_oneof![
        8 => (0..4_u16).prop_map(Act::ToAll),
        2 => ends().prop_map(|(from, to)| Act::ToOne(from, to)),
        6 => (0..9_usize).prop_map(Act::Poll),
        1 => (ends(), prop_oneof![2 => even_config(), 1 => any_config()]).prop_map(|((from, to), config)| Act::Change(from, to, Box::new(config))),
    ];
    vec((0..7_u64, act), 1..80).boxed()
}

properties! {
    #![proptest_config(cases(800))]

    /// Packets of a broadcast, which are stored together, come out one by one, each at its turn among all others, whenever the driver polls.
    #[test]
    fn packets_of_a_broadcast_come_out_like_single_packets(plan in prop_oneof![even_plan(), uneven_plan()], acts in acts(), awaits: bool) {
        let build = || if awaits { plan.build(false).awaiting([NodeId(1)]) } else { plan.build(false) };
        let (mut subject, mut single) = (build(), build());
        let mut now = Instant::ZERO;
        let drained = [(0, Act::Poll(usize::MAX)), (100_000, Act::Poll(usize::MAX))];
        for (number, (gap, act)) in (0..).zip(acts.into_iter().chain(drained)) {
            now += Duration::from_micros(gap);
            let size = Bytes::new(64);
            match act {
                Act::ToAll(from) => {
                    subject.handle_broadcast(now, NodeId(from), size, number).unwrap();
                    for to in (0..4).filter(|to| *to != from) {
                        single.handle_packet(now, NodeId(from), NodeId(to), size, number).unwrap();
                    }
                }
                Act::ToOne(from, to) => {
                    for network in [&mut subject, &mut single] {
                        network.handle_packet(now, NodeId(from), NodeId(to), size, number).unwrap();
                    }
                }
                Act::Poll(most) => {
                    for network in [&mut subject, &mut single] {
                        network.handle_timeout(now).unwrap();
                    }
                    for _ in 0..most {
                        let found = subject.take_mere_arrivals(ControlFlow::Break).or_else(|| subject.poll_event());
                        prop_assert_eq!(&found, &single.poll_event());
                        if found.is_none() {
                            break;
                        }
                    }
                }
                Act::Change(from, to, config) => {
                    for network in [&mut subject, &mut single] {
                        network.set_link(now, NodeId(from), NodeId(to), (*config).clone()).unwrap();
                    }
                }
            }
            prop_assert_eq!((subject.poll_timeout(), subject.poll_awaited()), (single.poll_timeout(), single.poll_awaited()));
        }
        for (from, to) in (0..4).flat_map(|from| (0..4).map(move |to| (NodeId(from), NodeId(to)))) {
            prop_assert_eq!(subject.link_stats(from, to), single.link_stats(from, to));
        }
    }
}
