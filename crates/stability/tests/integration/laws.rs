//! The laws that remember, extrapolate or look back, against values that were computed apart from this program: see `tests/reference/README.md`.

use cohaptic_stability::{AnalysisError, Method, analyse};
use serde_json::Value;

use crate::reference::{Case, cases_of, compare};
use crate::{admittance, anchors, mean_square};

fn entries(kind: &str) -> Vec<Value> {
    let all: Value = serde_json::from_str(include_str!("../reference/laws.json")).unwrap();
    all[kind].as_array().unwrap().clone()
}

fn cases() -> Vec<Case> {
    let cases = cases_of(&entries("radii"));
    assert!(cases.len() >= 30, "{}", cases.len());
    cases
}

/// The states of many ticks are as many eigenvalues near zero, which the general path and the determinant bound loosely: of these only the truth of the
/// bound is asked.
fn sharp(case: &Case) -> f64 {
    if case.name.starts_with("local-lag") { f64::INFINITY } else { 1e-6 }
}

#[test]
fn the_reduced_radii_of_laws_are_those_of_fifty_digits() {
    for case in cases() {
        compare(&case, &analyse(&case.scene, Method::Reduced).unwrap(), 1e-8);
    }
}

#[test]
fn the_general_path_finds_the_same_of_laws() {
    for case in cases().iter().filter(|case| case.scene.peers.len() <= 8) {
        compare(case, &analyse(&case.scene, Method::Full).unwrap(), sharp(case));
    }
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn the_determinant_finds_the_same_of_laws() {
    for case in cases() {
        compare(&case, &analyse(&case.scene, Method::Determinant).unwrap(), sharp(&case));
    }
}

/// With losses and random delays; a horizon of a second is never reached. The proven bounds of long lags are wider than those of other laws.
#[test]
fn the_mean_squares_of_laws_come_out() {
    let entries = entries("mean_square");
    assert!(entries.len() >= 20, "{}", entries.len());
    for entry in entries {
        let (name, found) = mean_square::compare(&entry, 1e-6);
        // Of a force with a lag a held sample is felt as without it; a sample that is extrapolated moves on by its velocity and is felt whole.
        match name.as_str() {
            "smoothed-held-sample" => assert_eq!(found.radius.value.to_bits(), found.held.value.to_bits(), "{found:?}"),
            "extrapolated-held-sample" => assert!(found.radius.value > found.held.value + 0.05, "{found:?}"),
            _ => {}
        }
    }
}

#[test]
fn the_admittances_of_laws_are_those_of_long_arithmetic() {
    let entries = entries("admittance");
    assert!(entries.len() >= 30, "{}", entries.len());
    admittance::compare(&entries);
}

/// A clock that is late by 300 µs shows another age at every tick, the same in every frame; the second moment is not followed then. Clocks that drift apart show
/// another age in every frame.
#[test]
fn ages_by_clocks_are_followed_until_clocks_drift_apart() {
    let extrapolated = |keys: &[&str]| anchors::scene(&[&["coordination.strategy=extrapolated"], keys].concat());
    let late = ["peers.peer2.clock.offset=300us"];
    assert!(analyse(&extrapolated(&late), Method::Reduced).is_ok());
    let lossy = extrapolated(&[late[0], "link.loss=10%"]);
    assert!(
        matches!(cohaptic_stability::mean_square(&lossy), Err(AnalysisError::ChanceWithoutMoments { why, .. }) if why.contains("clocks that differ"))
    );
    // Clocks run fast alike: ages are numbers of ticks.
    let [fast, regular] = [&["peer.clock.drift=0.01", "link.delay=0s"], &["peer.clock.drift=0", "link.delay=0s"]].map(|keys| extrapolated(keys));
    assert!(analyse(&fast, Method::Reduced).is_ok() && analyse(&regular, Method::Reduced).is_ok());
    let apart = extrapolated(&["peers.peer2.clock.drift=0.0625"]);
    for method in [Method::Reduced, Method::Full] {
        assert!(matches!(analyse(&apart, method), Err(AnalysisError::AgesByClocks { strategy: "extrapolated" })), "{method:?}");
    }
}
