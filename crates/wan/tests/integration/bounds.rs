//! Lower bounds, orders and rates that hold for every link, whatever its random numbers.

use std::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{
    AccessLine, Bottleneck, Delay, Distribution, DropCause, Fate, Link, LinkConfig, LinkName, Network, NetworkConfig, NetworkError, NodeId, Order,
    PacketEvent, QueueLimit, Service, TimeWentBack,
};
use proptest::prelude::*;

use crate::random_links::{
    Operation, Payload, any_config, at, bottleneck, cases, config, drain, drain_network, jittery, link, nanos, offers, operations, plan, rate,
    sendings,
};

/// Returns the events of packets offered with the given gaps before them, in the order in which the link gives them when it is polled at the end.
fn run(config: &LinkConfig, offered: &[(Duration, Bytes)]) -> Vec<PacketEvent<Payload>> {
    let mut subject = link(config.clone());
    let mut now = Instant::ZERO;
    for ((gap, size), number) in offered.iter().zip(0..) {
        now += *gap;
        subject.handle_packet(now, *size, number).unwrap();
    }
    subject.handle_timeout(Instant::MAX).unwrap();
    drain(&mut subject)
}

properties! {
    #![proptest_config(cases(600))]

    #[test]
    fn no_packet_arrives_before_the_least_delay(config in any_config(), offered in offers()) {
        for event in run(&config, &offered) {
            if let Fate::Delivered(at) = event.fate {
                prop_assert_eq!(at, event.at);
                prop_assert!(at >= event.offered + config.delay.least(), "{:?}", event);
            } else {
                prop_assert_eq!(event.at, event.offered);
            }
        }
    }

    #[test]
    fn packets_of_a_link_in_order_arrive_and_are_polled_in_sequence(config in config(), offered in offers()) {
        let config = LinkConfig { order: Order::InOrder, ..config };
        let arrived: Vec<(u64, Instant)> = run(&config, &offered).into_iter()
            .filter(|event| matches!(event.fate, Fate::Delivered(_)))
            .map(|event| (event.sequence, event.at))
            .collect();
        prop_assert!(arrived.is_sorted(), "{:?}", arrived);
    }

    #[test]
    fn events_are_polled_in_the_order_of_their_instants(config in any_config(), offered in offers()) {
        let instants: Vec<Instant> = run(&config, &offered).into_iter().map(|event| event.at).collect();
        prop_assert!(instants.is_sorted());
    }

    /// The first of the packets that leave in a window may have been sent almost wholly before it: that is the one packet more.
    #[test]
    fn no_window_carries_more_than_the_rate_and_one_packet(bottleneck in bottleneck(), offered in offers()) {
        let Service::Rate(rate) = bottleneck.service else { unreachable!("only rates are drawn") };
        let config = LinkConfig { bottleneck: Some(bottleneck.clone()), ..LinkConfig::default() };
        let departures: Vec<(Instant, Bytes)> = run(&config, &offered).into_iter()
            .filter(|event| matches!(event.fate, Fate::Delivered(_)))
            .map(|event| (event.at, bottleneck.framing.on_the_line(event.size)))
            .collect();
        for (first, (from, _)) in departures.iter().enumerate() {
            let mut bits = 0;
            for (to, size) in &departures[first + 1..] {
                bits += u128::from(size.get()) * 8;
                prop_assert!(bits * 1_000_000_000 <= rate.bits_sent(*to - *from), "{} bits from {} to {}", bits, from, to);
            }
        }
    }

    /// A timeout may name an instant at which nothing happens (a departure that a change of rate made stale), but never one that is past, and never
    /// none while a packet is inside.
    #[test]
    fn the_timeout_of_a_drained_link_is_not_past(config in any_config(), script in operations()) {
        let mut subject = link(config);
        let mut now = Instant::ZERO;
        for operation in script {
            match operation {
                Operation::Offer { gap, size } => {
                    now += gap;
                    subject.handle_packet(now, size, 0).unwrap();
                }
                Operation::Pass { gap } => {
                    now += gap;
                    subject.handle_timeout(now).unwrap();
                }
                Operation::Configure { gap, config } => {
                    now += gap;
                    subject.set_model(now, *config).unwrap();
                }
                Operation::Poll => {
                    drain(&mut subject);
                }
            }
            // A link need not even be drained: arrivals that have happened are not pending.
            prop_assert!(subject.poll_timeout().is_none_or(|next| next >= now));
            prop_assert!(subject.stats().in_flight() == 0 || subject.poll_timeout().is_some());
        }
    }

    #[test]
    fn the_timeout_of_a_drained_network_is_not_past(plan in prop_oneof![plan(3, 0.5), plan(3, 0.01)], script in sendings(3)) {
        let mut subject = plan.build(false);
        let mut now = Instant::ZERO;
        let mut last = Instant::ZERO;
        for sending in script {
            now += sending.gap;
            subject.handle_packet(now, sending.from, sending.to, sending.size, 0).unwrap();
            for event in drain_network(&mut subject) {
                prop_assert!(last <= event.at && event.at <= now, "events come in the order of their instants, none from the future");
                last = event.at;
            }
            prop_assert!(subject.poll_timeout().is_none_or(|next| next >= now));
        }
    }

    #[test]
    fn time_that_goes_back_is_refused_and_changes_nothing(config in any_config(), changed in any_config(), offered in offers(), back in 1..1_000_000u64, which in 0..3) {
        let mut subject = link(config);
        let mut now = Instant::ZERO;
        for (gap, size) in &offered {
            now += *gap + nanos(1);
            subject.handle_packet(now, *size, 0).unwrap();
        }
        let before = format!("{subject:?}");
        let past = at(now.as_nanos().saturating_sub(back));
        let refused = match which {
            0 => subject.handle_packet(past, Bytes::new(1), 0),
            1 => subject.handle_timeout(past),
            _ => subject.set_model(past, changed),
        };
        let TimeWentBack { now: given, was, .. } = refused.unwrap_err();
        prop_assert_eq!((given, was), (past, now));
        prop_assert_eq!(format!("{subject:?}"), before);
    }

    #[test]
    fn a_network_refuses_time_that_goes_back_and_links_that_are_not(plan in plan(3, 0.5), changed in any_config(), script in sendings(3), which in 0..7) {
        let mut subject = plan.build(false);
        let mut now = at(1);
        for sending in script {
            now += sending.gap;
            subject.handle_packet(now, sending.from, sending.to, sending.size, 0).unwrap();
        }
        let before = format!("{subject:?}");
        let (left, right, nobody) = (NodeId(0), NodeId(1), NodeId(3));
        let past = at(now.as_nanos() - 1);
        let later = now + nanos(1_000_000);
        let error = match which {
            0 => subject.handle_packet(past, left, right, Bytes::new(1), 0).unwrap_err(),
            1 => subject.handle_timeout(past).unwrap_err().into(),
            2 => subject.set_link(past, left, right, changed).unwrap_err(),
            3 => subject.handle_packet(later, left, left, Bytes::new(1), 0).unwrap_err(),
            4 => subject.handle_packet(later, left, nobody, Bytes::new(1), 0).unwrap_err(),
            5 => subject.set_link(later, nobody, left, changed).unwrap_err(),
            // Node 2^16 must not be taken for node 0.
            _ => subject.handle_packet(later, NodeId::new(1 << 16), right, Bytes::new(1), 0).unwrap_err(),
        };
        if let NetworkError::TimeWentBack(TimeWentBack { now: given, was, .. }) = error {
            prop_assert!(which < 3 && (given, was) == (past, now));
        } else {
            prop_assert!(which >= 3 && matches!(error, NetworkError::NoLink { .. }), "{}", error);
        }
        prop_assert_eq!(format!("{subject:?}"), before);
    }
}

