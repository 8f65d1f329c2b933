//! Scenes whose radius is known to fifty digits, and one whose mean-square radius is known to twelve.

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

const RADII: &str = include_str!("../../reference/radii.json");
const MEAN_SQUARE: &str = include_str!("../../reference/mean_square.json");

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
    let all: Value = serde_json::from_str(RADII).expect("JSON");
    let find = |(name, frames): (&str, Option<u32>)| reference(&all, name, "radius", frames);
    NAMES.into_iter().map(find).collect()
}

/// Two peers that lose a tenth of all samples; the radius is that of the second moment.
///
/// # Panics
///
/// If the file of references is not what it is.
#[must_use]
pub fn mean_square_reference() -> Reference {
    let all: Value = serde_json::from_str(MEAN_SQUARE).expect("JSON");
    reference(&all, "loss-n2-ap-8ms-p0.1", "mean_square_radius", None)
}

/// Three equal peers at 24 ms on the edge of stability, and the text of the scene: its stiffness KT is the number next to the boundary.
///
/// # Panics
///
/// If the file of references is not what it is.
#[must_use]
pub fn on_the_edge() -> (Reference, String) {
    let all: Value = serde_json::from_str(RADII).expect("JSON");
    let name = "on-the-edge";
    (reference(&all, name, "radius", Some(3)), text(entry(&all, name), "scene"))
}

fn entry<'a>(all: &'a Value, name: &str) -> &'a Value {
    all.as_array().expect("a list").iter().find(|entry| entry["name"] == name).expect("a name of the file")
}

fn text(entry: &Value, key: &str) -> String {
    entry[key].as_str().expect("a text").to_owned()
}

fn reference(all: &Value, name: &str, radius: &str, frames: Option<u32>) -> Reference {
    let entry = entry(all, name);
    let scene = Scene::parse(&text(entry, "scene"), name.as_ref(), &[]).expect("a scene");
    Reference { name: name.to_owned(), scene, radius: text(entry, radius).parse().expect("a number"), frames }
}
