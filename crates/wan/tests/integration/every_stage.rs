//! Promises of every link, whatever its stages and its kind, tried on random links with random operations and live changes between all kinds.

use std::collections::{BTreeMap, BTreeSet};

use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Ecn, Instant};
use cohaptic_wan::{
    Discipline, Displacement, DropCause, Fate, FateLog, Layout, Link, LinkConfig, LinkModel, Network, NetworkConfig, NodeId, Order, PacketEvent,
    PacketInfo, Path,
};
use proptest::prelude::*;

use crate::any_link::{Step, all_events, any_link, any_model, any_stages, config_in, direct_config, packets, steps};
use crate::random_links::{Payload, SEED, cases, drain, drain_network, nanos};

/// The events so far, by packet and copy.
#[derive(Clone, Default)]
struct Ledger {
    ends: BTreeMap<(u64, u8), Fate>,
    copies: BTreeSet<(u64, u8)>,
    last: Instant,
}

impl Ledger {
    fn drain(&mut self, link: &mut Link<Payload>, now: Instant) -> Result<(), TestCaseError> {
        for event in drain(link) {
            prop_assert!(event.offered <= event.at && event.at <= now, "an event before its packet or in the future: {:?}", event);
            prop_assert!(self.last <= event.at, "events come in the order of their instants: {:?} after {}", event, self.last);
            prop_assert_eq!(event.payload, event.sequence);
            self.last = event.at;
            let place = (event.sequence, event.copy);
            let new = match event.fate {
                Fate::Delivered(at) => {
                    prop_assert_eq!(at, event.at);
                    self.ends.insert(place, event.fate).is_none()
                }
                Fate::Duplicated => event.copy == 1 && self.copies.insert(place),
                _ => self.ends.insert(place, event.fate).is_none(),
            };
            prop_assert!(new, "the second such fate: {:?}", event);
            prop_assert!(event.copy == 0 || self.copies.contains(&place), "a copy that nobody made: {:?}", event);
        }
        Ok(())
    }
}

/// Checks the counters of a link against the fates of its packets. The fates come from a drained copy of the link, so that the link itself stays as it is.
fn audit(link: &Link<Payload>, polled: &Ledger, offered: u64, now: Instant) -> Result<(), TestCaseError> {
    let mut ledger = polled.clone();
    // What has arrived counts as delivered when it is polled.
    let mut drained = link.clone();
    ledger.drain(&mut drained, now)?;
    let stats = drained.stats();
    let count = |wanted: &dyn Fn(&Fate) -> bool| ledger.ends.values().filter(|fate| wanted(fate)).count() as u64;
    prop_assert_eq!(stats.offered(), offered);
    prop_assert_eq!(stats.duplicated(), ledger.copies.len() as u64);
    prop_assert_eq!(stats.delivered(), count(&|fate| matches!(fate, Fate::Delivered(_))));
    for cause in DropCause::ALL {
        prop_assert_eq!(stats.dropped(cause), count(&|fate| *fate == Fate::Dropped(cause)), "{:?}", cause);
    }
    prop_assert_eq!(stats.in_flight(), offered + ledger.copies.len() as u64 - ledger.ends.len() as u64);
    prop_assert!(link.poll_timeout().is_none_or(|next| next >= now), "the next timeout is past");
    prop_assert!(stats.in_flight() == 0 || drained.poll_timeout().is_some(), "packets are inside, and nobody will wake the link");
    Ok(())
}

/// Instants at which a driver calls and polls a link between two packets.
#[derive(Clone, Copy, Debug)]
enum Looking {
    WhenAsked,
    Every(u64),
}

