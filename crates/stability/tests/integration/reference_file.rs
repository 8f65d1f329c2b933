//! Reader of the files of `tests/reference` with twelve digits, whose scenes have radii and boundaries. The README of that folder describes the format.

use cohaptic_scene::Scene;
use cohaptic_stability::{Family, FamilyScratch, KeyRange, Method, Verdict, analyse};
use serde_json::Value;

/// Scene with its radius.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) text: String,
    pub(crate) scene: Scene,
    pub(crate) radius: f64,
}

/// A file of reference values.
pub(crate) struct ReferenceFile {
    /// Content of the file.
    pub(crate) json: &'static str,
    /// Number of radii in the file.
    pub(crate) radii: usize,
}

impl ReferenceFile {
    /// Returns the entries of one kind, such as `boundaries`.
    pub(crate) fn entries(&self, kind: &str) -> Vec<Value> {
        let all: Value = serde_json::from_str(self.json).unwrap();
        all[kind].as_array().unwrap().clone()
    }

    /// Returns all scenes with a radius.
    pub(crate) fn cases(&self) -> Vec<Case> {
        let case = |entry: &Value| {
            let text_of = |key: &str| text(entry, key);
            Case { name: text_of("name"), scene: parsed(&text_of("scene"), &[]), text: text_of("scene"), radius: text_of("radius").parse().unwrap() }
        };
        let cases: Vec<Case> = self.entries("radii").iter().map(case).collect();
        assert_eq!(cases.len(), self.radii);
        cases
    }

    /// Returns the scene of this name.
    pub(crate) fn case(&self, name: &str) -> Case {
        self.cases().into_iter().find(|case| case.name == name).unwrap()
    }
}

/// Returns a text of an entry.
pub(crate) fn text(entry: &Value, key: &str) -> String {
    entry[key].as_str().unwrap().to_owned()
}

/// Reads a scene with overrides.
pub(crate) fn parsed(text: &str, overrides: &[&str]) -> Scene {
    Scene::parse(text, "reference.toml".as_ref(), &owned(overrides)).unwrap()
}

/// Returns overrides as the library takes overrides.
pub(crate) fn owned(overrides: &[&str]) -> Vec<String> {
    overrides.iter().map(|text| (*text).to_owned()).collect()
}

/// Compares a map or line over `key` with the analysis of single scenes, at some values. Each bound is below `sharp`.
#[track_caller]
pub(crate) fn compare_family(text: &str, key: &str, values: [f64; 2], sharp: f64) {
    let range = KeyRange::parse(key).unwrap();
    let family = Family::new(text, "reference.toml".as_ref(), &[], vec![range.clone()]).unwrap();
    let mut scratch = FamilyScratch::default();
    for value in values {
        let found = family.bounded_radius(&[value], &mut scratch).unwrap();
        let scene = parsed(text, &[&range.text(value)]);
        let expected = analyse(&scene, Method::Reduced).unwrap().radius;
        assert!((found.radius.value - expected.value).abs() < 1e-12, "{key} at {value}: {found:?} is not {expected:?}");
        assert!(found.radius.error < sharp, "{key} at {value}: a bound of {:e} says little", found.radius.error);
    }
}

/// Returns the parts of the first mode of a scene: kind, peer and number of copies.
pub(crate) fn parts(case: &Case) -> Vec<(&'static str, Option<usize>, usize)> {
    let analysis = analyse(&case.scene, Method::Reduced).unwrap();
    analysis.modes[0].parts.iter().map(|part| (part.kind.word(), part.kind.peer(), part.copies)).collect()
}

/// Checks the verdict on a scene within `apart` of each side of its boundary. `key` is the key that changes.
#[track_caller]
pub(crate) fn compare_boundary(entry: &Value, key: &str, apart: f64) {
    let crossing: f64 = text(entry, "crossing").parse().unwrap();
    let verdict = |value: f64| {
        let scene = parsed(&text(entry, "scene"), &[&format!("{key}={value}")]);
        analyse(&scene, Method::Reduced).unwrap().verdict()
    };
    assert_eq!((verdict(crossing - apart), verdict(crossing + apart)), (Verdict::Stable, Verdict::Unstable), "{entry}");
}
