//! Nothing appears and nothing vanishes: offered + duplicated = delivered + dropped (by cause) + in flight, at every instant, where what is in
//! flight is counted by who still has no fate.

use std::collections::BTreeMap;

use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use cohaptic_wan::{AccessLine, DropCause, Fate, Link, LinkStats, Network, NodeId};
use proptest::prelude::*;

use crate::random_links::{Operation, Payload, Plan, Sending, any_config, cases, drain, drain_network, link, operations, plan, sendings};

/// The fates known so far, by packet: a second fate for one packet is an error.
#[derive(Clone, Default)]
struct Ledger {
    fates: BTreeMap<(NodeId, NodeId, u64), Fate>,
}

const LEFT: NodeId = NodeId(0);
const RIGHT: NodeId = NodeId(1);

impl Ledger {
    fn note(&mut self, from: NodeId, to: NodeId, sequence: u64, fate: Fate) -> Result<(), TestCaseError> {
        let earlier = self.fates.insert((from, to, sequence), fate);
        prop_assert!(earlier.is_none(), "packet {} has two fates: {:?} and {:?}", sequence, earlier, fate);
        Ok(())
    }

    fn drain(&mut self, link: &mut Link<Payload>) -> Result<(), TestCaseError> {
        drain(link).into_iter().try_for_each(|event| self.note(LEFT, RIGHT, event.sequence, event.fate))
    }

    fn drain_network(&mut self, network: &mut Network<Payload>) -> Result<(), TestCaseError> {
        drain_network(network).into_iter().try_for_each(|event| self.note(event.path.from, event.path.to, event.sequence, event.fate))
    }

    fn known(&self) -> u64 {
        self.fates.len() as u64
    }

    fn delivered(&self) -> u64 {
        self.fates.values().filter(|fate| matches!(fate, Fate::Delivered(_))).count() as u64
    }

    fn dropped(&self, cause: DropCause) -> u64 {
        self.fates.values().filter(|fate| **fate == Fate::Dropped(cause)).count() as u64
    }
}

fn dropped(stats: &LinkStats) -> u64 {
    DropCause::ALL.into_iter().map(|cause| stats.dropped(cause)).sum()
}

/// The balance of one line against itself.
fn balance(stats: &LinkStats) -> Result<(), TestCaseError> {
    prop_assert_eq!(stats.offered() + stats.duplicated(), stats.delivered() + dropped(stats) + stats.in_flight());
    prop_assert_eq!(stats.dropped_in_all(), dropped(stats));
    Ok(())
}

/// Checks the counters of a link against the fates of its packets. The fates come from a drained copy of the link, so that the link itself stays as it is.
fn audit(link: &Link<Payload>, polled: &Ledger, offered: u64) -> Result<(), TestCaseError> {
    let mut ledger = polled.clone();
    balance(&link.stats())?;
    // What has arrived counts as delivered when it is polled.
    let mut drained = link.clone();
    ledger.drain(&mut drained)?;
    let stats = drained.stats();
    balance(&stats)?;
    prop_assert_eq!(stats.offered(), offered);
    prop_assert!(ledger.known() <= offered, "more fates than packets");
    prop_assert_eq!(stats.delivered(), ledger.delivered());
    for cause in DropCause::ALL {
        prop_assert_eq!(stats.dropped(cause), ledger.dropped(cause));
    }
    prop_assert_eq!(stats.in_flight(), offered - ledger.known());
    Ok(())
}

