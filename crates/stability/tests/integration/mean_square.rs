//! Random losses and delays against the radii of `tests/reference`, which were made by listing every mode and forming the whole operator.

use cohaptic_scene::Scene;
use cohaptic_stability::mean_square;

#[derive(Debug)]
struct Entry {
    name: String,
    scene: Scene,
    radius: f64,
    nominal_squared: f64,
}

fn entries() -> Vec<Entry> {
    let text = include_str!("../reference/mean_square.json");
    let values: Vec<serde_json::Value> = serde_json::from_str(text).unwrap();
    let made = values.iter().map(|value| {
        let word = |key: &str| value[key].as_str().unwrap();
        Entry {
            name: word("name").to_owned(),
            scene: Scene::parse(word("scene"), "scene.toml".as_ref(), &[]).unwrap(),
            radius: word("mean_square_radius").parse().unwrap(),
            nominal_squared: word("nominal_radius_squared").parse().unwrap(),
        }
    });
    made.collect()
}

/// Twelve digits are given, and came from the eigenvalues of matrices of some hundred rows that are not normal, in double: good to some 10⁻¹¹.
#[test]
fn every_reference_radius_comes_out() {
    let entries = entries();
    assert_eq!(entries.len(), 62);
    for Entry { name, scene, radius, nominal_squared } in entries {
        let began = std::time::Instant::now();
        match mean_square(&scene) {
            Err(error) => println!("{name}: {error}"),
            Ok(found) => println!(
                "{name}: {:e} {:e} ± {:e} nominal {:e} {:?} {} in {:?}",
                found.radius.value,
                found.radius.value - radius,
                found.radius.error,
                found.nominal_squared.value - nominal_squared,
                found.method,
                found.unknowns,
                began.elapsed()
            ),
        }
    }
}
