//! Frequency of the question whether to go on. A run of any number of peers must end soon after a signal.

use std::convert::Infallible;
use std::path::Path;

use cohaptic_harness::live::{Inputs, replay};
use cohaptic_harness::{Ending, Model, Observer, Simulation};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

/// Observer that ends a run at the first question.
struct Impatient;

impl Observer for Impatient {
    type Error = Infallible;

    fn keep_going(&mut self, _now: Instant) -> bool {
        false
    }
}

fn scene(peers: usize, keys: &[&str]) -> Scene {
    let text = format!(
        "scene = {{ duration = \"20s\", count = {peers} }}\nobject.mass = 3.0\nlink = {{ delay = \"8ms\", jitter = \"1ms\" }}\n\
         coordination = {{ strategy = \"average-position\", stiffness = 20.0, damping = 0.5, update = \"8ms\" }}\n\
         peer = {{ device = {{ mass = 0.1, damping = 5.0 }}, coupling = {{ stiffness = 1000.0, damping = 5.0 }} }}\n"
    );
    let keys: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
    Scene::parse(&text, Path::new("many.toml"), &keys).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the number of ticks of a run before the first question.
fn asked_after(scene: &Scene, model: Model) -> u64 {
    let Ok(summary) = Simulation::new(scene, model).run(&mut Impatient);
    assert!(matches!(summary.ending, Ending::Interrupted(_)), "{:?}", summary.ending);
    summary.ticks
}

/// 300 peers have 90,000 links, so that 2²² packets are sent at 46 instants. Rounded down to a power of two, the question comes after 32.
#[test]
fn a_run_of_many_peers_is_asked_before_it_has_done_much() {
    let many = scene(300, &[]);
    assert_eq!(asked_after(&many, Model::Least), 32);
    // Beside ticks there are instants at which packets arrive.
    assert!(asked_after(&many, Model::General) <= 32);
    // A peer ticks between the others: there are two instants a tick.
    let apart = scene(300, &["peers=[{ name = \"peer1\", clock.offset = \"500us\" }]"]);
    assert_eq!(asked_after(&apart, Model::Least), 16);
}

#[test]
fn a_run_of_few_peers_is_asked_every_1024_ticks() {
    assert_eq!(asked_after(&scene(3, &[]), Model::Least), 1024);
}

#[test]
fn a_replay_is_asked_too() {
    let few = scene(2, &[]);
    let Ok(summary) = replay(&few, &Inputs::default(), &mut Impatient);
    assert!(matches!(summary.ending, Ending::Interrupted(_)), "{:?}", summary.ending);
    assert!(summary.ticks <= 1024, "{}", summary.ticks);
}
