//! Links and networks against the naive model: every fate and every instant, to the nanosecond.

use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Bottleneck, Delay, DropCause, Fate, LinkConfig, LinkName, Loss, NodeId, Order, Outages, QueueLimit, Service};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::naive::{Offered, fates, network_fates};
use crate::random_links::{
    BYTE_A_MICROSECOND, Operation, Plan, Sending, any_config, at, bottleneck, cases, config_with, drain, drain_network, gap, link, nanos, offers,
    operations, plan, rate, sendings, size,
};

/// The fates by sequence.
fn in_sequence(mut events: Vec<(u64, Fate)>) -> Vec<Fate> {
    events.sort_by_key(|(sequence, _)| *sequence);
    assert!(events.iter().zip(0..).all(|((sequence, _), expected)| *sequence == expected), "each packet has one fate: {events:?}");
    events.into_iter().map(|(_, fate)| fate).collect()
}

/// The fates of the packets of a link to which these configurations are given in turn, by the subject and by the model.
fn both(initial: &LinkConfig, script: &[Operation]) -> (Vec<Fate>, Vec<Fate>) {
    let mut subject = link(initial.clone());
    let mut configs = vec![(Instant::ZERO, initial.clone())];
    let mut offered = Vec::new();
    let mut now = Instant::ZERO;
    let mut events = Vec::new();
    for operation in script {
        match operation {
            Operation::Offer { gap, size } => {
                now += *gap;
                subject.handle_packet(now, *size, offered.len() as u64).unwrap();
                offered.push(Offered { moment: (now, configs.len() - 1), size: *size });
            }
            Operation::Pass { gap } => {
                now += *gap;
                subject.handle_timeout(now).unwrap();
            }
            Operation::Poll => events.extend(drain(&mut subject)),
            Operation::Configure { gap, config } => {
                now += *gap;
                subject.set_model(now, (**config).clone()).unwrap();
                configs.push((now, (**config).clone()));
            }
        }
    }
    while let Some(next) = subject.poll_timeout() {
        subject.handle_timeout(next).unwrap();
    }
    events.extend(drain(&mut subject));
    assert!(events.iter().all(|event| event.payload == event.sequence), "payloads stay with their packets");
    let events = events.into_iter().map(|event| (event.sequence, event.fate)).collect();
    (in_sequence(events), fates(&LinkName::between("left", "right"), &configs, &offered))
}

/// Sizes that a line sends before the end of time.
fn moderate(script: &[Operation]) -> Vec<Operation> {
    let small = |size: Bytes| if size > Bytes::new(1_500) { Bytes::new(1_500) } else { size };
    script
        .iter()
        .map(|operation| match operation {
            Operation::Offer { gap, size } => Operation::Offer { gap: *gap, size: small(*size) },
            Operation::Pass { .. } | Operation::Poll | Operation::Configure { .. } => operation.clone(),
        })
        .collect()
}

/// Operations whose changes never take a bottleneck away or add one: what waits then is another test's matter.
fn changes(bottlenecks: bool) -> BoxedStrategy<(LinkConfig, Vec<Operation>)> {
    let config = move || config_with(bottleneck().prop_map(move |bottleneck| bottlenecks.then_some(bottleneck)));
    let operation = prop_oneof![
        6 => (gap(), size()).prop_map(|(gap, size)| Operation::Offer { gap, size }),
        1 => gap().prop_map(|gap| Operation::Pass { gap }),
        1 => Just(Operation::Poll),
        2 => (gap(), config()).prop_map(|(gap, config)| Operation::Configure { gap, config: Box::new(config) }),
    ];
    (config(), vec(operation, 1..80)).boxed()
}

properties! {
    #![proptest_config(cases(1_500))]

    #[test]
    fn a_link_does_what_the_naive_model_says(config in any_config(), script in operations()) {
        let script: Vec<Operation> = moderate(&script).into_iter().filter(|operation| !matches!(operation, Operation::Configure { .. })).collect();
        let (subject, model) = both(&config, &script);
        prop_assert_eq!(subject, model);
    }

    #[test]
    fn a_link_that_is_changed_while_packets_are_inside_does_what_the_naive_model_says((config, script) in prop_oneof![3 => changes(true), 1 => changes(false)]) {
        let (subject, model) = both(&config, &script);
        prop_assert_eq!(subject, model);
    }

    #[test]
    fn a_rate_that_changes_in_the_middle_of_a_packet_sends_every_bit_once(
        sizes in vec(1..200u64, 1..10),
        rates in vec((1..20_000u64, 1_000..50_000_000u64), 1..10),
        mut bottleneck in bottleneck(),
    ) {
        bottleneck.limit = None;
        let config = |bits| LinkConfig { bottleneck: Some(Bottleneck { service: Service::Rate(rate(bits)), ..bottleneck.clone() }), ..LinkConfig::default() };
        let script: Vec<Operation> = sizes.iter().map(|size| Operation::Offer { gap: nanos(0), size: Bytes::new(*size) })
            .chain(rates.iter().map(|(gap, bits)| Operation::Configure { gap: nanos(*gap), config: Box::new(config(*bits)) }))
            .collect();
        let (subject, model) = both(&config(1_000_000), &script);
        prop_assert_eq!(subject, model);
    }

    #[test]
    fn a_network_does_what_the_naive_model_says(plan in prop_oneof![plan(2, 0.5), plan(3, 0.5), plan(3, 0.01), plan(4, 0.95)], general: bool, script in sendings(2)) {
        compare_network(&plan, general, &script)?;
    }

    #[test]
    fn a_network_whose_paths_share_lines_does_what_the_naive_model_says(plan in plan(3, 0.7), general: bool, script in sendings(3)) {
        compare_network(&plan, general, &script)?;
    }

    /// The lines have no randomness, and constant delays of at most 2 µs, so that many events fall on equal instants.
    #[test]
    fn lines_that_meet_at_one_instant_do_what_the_naive_model_says(mut plan in plan(3, 0.95), script in sendings(3)) {
        let lines = plan.links.iter_mut().chain(plan.uplinks.iter_mut().flatten()).chain(plan.downlinks.iter_mut().flatten());
        for line in lines {
            line.loss = Loss::None;
            line.outages = Outages::default();
            let micros = line.delay.mean().as_micros() % 3;
            line.delay = Delay::constant(nanos(u64::try_from(micros).unwrap() * 1_000));
            if let Some(bottleneck) = &mut line.bottleneck {
                bottleneck.service = Service::Rate(rate(BYTE_A_MICROSECOND));
                bottleneck.framing.overhead = 0;
            }
        }
        compare_network(&plan, false, &script)?;
    }
}

