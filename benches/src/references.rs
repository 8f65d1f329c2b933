//! Scenes whose radius is known to fifty digits.

use cohaptic_scene::Scene;
use serde_json::Value;

/// A scene of `crates/stability/tests/reference/radii.json`.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Its name there.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// The radius; the digits beyond a double are not looked at.
    pub radius: f64,
    /// The delay of all links in frames, where the peers are equal, grasp, and samples take whole frames: what `BarePair` is for.
    pub frames: Option<u32>,
}

/// The scenes of the table.
const NAMES: [(&str, Option<u32>); 9] = [
    ("anchor-n3-ap-8ms", Some(1)),
    ("paper-5-1-ap-1000", None),
    ("every-peer-different", None),
    ("everything-different", None),
    ("just-stable", Some(3)),
    ("nearly-equal-moduli", None),
    ("nearly-defective", None),
    ("peers-4096-ap", Some(1)),
    ("thousand-frames-stable", Some(1000)),
];

/// The scenes of the table.
///
/// # Panics
///
/// If the file of references is not what it is.
#[must_use]
pub fn references() -> Vec<Reference> {
    let all: Value = serde_json::from_str(include_str!("../../crates/stability/tests/reference/radii.json")).expect("JSON");
    let entries = all.as_array().expect("a list");
    let text = |entry: &Value, key: &str| entry[key].as_str().expect("a text").to_owned();
    let find = |(name, frames): (&str, Option<u32>)| {
        let entry = entries.iter().find(|entry| entry["name"] == name).expect("a name of the file");
        let scene = Scene::parse(&text(entry, "scene"), name.as_ref(), &[]).expect("a scene");
        Reference { name: name.to_owned(), scene, radius: text(entry, "radius").parse().expect("a number"), frames }
    };
    NAMES.into_iter().map(find).collect()
}
