//! The edges of time and of number.

use std::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Bottleneck, Delay, Distribution, DropCause, Fate, Framing, Layout, Link, LinkConfig, LinkName, Loss, NodeId, Order};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use crate::random_links::{Payload, Plan, at, cases, drain, drain_network, jittery, link, nanos, probability, rate};

const HALF: u64 = 1 << 63;

/// Spans at and around the powers of two that end a signed or an unsigned count.
fn edge() -> BoxedStrategy<u64> {
    select(vec![0, 1, HALF - 2, HALF - 1, HALF, HALF + 1, u64::MAX - 1, u64::MAX]).boxed()
}

fn long_delay() -> BoxedStrategy<Delay> {
    // Jitter is counted with a sign: a mean up to 2^63 − 1, a deviation up to half of it.
    let mean = || edge().prop_map(|nanos| nanos.min(HALF - 1));
    prop_oneof![
        2 => edge().prop_map(|mean| Delay::constant(nanos(mean))),
        1 => Just(Delay::constant(Duration::MAX)),
        1 => (mean(), edge()).prop_map(|(mean, sd)| jittery(nanos(mean), nanos(sd.min((HALF - 1) / 2)), Distribution::Normal)),
        1 => mean().prop_map(|mean| jittery(nanos(mean), nanos(mean / 2), Distribution::Uniform)),
    ]
    .boxed()
}

fn extreme_config() -> BoxedStrategy<LinkConfig> {
    let overhead = select(vec![0, 1, i32::MAX]);
    let bottleneck = (select(vec![1, 8, u64::MAX]), overhead)
        .prop_map(|(bits, overhead)| Bottleneck { framing: Framing { overhead, cells: None }, ..Bottleneck::at_rate(rate(bits)) });
    (long_delay(), proptest::option::of(bottleneck), select(vec![Order::AllowReordering, Order::InOrder]))
        .prop_map(|(delay, bottleneck, order)| LinkConfig { delay, bottleneck, order, ..LinkConfig::default() })
        .boxed()
}

properties! {
    #![proptest_config(cases(1_000))]

    #[test]
    fn spans_at_the_edges_saturate_at_the_end_of_time(config in extreme_config(), changed in extreme_config(), offers in vec((edge(), edge()), 1..12), change in 0..12usize) {
        let mut subject = link(config.clone());
        let mut network = Plan { nodes: 2, links: vec![config.clone(); 4], uplinks: vec![Some(config), None], downlinks: vec![None, Some(changed.clone())] }.build(false);
        let count = offers.len();
        let mut instants: Vec<u64> = offers.iter().map(|(at, _)| *at).collect();
        instants.sort_unstable();
        for (number, (now, (_, size))) in instants.into_iter().zip(offers).enumerate() {
            let now = at(now);
            subject.handle_packet(now, Bytes::new(size), 0).unwrap();
            network.handle_packet(now, NodeId(0), NodeId(1), Bytes::new(size), 0).unwrap();
            if number == change {
                subject.set_model(now, changed.clone()).unwrap();
                network.set_link(now, NodeId(0), NodeId(1), changed.clone()).unwrap();
            }
        }
        subject.handle_timeout(Instant::MAX).unwrap();
        network.handle_timeout(Instant::MAX).unwrap();
        let events = drain(&mut subject);
        prop_assert_eq!(events.len(), count);
        prop_assert!(events.iter().all(|event| event.fate == Fate::Delivered(event.at) && event.at >= event.offered));
        prop_assert_eq!(subject.stats().in_flight(), 0);
        prop_assert!(subject.poll_timeout().is_none());
        prop_assert_eq!(drain_network(&mut network).len(), count);
        prop_assert!(network.poll_timeout().is_none());
    }
}

#[test]
fn a_packet_offered_at_the_end_of_time_arrives_there() {
    let mut subject = link(LinkConfig { delay: Delay::constant(nanos(HALF)), ..LinkConfig::default() });
    subject.handle_packet(Instant::MAX, Bytes::new(1), 0).unwrap();
    assert_eq!(subject.poll_timeout(), Some(Instant::MAX));
    subject.handle_timeout(Instant::MAX).unwrap();
    assert_eq!(subject.poll_event().map(|event| event.fate), Some(Fate::Delivered(Instant::MAX)));
}

