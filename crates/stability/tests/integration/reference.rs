//! Radii of 50 digits that were computed apart from this program: see `tests/reference/README.md`.

use cohaptic_scene::Scene;
use cohaptic_stability::{Analysis, Method, Verdict, analyse};
use serde_json::Value;

pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) scene: Scene,
    radius: f64,
    rigid_modes: u64,
}

fn cases() -> Vec<Case> {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/radii.json")).unwrap();
    cases_of(&serde_json::from_str::<Vec<Value>>(&text).unwrap())
}

pub(crate) fn cases_of(entries: &[Value]) -> Vec<Case> {
    let case = |entry: &Value| {
        let name = entry["name"].as_str().unwrap().to_owned();
        let count = entry["count"].as_u64().map(|count| format!("scene.count={count}"));
        let overrides: Vec<String> = count.into_iter().collect();
        Case {
            scene: Scene::parse(entry["scene"].as_str().unwrap(), name.as_ref(), &overrides).unwrap_or_else(|error| panic!("{name}: {error}")),
            // The nearest double: the rounding is far below every bound.
            radius: entry["radius"].as_str().unwrap().parse().unwrap(),
            rigid_modes: entry["rigid_modes"].as_u64().unwrap(),
            name,
        }
    };
    entries.iter().map(case).collect()
}

/// The truth lies within the bound.
#[track_caller]
pub(crate) fn compare_value(case: &Case, analysis: &Analysis) {
    let (radius, name) = (analysis.radius, &case.name);
    let apart = (radius.value - case.radius).abs();
    assert!(apart <= radius.error + f64::EPSILON * case.radius, "{name}: {radius:?}, but it is {}", case.radius);
}

/// The truth lies within the bound, and the bound is worth something: below `sharp` of the radius, but for eigenvalues that meet, which rounding moves by its
/// square root or cube root.
#[track_caller]
pub(crate) fn compare(case: &Case, analysis: &Analysis, sharp: f64) {
    compare_value(case, analysis);
    let (radius, name) = (analysis.radius, &case.name);
    assert_eq!(analysis.rigid_modes as u64, case.rigid_modes, "{name}");
    let meeting = ["defective", "free-object", "kt-0", "free-device", "stiff-", "light", "heavy", "no-damping", "nearly"];
    if !meeting.iter().any(|known| name.contains(known)) {
        assert!(radius.error < sharp * case.radius, "{name}: a bound of {:e} says little", radius.error);
    }
}

#[test]
fn the_reduced_radii_are_those_of_fifty_digits() {
    for case in cases() {
        compare(&case, &analyse(&case.scene, Method::Reduced).unwrap(), 1e-8);
    }
}

#[test]
fn the_general_path_finds_the_same() {
    for case in cases() {
        let long = case.scene.links.between(0, 1).mean_delay().as_secs_f64() > 1.0;
        if case.scene.peers.len() <= 8 && !long {
            compare(&case, &analyse(&case.scene, Method::Full).unwrap(), 1e-6);
        }
    }
}

/// Forced through the determinant, delays of any length lead to the same radii.
#[test]
fn the_determinant_finds_the_same() {
    for case in cases() {
        compare_value(&case, &analyse(&case.scene, Method::Determinant).unwrap());
    }
}

/// Numbers between 10⁻³⁰⁰ and 10³⁰⁰, alone and in pairs: a bound holds, or there is none.
#[test]
fn no_number_is_so_absurd_that_a_bound_or_a_verdict_is_wrong() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/absurd.json")).unwrap();
    let cases = cases_of(&serde_json::from_str::<Vec<Value>>(&text).unwrap());
    assert_eq!(cases.len(), 400);
    let mut answered = 0;
    for case in &cases {
        for method in [Method::Reduced, Method::Determinant, Method::Full] {
            let analysis = analyse(&case.scene, method).unwrap();
            let (name, radius, truth) = (&case.name, analysis.radius, case.radius);
            let (low, high) = radius.bounds();
            let slack = f64::EPSILON * truth;
            // A radius above the range of doubles is infinite here too.
            if radius.value.is_finite() {
                assert!(low <= truth + slack && truth - slack <= high, "{name} by {method:?}: {radius:?}, but it is {truth:e}");
            }
            match analysis.verdict() {
                Verdict::Stable => assert!(truth < 1.0, "{name} by {method:?}: {radius:?} is stable, but it is {truth:e}"),
                Verdict::Unstable => assert!(truth > 1.0, "{name} by {method:?}: {radius:?} is unstable, but it is {truth:e}"),
                Verdict::Marginal | Verdict::Overflow => continue,
            }
            answered += 1;
        }
    }
    // Many scenes have a verdict: a program that always answers "overflow" would pass everything above.
    assert!(answered > cases.len(), "{answered} verdicts of {}", 3 * cases.len());
}

/// 10⁻¹⁰ on either side of 1 is told apart; what is 1, or nearer than 10⁻¹⁷, is not.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn the_edge_of_stability_is_seen_from_both_sides() {
    let verdict = |name: &str| {
        let cases = cases();
        let case = cases.iter().find(|case| case.name == name).unwrap();
        analyse(&case.scene, Method::Reduced).unwrap().verdict()
    };
    assert_eq!(verdict("just-stable"), Verdict::Stable);
    assert_eq!(verdict("just-stable-pd"), Verdict::Stable);
    assert_eq!(verdict("just-unstable"), Verdict::Unstable);
    assert_eq!(verdict("just-unstable-pd"), Verdict::Unstable);
    for name in ["on-the-edge", "free-object", "kt-0", "kt-0-bt-0-free", "free-device-without-damping"] {
        assert_eq!(verdict(name), Verdict::Marginal, "{name}");
    }
}
