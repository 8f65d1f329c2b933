//! Scenes whose radius is known to fifty digits, and a scene whose mean-square radius is known to twelve.

use cohaptic_scene::Scene;
use serde_json::Value;

/// A scene of `crates/stability/tests/reference/radii.json`.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Name in the file of references.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// Spectral radius, rounded to a double.
    pub radius: f64,
    /// Delay of all links in frames, for scenes with equal peers that grasp and with samples that take whole frames, as `BarePair` needs; otherwise `None`.
    pub frames: Option<u32>,
}

const RADII: &str = include_str!("../../reference/radii.json");
const MEAN_SQUARE: &str = include_str!("../../reference/mean_square.json");

/// Names of the scenes in the file, with [`Reference::frames`].
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

/// Returns the reference scenes.
///
/// # Panics
///
/// If the file of references lacks a scene or is malformed.
#[must_use]
pub fn references() -> Vec<Reference> {
    let all: Value = serde_json::from_str(RADII).expect("JSON");
    let find = |(name, frames): (&str, Option<u32>)| reference(&all, name, "radius", frames);
    NAMES.into_iter().map(find).collect()
}

/// Returns a scene of two peers that lose a tenth of all samples, with the radius of the second moment.
///
/// # Panics
///
/// If the file of references lacks the scene or is malformed.
#[must_use]
pub fn mean_square_reference() -> Reference {
    let all: Value = serde_json::from_str(MEAN_SQUARE).expect("JSON");
    reference(&all, "loss-n2-ap-8ms-p0.1", "mean_square_radius", None)
}

/// Returns a scene of three equal peers at 24 ms on the edge of stability, and the text of the scene. Its stiffness KT is the double next to the boundary.
///
/// # Panics
///
/// If the file of references lacks the scene or is malformed.
#[must_use]
pub fn on_the_edge() -> (Reference, String) {
    let all: Value = serde_json::from_str(RADII).expect("JSON");
    let name = "on-the-edge";
    (reference(&all, name, "radius", Some(3)), text(entry(&all, name), "scene"))
}

/// Returns the entry of a scene in the file.
fn entry<'a>(all: &'a Value, name: &str) -> &'a Value {
    all.as_array().expect("a list").iter().find(|entry| entry["name"] == name).expect("a name of the file")
}

/// Returns a text of an entry.
fn text(entry: &Value, key: &str) -> String {
    entry[key].as_str().expect("a text").to_owned()
}

/// Returns the reference of an entry, with its radius under the key `radius`.
fn reference(all: &Value, name: &str, radius: &str, frames: Option<u32>) -> Reference {
    let entry = entry(all, name);
    let scene = Scene::parse(&text(entry, "scene"), name.as_ref(), &[]).expect("a scene");
    // Digits beyond a double are rounded by the parser.
    Reference { name: name.to_owned(), scene, radius: text(entry, radius).parse().expect("a number"), frames }
}
