//! Whom nobody watches is run in arrays, alone or beside others of the same shape: the same as every event of it one after the other, to the bit.

use std::time::Duration;

use cohaptic_harness::{Ending, Model, NoObserver, Observer, Simulation, Summary, run_side_by_side, same_shape};
use cohaptic_scene::Scene;
use cohaptic_tests::{Draft, cases, drafts, shipped_scenes};
use cohaptic_units::Instant;
use proptest::prelude::*;

fn run(scene: &Scene, model: Model) -> Summary {
    let Ok(summary) = Simulation::new(scene, model).run(&mut NoObserver);
    summary
}

/// What two runs differ in, first of all; `PartialEq` would let a zero pass for another one.
fn difference(one: &Summary, other: &Summary) -> Option<String> {
    let (one, other) = (format!("{one:#?}"), format!("{other:#?}"));
    let (line, (found, expected)) = one.lines().zip(other.lines()).enumerate().find(|(_, (a, b))| a != b)?;
    Some(format!("line {line}: {found} is not {expected}"))
}

proptest! {
    #![proptest_config(cases(1500))]

    #[test]
    fn one_scene_in_arrays_comes_to_what_its_events_come_to(drafts in drafts::alike(Just(1))) {
        let scene = drafts[0].scene();
        prop_assert!(same_shape(&scene, &scene), "it is run in arrays");
        let difference = difference(&run(&scene, Model::Least), &run(&scene, Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn scenes_side_by_side_come_to_what_each_comes_to_alone(drafts in drafts::alike(prop_oneof![1 => 1..=7_usize, 3 => 7..=11_usize])) {
        let scenes: Vec<Scene> = drafts.iter().map(Draft::scene).collect();
        let together = run_side_by_side(&scenes);
        prop_assert_eq!(together.len(), scenes.len());
        for (scene, together) in scenes.iter().zip(&together) {
            let difference = difference(together, &run(scene, Model::General));
            prop_assert!(difference.is_none(), "{}", difference.unwrap());
        }
    }

    /// A run that is ended on the way has done what one with events has.
    #[test]
    fn a_run_that_is_interrupted_comes_to_the_same(mut drafts in drafts::alike(Just(1)), breaths in 1..3_u32) {
        struct Impatient(u32);
        impl Observer for Impatient {
            type Error = std::convert::Infallible;

            fn keep_going(&mut self, _now: Instant) -> bool {
                self.0 -= 1;
                self.0 > 0
            }
        }
        let draft = &mut drafts[0];
        draft.duration = 2500;
        let interrupted = |model| {
            let Ok(summary) = Simulation::new(&draft.scene(), model).run(&mut Impatient(breaths));
            summary
        };
        let difference = difference(&interrupted(Model::Least), &interrupted(Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

/// Of the scenes of other shapes none is lost or mixed up.
#[test]
fn shipped_scenes_side_by_side_come_to_what_each_comes_to_alone() {
    let mut scenes: Vec<Scene> =
        shipped_scenes().iter().map(|path| Scene::read(path, &[]).unwrap()).filter(|scene| scene.peers.len() <= 10).collect();
    for scene in &mut scenes {
        scene.duration = scene.duration.min(Duration::from_millis(500));
        scene.expect = None;
        scene.timeline.retain(|change| change.at - Instant::ZERO <= Duration::from_millis(500));
    }
    let together = run_side_by_side(&scenes);
    assert_eq!(together.len(), scenes.len());
    for (scene, together) in scenes.iter().zip(&together) {
        assert_eq!(difference(together, &run(scene, Model::Least)), None, "{}", scene.title);
    }
}

/// Eight runs of one scene of which some diverge: each ends when it would alone.
#[test]
fn each_run_ends_when_it_would_alone() {
    let text = r#"
        scene = { duration = "3s", count = 3 }
        object = { mass = 0.45 }
        coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
        peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
        peers = [{ name = "peer1", hand = { force = 1.5 } }]
        link = { delay = "24ms", jitter = "3ms", loss = "5%" }
    "#;
    let stiffness = |gain: f64| {
        let mut scene = Scene::parse(text, "three.toml".as_ref(), &[]).unwrap();
        scene.coordination.gains.stiffness = gain;
        scene
    };
    let scenes: Vec<Scene> = [500.0, 3e7, 1000.0, 3e8, 500.0, 3e9, 3e10, 700.0].map(stiffness).into();
    let together = run_side_by_side(&scenes);
    let endings: Vec<bool> = together.iter().map(|summary| summary.ending == Ending::Complete).collect();
    assert_eq!(endings, [true, false, true, false, true, false, false, true]);
    for (scene, together) in scenes.iter().zip(&together) {
        assert_eq!(difference(together, &run(scene, Model::General)), None);
    }
}
