//! Networks shrink to few links with small impairments.

use std::time::Duration;

use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::proptest::sample::{select, subsequence};
use cohaptic_testkit::strategies::{ImpairedLink, ImpairedNetwork, LinkBounds, Stage, any_network, networks_like};
use cohaptic_wan::NodeId;

use super::shrink;

fn delay(link: &ImpairedLink) -> Duration {
    link.netem().delay.as_ref().map_or(Duration::ZERO, |delay| delay.time)
}

fn link(network: &ImpairedNetwork, from: u16, to: u16) -> &ImpairedLink {
    network.link(NodeId(from), NodeId(to)).unwrap()
}

/// Checks that every failing network of five hosts, of fifty seeds, shrinks to the network `words`, in at most `most` runs of the test.
fn comes_down_to(words: &str, most: u32, fails: impl Fn(&ImpairedNetwork) -> bool) {
    let mut found = 0;
    for seed in 0..50 {
        let Some(shrunk) = shrink(&any_network(5), seed, &fails) else { continue };
        found += 1;
        assert_eq!(shrunk.least, ImpairedNetwork::words(words), "from {:?}", shrunk.first);
        assert!(shrunk.asked <= most, "{} steps from {:?}", shrunk.asked, shrunk.first);
    }
    assert_eq!(found, 50);
}

#[test]
fn what_always_fails_fails_on_the_ideal_network() {
    comes_down_to("5 hosts", 2, |_| true);
}

#[test]
fn two_links_of_twenty() {
    comes_down_to("5 hosts; a -> c: delay 11ms; b -> a: duplicate 0.1%", 60, |network| {
        // Above 10 ms, in whole milliseconds.
        delay(link(network, 0, 2)) >= Duration::from_millis(11) && link(network, 1, 0).has(Stage::Duplicate)
    });
}

#[test]
fn one_link_of_twenty() {
    comes_down_to("5 hosts; d -> b: delay 1ms reorder 1%", 30, |network| link(network, 3, 1).has(Stage::Reorder));
}

#[test]
fn any_link_that_loses_leaves_one() {
    for seed in 0..50 {
        let shrunk = shrink(&any_network(5), seed, |network| network.links().any(|(_, _, link)| link.has(Stage::Loss))).unwrap();
        let words: Vec<_> = shrunk.least.impaired().map(|(_, _, link)| link.to_string()).collect();
        assert_eq!(words, ["loss 0.1%"], "from {:?}", shrunk.first);
        assert!(shrunk.asked < 60, "{} steps", shrunk.asked);
    }
}

#[test]
fn three_links_that_take_long_together() {
    // A sum has many least values; each is one: no link can go, and no delay can be less by a step of two digits.
    let fails = |network: &ImpairedNetwork| {
        [(0, 1), (1, 2), (2, 3)].iter().map(|(a, b)| delay(link(network, *a, *b))).sum::<Duration>() >= Duration::from_millis(300)
    };
    for seed in 0..30 {
        let Some(shrunk) = shrink(&any_network(4), seed, fails) else { continue };
        assert!(fails(&shrunk.least) && shrunk.asked < 200, "{} steps to {}", shrunk.asked, shrunk.least);
        for (from, to, _) in shrunk.least.impaired() {
            assert!(!fails(&shrunk.least.clone().with_link(from, to, ImpairedLink::ideal())), "{}", shrunk.least);
        }
    }
}

#[test]
fn required_stages_stay_in_every_link() {
    let bounds = LinkBounds::any().always(Stage::Delay);
    for seed in 0..10 {
        let least = shrink(&networks_like(3, bounds.clone()), seed, |_| true).unwrap().least;
        assert!(least.links().all(|(_, _, link)| link.to_string() == "delay 1ms"), "{least}");
    }
}

/// Impairment of a link with which a program fails: at least this delay, jitter, loss, share of copies or share of reordered packets, or at most this rate.
#[derive(Clone, Copy, Debug)]
enum Weakness {
    Delay(u64),
    Jitter(u64),
    Loss(u32),
    Duplicate(u32),
    Reorder(u32),
    Rate(u64),
}

