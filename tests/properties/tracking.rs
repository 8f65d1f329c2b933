//! Runs with a person who tracks, which come to rest at a target that stands still, against the spectral radius. The two computations share the steps of
//! bodies and no more.

use cohaptic_harness::Model;
use cohaptic_scene::Scene;
use cohaptic_stability::{Method, analyse};
use cohaptic_tests::run;
use serde_json::Value;

use crate::properties::count;

/// Scenes whose motion comes to rest by a pair of complex eigenvalues that is far outside of all others.
const PAIRS: [&str; 9] = [
    "own",
    "sees-the-second",
    "three",
    "soft-and-late-sees-the-second",
    "within-a-frame",
    "not-whole",
    "compute-delay-sees-the-second",
    "slow-eye",
    "heavy-arm",
];
/// Distance of the target from where everything is at first \[m\].
const TARGET: f64 = 0.01;
/// Frames between the two looks at a motion.
const APART: usize = 100;

fn scene(name: &str, overrides: &[&str]) -> Scene {
    let all: Value = serde_json::from_str(include_str!("../../crates/stability/tests/reference/crossover.json")).unwrap();
    let case = all["radii"].as_array().unwrap().iter().find(|case| case["name"] == name).unwrap();
    let at_rest = [format!("task.position={TARGET}"), "task.sines=[{ amplitude = 0.0, frequency = 0.1 }]".to_owned()];
    let overrides: Vec<String> = at_rest.into_iter().chain(overrides.iter().map(|text| (*text).to_owned())).collect();
    Scene::parse(case["scene"].as_str().unwrap(), name.as_ref(), &overrides).unwrap()
}

/// Of a motion z(n) = Re(c·λⁿ), z(n−1)·z(n+1) − z(n)² is a constant times |λ|²ⁿ.
#[track_caller]
fn comes_to_rest_by_its_radius(name: &str, overrides: &[&str]) {
    let scene = scene(name, overrides);
    let radius = analyse(&scene, Method::Reduced).unwrap().radius.value;
    let log = run(&scene, Model::Least);
    let frame = scene.coordination.update.as_nanos();
    let at_frames = log.ticks.iter().filter(|tick| tick.peer == 0 && u128::from(tick.at.as_nanos()) % frame == 0);
    let left: Vec<f64> = at_frames.map(|tick| tick.object.position[0] - TARGET).collect();
    let size = |n: usize| left[n - 1] * left[n + 1] - left[n] * left[n];
    // The slowest motion alone is left when it has come to a ten-thousandth, or at the end of the run.
    let late = (1..left.len() - APART - 1).find(|n| libm::pow(radius, count(*n)) < 1e-4).unwrap_or(left.len() - APART - 2);
    let found = libm::pow(size(late + APART) / size(late), 0.5 / count(APART));
    assert!((found - radius).abs() < 1e-6, "{name} {overrides:?}: a run falls by {found} a frame, and the radius is {radius}");
}

#[test]
fn a_run_with_a_person_comes_to_rest_by_the_spectral_radius() {
    for name in PAIRS {
        comes_to_rest_by_its_radius(name, &[]);
    }
}

/// Boundaries: 7.56 and 5.44 rad/s.
#[test]
fn a_run_with_a_person_who_is_too_quick_grows_by_the_spectral_radius() {
    comes_to_rest_by_its_radius("own", &["peers.a.hand.operator.crossover=8"]);
    comes_to_rest_by_its_radius("sees-the-second", &["peers.a.hand.operator.crossover=5.6"]);
}