fn driven(model: &LinkModel, offered: &[(std::time::Duration, PacketInfo)], looking: Looking) -> Vec<PacketEvent<Payload>> {
    let mut subject = any_link(model.clone());
    let (mut now, mut events) = (Instant::ZERO, Vec::new());
    for ((gap, info), number) in offered.iter().zip(0..) {
        let until = now + *gap;
        // A long gap is looked at at its begin only.
        for _ in 0..50 {
            let next = match looking {
                Looking::WhenAsked => subject.poll_timeout(),
                Looking::Every(step) => Some(now + nanos(step)),
            };
            let Some(next) = next.filter(|next| *next <= until) else { break };
            now = next;
            subject.handle_timeout(now).unwrap();
            events.extend(drain(&mut subject));
        }
        now = until;
        subject.handle_packet(now, *info, number).unwrap();
    }
    subject.handle_timeout(Instant::MAX).unwrap();
    events.extend(drain(&mut subject));
    events
}

type Seen = (u64, u8, Instant, Instant, Bytes, Payload, Fate, bool, Option<cohaptic_wan::Damage>);

fn of_link(event: PacketEvent<Payload>) -> Seen {
    (event.sequence, event.copy, event.offered, event.at, event.size, event.payload, event.fate, event.marked, event.damage)
}

fn of_network(event: PacketEvent<Payload, Path>) -> Seen {
    // A link is the second of three lines, so that its copies have the second bit.
    (event.sequence, event.copy / 2, event.offered, event.at, event.size, event.payload, event.fate, event.marked, event.damage)
}

