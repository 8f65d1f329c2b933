//! Peers that tick at instants of their own have an event for each tick, also where the run is compiled to the least: the same as everything modelled, to the bit.

use std::time::Duration;

use cohaptic_harness::{Ending, Model};
use cohaptic_peer::Drift;
use cohaptic_scene::Scene;
use cohaptic_tests::drafts;
use cohaptic_tests_common::{are_all, cases, properties};
use proptest::collection::vec;
use proptest::prelude::*;

use super::arrays::{difference, mesh, run, run_interrupted};

/// Offset \[ns\] and drift [ppb] of each of up to eleven peers: some equal, some late by many ticks, some as fast or as slow as can be.
fn clocks() -> BoxedStrategy<Vec<(u64, i32)>> {
    let offset = prop_oneof![2 => Just(0), 1 => Just(1_000_000), 3 => 0..3_000_000_u64, 1 => 0..90_000_000_u64];
    let drift = prop_oneof![Just(0), -100_000..100_000_i32, -100_000_000..100_000_000_i32, Just(100_000_000), Just(-100_000_000)];
    prop_oneof![vec((offset.clone(), Just(0)), 11), vec((offset.clone(), -100_000..100_000_i32), 11), vec((offset, drift), 11),].boxed()
}

properties! {
    #![proptest_config(cases(200))]

    #[test]
    fn a_run_of_clocks_that_is_interrupted_comes_to_the_same(mut drafts in drafts::alike(Just(1)), clocks in clocks(), breaths in 1..3_usize) {
        let draft = &mut drafts[0];
        for (peer, clock) in draft.peers.iter_mut().zip(&clocks) {
            (peer.offset, peer.drift) = *clock;
        }
        draft.duration = 1500;
        draft.gains = draft.gains.scaled(0.2);
        let interrupted = |model| run_interrupted(&draft.scene(), model, breaths);
        let difference = difference(&interrupted(Model::Least), &interrupted(Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

/// Gives the peers of a scene offsets within a tick, and drifts of that many parts per million either way at most.
fn spread(scene: &mut Scene, ppm: i64) {
    for (peer, place) in scene.peers.iter_mut().zip(0_i64..) {
        peer.clock.offset = Duration::from_nanos((place * 7_919_317 % 1_000_000).unsigned_abs());
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let fraction = (place * 37 % (2 * ppm + 1) - ppm) as f64 * 1e-6;
        peer.clock.drift = Drift::from_fraction(fraction).unwrap();
    }
}

/// Of 257 peers on the means are exact, whether packets arrive in order or not. Links without chance are among all cases.
#[test]
fn many_clocks_come_to_the_same() {
    let overtaking = "delay = \"6ms\", jitter = { sd = \"3ms\", distribution = \"uniform\" }, order = \"allow-reordering\"";
    let links = [("delay = \"3ms\"", 8), ("delay = \"3ms\", jitter = \"400us\", loss = \"5%\"", 8), (overtaking, 2)];
    for (link, update) in links.into_iter().skip(if are_all() { 0 } else { 1 }) {
        let mut scene = mesh(260, link);
        scene.coordination.update = Duration::from_millis(update);
        scene.peers.iter_mut().zip(0..).for_each(|(peer, place)| peer.phase = place % update);
        scene.duration = Duration::from_millis(24);
        spread(&mut scene, 5000);
        let [least, general] = [Model::Least, Model::General].map(|model| run(&scene, model));
        assert_eq!(difference(&least, &general), None, "{link}");
    }
}

/// A run that diverges ends at the next tick of any peer, which may be another one; one that does so at the end of its scene ends there.
#[test]
fn clocks_that_diverge_come_to_the_same() {
    for (link, ppm) in [("delay = \"2ms\"", 0), ("delay = \"2ms\"", 3000), ("delay = \"2ms\", jitter = \"200us\", loss = \"3%\"", 3000)] {
        let mut scene = mesh(9, link);
        scene.coordination.gains.stiffness = 3e7;
        spread(&mut scene, ppm);
        let Ending::Diverged(at) = run(&scene, Model::General).ending else { panic!("{link}: it diverges") };
        for early in [0, 1, 100_000, 999_999, 1_000_001] {
            scene.duration = Duration::from_nanos(at.as_nanos() - early);
            assert_eq!(difference(&run(&scene, Model::Least), &run(&scene, Model::General)), None, "{link}, {early} ns before");
        }
    }
}
