//! Radii that are known from the paper, from closed forms or from other programs.

use cohaptic_scene::Scene;
use cohaptic_stability::{Method, analyse};

/// The paper's parameters (Rakhsha & Constantinescu 2015, Section 3) with everybody touching.
pub(crate) const PAPER: &str = r#"
    scene        = { duration = "1s", count = 3 }
    object       = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link         = { delay = "8ms" }
"#;

pub(crate) fn scene(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(PAPER, "paper.toml".as_ref(), &overrides).unwrap()
}

/// The radius computed apart from this program from the full matrix: 0.8964881385693.
#[test]
fn three_peers_who_touch_have_the_radius_computed_elsewhere() {
    for method in [Method::Reduced, Method::Full] {
        let analysis = analyse(&scene(&[]), method).unwrap();
        assert!((analysis.radius.value - 0.896_488_138_569_3).abs() < 2e-13, "{analysis:?}");
        assert_eq!(analysis.rigid_modes, 1);
    }
}

/// With a delay of one frame each peer has four states and one sample (a position and a velocity) on its way; the blocks need of a sample only the force
/// that it makes: 4 + 1 rows for the difference, one fewer for the average without the rigid-body mode.
#[test]
fn nothing_is_a_state_that_decides_nothing() {
    let analysis = analyse(&scene(&[]), Method::Reduced).unwrap();
    let sizes: Vec<(usize, usize)> = analysis.modes[0].parts.iter().map(|part| (part.size, part.copies)).collect();
    assert_eq!((analysis.dimension, sizes), (3 * (4 + 2) - 1, vec![(4, 1), (5, 2)]));
}

/// A device of 10⁻⁶⁰ kg that touches nothing stands still after a tick, which rounding over eight ticks cannot show: nothing is known of its radius, and its bound is
/// a number all the same.
#[test]
fn a_bound_that_overflowed_over_a_frame_says_nothing() {
    let analysis = analyse(&scene(&["peer.device.mass=1e-60", "peer.contact=none", "peer.coupling.stiffness=0"]), Method::Reduced).unwrap();
    let parts = &analysis.modes[0].parts;
    let loose = parts.iter().find(|part| part.kind.word() == "loose-device").unwrap();
    assert_eq!((loose.radius.value, loose.radius.error), (f64::INFINITY, f64::INFINITY), "{loose:?}");
    assert!(parts.iter().all(|part| !part.radius.error.is_nan()), "{parts:?}");
}
