//! Equal seeds give equal fates, whatever other links exist and however often a driver polls.

use std::collections::BTreeMap;
use std::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Distribution, DropCause, Fate, Layout, Link, LinkConfig, LinkName, Loss, Network, NetworkConfig, NodeId, PacketEvent, Path};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::random_links::{
    Payload, Plan, SEED, Sending, any_config, at, cases, config, delay, drain, drain_network, jittery, link, loss, name, nanos, offers, plan,
    probability, sendings,
};

/// Instants at which a driver calls and polls a link between two packets.
#[derive(Clone, Copy, Debug)]
enum Looking {
    /// Only when all is over.
    Never,
    /// At every instant that the link asks for.
    WhenAsked,
    /// At this interval, whether anything happens or not.
    Every(Duration),
}

fn look(subject: &mut Link<Payload>, from: Instant, to: Instant, looking: Looking) -> Vec<PacketEvent<Payload>> {
    let mut events = Vec::new();
    let mut now = from;
    loop {
        let next = match looking {
            Looking::Never => return events,
            Looking::WhenAsked => subject.poll_timeout(),
            Looking::Every(step) => Some(now + step),
        };
        let Some(next) = next.filter(|next| *next <= to) else { return events };
        now = next;
        subject.handle_timeout(now).unwrap();
        events.extend(drain(subject));
    }
}

fn run(config: &LinkConfig, offered: &[(Duration, Bytes)], looking: Looking) -> Vec<PacketEvent<Payload>> {
    let mut subject = link(config.clone());
    let mut now = Instant::ZERO;
    let mut events = Vec::new();
    for ((gap, size), number) in offered.iter().zip(0..) {
        events.extend(look(&mut subject, now, now + *gap, looking));
        now += *gap;
        subject.handle_packet(now, *size, number).unwrap();
    }
    subject.handle_timeout(Instant::MAX).unwrap();
    events.extend(drain(&mut subject));
    events
}

/// Returns the events of a network for the packets of a script. The network is polled after each sending that asks for that.
fn run_network(plan: &Plan, general: bool, script: &[Sending]) -> Vec<PacketEvent<Payload, Path>> {
    let mut subject = plan.build(general);
    let mut now = Instant::ZERO;
    let mut events = Vec::new();
    for (sending, number) in script.iter().zip(0..) {
        now += sending.gap;
        subject.handle_packet(now, sending.from, sending.to, sending.size, number).unwrap();
        if sending.poll {
            events.extend(drain_network(&mut subject));
        }
    }
    subject.handle_timeout(Instant::MAX).unwrap();
    events.extend(drain_network(&mut subject));
    events
}

/// The fates of packets that are sent a microsecond apart, by sequence.
fn fates(config: &LinkConfig, count: u64) -> Vec<Fate> {
    let mut events = run(config, &vec![(nanos(1_000), Bytes::new(1)); usize::try_from(count).unwrap()], Looking::Never);
    events.sort_by_key(|event| event.sequence);
    events.into_iter().map(|event| event.fate).collect()
}

fn lost(fates: &[Fate]) -> Vec<bool> {
    fates.iter().map(|fate| *fate == Fate::Dropped(DropCause::Loss)).collect()
}

