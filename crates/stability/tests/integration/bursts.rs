//! Losses in bursts with samples that overtake, against the radii of `tests/reference/bursts.py`, which draws the fate of each sample when it is sent.

use cohaptic_scene::Scene;
use cohaptic_stability::{MeanSquareMethod, mean_square};
use serde_json::Value;

/// The reference uses neither the hazards nor the places of this crate. For its entries without memory, this crate needs no chain.
#[test]
fn radii_are_those_of_samples_whose_fates_are_drawn_one_by_one() {
    let entries: Vec<Value> = serde_json::from_str(include_str!("../reference/bursts.json")).unwrap();
    assert_eq!(entries.len(), 7);
    for entry in entries {
        let word = |key: &str| entry[key].as_str().unwrap();
        let (name, expected) = (word("name"), word("mean_square_radius").parse::<f64>().unwrap());
        let found = mean_square(&Scene::parse(word("scene"), "scene.toml".as_ref(), &[]).unwrap()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(found.method, MeanSquareMethod::Events, "{name}");
        // Twelve digits are given; LAPACK in double leaves some 10⁻¹² open, more for the largest operators.
        assert!((found.radius.value - expected).abs() < 2e-11 && found.radius.error < 1e-8, "{name}: {expected} {found:?}");
    }
}