#[test]
fn a_million_packets_are_in_flight_on_one_link() {
    const COUNT: u64 = 1_000_000;
    // One packet in a microsecond, ten seconds of delay: the last is sent at 1 s, the first arrives at 10 s. In both ways that a link has of keeping them.
    for order in [Order::AllowReordering, Order::InOrder] {
        let mut subject = link(LinkConfig { delay: Delay::constant(Duration::from_secs(10)), order, ..LinkConfig::default() });
        for number in 0..COUNT {
            subject.handle_packet(at(number * 1_000), Bytes::new(64), number).unwrap();
        }
        assert_eq!(subject.stats().in_flight(), COUNT);
        assert_eq!(subject.poll_timeout(), Some(at(10_000_000_000)));
        // Half of them.
        subject.handle_timeout(at(10_000_000_000 + (COUNT / 2 - 1) * 1_000)).unwrap();
        assert_eq!((subject.stats().delivered(), subject.stats().in_flight()), (COUNT / 2, COUNT / 2));
        subject.handle_timeout(Instant::MAX).unwrap();
        let mut numbers = 0..COUNT;
        while let Some(event) = subject.poll_event() {
            assert_eq!((Some(event.payload), event.at), (numbers.next(), event.offered + Duration::from_secs(10)));
        }
        assert!(numbers.is_empty());
        assert_eq!(subject.stats().mean_delay(), Some(Duration::from_secs(10)));
    }
}

#[test]
fn a_link_that_loses_everything_heals() {
    let dead = LinkConfig { loss: Loss::Independent(probability(1.0)), delay: Delay::constant(Duration::from_millis(5)), ..LinkConfig::default() };
    let healed = LinkConfig { loss: Loss::None, ..dead.clone() };
    let mut subject: Link<Payload> = Link::new(1, &LinkName::between("a", "b"), dead);
    let millis = |millis: u64| at(millis * 1_000_000);
    for number in 0..100 {
        subject.handle_packet(millis(number), Bytes::new(64), number).unwrap();
    }
    assert_eq!((subject.poll_timeout(), subject.stats().dropped(DropCause::Loss)), (None, 100));
    subject.set_model(millis(100), healed).unwrap();
    for number in 100..200 {
        subject.handle_packet(millis(number), Bytes::new(64), number).unwrap();
    }
    subject.handle_timeout(millis(1_000)).unwrap();
    let fates: Vec<Fate> = drain(&mut subject).into_iter().map(|event| event.fate).collect();
    assert!(fates[..100].iter().all(|fate| *fate == Fate::Dropped(DropCause::Loss)));
    assert!((105..205).map(millis).map(Fate::Delivered).eq(fates[100..].iter().copied()));
}

#[test]
fn a_link_without_delay_delivers_at_the_instant_of_sending() {
    for order in [Order::AllowReordering, Order::InOrder] {
        let mut subject = link(LinkConfig { order, ..LinkConfig::default() });
        let now = at(7);
        subject.handle_packet(now, Bytes::new(64), 0).unwrap();
        assert_eq!(subject.poll_timeout(), Some(now));
        subject.handle_timeout(now).unwrap();
        assert_eq!(subject.poll_event().map(|event| (event.offered, event.fate)), Some((now, Fate::Delivered(now))));
    }
}

#[test]
fn a_packet_of_no_bytes_takes_no_time_on_the_line() {
    let bottleneck = Bottleneck { limit: Some(cohaptic_wan::QueueLimit::Packets(0)), ..Bottleneck::at_rate(rate(1)) };
    let mut subject = link(LinkConfig { bottleneck: Some(bottleneck), ..LinkConfig::default() });
    // The line is idle again before the next is offered, although nothing may wait.
    for number in 0..3 {
        subject.handle_packet(at(5), Bytes::ZERO, number).unwrap();
    }
    subject.handle_timeout(at(5)).unwrap();
    assert_eq!(drain(&mut subject).into_iter().map(|event| event.fate).collect::<Vec<_>>(), [Fate::Delivered(at(5)); 3]);
}

/// A packet that waits in a queue of 1 ms a packet before 5 ms of propagation still propagates, once, when the rate moves behind the delay.
#[test]
fn a_packet_inside_goes_on_in_the_order_of_stages_it_came_in() {
    let millis = Duration::from_millis;
    let config = |layout| LinkConfig {
        bottleneck: Some(Bottleneck::at_rate(rate(8_000))),
        delay: Delay::constant(millis(5)),
        layout,
        ..LinkConfig::default()
    };
    for (first, second) in [(Layout::Physical, Layout::Netem), (Layout::Netem, Layout::Physical)] {
        let mut subject = link(config(first));
        for payload in 0..3 {
            subject.handle_packet(at(0), Bytes::new(1), payload).unwrap();
        }
        subject.set_model(at(1_500_000), config(second)).unwrap();
        subject.handle_packet(at(1_500_000), Bytes::new(1), 3).unwrap();
        subject.handle_timeout(Instant::MAX).unwrap();
        let arrived: Vec<(Payload, u64)> = drain(&mut subject).into_iter().map(|event| (event.payload, event.at.as_nanos() / 1_000)).collect();
        // Waiting for 1, 2 and 3 ms and then propagating, or the other way round: 6, 7 and 8 ms. The new packet has a line of its own: 1.5 + 6 ms.
        assert_eq!(arrived, [(0, 6_000), (1, 7_000), (3, 7_500), (2, 8_000)], "{first:?}");
    }
}