fn compare_network(plan: &Plan, general: bool, script: &[Sending]) -> Result<(), TestCaseError> {
    let mut subject = plan.build(general);
    let mut now = Instant::ZERO;
    let mut events = Vec::new();
    for sending in script {
        now += sending.gap;
        subject.handle_packet(now, sending.from, sending.to, sending.size, 0).unwrap();
        if sending.poll {
            events.extend(drain_network(&mut subject));
        }
    }
    events.extend(drain_network(&mut subject));
    while let Some(next) = subject.poll_timeout() {
        subject.handle_timeout(next).unwrap();
        events.extend(drain_network(&mut subject));
    }
    let count = events.len();
    prop_assert_eq!(count, script.len());
    let by_path = events.into_iter().map(|event| ((event.path.from, event.path.to, event.sequence), (event.at, event.fate))).collect();
    let model = network_fates(plan, script);
    prop_assert_eq!(model, by_path);
    Ok(())
}

#[test]
fn a_departure_from_a_link_makes_room_for_what_leaves_the_uplink_at_that_instant() {
    // The uplink sends a byte in a microsecond, the link in two, with room for one that waits. Packets are offered in one burst at 0: they leave the
    // uplink at 1, 2, 3, 4 µs. The link serves the first over [1, 3], and the second waits from 2 to 3; at 3 the third comes and finds room.
    // The link then serves the second until 5; the fourth comes at 4 and is dropped.
    let line = |bits, limit| LinkConfig {
        bottleneck: Some(Bottleneck { limit, ..Bottleneck::at_rate(rate(bits)) }),
        delay: Delay::default(),
        order: Order::AllowReordering,
        ..LinkConfig::default()
    };
    let byte = BYTE_A_MICROSECOND;
    let plan = Plan {
        nodes: 2,
        links: vec![line(byte / 2, Some(QueueLimit::Packets(1))); 4],
        uplinks: vec![Some(line(byte, None)), None],
        downlinks: vec![None, None],
    };
    let mut network = plan.build(false);
    for number in 0..4 {
        network.handle_packet(Instant::ZERO, NodeId(0), NodeId(1), Bytes::new(1), number).unwrap();
    }
    network.handle_timeout(at(100_000)).unwrap();
    let mut fates: Vec<(u64, Fate)> = drain_network(&mut network).into_iter().map(|event| (event.payload, event.fate)).collect();
    fates.sort_by_key(|(number, _)| *number);
    let delivered = |micros: u64| Fate::Delivered(at(micros * 1_000));
    assert_eq!(fates, [(0, delivered(3)), (1, delivered(5)), (2, delivered(7)), (3, Fate::Dropped(DropCause::QueueFull))]);
}

properties! {
    #![proptest_config(cases(300))]

    /// Packets that wait when the bottleneck is removed leave at once, in order.
    #[test]
    fn a_bottleneck_that_is_taken_away_releases_what_it_held(offered in offers(), bottleneck in bottleneck(), change in 0..200_000u64) {
        let narrow = LinkConfig { bottleneck: Some(Bottleneck { limit: None, ..bottleneck }), ..LinkConfig::default() };
        let mut now = Instant::ZERO;
        let mut subject = link(narrow.clone());
        let mut packets = Vec::new();
        for (gap, size) in &offered {
            now += *gap;
            subject.handle_packet(now, *size, packets.len() as u64).unwrap();
            packets.push(Offered { moment: (now, 0), size: *size });
        }
        let change = now + nanos(change);
        subject.set_model(change, LinkConfig::default()).unwrap();
        subject.handle_timeout(change).unwrap();
        let events = drain(&mut subject).into_iter().map(|event| (event.sequence, event.fate)).collect();
        let model: Vec<Fate> = fates(&LinkName::between("left", "right"), &[(Instant::ZERO, narrow)], &packets)
            .into_iter()
            .map(|fate| if let Fate::Delivered(at) = fate { Fate::Delivered(at.min(change)) } else { fate })
            .collect();
        prop_assert_eq!(in_sequence(events), model);
    }
}