properties! {
    #![proptest_config(cases(600))]

    #[test]
    fn a_link_conserves_packets_at_every_instant(config in any_config(), script in operations()) {
        let mut subject = link(config);
        let mut ledger = Ledger::default();
        let (mut now, mut offered) = (Instant::ZERO, 0);
        for operation in script {
            match operation {
                Operation::Offer { gap, size } => {
                    now += gap;
                    subject.handle_packet(now, size, offered).unwrap();
                    offered += 1;
                }
                Operation::Pass { gap } => {
                    now += gap;
                    subject.handle_timeout(now).unwrap();
                }
                Operation::Poll => ledger.drain(&mut subject)?,
                Operation::Configure { gap, config } => {
                    now += gap;
                    subject.set_model(now, *config).unwrap();
                }
            }
            audit(&subject, &ledger, offered)?;
        }
        // At the end of time nothing is in flight any more.
        subject.handle_timeout(Instant::MAX).unwrap();
        ledger.drain(&mut subject)?;
        audit(&subject, &ledger, offered)?;
        prop_assert_eq!(ledger.known(), offered);
    }

    #[test]
    #[ignore = ".ci/nightly runs it: it takes long"]
    fn a_network_conserves_packets_on_every_line_and_end_to_end(
        plan in prop_oneof![plan(3, 0.5), plan(3, 0.01)],
        script in sendings(3),
        changes in proptest::collection::vec((0..120usize, any_config()), 0..4),
        general: bool,
    ) {
        let mut subject = plan.build(general);
        let mut ledger = Ledger::default();
        let mut offered: BTreeMap<(NodeId, NodeId), u64> = BTreeMap::new();
        let mut now = Instant::ZERO;
        for (step, Sending { gap, from, to, size, poll }) in script.into_iter().enumerate() {
            now += gap;
            subject.handle_packet(now, from, to, size, 0).unwrap();
            *offered.entry((from, to)).or_default() += 1;
            for (_, config) in changes.iter().filter(|(when, _)| *when == step) {
                subject.set_link(now, from, to, config.clone()).unwrap();
            }
            if poll {
                ledger.drain_network(&mut subject)?;
            }
            audit_network(&plan, &subject, &ledger, &offered)?;
        }
        subject.handle_timeout(Instant::MAX).unwrap();
        ledger.drain_network(&mut subject)?;
        audit_network(&plan, &subject, &ledger, &offered)?;
        prop_assert_eq!(ledger.known(), offered.values().sum::<u64>());
    }
}

/// Every line balances, each line is offered what the line before delivered, and the ends agree with the fates.
///
/// A network counts an arrival when it is polled, so the counters are those of a drained copy.
fn audit_network(plan: &Plan, network: &Network<Payload>, polled: &Ledger, offered: &BTreeMap<(NodeId, NodeId), u64>) -> Result<(), TestCaseError> {
    let mut network = network.clone();
    let mut ledger = polled.clone();
    ledger.drain_network(&mut network)?;

    let lines = |from: NodeId| plan.node_ids().filter(move |to| *to != from).map(move |to| (from, to));
    let sent = |pair: (NodeId, NodeId)| offered.get(&pair).copied().unwrap_or(0);
    let (mut in_flight, mut delivered) = (0, 0);
    let mut dropped_by_cause: BTreeMap<DropCause, u64> = BTreeMap::new();
    let mut add = |stats: &LinkStats| -> Result<(), TestCaseError> {
        balance(stats)?;
        in_flight += stats.in_flight();
        for cause in DropCause::ALL {
            *dropped_by_cause.entry(cause).or_default() += stats.dropped(cause);
        }
        Ok(())
    };
    for node in plan.node_ids() {
        let onward: u64 = lines(node).map(|(from, to)| network.link_stats(from, to).unwrap().offered()).sum();
        let handed: u64 = lines(node).map(sent).sum();
        match network.access_stats(AccessLine::Uplink(node)) {
            None => prop_assert_eq!(onward, handed),
            Some(uplink) => {
                prop_assert_eq!(uplink.offered(), handed);
                prop_assert_eq!(onward, uplink.delivered());
                add(&uplink)?;
            }
        }
        let mut arrived = 0;
        for (to, from) in lines(node) {
            let stats = network.link_stats(from, to).unwrap();
            arrived += stats.delivered();
            add(&stats)?;
        }
        match network.access_stats(AccessLine::Downlink(node)) {
            None => delivered += arrived,
            Some(downlink) => {
                prop_assert_eq!(downlink.offered(), arrived);
                delivered += downlink.delivered();
                add(&downlink)?;
            }
        }
    }
    prop_assert_eq!(delivered, ledger.delivered());
    for (cause, count) in dropped_by_cause {
        prop_assert_eq!(count, ledger.dropped(cause));
    }
    prop_assert_eq!(in_flight, offered.values().sum::<u64>() - ledger.known());
    prop_assert!(ledger.fates.keys().all(|(from, to, sequence)| *sequence < sent((*from, *to))), "a fate for a packet nobody sent");
    Ok(())
}
