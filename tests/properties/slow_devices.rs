//! Runs with devices that exchange late or not at each tick, against the spectral radius. The two computations share the steps of bodies and no more.

use cohaptic_harness::Model;
use cohaptic_scene::Scene;
use cohaptic_stability::{Method, analyse};
use cohaptic_tests::run;
use serde_json::Value;

use crate::properties::count;

/// Scenes, each with a law, whose motion comes to rest, or grows, by a pair of complex eigenvalues that is far outside of all others but the displacement of all
/// together.
const PAIRS: [(&str, &str); 11] = [
    ("two-late", "average-position"),
    ("two-late-stiff", "average-position"),
    ("each-tick-late", "average-position"),
    ("two", "average-position"),
    ("one-slow", "average-position"),
    ("one-touches-nothing", "average-position"),
    ("other-ticks", "average-position"),
    ("offset-between-exchanges", "average-position"),
    ("two-late", "smoothed-average-position"),
    ("one-slow", "local-lag"),
    ("each-tick-late", "extrapolated"),
];

fn scene(name: &str, law: &str) -> Scene {
    let all: Value = serde_json::from_str(include_str!("../../crates/stability/tests/reference/exchange.json")).unwrap();
    let case = all["radii"].as_array().unwrap().iter().find(|case| case["name"] == name).unwrap();
    let apart = ["peers.a.position=0.001".to_owned(), "peers.b.velocity=0.02".to_owned(), format!("coordination.strategy={law}")];
    Scene::parse(case["scene"].as_str().unwrap(), name.as_ref(), &apart).unwrap()
}

/// For a motion z(n) = Re(c·λⁿ), z(n−1)·z(n+1) − z(n)² is a constant times |λ|²ⁿ. The stretch of a coupling does not see a displacement of all bodies.
#[test]
fn a_run_with_slow_devices_follows_the_spectral_radius() {
    for (name, law) in PAIRS {
        let scene = scene(name, law);
        let analysis = analyse(&scene, Method::Reduced).unwrap();
        let (radius, frame) = (analysis.radius.value, analysis.frame.as_nanos());
        let log = run(&scene, Model::Least);
        let first_of_frame = |at: u128| at % frame < scene.peers[0].clock.tick.as_nanos();
        let at_frames = log.ticks.iter().filter(|tick| tick.peer == 0 && first_of_frame(u128::from(tick.at.as_nanos())));
        let stretch: Vec<f64> = at_frames.map(|tick| tick.device.position[0] - tick.object.position[0]).collect();
        let size = |n: usize| stretch[n - 1] * stretch[n + 1] - stretch[n] * stretch[n];
        // Faster motions have died out when the slowest motion has come to a ten-thousandth or grown as much, and the slowest is then far above rounding.
        let late = (20..300).find(|n| libm::log(radius).abs() * count(*n) > 4.0 * std::f64::consts::LN_10).unwrap_or(300);
        let apart = (5..100).find(|n| libm::log(radius).abs() * count(*n) > 4.0 * std::f64::consts::LN_10).unwrap_or(100);
        let found = libm::pow(size(late + apart) / size(late), 0.5 / count(apart));
        assert!((found - radius).abs() < 1e-6, "{name} with {law}: a run falls by {found} a frame, and the radius is {radius}");
    }
}