properties! {
    #![proptest_config(cases(240))]

    #[test]
    fn packets_are_conserved_at_every_instant(model in any_model(), script in steps()) {
        let mut subject = any_link(model);
        let mut ledger = Ledger::default();
        let (mut now, mut offered) = (Instant::ZERO, 0);
        for step in script {
            match step {
                Step::Offer { gap, info } => {
                    now += gap;
                    subject.handle_packet(now, info, offered).unwrap();
                    offered += 1;
                }
                Step::Pass { gap } => {
                    now += gap;
                    subject.handle_timeout(now).unwrap();
                }
                Step::Poll => ledger.drain(&mut subject, now)?,
                Step::Change { gap, model } => {
                    now += gap;
                    subject.set_model(now, *model).unwrap();
                }
            }
            audit(&subject, &ledger, offered, now)?;
        }
        subject.handle_timeout(Instant::MAX).unwrap();
        ledger.drain(&mut subject, Instant::MAX)?;
        audit(&subject, &ledger, offered, Instant::MAX)?;
        prop_assert_eq!(subject.stats().in_flight(), 0);
        prop_assert_eq!(subject.poll_timeout(), None);
    }

    /// The events of a link fulfil the rules of a fate log: each packet and each copy has one end, and no time goes back.
    #[test]
    fn the_events_of_a_link_are_a_fate_log(model in any_model(), offered in packets()) {
        let events = all_events(model, &offered);
        let log = FateLog::new(events.iter().map(|event| event.record));
        prop_assert_eq!(log.map(|log| log.packets()), Ok(offered.len()));
    }

    #[test]
    fn how_often_a_link_is_polled_changes_nothing(model in any_model(), offered in packets(), step in 1..5_000u64) {
        let never = all_events(model.clone(), &offered);
        prop_assert_eq!(&never, &driven(&model, &offered, Looking::WhenAsked));
        prop_assert_eq!(&never, &driven(&model, &offered, Looking::Every(step)));
    }

    #[test]
    fn a_network_of_one_path_behaves_as_a_link(model in any_model(), script in steps(), general: bool) {
        let mut alone = any_link(model.clone());
        let nodes = vec!["left".into(), "right".into()];
        let mut network: Network<Payload> = Network::new(NetworkConfig { seed: SEED, nodes, general }, |_, _| model.clone());
        let (left, right) = (NodeId(0), NodeId(1));
        let mut both: [Vec<Seen>; 2] = Default::default();
        let (mut now, mut number) = (Instant::ZERO, 0);
        for step in script {
            match step {
                Step::Offer { gap, info } => {
                    now += gap;
                    alone.handle_packet(now, info, number).unwrap();
                    network.handle_packet(now, left, right, info, number).unwrap();
                    number += 1;
                }
                Step::Pass { gap } => {
                    now += gap;
                    alone.handle_timeout(now).unwrap();
                    network.handle_timeout(now).unwrap();
                }
                Step::Poll => {
                    alone.handle_timeout(now).unwrap();
                    both[0].extend(drain(&mut alone).into_iter().map(of_link));
                    both[1].extend(drain_network(&mut network).into_iter().map(of_network));
                    // A network may name an instant at which nothing happens any more.
                    prop_assert!(network.poll_timeout().unwrap_or(Instant::MAX) <= alone.poll_timeout().unwrap_or(Instant::MAX));
                }
                Step::Change { gap, model } => {
                    now += gap;
                    alone.set_model(now, (*model).clone()).unwrap();
                    network.set_link(now, left, right, *model).unwrap();
                }
            }
        }
        alone.handle_timeout(Instant::MAX).unwrap();
        network.handle_timeout(Instant::MAX).unwrap();
        both[0].extend(drain(&mut alone).into_iter().map(of_link));
        both[1].extend(drain_network(&mut network).into_iter().map(of_network));
        let [of_link, of_network] = both;
        prop_assert_eq!(of_link, of_network);
        prop_assert_eq!(Some(alone.stats()), network.link_stats(left, right));
    }

    /// A limit that is never reached makes the link use the engine that keeps packets. Without the limit, the link decides the arrival of a packet when it is
    /// offered. Both give the same events.
    #[test]
    fn the_engine_says_what_the_function_says(config in direct_config(), changed in direct_config(), offered in packets(), change in 0..60usize) {
        let run = |limit| {
            let with = |config: &LinkConfig| LinkConfig { limit, ..config.clone() };
            let mut subject = any_link(with(&config));
            let mut now = Instant::ZERO;
            for (number, (gap, info)) in offered.iter().enumerate() {
                now += *gap;
                if number == change {
                    subject.set_model(now, with(&changed)).unwrap();
                }
                subject.handle_packet(now, *info, number as u64).unwrap();
            }
            subject.handle_timeout(Instant::MAX).unwrap();
            drain(&mut subject)
        };
        prop_assert_eq!(run(None), run(Some(u64::MAX)));
    }

    /// Every packet that does not jump takes at least the least delay of the law plus the least delay of the recorded path.
    #[test]
    fn no_packet_arrives_before_the_least_delay(mut config in any_stages(), offered in packets()) {
        if config.reorder.is_some_and(|reorder| matches!(reorder.how, Displacement::Jump { .. })) {
            config.reorder = None;
        }
        let least = config.delay.least() + config.trace.as_ref().map_or_else(Default::default, cohaptic_wan::PathTrace::least);
        for event in all_events(config, &offered) {
            if matches!(event.fate, Fate::Delivered(_) | Fate::Dropped(DropCause::Checksum)) {
                prop_assert!(event.at >= event.offered + least, "{:?}", event);
            }
        }
    }

    /// Unless packets are held back on purpose, a link in order is a first-in-first-out queue.
    #[test]
    fn packets_of_a_link_in_order_arrive_in_sequence(config in config_in(Layout::Physical), mut offered in packets()) {
        let config = LinkConfig { order: Order::InOrder, reorder: None, ..config };
        // DualPI2 serves two queues, and a packet of one queue may pass the packets of the other queue. Packets without ECN all take the C queue.
        if config.bottleneck.as_ref().is_some_and(|bottleneck| matches!(bottleneck.discipline, Discipline::DualPi2(_))) {
            offered.iter_mut().for_each(|(_, info)| info.ecn = Ecn::NotCapable);
        }
        let arrived: Vec<_> = all_events(config, &offered).into_iter()
            .filter(|event| matches!(event.fate, Fate::Delivered(_)))
            .map(|event| (event.sequence, event.copy))
            .collect();
        prop_assert!(arrived.is_sorted(), "{:?}", arrived);
    }
}
