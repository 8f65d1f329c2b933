//! Random losses and delays against the radii of `tests/reference`, which were made by listing every mode and forming the whole operator.

use cohaptic_scene::Scene;
use cohaptic_stability::{MeanSquare, mean_square};
use serde_json::Value;

/// The analysis of an entry with its name, compared. Twelve digits are given, of eigenvalues from LAPACK in double: good to some 10⁻¹². The bound is below
/// `sharp`.
#[track_caller]
pub(crate) fn compare(entry: &Value, sharp: f64) -> (String, MeanSquare) {
    let word = |key: &str| entry[key].as_str().unwrap();
    let number = |key: &str| word(key).parse::<f64>().unwrap();
    let (name, radius, nominal_squared) = (word("name"), number("mean_square_radius"), number("nominal_radius_squared"));
    let found = mean_square(&Scene::parse(word("scene"), "scene.toml".as_ref(), &[]).unwrap()).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert!((found.radius.value - radius).abs() < 1e-11, "{name}: {radius} {found:?}");
    // The proven bounds: some thousand roundings, times the condition of the eigenvalue.
    assert!(found.radius.error < sharp, "{name}: {found:?}");
    assert!(found.held.value <= found.radius.value, "{name}: {found:?}");
    // The reference takes a loss of everything for random; here it is certain that nothing arrives, with or without chance.
    if name != "loss-certain" {
        assert!((found.nominal_squared.value - nominal_squared).abs() < 1e-13, "{name}: {nominal_squared} {found:?}");
    }
    (name.to_owned(), found)
}

/// Every scene of the reference is analysed, and none is refused.
#[test]
fn every_reference_radius_comes_out() {
    let entries: Vec<Value> = serde_json::from_str(include_str!("../reference/mean_square.json")).unwrap();
    assert_eq!(entries.len(), 62);
    for entry in entries {
        let (name, found) = compare(&entry, 5e-8);
        if matches!(name.as_str(), "loss-certain" | "loss-held-sample") {
            assert_eq!(found.radius.value.to_bits(), found.held.value.to_bits(), "{name}");
            assert!(found.notes.iter().any(|note| note.contains("held sample")), "{name}: {found:?}");
        }
    }
}
