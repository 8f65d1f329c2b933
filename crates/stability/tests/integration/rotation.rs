//! Objects that turn.

use cohaptic_scene::Scene;
use cohaptic_stability::{Method, PartKind, admittance, analyse, monodromy};

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

/// Nine radii of the differences across the grasp, and nine of the pivots, computed apart from this program: J is 2.7·10⁻⁴ kg·m².
#[test]
fn one_grasp_for_all_has_the_radii_computed_elsewhere() {
    for (peers, delay, grasp, stiffness, across, pivot) in [
        (3, 24, 0.03, 1000.0, 0.929_838_311, 1.038_068_529),
        (5, 8, 0.02, 2000.0, 0.864_191_270, 0.974_580_702),
        (2, 8, 0.03, 500.0, 0.862_751_514, 0.946_850_240),
    ] {
        let set = [
            format!("scene.count={peers}"),
            format!("link.delay={delay}ms"),
            format!("peer.grasp=[{grasp}, 0, 0]"),
            format!("coordination.stiffness={stiffness}"),
        ];
        let found = analyse(&scene(&set.each_ref().map(String::as_str)), Method::Reduced).unwrap();
        let difference = |motion: &str| {
            let mode = found.modes.iter().find(|mode| mode.motion.starts_with(motion)).unwrap();
            mode.parts.iter().find(|part| matches!(part.kind, PartKind::Apart { .. })).unwrap().radius.value
        };
        for (motion, expected) in [("touched 2", across), ("pivot", pivot)] {
            assert!((difference(motion) - expected).abs() <= 5.5e-10, "{peers}, {motion}: {}", difference(motion));
        }
        assert!((found.radius.value - across.max(pivot)).abs() <= 5.5e-10, "{found:?}");
        assert_eq!(found.rigid_modes, 6);
    }
}

#[test]
fn what_does_not_follow_turns_refuses_them_by_name() {
    let scene = scene(&[]);
    let error = monodromy(&scene).unwrap_err();
    assert!(error.to_string().starts_with("the monodromy matrix does not follow an object that turns"), "{error}");
    let error = admittance(&scene, 0, &[1.0]).unwrap_err();
    assert!(error.to_string().contains("does not follow an object that turns"), "{error}");
}
