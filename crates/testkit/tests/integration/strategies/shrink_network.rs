//! Networks shrink to few links, and these to little.

use std::time::Duration;

use cohaptic_testkit::strategies::{ImpairedLink, ImpairedNetwork, LinkBounds, Stage, any_network, networks_like};
use cohaptic_wan::NodeId;

use super::shrink;

fn delay(link: &ImpairedLink) -> Duration {
    link.netem().delay.as_ref().map_or(Duration::ZERO, |delay| delay.time)
}

fn link(network: &ImpairedNetwork, from: u32, to: u32) -> &ImpairedLink {
    network.link(NodeId(from), NodeId(to)).unwrap()
}

/// What any network of five comes down to from fifty beginnings, and how often the test is asked at most.
fn comes_down_to(words: &str, most: u32, fails: impl Fn(&ImpairedNetwork) -> bool) {
    let mut found = 0;
    let mut steps = 0;
    for seed in 0..50 {
        let Some(shrunk) = shrink(&any_network(5), seed, &fails) else { continue };
        found += 1;
        steps = steps.max(shrunk.asked);
        assert_eq!(shrunk.least, ImpairedNetwork::words(words), "from {:?}", shrunk.first);
        assert!(shrunk.asked <= most, "{} steps from {:?}", shrunk.asked, shrunk.first);
    }
    assert_eq!(found, 50);
    eprintln!("{words}: at most {steps} steps");
}

#[test]
fn what_always_fails_fails_on_the_ideal_network() {
    comes_down_to("5 hosts", 2, |_| true);
}

#[test]
fn two_links_of_twenty() {
    comes_down_to("5 hosts; a -> c: delay 11ms; b -> a: duplicate 0.1%", 120, |network| {
        // Above 10 ms, in whole milliseconds.
        delay(link(network, 0, 2)) >= Duration::from_millis(11) && link(network, 1, 0).has(Stage::Duplicate)
    });
}

#[test]
fn one_link_of_twenty() {
    comes_down_to("5 hosts; d -> b: delay 1ms reorder 1%", 60, |network| link(network, 3, 1).has(Stage::Reorder));
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
    let fails = |network: &ImpairedNetwork| [(0, 1), (1, 2), (2, 3)].iter().map(|(a, b)| delay(link(network, *a, *b))).sum::<Duration>() >= Duration::from_millis(300);
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
