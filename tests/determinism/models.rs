//! What a scene is compiled to changes no bit of the answer: `Model::Least`, the least that it needs, against `Model::General`, everything there is.

use std::time::Duration;

use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_scene::Scene;
use cohaptic_tests::{cases, drafts, first_difference, record, run, shipped_scenes};
use cohaptic_units::Instant;
use proptest::prelude::*;

proptest! {
    #![proptest_config(cases(1500))]

    #[test]
    fn both_models_give_the_same_rows(draft in drafts::anything()) {
        let scene = draft.scene();
        let difference = first_difference(&run(&scene, Model::Least), &run(&scene, Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }

    /// Whom nobody watches, the least model leaves out.
    #[test]
    fn both_models_come_to_the_same_end_unobserved(draft in drafts::anything()) {
        let scene = draft.scene();
        let unobserved = |model| {
            let Ok(summary) = Simulation::new(&scene, model).run(&mut NoObserver);
            summary
        };
        prop_assert_eq!(unobserved(Model::Least), unobserved(Model::General));
        // Nor does watching change what happens.
        prop_assert_eq!(unobserved(Model::Least), run(&scene, Model::Least).summary);
    }
}

proptest! {
    // Each case writes twelve files.
    #![proptest_config(cases(100))]

    #[test]
    fn both_models_write_the_same_bytes(draft in drafts::anything()) {
        let scene = draft.scene();
        let difference = record(&scene, Model::Least).first_difference(&record(&scene, Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

/// The beginning of every shipped scene: all of it up to a second, and less where hundreds of links write a row for each packet.
#[test]
fn both_models_write_the_same_bytes_for_every_shipped_scene() {
    for path in shipped_scenes() {
        let mut scene = Scene::read(&path, &[]).unwrap();
        let longest = Duration::from_millis(if scene.peers.len() > 10 { 60 } else { 1000 });
        scene.duration = scene.duration.min(longest);
        scene.expect = None;
        scene.timeline.retain(|change| change.at - Instant::ZERO <= longest);
        let difference = record(&scene, Model::Least).first_difference(&record(&scene, Model::General));
        assert!(difference.is_none(), "{}: {}", path.display(), difference.unwrap());
    }
}
