//! What dead bands keep, and what they do to the bound on damping.
//!
//! **Claim** (derived in `docs/claims.md`). Without delay and loss, at each instant at which a peer may send, the state that the others hold of it is within the thresholds of its
//! own: ‖v − v₀‖ < part·(‖v₀‖ + 10⁻⁵ m/s) and ‖x − x₀‖ < distance.

use std::collections::BTreeSet;

use cohaptic_harness::Model;
use cohaptic_peer::SendWhen;
use cohaptic_scene::Scene;
use cohaptic_tests::{Draft, Log, drafts, run};
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::claims::cases;
use crate::claims::energy::springs;
use crate::claims::injected::{Injected, stored_at_first};

/// The ticks at which a peer has sent.
fn sent_at(log: &Log, peer: usize) -> BTreeSet<u64> {
    log.packets.iter().filter(|packet| packet.path.from.index() == peer).map(|packet| packet.offered.as_nanos()).collect()
}

fn read(name: &str, changes: &[&str]) -> Scene {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios").join(name);
    let changes: Vec<String> = changes.iter().copied().map(str::to_owned).collect();
    Scene::read(&file, &changes).unwrap_or_else(|error| panic!("{error}"))
}

properties! {
    #![proptest_config(cases(100))]

    #[test]
    fn what_is_held_is_within_the_thresholds(
        mut draft in springs(),
        velocity in 0.01..0.99,
        position in 1e-5..1e-2,
    ) {
        draft.links.clear();
        draft.link = String::new();
        draft.send_when = Some(SendWhen { velocity: Some(velocity), position: Some(position), heartbeat: None });
        let scene = draft.scene();
        let log = run(&scene, Model::Least);
        let every = scene.samples_every(0);
        for peer in 0..scene.peers.len() {
            let (sent, mut last) = (sent_at(&log, peer), None);
            for (tick, row) in log.of(peer).into_iter().enumerate() {
                if tick as u64 % every != scene.peers[peer].phase {
                    prop_assert!(!sent.contains(&row.at.as_nanos()));
                    continue;
                }
                if sent.contains(&row.at.as_nanos()) {
                    last = Some(row.object);
                }
                let held = last.expect("the first sample is always sent");
                let (v, held_v) = (row.object.velocity[0], held.velocity[0]);
                prop_assert!((v - held_v).abs() < velocity * (held_v.abs() + 1e-5) || row.object == held);
                prop_assert!((row.object.position[0] - held.position[0]).abs() < position);
            }
        }
    }

    /// With a dead band of nothing every sample is sent, and with a heartbeat of the period too.
    #[test]
    fn a_dead_band_of_nothing_changes_nothing(mut draft in drafts::anything()) {
        prop_assume!(!draft.strategy.kind(&draft.settings).is_personal());
        draft.send_when = None;
        let all = run(&draft.scene(), Model::Least);
        draft.send_when = Some(SendWhen { velocity: Some(0.0), position: None, heartbeat: None });
        prop_assert_eq!(run(&draft.scene(), Model::Least), all);
    }
}

/// Three users whose hands move out of phase, at 1 kHz over 8 ms: a quarter of the samples is sent. By a simulation of the equations apart from this program.
#[test]
fn a_quarter_of_the_samples_is_sent() {
    let mut draft = Draft { duration: 4000, update: 1000, link: "delay = \"8ms\"".to_owned(), ..Draft::calm(3) };
    draft.mass = 0.45;
    draft.gains = cohaptic_peer::Gains { stiffness: 1000.0, damping: 5.0 };
    for (place, peer) in draft.peers.iter_mut().enumerate() {
        peer.contact = cohaptic_peer::Contact::Grasp;
        peer.device = cohaptic_peer::DeviceConfig { mass: 0.1, damping: 5.0 };
        peer.coupling = cohaptic_peer::Gains { stiffness: 3500.0, damping: 5.0 };
        peer.hand = cohaptic_tests::DraftHand::Sine { amplitude: [1.5, 0.0, 0.0], frequency: 1.0, phase: 2.1 * place as f64 };
    }
    draft.send_when = Some(SendWhen { velocity: Some(0.1), position: Some(0.0005), heartbeat: Some(std::time::Duration::from_secs(1)) });
    let log = run(&draft.scene(), Model::Least);
    // What is on the way at the end was sent too.
    let sent: u64 = log.summary.links.iter().map(|link| link.stats.offered()).sum();
    assert_eq!((sent as f64 / 4.0).round(), 1498.0);
}

/// Samples that are not sent are older than the damping of `local-damping` was made for.
#[test]
fn dead_bands_break_the_bound_on_damping() {
    let injected = |changes: &[&str]| {
        let scene = read("counterexamples/send-when-springs.toml", changes);
        assert_eq!(stored_at_first(&scene), 0.0);
        Injected::of(&scene, &run(&scene, Model::Least))
    };
    // By a simulation of the equations apart from this program.
    let thinned = injected(&[]);
    assert!((thinned.peak() - 0.0901).abs() < 5e-5, "{}", thinned.peak());
    let all = injected(&["coordination.send-when.velocity=0"]);
    assert!(all.excess(0.0) <= 0.0, "{}", all.peak());
}
