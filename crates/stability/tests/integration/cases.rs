//! Random scenes, and what is known of each from long arithmetic: see `tests/reference/README.md`. The tests of `cohaptic-proofs` read them too.

use cohaptic_scene::Scene;
use serde_json::Value;

/// Scene with its reference values.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) text: String,
    pub(crate) scene: Scene,
    pub(crate) radius: f64,
    pub(crate) rigid_modes: u64,
    /// Index of a peer, and the spring, damper and mass that its hand feels.
    pub(crate) felt: Option<(usize, [f64; 3])>,
}

/// Returns all cases of the reference file.
pub(crate) fn cases() -> Vec<Case> {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../stability/tests/reference/random.json")).unwrap();
    let entries: Vec<Value> = serde_json::from_str(&text).unwrap();
    let number = |entry: &Value, key: &str| entry[key].as_str().unwrap().parse::<f64>().unwrap();
    let case = |entry: &Value| {
        let name = entry["name"].as_str().unwrap().to_owned();
        let text = entry["scene"].as_str().unwrap().to_owned();
        let scene = Scene::parse(&text, name.as_ref(), &[]).unwrap_or_else(|error| panic!("{name}: {error}"));
        let felt = entry["peer"].as_str().map(|peer| {
            let place = scene.peers.iter().position(|other| other.name == peer).unwrap();
            (place, ["stiffness", "viscosity", "inertia"].map(|key| number(entry, key)))
        });
        Case { radius: number(entry, "radius"), rigid_modes: entry["rigid_modes"].as_u64().unwrap(), felt, scene, text, name }
    };
    let cases: Vec<Case> = entries.iter().map(case).collect();
    assert!(cases.len() >= 180, "{}", cases.len());
    cases
}