#[test]
fn an_access_line_of_nobody_is_refused() {
    let plan_of_two = NetworkConfig { seed: 1, nodes: vec!["a".into(), "b".into()], general: false };
    let network: Network<Payload> = Network::new(plan_of_two, |_, _| LinkConfig::default());
    let line = AccessLine::Uplink(NodeId(2));
    assert!(matches!(network.with_access_line(line, LinkConfig::default()), Err(NetworkError::NoLine(refused)) if refused == line));
}

#[test]
fn a_change_to_in_order_holds_for_what_is_on_the_way() {
    // Sent at 0 with 10 ms; at 1 ms the delay becomes 1 ms and the order kept: what is sent at 2 ms would arrive at 3 ms, and waits for the first.
    let mut subject =
        Link::new(1, &LinkName::between("a", "b"), LinkConfig { delay: Delay::constant(Duration::from_millis(10)), ..LinkConfig::default() });
    let millis = |millis: u64| at(millis * 1_000_000);
    subject.handle_packet(millis(0), Bytes::new(1), 0).unwrap();
    let shorter = LinkConfig { delay: Delay::constant(Duration::from_millis(1)), order: Order::InOrder, ..LinkConfig::default() };
    subject.set_model(millis(1), shorter).unwrap();
    subject.handle_packet(millis(2), Bytes::new(1), 1).unwrap();
    subject.handle_timeout(millis(10)).unwrap();
    let arrivals: Vec<(Payload, Instant)> = std::iter::from_fn(|| subject.poll_event()).map(|event| (event.payload, event.at)).collect();
    assert_eq!(arrivals, [(0, millis(10)), (1, millis(10))]);
}

#[test]
fn a_limit_in_bytes_does_not_wrap_for_packets_beyond_counting() {
    // The first is on the line. The second fills a queue of 2⁶⁴−1 bytes; the third finds it full.
    let limit = Some(QueueLimit::Bytes(Bytes::new(u64::MAX)));
    let bottleneck = Bottleneck { limit, ..Bottleneck::at_rate(rate(u64::MAX)) };
    let mut subject = link(LinkConfig { bottleneck: Some(bottleneck), ..LinkConfig::default() });
    for number in 0..3 {
        subject.handle_packet(Instant::ZERO, Bytes::new(u64::MAX), number).unwrap();
    }
    let events = drain(&mut subject);
    assert_eq!(events.iter().map(|event| (event.sequence, event.fate)).collect::<Vec<_>>(), [(2, Fate::Dropped(DropCause::QueueFull))]);
}

#[test]
fn the_least_delay_is_kept_and_nearly_reached() {
    // Of n draws uniform over [least, least + 2·√3·sd], none is below least, and the smallest is within a fraction 6.91/n of the width with probability
    // 1 − (1 − 6.91/n)ⁿ ≈ 0.999. Rounding to a nanosecond is far finer: the width is 34.6 ms.
    const COUNT: u16 = 50_000;
    let mean = Duration::from_millis(24);
    let sd = Duration::from_millis(10);
    let delay = jittery(mean, sd, Distribution::Uniform);
    let offered = vec![(nanos(1_000), Bytes::new(64)); usize::from(COUNT)];
    let events = run(&LinkConfig { delay: delay.clone(), ..LinkConfig::default() }, &offered);
    let smallest = events.into_iter().map(|event| event.at - event.offered).min().unwrap();
    let width = sd.mul_f64(2.0 * 3f64.sqrt());
    assert!(smallest >= delay.least(), "{smallest:?} is below {:?}", delay.least());
    assert!(smallest < delay.least() + width.mul_f64(6.91 / f64::from(COUNT)), "{smallest:?} is far above {:?}", delay.least());
}
