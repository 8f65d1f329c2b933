//! Drawn links: every stage occurs in every form, equal seeds give equal links, and the links account for every packet.

use std::collections::BTreeSet;

use cohaptic_testkit::Testbed;
use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::{ImpairedLink, ImpairedNetwork, Stage, any_link, any_network};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Fate, Link, LinkName, Network, NodeId};

use super::{runner, sample};

fn share(links: &[ImpairedLink], is: impl Fn(&ImpairedLink) -> bool) -> f64 {
    f64::from(u32::try_from(links.iter().filter(|link| is(link)).count()).unwrap()) / f64::from(u32::try_from(links.len()).unwrap())
}

#[test]
fn every_stage_is_drawn_in_every_form() {
    let links = sample(&any_link(), 11, 4_000);
    for stage in Stage::ALL {
        // One in three; a delay counts only if neither jitter nor reordering is there, with 4/9. Five standard deviations of 4000 draws.
        let expected: f64 = if stage == Stage::Delay { 4.0 / 27.0 } else { 1.0 / 3.0 };
        let sd = (expected * (1.0 - expected) / 4_000.0).sqrt();
        let found = share(&links, |link| link.has(stage));
        assert!((found - expected).abs() < 5.0 * sd, "{stage}: {found}");
    }
    // The ideal link and a single impairment are drawn too: (2/3)⁹ = 2.6 %, of one stage 9 · (2/3)⁸ / 3 = 11.7 % at least.
    assert!((0.014..0.039).contains(&share(&links, ImpairedLink::is_ideal)));
    assert!(share(&links, |link| link.stages().len() == 1) > 0.09);
    for words in [
        "distribution normal",
        "distribution pareto ",
        "distribution paretonormal",
        "loss gemodel",
        "loss state",
        "gap ",
        "slot distribution",
        "packets",
    ] {
        assert!(share(&links, |link| format!("{link} ").contains(words)) > 0.005, "{words}");
    }
}

#[test]
fn the_same_seed_gives_the_same() {
    assert_eq!(sample(&any_link(), 1, 100), sample(&any_link(), 1, 100));
    assert_ne!(sample(&any_link(), 1, 100), sample(&any_link(), 2, 100));
    assert_eq!(sample(&any_network(4), 1, 20), sample(&any_network(4), 1, 20));
}

/// Runs a bed that loses every second packet in 20 cases of a property. Returns the sets of packets that have arrived.
fn arrivals(with_seed: bool) -> BTreeSet<Vec<u8>> {
    let seen = std::cell::RefCell::new(BTreeSet::new());
    let case = |seed: u64| {
        let bed = Testbed::new(["a", "b"]).links("loss 50%");
        let bed = if with_seed { bed.seed(seed) } else { bed };
        let arrived = bed.run(|bed| async move {
            let (from, to) = (bed.host("a").bind("0.0.0.0:1").unwrap(), bed.host("b").bind("0.0.0.0:1").unwrap());
            for number in 0..64 {
                from.send_to(&[number], "b:1").await.unwrap();
            }
            let mut number = [0];
            std::iter::from_fn(|| to.try_recv(&mut number).ok().map(|_| number[0])).collect::<Vec<u8>>()
        });
        seen.borrow_mut().insert(arrived);
        Ok(())
    };
    runner(5, 20).run(&any::<u64>().no_shrink(), case).unwrap();
    seen.into_inner()
}

/// The seed of a bed follows from the place of the run, and not from the case.
#[test]
fn all_cases_of_a_property_lose_the_same_packets_unless_the_property_draws_the_seed() {
    assert_eq!(arrivals(false).len(), 1);
    assert_eq!(arrivals(true).len(), 20);
}

#[test]
fn networks_have_ideal_links_among_others() {
    let networks = sample(&any_network(5), 4, 300);
    let counts: Vec<usize> = networks.iter().map(|network| network.impaired().count()).collect();
    assert!(counts.iter().any(|count| *count <= 3) && counts.iter().any(|count| *count >= 18));
    assert!(networks.iter().all(|network| network.hosts() == 5 && network.links().count() == 20));
}

proptest! {
    #[test]
    fn links_keep_account_of_their_packets(link in any_link(), gap in 0..3_000_000_u64, seed in any::<u64>()) {
        let mut subject = Link::new(seed, &LinkName::between("left", "right"), &link);
        let mut now = Instant::ZERO;
        // Counted apart from the link: delivered, dropped, duplicated.
        let mut counts = [0_u64; 3];
        let mut count = |subject: &mut Link<u64>| {
            while let Some(event) = subject.poll_event() {
                counts[match event.fate {
                    Fate::Delivered(_) => 0,
                    Fate::Dropped(_) => 1,
                    Fate::Duplicated => 2,
                }] += 1;
            }
            let stats = subject.stats();
            assert_eq!(counts, [stats.delivered(), stats.dropped_in_all(), stats.duplicated()]);
            stats.offered() + counts[2] - counts[0] - counts[1]
        };
        for number in 0..50_u64 {
            subject.handle_packet(now, Bytes::new(100), number).unwrap();
            let inside = count(&mut subject);
            prop_assert_eq!(inside, subject.stats().in_flight());
            now = Instant::from_nanos(now.as_nanos() + gap);
        }
        while let Some(next) = subject.poll_timeout() {
            subject.handle_timeout(next).unwrap();
            count(&mut subject);
        }
        prop_assert_eq!(count(&mut subject), 0);
        prop_assert_eq!(subject.stats().offered(), 50);
    }

    #[test]
    fn networks_are_networks(network in any_network(3)) {
        let mut subject: Network<u32> = Network::new(network.config(5), |from, to| network.model(from, to));
        for number in 0..20 {
            for from in 0..3 {
                subject.handle_broadcast(Instant::ZERO, NodeId(from), Bytes::new(64), number).unwrap();
            }
        }
        subject.handle_timeout(Instant::MAX).unwrap();
        while subject.poll_event().is_some() {}
        for (from, to, link) in network.links() {
            let stats = subject.link_stats(from, to).unwrap();
            prop_assert_eq!(stats.offered(), 20);
            if link.is_ideal() {
                prop_assert_eq!(stats.delivered(), 20);
            }
        }
        prop_assert_eq!(subject.link_stats(NodeId(0), NodeId(0)), None);
        prop_assert!(ImpairedNetwork::ideal(3).impaired().next().is_none());
    }
}
