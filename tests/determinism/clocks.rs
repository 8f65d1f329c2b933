//! Peers that tick at instants of their own are run in arrays, window by window, if nobody watches: the same as every event one after the other, to the bit.

use std::time::Duration;

use cohaptic_harness::{Ending, Model, same_shape};
use cohaptic_peer::Drift;
use cohaptic_scene::Scene;
use cohaptic_tests::{Draft, cases, drafts};
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;

use super::arrays::{difference, mesh, run, run_interrupted};
use super::watched::found;

/// Offset \[ns\] and drift [ppb] of each of up to eleven peers: some equal, some late by many ticks, some as fast or as slow as can be.
fn clocks() -> impl Strategy<Value = Vec<(u64, i32)>> {
    let offset = prop_oneof![2 => Just(0), 1 => Just(1_000_000), 3 => 0..3_000_000_u64, 1 => 0..90_000_000_u64];
    let drift = prop_oneof![Just(0), -100_000..100_000_i32, -100_000_000..100_000_000_i32, Just(100_000_000), Just(-100_000_000)];
    prop_oneof![vec((offset.clone(), Just(0)), 11), vec((offset.clone(), -100_000..100_000_i32), 11), vec((offset, drift), 11),]
}

/// Gives the peers of a draft these clocks; the first one has some drift, so that not all tick together.
fn with_clocks(draft: &mut Draft, clocks: &[(u64, i32)]) {
    for (peer, (offset, drift)) in draft.peers.iter_mut().zip(clocks) {
        (peer.offset, peer.drift) = (*offset, *drift);
    }
    draft.peers[0].offset += 1;
}

fn in_arrays(scene: &Scene) -> bool {
    same_shape(scene, scene)
}

proptest! {
    #![proptest_config(cases(1500))]

    #[test]
    fn clocks_of_their_own_come_to_the_same(mut draft in drafts::direct(), clocks in clocks(), relay: bool) {
        with_clocks(&mut draft, &clocks);
        let scene = Scene { relay, ..draft.scene() };
        prop_assert!(in_arrays(&scene), "it is run in arrays");
        let difference = difference(&run(&scene, Model::Least), &run(&scene, Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

proptest! {
    #![proptest_config(cases(200))]

    /// Samples that travel together, are sent as often as peers tick, and arrive with and without delay.
    #[test]
    fn samples_that_travel_together_come_to_the_same(mut draft in drafts::direct(), clocks in clocks(), delay in 0..40_000_u32) {
        with_clocks(&mut draft, &clocks);
        draft.link = format!("delay = \"{}us\", jitter = \"0s\"", delay.saturating_sub(2000));
        draft.links.clear();
        if delay % 2 == 0 {
            (draft.update, draft.gains) = (draft.peers[0].tick, draft.gains.scaled(0.05));
            draft.peers.iter_mut().for_each(|peer| peer.phase = 0);
        }
        let scene = draft.scene();
        prop_assert!(in_arrays(&scene), "it is run in arrays");
        let difference = difference(&run(&scene, Model::Least), &run(&scene, Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }

    /// Samples that overtake each other within a tick and over ticks.
    #[test]
    fn samples_that_overtake_come_to_the_same(mut draft in drafts::direct(), clocks in clocks(), delay in 1..400_u32, part in 1..57_u32) {
        with_clocks(&mut draft, &clocks);
        let jitter = format!("jitter = {{ sd = \"{}us\", distribution = \"uniform\" }}", 10 * delay * part);
        draft.link = format!("delay = \"{delay}ms\", {jitter}, order = \"allow-reordering\", loss = 0.1");
        (draft.update, draft.gains) = (draft.peers[0].tick, draft.gains.scaled(0.05));
        draft.duration = u64::from(delay) + 300;
        draft.peers.iter_mut().for_each(|peer| peer.phase = 0);
        let scene = draft.scene();
        let difference = difference(&run(&scene, Model::Least), &run(&scene, Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }

    /// What an observer sees of ticks and instants, row by row.
    #[test]
    fn rows_of_clocks_of_their_own_are_those_of_their_events(mut draft in drafts::direct(), clocks in clocks()) {
        with_clocks(&mut draft, &clocks);
        let found = found(&draft.scene(), |_| ());
        prop_assert!(found.is_none(), "{}", found.unwrap());
    }

    #[test]
    fn a_run_of_clocks_that_is_interrupted_comes_to_the_same(mut draft in drafts::direct(), clocks in clocks(), breaths in 1..3_usize) {
        with_clocks(&mut draft, &clocks);
        draft.duration = 1500;
        draft.gains = draft.gains.scaled(0.2);
        let interrupted = |model| run_interrupted(&draft.scene(), model, breaths);
        let difference = difference(&interrupted(Model::Least), &interrupted(Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

proptest! {
    #![proptest_config(cases(30))]

    /// An observer that ends a run, or fails, has seen what it would have seen of events.
    #[test]
    fn who_has_had_enough_of_clocks_has_seen_the_same(
        mut draft in drafts::direct(), clocks in clocks(), millis in 0..900_u64, most_rows in prop_oneof![1..200_usize, Just(usize::MAX)],
    ) {
        with_clocks(&mut draft, &clocks);
        draft.duration = 1500;
        let until = Instant::from_nanos(millis * 1_000_000);
        let found = found(&draft.scene(), |keeper| (keeper.until, keeper.most_rows) = (until, most_rows));
        prop_assert!(found.is_none(), "{}", found.unwrap());
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

/// Of 257 peers on the means are exact, whether samples travel together or each by itself.
#[test]
fn many_clocks_come_to_the_same() {
    let overtaking = "delay = \"6ms\", jitter = { sd = \"3ms\", distribution = \"uniform\" }, order = \"allow-reordering\"";
    for (link, update) in [("delay = \"3ms\"", 8), ("delay = \"3ms\", jitter = \"400us\", loss = \"5%\"", 8), (overtaking, 2)] {
        let mut scene = mesh(260, link);
        scene.coordination.update = Duration::from_millis(update);
        scene.peers.iter_mut().zip(0..).for_each(|(peer, place)| peer.phase = place % update);
        scene.duration = Duration::from_millis(24);
        spread(&mut scene, 5000);
        assert!(in_arrays(&scene));
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
            assert!(in_arrays(&scene));
            assert_eq!(difference(&run(&scene, Model::Least), &run(&scene, Model::General)), None, "{link}, {early} ns before");
            assert_eq!(found(&scene, |_| ()), None, "{link}, {early} ns before");
        }
    }
}
