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

/// For a motion z(n) = Re(c·λⁿ), z(n−1)·z(n+1) − z(n)² is a constant times |λ|²ⁿ.
#[track_caller]
fn comes_to_rest_by_its_radius(name: &str, overrides: &[&str]) {
    let scene = scene(name, overrides);
    let radius = analyse(&scene, Method::Reduced).unwrap().radius.value;
    let log = run(&scene, Model::Least);
    let frame = scene.coordination.update.as_nanos();
    let at_frames = log.ticks.iter().filter(|tick| tick.peer == 0 && u128::from(tick.at.as_nanos()) % frame == 0);
    let left: Vec<f64> = at_frames.map(|tick| tick.object.position[0] - TARGET).collect();
    let size = |n: usize| left[n - 1] * left[n + 1] - left[n] * left[n];
    // Faster motions have died out when the slowest motion has come to a ten-thousandth, or at the end of the run.
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

/// Changes that give a scene a server, and two clients of which a person leads the first.
const SERVER: [&str; 5] = [
    "coordination.strategy=client-server",
    "coordination.stiffness=0",
    "peer.coupling={ stiffness = 100, damping = 5 }",
    "link.delay=8ms",
    r#"peers=[{ name = "server", contact = "none" }, { name = "a", hand = { operator = { law = "crossover" } } }, { name = "b" }]"#,
];

/// Strategies without a linear form take the general path, of which no other program's radii with people are known.
#[test]
fn a_run_with_waves_or_a_server_comes_to_rest_by_the_radius_of_the_general_path() {
    const WAVE: &str = "coordination.strategy=wave";
    comes_to_rest_by_its_radius("own", &[WAVE]);
    comes_to_rest_by_its_radius("own", &[WAVE, "peers.a.hand.operator.crossover=8"]);
    comes_to_rest_by_its_radius("within-a-frame", &[WAVE, "peers.a.hand.operator.crossover=20"]);
    comes_to_rest_by_its_radius("own", &SERVER);
    for more in ["peers.a.hand.operator.crossover=6", "peers.a.hand.operator.sees=server", "coordination.client-server.returns=object"] {
        comes_to_rest_by_its_radius("own", &[&SERVER[..], &[more]].concat());
    }
}

/// Boundaries: 7.56 and 5.44 rad/s.
#[test]
fn a_run_with_a_person_who_is_too_quick_grows_by_the_spectral_radius() {
    comes_to_rest_by_its_radius("own", &["peers.a.hand.operator.crossover=8"]);
    comes_to_rest_by_its_radius("sees-the-second", &["peers.a.hand.operator.crossover=5.6"]);
}
