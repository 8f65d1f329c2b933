//! Scenes whose peers hear their neighbours alone: in arrays and on threads the same as event by event, to the bit, and as a full mesh where all are neighbours.

use std::sync::Arc;

use cohaptic_harness::{Model, NoObserver, Simulation, Summary, run_side_by_side, same_shape};
use cohaptic_scene::{ChangeKind, Scene, Topology};
use cohaptic_tests::{Draft, drafts, record};
use cohaptic_tests_common::{cases, properties};
use cohaptic_units::parse;
use proptest::prelude::*;

use crate::determinism::arrays::{difference, mesh, run};

/// A topology of that many peers, as some numbers say.
fn topology(peers: usize, kind: u8, numbers: &[f64]) -> Topology {
    let near = Topology::ring(peers, 2).filter(|_| kind == 0);
    let ring = near.or_else(|| (kind == 1).then(|| Topology::ring(peers, (peers - 1) / 2 * 2))?);
    let star = || (kind == 2).then(|| Topology::star(peers, peers / 2))?;
    ring.or_else(star).unwrap_or_else(|| {
        // A chain, so that it is connected, and whatever else the numbers have between others.
        let weight = |one: usize, other: usize| {
            let number = numbers[(one * peers + other) % numbers.len()];
            if other == one + 1 || number > 1.0 { number } else { 0.0 }
        };
        let of = |row: usize, column: usize| if row == column { 0.0 } else { weight(row.min(column), row.max(column)) };
        let rows: Vec<Vec<f64>> = (0..peers).map(|row| (0..peers).map(|column| of(row, column)).collect()).collect();
        Topology::graph(&rows).unwrap()
    })
}

fn any_topology() -> BoxedStrategy<(u8, Vec<f64>)> {
    (0..4_u8, proptest::collection::vec(prop_oneof![Just(1.5), 0.01..3.0], 7..40)).boxed()
}

/// The scene of a draft on a topology; `None` if its strategy is no law.
fn on(draft: &Draft, (kind, numbers): &(u8, Vec<f64>)) -> Option<Scene> {
    let mut scene = draft.scene();
    let topology = topology(scene.peers.len(), *kind, numbers);
    scene.timeline.retain(|change| !matches!(&change.what, ChangeKind::Link(link) if !topology.has_link(link.from, link.to)));
    scene.law(0).is_some().then_some(Scene { topology: Some(Arc::new(topology)), ..scene })
}

properties! {
    #![proptest_config(cases(600))]

    #[test]
    fn in_arrays_they_come_to_what_their_events_come_to(drafts in prop_oneof![drafts::alike(Just(1)), drafts::changing(Just(1))], topology in any_topology()) {
        let Some(scene) = on(&drafts[0], &topology) else { return Ok(()) };
        prop_assert!(scene.has_gains_by_peer() || same_shape(&scene, &scene), "it is run in arrays");
        let expected = run(&scene, Model::General);
        prop_assert_eq!(difference(&run(&scene, Model::Least), &expected), None);
        let Ok(on_threads) = Simulation::new(&scene, Model::Least).on_threads(2).run(&mut NoObserver);
        prop_assert_eq!(difference(&on_threads, &expected), None);
    }
}

properties! {
    // Each case writes many files.
    #![proptest_config(cases(60))]

    /// Every kind of clock, link and change, recorded.
    #[test]
    fn their_records_do_not_depend_on_the_machinery(draft in drafts::anything(), topology in any_topology()) {
        let Some(scene) = on(&draft, &topology) else { return Ok(()) };
        let difference = record(&scene, Model::Least).first_difference(&record(&scene, Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

const LINKS: [&str; 4] = [
    "delay = \"24ms\"",
    "delay = \"24ms\", jitter = \"3ms\", loss = 0.05",
    "delay = \"9ms\", rate = \"60kbit\", queue = { limit = \"2 packets\" }",
    "delay = \"9ms\", rate = \"60kbit\", queue = { limit = \"3 packets\", discipline = \"codel\" }",
];

/// Three peers on a ring all hear each other: every number is that of the full mesh.
#[test]
fn a_ring_of_three_is_a_full_mesh() {
    for link in LINKS {
        let full = mesh(3, link);
        let ring = Scene { topology: Topology::ring(3, 2).map(Arc::new), ..full.clone() };
        let graph = Scene {
            topology: Some(Arc::new(Topology::graph(&[[0.0, 2.0, 2.0], [2.0, 0.0, 2.0], [2.0, 2.0, 0.0]].map(Vec::from)).unwrap())),
            ..full.clone()
        };
        let bare = |summary: Summary| (format!("{:?}", summary.peers), format!("{:?}", summary.links), summary.max_discrepancy.to_bits());
        let expected = bare(run(&full, Model::Least));
        for scene in [ring, graph] {
            for model in [Model::Least, Model::General] {
                assert_eq!(bare(run(&scene, model)), expected, "{link}");
            }
        }
    }
}

/// Side by side, on threads, and with a hub that hears so many that its mean is exact while those of the others are not.
#[test]
fn stars_and_rings_run_beside_others_and_on_threads() {
    for link in LINKS {
        let ring = Scene { topology: Topology::ring(7, 4).map(Arc::new), ..mesh(7, link) };
        let scenes: Vec<Scene> = (0..8).map(|seed| Scene { seed, ..ring.clone() }).collect();
        for (scene, together) in scenes.iter().zip(run_side_by_side(&scenes)) {
            assert_eq!(difference(&together, &run(scene, Model::General)), None, "{link}");
        }
        let mut star = Scene { topology: Topology::star(300, 3).map(Arc::new), duration: parse::duration("100ms").unwrap(), ..mesh(300, link) };
        star.peers[7].position = [0.1; 3];
        let expected = run(&star, Model::General);
        for threads in [1, 2, 5] {
            let Ok(found) = Simulation::new(&star, Model::Least).on_threads(threads).run(&mut NoObserver);
            assert_eq!(difference(&found, &expected), None, "{link}, {threads} threads");
        }
    }
}