properties! {
    #![proptest_config(cases(400))]

    #[test]
    fn how_often_a_link_is_polled_changes_nothing(config in any_config(), offered in vec((0..8_000u64, 0..4u64), 1..40), step in 1..2_000u64) {
        let offered: Vec<(Duration, Bytes)> = offered.into_iter().map(|(gap, size)| (nanos(gap), Bytes::new(size))).collect();
        let never = run(&config, &offered, Looking::Never);
        // Not only the same events: in the same order.
        prop_assert_eq!(&never, &run(&config, &offered, Looking::WhenAsked));
        prop_assert_eq!(&never, &run(&config, &offered, Looking::Every(nanos(step))));
    }

    #[test]
    fn how_often_a_network_is_polled_changes_nothing(plan in prop_oneof![plan(3, 0.5), plan(3, 0.01)], script in sendings(3)) {
        let with_polls = |poll| script.iter().map(|sending| Sending { poll, ..*sending }).collect::<Vec<_>>();
        // The events are equal and in the same order, also where a driver polls between two packets of one instant.
        let sometimes = run_network(&plan, false, &script);
        prop_assert_eq!(&sometimes, &run_network(&plan, false, &with_polls(false)));
        prop_assert_eq!(&sometimes, &run_network(&plan, false, &with_polls(true)));
    }

    #[test]
    fn the_general_path_gives_the_same_events(
        plan in prop_oneof![1 => plan(3, 0.5), 1 => plan(3, 0.01)],
        script in sendings(3),
        changed in vec(any_config(), 1..4),
        layouts in vec(any::<bool>(), 1..5),
    ) {
        // In either order of the stages, also where a link has but one.
        let (mut plan, mut changed) = (plan, changed);
        for (config, is_netem) in plan.links.iter_mut().chain(&mut changed).zip(layouts.iter().cycle()) {
            config.layout = if *is_netem { Layout::Netem } else { Layout::Physical };
        }
        prop_assert_eq!(run_network(&plan, false, &script), run_network(&plan, true, &script));

        // Also when links are changed while packets are inside.
        let [mut short, mut general] = [plan.build(false), plan.build(true)];
        let mut now = Instant::ZERO;
        for (step, sending) in script.iter().enumerate() {
            now += sending.gap;
            for subject in [&mut short, &mut general] {
                subject.handle_packet(now, sending.from, sending.to, sending.size, 0).unwrap();
                if step % 8 == 7 {
                    subject.set_link(now, sending.from, sending.to, changed[step / 8 % changed.len()].clone()).unwrap();
                }
            }
            prop_assert_eq!(drain_network(&mut short), drain_network(&mut general));
        }
        for subject in [&mut short, &mut general] {
            subject.handle_timeout(Instant::MAX).unwrap();
        }
        prop_assert_eq!(drain_network(&mut short), drain_network(&mut general));
    }

    #[test]
    fn a_network_of_one_path_behaves_as_a_link(config in any_config(), changed in any_config(), offered in offers(), polls: bool, change in 0..80usize) {
        let mut alone = Link::new(SEED, &LinkName::between(&name(0), &name(1)), config.clone());
        let mut network = Plan { nodes: 2, links: vec![config; 4], uplinks: vec![None, None], downlinks: vec![None, None] }.build(false);
        let of_link = |event: PacketEvent<Payload>| (event.sequence, event.offered, event.at, event.size, event.payload, event.fate);
        let of_network = |event: PacketEvent<Payload, Path>| (event.sequence, event.offered, event.at, event.size, event.payload, event.fate);
        let mut both = [Vec::new(), Vec::new()];
        let mut now = Instant::ZERO;
        for (number, (gap, size)) in offered.into_iter().enumerate() {
            now += gap;
            alone.handle_packet(now, size, 7).unwrap();
            network.handle_packet(now, NodeId(0), NodeId(1), size, 7).unwrap();
            if number == change {
                alone.set_model(now, changed.clone()).unwrap();
                network.set_link(now, NodeId(0), NodeId(1), changed.clone()).unwrap();
            }
            if polls {
                alone.handle_timeout(now).unwrap();
                both[0].extend(drain(&mut alone).into_iter().map(of_link));
                both[1].extend(drain_network(&mut network).into_iter().map(of_network));
                // A network may name an instant at which nothing happens any more.
                prop_assert!(network.poll_timeout().unwrap_or(Instant::MAX) <= alone.poll_timeout().unwrap_or(Instant::MAX));
            }
        }
        alone.handle_timeout(Instant::MAX).unwrap();
        network.handle_timeout(Instant::MAX).unwrap();
        both[0].extend(drain(&mut alone).into_iter().map(of_link));
        both[1].extend(drain_network(&mut network).into_iter().map(of_network));
        let [of_link, of_network] = both;
        prop_assert_eq!(of_link, of_network);
        prop_assert_eq!(Some(alone.stats()), network.link_stats(NodeId(0), NodeId(1)));
    }

    /// The further node may stand at any place of the list, so that the numbers of the other nodes change.
    #[test]
    fn a_node_more_moves_no_other_paths_fates(small in plan(3, 0.01), extra in vec(any_config(), 16), script in sendings(3), more in sendings(4), place in 0..4usize) {
        let build = |names: &[usize], link: &dyn Fn(usize, usize) -> LinkConfig| {
            let config = NetworkConfig { seed: SEED, nodes: names.iter().copied().map(name).collect(), general: false };
            Network::<Payload>::new(config, |from, to| link(names[from.index()], names[to.index()]))
        };
        let mut names = vec![0, 1, 2];
        let among_three = |from: usize, to: usize| small.links[from * 3 + to].clone();
        let mut three = build(&names, &among_three);
        names.insert(place, 3);
        let mut four = build(&names, &|from, to| if from < 3 && to < 3 { among_three(from, to) } else { extra[from * 4 + to].clone() });
        let number = |node: NodeId| NodeId::new(names.iter().position(|name| *name == node.index()).unwrap());

        let mut now = Instant::ZERO;
        for (sending, other) in script.iter().zip(more.iter().cycle()) {
            now += sending.gap;
            three.handle_packet(now, sending.from, sending.to, sending.size, 0).unwrap();
            four.handle_packet(now, number(sending.from), number(sending.to), sending.size, 0).unwrap();
            if other.from.0 == 3 || other.to.0 == 3 {
                four.handle_packet(now, number(other.from), number(other.to), other.size, 0).unwrap();
            }
        }
        let by_path = |network: &mut Network<Payload>, names: &[usize]| {
            network.handle_timeout(Instant::MAX).unwrap();
            let node = |id: NodeId| names[id.index()];
            drain_network(network).into_iter().map(|event| ((node(event.path.from), node(event.path.to), event.sequence), (event.at, event.fate))).collect::<BTreeMap<_, _>>()
        };
        let alone = by_path(&mut three, &[0, 1, 2]);
        let mut joined = by_path(&mut four, &names);
        joined.retain(|(from, to, _), _| *from != 3 && *to != 3);
        prop_assert_eq!(alone, joined);
    }

    #[test]
    fn a_change_of_delay_leaves_the_losses_alone(loss in loss(), delays in (delay(), delay())) {
        let with = |delay| lost(&fates(&LinkConfig { loss: loss.clone(), delay, ..LinkConfig::default() }, 200));
        prop_assert_eq!(with(delays.0), with(delays.1));
    }

    /// Common random numbers: also, a packet lost at a probability is lost at every higher one.
    #[test]
    fn a_change_of_loss_leaves_the_jitter_alone(low in 0.0..1.0f64, high in 0.0..1.0f64, config in config(), uniform: bool) {
        let (low, high) = (low.min(high), low.max(high));
        let distribution = if uniform { Distribution::Uniform } else { Distribution::Normal };
        let with = |p| fates(&LinkConfig {
            loss: Loss::Independent(probability(p)),
            delay: jittery(nanos(50_000), nanos(20_000), distribution.clone()),
            outages: config.outages.clone(),
            ..LinkConfig::default()
        }, 200);
        for (fewer, more) in with(low).into_iter().zip(with(high)) {
            match (fewer, more) {
                (Fate::Delivered(at), Fate::Delivered(again)) => prop_assert_eq!(at, again),
                (Fate::Dropped(DropCause::Loss), more) => prop_assert_eq!(more, Fate::Dropped(DropCause::Loss)),
                (Fate::Delivered(_), more) => prop_assert_eq!(more, Fate::Dropped(DropCause::Loss)),
                (fewer, more) => prop_assert_eq!(fewer, more),
            }
        }
    }
}

#[test]
fn loss_and_jitter_of_a_packet_have_nothing_to_do_with_each_other() {
    // If both came from one stream, the packets that get through at p = 1/2 would be those with the larger draws, and all later (or sooner) than the mean.
    // n ≈ 5000 delivered, uniform law: the mean of the deviations has the standard error sd/√n; 3.29 of them is the 0.9995 quantile.
    let delay = jittery(nanos(50_000), nanos(20_000), Distribution::Uniform);
    let config = LinkConfig { delay, loss: Loss::Independent(probability(0.5)), ..LinkConfig::default() };
    let deviations: Vec<f64> = (1u64..)
        .zip(fates(&config, 10_000))
        .filter_map(|(number, fate)| if let Fate::Delivered(arrival) = fate { Some((number, arrival)) } else { None })
        .map(|(number, arrival)| (arrival - at(number * 1_000)).as_nanos() as f64 - 50_000.0)
        .collect();
    let count = deviations.len() as f64;
    let mean = deviations.iter().sum::<f64>() / count;
    assert!(mean.abs() < 3.29 * 20_000.0 / count.sqrt(), "the mean deviation of {count} delivered packets is {mean} ns");
}
