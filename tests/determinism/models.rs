//! What a scene is compiled to changes no bit of the answer: `Model::Least`, the least that it needs, against `Model::General`, everything there is.

use std::convert::Infallible;
use std::path::Path;
use std::time::Duration;

use cohaptic_harness::{Model, NoObserver, Observer, Simulation, TickRow};
use cohaptic_scene::Scene;
use cohaptic_tests::{drafts, first_difference, record, run, shipped_scenes};
use cohaptic_tests_common::{cases, properties, quarter_by_day};
use cohaptic_units::Instant;
use proptest::prelude::*;

properties! {
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

properties! {
    // Each case writes twelve files.
    #![proptest_config(cases(100))]

    #[test]
    fn both_models_write_the_same_bytes(draft in drafts::anything()) {
        let scene = draft.scene();
        let difference = record(&scene, Model::Least).first_difference(&record(&scene, Model::General));
        prop_assert!(difference.is_none(), "{}", difference.unwrap());
    }
}

/// The beginning of every shipped scene: up to a second, by day up to a quarter of that, and less where hundreds of links write a row for each packet.
#[test]
fn both_models_write_the_same_bytes_for_every_shipped_scene() {
    for path in shipped_scenes() {
        let mut scene = Scene::read(&path, &[]).unwrap();
        let longest = Duration::from_millis(if scene.peers.len() > 10 { 60 } else { quarter_by_day(1000) });
        scene.duration = scene.duration.min(longest);
        scene.expect = None;
        scene.timeline.retain(|change| change.at - Instant::ZERO <= longest);
        let difference = record(&scene, Model::Least).first_difference(&record(&scene, Model::General));
        assert!(difference.is_none(), "{}: {}", path.display(), difference.unwrap());
    }
}

/// Three peers hold one object over links of 24 ms; the first one moves it.
const BASE: &str = r#"
    scene        = { duration = "2s", count = 3, seed = 7 }
    object       = { mass = 0.45, damping = 0.5 }
    coordination = { strategy = "average-position", stiffness = 200.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link         = { delay = "24ms" }

    [[peers]]
    name = "peer1"
    hand = { sine = { amplitude = 1.5, frequency = 1.3, phase = 0.2 } }
"#;

/// One thing more than the base has, as keys of the scene. The least model has a part of its own for most of them.
const ADDITIONS: [&[&str]; 27] = [
    &[],
    &["scene.axes=2", "peers.peer1.hand.sine.amplitude=[1.5, 1.0]"],
    &["scene.axes=3", "peers.peer1.hand.sine.amplitude=[1.5, 1.0, 0.5]"],
    &["link.jitter=2ms"],
    &["link.jitter={ sd = \"2ms\", distribution = \"gamma\", floor = \"20ms\" }"],
    &["link.jitter={ sd = \"2ms\", correlation = 0.75 }"],
    &["link.loss=1%"],
    &["link.loss={ gilbert-elliott = { p = 0.01, r = 0.2 } }"],
    &["link.jitter=2ms", "link.loss=1%"],
    &["link.order=in-order"],
    &["link.duplicate=1%"],
    &["link.corrupt=1%"],
    &["link.reorder=1%"],
    &["link.rate=1Mbit", "link.queue={ limit = \"100 packets\" }"],
    &["link.token-bucket={ rate = \"1Mbit\", burst = \"10kB\" }"],
    &["link={ netem = \"delay 24ms\", netem-profile = \"kernel-6.6\" }"],
    &["link.limit=2 packets"],
    &[
        "peer.uplink={ rate = \"90kbit\", delay = \"4ms\", queue = { limit = \"5 packets\" } }",
        "peer.downlink={ jitter = \"1ms\", duplicate = \"10%\" }",
    ],
    &["peer.uplink={ rate = \"90kbit\", jitter = \"1ms\" }", "topology={ kind = \"star\", role = \"relay\" }"],
    &["peer.contact={ push = \"+x\" }"],
    &["peer.compute-delay=1"],
    &["peer.device.exchange-every=3", "peer.device.exchange-age=1"],
    &["peer.clock={ drift = \"20ppm\" }"],
    &["object.enclosure={ min = -0.5, max = 0.5, stiffness = 2000.0, damping = 5.0 }"],
    &["peer.tick=500us"],
    &["simulation.integrator=semi-implicit-euler"],
    &["simulation.integrator=rk4"],
];

/// Keeps every position of every copy, in the order of the ticks. Wants no packets, so that the run need not have events.
#[derive(Default)]
struct Positions(Vec<u64>);

impl Observer for Positions {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        self.0.extend(row.object.position.iter().map(|position| position.to_bits()));
        Ok(())
    }
}

/// Watched in full, by ticks alone and not at all, each of which the least model may simulate in another way.
#[test]
fn each_addition_to_a_scene_leaves_both_models_equal() {
    for keys in ADDITIONS {
        let overrides: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
        let scene = Scene::parse(BASE, Path::new("base.toml"), &overrides).unwrap_or_else(|error| panic!("{keys:?}: {error}"));
        let difference = first_difference(&run(&scene, Model::Least), &run(&scene, Model::General));
        assert!(difference.is_none(), "{keys:?}: {}", difference.unwrap());
        let positions = |model| {
            let mut positions = Positions::default();
            let Ok(_) = Simulation::new(&scene, model).run(&mut positions);
            positions.0
        };
        let least = positions(Model::Least);
        assert!(!least.is_empty() && least == positions(Model::General), "{keys:?}: positions differ");
        let unobserved = |model| {
            let Ok(summary) = Simulation::new(&scene, model).run(&mut NoObserver);
            summary
        };
        assert_eq!(unobserved(Model::Least), unobserved(Model::General), "{keys:?}");
    }
}
