//! Random scenes: each can be read, and each shrinks to the calmest scene that still fails.

use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::scene::{AnyScene, Draft, DraftHand, any_scene, scenes_like};
use cohaptic_testkit::strategies::{ImpairedNetwork, LinkBounds, Stage};

use super::{sample, shrink};

/// Checks that every failing scene, of twenty seeds, shrinks to a calm scene of two peers with the given change and network, in at most `most` runs.
fn comes_down_to(change: impl Fn(&mut Draft), network: &str, most: u32, fails: impl Fn(&AnyScene) -> bool) {
    let mut found = 0;
    for seed in 0..20 {
        let Some(shrunk) = shrink(&any_scene(), seed, &fails) else { continue };
        found += 1;
        let mut calm = Draft { duration: 100, ..Draft::calm(2) };
        change(&mut calm);
        let least = shrunk.least.draft();
        // Fields in which no value is worse than another.
        (calm.seed, calm.strategy, calm.split_mass) = (least.seed, least.strategy, least.split_mass);
        for (peer, found) in calm.peers.iter_mut().zip(&least.peers) {
            peer.name.clone_from(&found.name);
        }
        calm.links.clone_from(&least.links);
        assert_eq!(least, calm, "from {}", shrunk.first);
        assert_eq!(shrunk.least.network(), &ImpairedNetwork::words(network));
        assert!(shrunk.asked <= most, "{} steps from {}", shrunk.asked, shrunk.first);
    }
    assert_eq!(found, 20);
}

#[test]
fn what_always_fails_fails_with_two_calm_peers() {
    comes_down_to(|_| {}, "2 hosts", 60, |_| true);
}

#[test]
fn a_number_comes_down_to_its_threshold() {
    comes_down_to(|draft| draft.mass = 1.2, "2 hosts", 80, |scene| scene.draft().mass >= 1.2);
    comes_down_to(|draft| draft.mass = 0.25, "2 hosts", 80, |scene| scene.draft().mass <= 0.25);
    comes_down_to(|draft| draft.update = 4_000, "2 hosts", 80, |scene| scene.draft().update >= 4_000);
    comes_down_to(|draft| draft.damping = 0.5, "2 hosts", 80, |scene| scene.draft().damping >= 0.5);
}

#[test]
fn a_peer_and_a_link_that_fail_together() {
    let fails = |scene: &AnyScene| {
        let late = scene.draft().peers[0].compute_delay;
        late && scene.network().impaired().any(|(from, _, link)| from.0 == 0 && link.has(Stage::Loss))
    };
    comes_down_to(|draft| draft.peers[0].compute_delay = true, "2 hosts; a -> b: loss 0.1%", 100, fails);
}

#[test]
fn three_peers_that_are_needed_stay() {
    for seed in 0..10 {
        let least = shrink(&any_scene(), seed, |scene| scene.draft().peers.len() >= 3).unwrap().least;
        assert_eq!(least.draft().peers.len(), 3);
        let least = shrink(&scenes_like(4..=5, LinkBounds::any()), seed, |_| true).unwrap().least;
        assert_eq!(least.draft().peers.len(), 4);
    }
}

#[test]
fn a_hand_comes_down_to_a_constant_force() {
    for seed in 0..10 {
        let moves = |scene: &AnyScene| scene.draft().peers.iter().any(|peer| !matches!(peer.hand, DraftHand::None));
        let least = shrink(&any_scene(), seed, moves).unwrap().least.draft();
        let hands: Vec<_> = least.peers.iter().map(|peer| peer.hand).filter(|hand| *hand != DraftHand::None).collect();
        assert!(matches!(hands[..], [DraftHand::Force([x, y, z])] if x.abs() + y.abs() + z.abs() <= 0.0), "{hands:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 30, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_scene_can_be_read(scene in any_scene()) {
        let read = scene.read();
        prop_assert!(read.is_ok(), "{}", read.unwrap_err());
        let read = read.unwrap();
        prop_assert_eq!(read.peers.len(), scene.network().hosts());
        prop_assert!((2..=6).contains(&read.peers.len()));
        // The text is all that a file needs.
        prop_assert_eq!(cohaptic_scene::Scene::parse(&scene.to_string(), "pasted.toml".as_ref(), &[]).unwrap().peers.len(), read.peers.len());
    }

    #[test]
    fn every_scene_on_the_way_can_be_read(seed in any::<u64>(), mass in 0.1..1.9) {
        let refused = std::cell::Cell::new(None);
        let _ = shrink(&any_scene(), seed, |scene| {
            if let Err(error) = scene.read() {
                refused.set(Some(error.to_string()));
            }
            scene.draft().mass >= mass && !scene.network().impaired().any(|(_, _, link)| link.has(Stage::Rate))
        });
        prop_assert_eq!(refused.take(), None);
    }
}

#[test]
fn everything_is_drawn() {
    let scenes: Vec<String> = sample(&any_scene(), 3, 300).iter().map(ToString::to_string).collect();
    let words = [
        "average-position",
        "proportional-derivative",
        "enclosure",
        "rk4",
        "semi-implicit-euler",
        "axes = 1",
        "axes = 2",
        "axes = 3",
        "push",
        "grasp",
        "contact = \"none\"",
        "arm = ",
        "sine = ",
        "force = ",
        "split-mass = true",
        "split-mass = false",
        "compute-delay = 1",
        "netem = ",
    ];
    for word in words {
        assert!(scenes.iter().filter(|scene| scene.contains(word)).count() > 15, "{word}");
    }
    assert_eq!(sample(&any_scene(), 3, 10), sample(&any_scene(), 3, 10));
}

#[test]
#[should_panic(expected = "scenes cannot have 1 to 3 peers: expected a range within 2 to 100 peers")]
fn a_scene_of_one_is_not_drawn() {
    let _ = scenes_like(1..=3, LinkBounds::any());
}
