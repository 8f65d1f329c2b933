//! Twice, one after the other and on several threads at once.

use cohaptic_harness::Model;
use cohaptic_tests::{Records, drafts, record};
use cohaptic_tests_common::{cases, properties};
use proptest::prelude::*;

properties! {
    // Each case writes thirty files.
    #![proptest_config(cases(40))]

    #[test]
    fn a_scene_gives_the_same_bytes_again_and_on_other_threads(draft in drafts::anything()) {
        let scene = draft.scene();
        let first = record(&scene, Model::Least);
        prop_assert!(first.names().count() >= 6, "{:?}", first.names().collect::<Vec<_>>());
        let again = record(&draft.scene(), Model::Least);
        let beside: Vec<Records> = std::thread::scope(|scope| {
            let runs: Vec<_> = (0..3).map(|_| scope.spawn(|| record(&scene, Model::Least))).collect();
            runs.into_iter().map(|run| run.join().unwrap()).collect()
        });
        for records in std::iter::once(&again).chain(&beside) {
            let difference = first.first_difference(records);
            prop_assert!(difference.is_none(), "{}", difference.unwrap());
        }
    }

    /// Not because nothing is drawn: on a link that loses half of all packets another seed loses others.
    #[test]
    fn another_seed_gives_another_record(mut draft in drafts::anything()) {
        draft.link = "loss = 0.5".to_owned();
        draft.links.clear();
        draft.timeline.clear();
        draft.duration = 200;
        // Two links with 25 packets or more each: two seeds agree on all with a probability of 2^-50 at most.
        let first = record(&draft.scene(), Model::Least);
        draft.seed = draft.seed.wrapping_add(1);
        prop_assert!(first.first_difference(&record(&draft.scene(), Model::Least)).is_some());
    }
}
