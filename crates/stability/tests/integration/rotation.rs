//! Objects that turn.

use cohaptic_scene::Scene;
use cohaptic_stability::{AnalysisError, Method, admittance, analyse, mean_square, monodromy};

/// The paper's peers, who hold an object that turns.
const TURNS: &str = r#"
    scene        = { duration = "1s", count = 2, axes = 3 }
    object       = { mass = 0.45, inertia = 2.7e-4 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link         = { delay = "8ms" }
"#;

fn scene(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(TURNS, "turns.toml".as_ref(), &overrides).unwrap()
}

#[test]
fn an_object_that_turns_is_refused_by_name() {
    let scene = scene(&[]);
    let refused = |error: &AnalysisError| matches!(error, AnalysisError::Turns { .. });
    for method in [Method::Reduced, Method::Determinant, Method::Full] {
        assert!(refused(&analyse(&scene, method).unwrap_err()));
    }
    assert!(refused(&mean_square(&scene).unwrap_err()) && refused(&monodromy(&scene).unwrap_err()));
    let error = admittance(&scene, 0, &[1.0]).unwrap_err();
    assert!(error.to_string().contains("of an object that turns"), "{error}");
}
