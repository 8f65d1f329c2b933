//! Regions of claims that are proven, not searched: every scene of a region, by boxes that are stable throughout.
//!
//! **`region-contains`**, its first region, is more than it says: there AP is stable *everywhere*, so that it contains the region of PD. Proven for each number of peers, each
//! number of them that touch, each delay and either mass; gains are a box. Peers tick together, so that a delay counts by the tick at which a sample comes into force, and whole
//! ticks are all delays.

use std::path::Path;

use cohaptic_proofs::{Guarantee, ProvenRegion};
use cohaptic_stability::{Family, KeyRange, Unwatched};

/// A scene of Figs. 3 and 4: average-position, BT = BC = 5 N·s/m.
fn figure(peers: usize, touching: usize, split_mass: bool, delay_ms: usize) -> String {
    // With nobody touching and no damping of the object a common velocity stays for ever.
    let damping = if touching == 0 { 0.01 } else { 0.0 };
    let peer = |place: usize| format!("{{ name = \"p{place}\", contact = \"{}\" }}", if place < touching { "grasp" } else { "none" });
    let peers: Vec<String> = (0..peers).map(peer).collect();
    format!(
        r#"scene = {{ duration = "1s" }}
object = {{ mass = 0.45, damping = {damping}, split-mass = {split_mass} }}
coordination = {{ strategy = "average-position", stiffness = 100.0, damping = 5.0, update = "8ms" }}
peer = {{ device = {{ mass = 0.1, damping = 5.0 }}, coupling = {{ stiffness = 1000.0, damping = 5.0 }} }}
peers = [{}]
link = {{ delay = "{delay_ms}ms" }}"#,
        peers.join(", ")
    )
}

fn proven(text: &str) -> ProvenRegion {
    let range = |text: &str| KeyRange::parse(text).unwrap();
    let keys = ["coordination.stiffness=10..1000", "peer.coupling.stiffness=500..6000"].map(range);
    let family = Family::new(text, Path::new("figure.toml"), &[], keys.to_vec()).unwrap();
    ProvenRegion::prove(&family, 10, None, &Unwatched).unwrap()
}

/// Proves the first region of `region-contains` for these numbers of peers, of peers that touch, and delays \[ms\].
fn prove(peers: impl IntoIterator<Item = usize>, touching: impl Fn(usize) -> Vec<usize>, delays: &[usize]) {
    for peers in peers {
        for touching in touching(peers) {
            for (delay_ms, split_mass) in delays.iter().flat_map(|delay| [(*delay, true), (*delay, false)]) {
                let region = proven(&figure(peers, touching, split_mass, delay_ms));
                let is_stable = region.boxes.iter().all(|one| one.guarantee == Guarantee::Stable);
                assert!(is_stable, "{peers} peers, {touching} touch, {delay_ms} ms, split mass {split_mass}: {}", region.share(Guarantee::Stable));
            }
        }
    }
}

#[test]
fn average_position_is_stable_throughout_a_region_for_three_and_six() {
    prove([3, 6], |peers| vec![1, peers], &[0, 8]);
    prove([3], |_| vec![0], &[3]);
}

/// All of the region: 396 combinations, some hundred thousand boxes.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn average_position_is_stable_throughout_the_region_in_which_it_contains_that_of_pd() {
    prove(3..=6, |peers| (0..=peers).collect(), &[0, 1, 2, 3, 4, 5, 6, 7, 8]);
}

/// A stiffness of four times the region's is too much: no proof says otherwise.
#[test]
fn beyond_the_region_boxes_are_unstable() {
    let text = figure(3, 3, true, 8);
    let keys = ["coordination.stiffness=10..4000", "peer.coupling.stiffness=500..6000"].map(|text| KeyRange::parse(text).unwrap());
    let family = Family::new(&text, Path::new("figure.toml"), &[], keys.to_vec()).unwrap();
    let region = ProvenRegion::prove(&family, 6, None, &Unwatched).unwrap();
    assert!(region.share(Guarantee::Stable) < 0.9 && region.share(Guarantee::Unstable) > 0.05, "{}", region.share(Guarantee::Stable));
}