impl Weakness {
    fn shows(self, link: &ImpairedLink) -> bool {
        let netem = link.netem();
        let share = |chance: Option<cohaptic_wan::netem::ChanceSpec>, percent: u32| chance.is_some_and(|c| c.percent.get() >= f64::from(percent));
        match self {
            Self::Delay(ms) => delay(link) >= Duration::from_millis(ms),
            Self::Jitter(ms) => {
                netem.delay.as_ref().and_then(|delay| delay.jitter.as_ref()).is_some_and(|jitter| jitter.time >= Duration::from_millis(ms))
            }
            Self::Loss(percent) => link.config().loss.mean().unwrap() >= f64::from(percent) / 100.0,
            Self::Duplicate(percent) => share(netem.duplicate, percent),
            Self::Reorder(percent) => share(netem.reorder.map(|reorder| reorder.chance), percent),
            Self::Rate(kbit) => netem.rate.is_some_and(|rate| rate.bytes_per_sec.get() <= 125 * kbit),
        }
    }

    fn least(self) -> String {
        match self {
            Self::Delay(ms) => format!("delay {ms}ms"),
            Self::Jitter(ms) => format!("delay {ms}ms {ms}ms"),
            Self::Loss(percent) => format!("loss {percent}%"),
            Self::Duplicate(percent) => format!("duplicate {percent}%"),
            Self::Reorder(percent) => format!("delay 1ms reorder {percent}%"),
            Self::Rate(kbit) => ImpairedLink::words(&format!("rate {kbit}kbit")).to_string(),
        }
    }
}

fn weakness() -> impl Strategy<Value = Weakness> {
    let round = select(vec![1_u64, 2, 7, 10, 11, 24, 60]);
    prop_oneof![
        round.clone().prop_map(Weakness::Delay),
        round.prop_map(Weakness::Jitter),
        (1..15_u32).prop_map(Weakness::Loss),
        (1..10_u32).prop_map(Weakness::Duplicate),
        (1..25_u32).prop_map(Weakness::Reorder),
        select(vec![1_000_u64, 1_500, 20_000]).prop_map(Weakness::Rate),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_a_program_cannot_stand_is_all_that_is_left(
        pairs in subsequence((0..20_u16).collect::<Vec<_>>(), 1..=2), weaknesses in (weakness(), weakness()), seed in any::<u64>()
    ) {
        // The n-th ordered pair of five hosts.
        let pairs = pairs.into_iter().map(|n| (n / 4, (n / 4 + 1 + n % 4) % 5));
        let planted: Vec<_> = pairs.zip([weaknesses.0, weaknesses.1]).collect();
        let fails = |network: &ImpairedNetwork| planted.iter().all(|((from, to), weakness)| weakness.shows(link(network, *from, *to)));
        let Some(shrunk) = shrink(&any_network(5), seed, fails) else { return Ok(()) };
        let least = planted.iter().fold(ImpairedNetwork::ideal(5), |network, ((from, to), weakness)| {
            network.with_link(NodeId(*from), NodeId(*to), ImpairedLink::words(&weakness.least()))
        });
        prop_assert_eq!(&shrunk.least, &least, "from {:?}", shrunk.first);
        prop_assert!(shrunk.asked < 100, "{} steps", shrunk.asked);
    }
}

#[test]
fn nats_go_first_and_those_that_stay_become_more_open() {
    let has = |network: &ImpairedNetwork, kinds: &[&str]| network.nats().any(|(_, words)| kinds.contains(&&*words));
    for (words, fails) in [
        ("3 hosts", &(|_: &ImpairedNetwork| true) as &dyn Fn(&ImpairedNetwork) -> bool),
        ("3 hosts; nat c: open", &|network| network.nats().any(|(host, _)| host == NodeId(2))),
        ("3 hosts; nat c: strict", &|network| network.nats().any(|(host, words)| host == NodeId(2) && words == "strict")),
        ("3 hosts; nat a: address; nat c: open", &|network| {
            network.nats().count() == 2 && !has(network, &["cgnat"]) && has(network, &["address", "home"])
        }),
    ] {
        let shrunk: Vec<ImpairedNetwork> =
            (0..200).filter_map(|seed| shrink(&any_network(3).behind_nats([0, 2]), seed, fails)).map(|shrunk| shrunk.least).collect();
        assert!(shrunk.len() > 10 && shrunk.contains(&ImpairedNetwork::words(words)), "{words}: {shrunk:?}");
        // A case in which one of two hosts must have a NAT that is not open can end with either host behind the NAT.
        assert!(words.contains("address") || shrunk.iter().all(|least| *least == ImpairedNetwork::words(words)), "{words}");
        assert!(shrunk.iter().all(|least| least.stages() == 0));
    }
}
