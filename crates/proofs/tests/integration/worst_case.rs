//! The worst case of whole scenes: it is nominal where nothing is left to choose, and ends where the watch says so.

use cohaptic_proofs::{Effort, Links, Patterns, SceneWorstCaseError, worst_case, worst_case_watched};
use cohaptic_scene::Scene;
use cohaptic_stability::{AnalysisError, Method, analyse};

use crate::cases::cases;
use crate::ends::ends_wherever_it_is_asked;

const THREE: &str = r#"
    scene        = { duration = "1s", count = 3 }
    object       = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link         = { delay = "24ms" }
"#;

/// The watch is asked at least once per product of matrices.
#[test]
fn a_worst_case_ends() {
    let scene = Scene::parse(THREE, "three.toml".as_ref(), &[]).unwrap();
    let patterns = Patterns { losses_in_a_row: 2, delay: None, links: Links::Together };
    let effort = Effort { accuracy: 1e-9, products: 2000 };
    ends_wherever_it_is_asked(2000, |ends| match worst_case_watched(&scene, &patterns, &effort, ends) {
        Err(SceneWorstCaseError::Analysis(AnalysisError::Stopped)) => true,
        found => {
            found.unwrap();
            false
        }
    });
}

/// With nothing lost and no delay that varies there is one frame, and the growth a period lies between the bounds: it is the radius over a frame of one
/// period, known to fifty digits.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn the_worst_case_is_nominal_where_nothing_is_left_to_choose() {
    let mut compared = 0;
    for case in cases().iter().filter(|case| case.felt.is_some()) {
        let patterns = Patterns { losses_in_a_row: 0, delay: None, links: Links::Together };
        let effort = Effort { products: 2000, ..Effort::default() };
        let Ok(found) = worst_case(&case.scene, &patterns, &effort) else { continue };
        let rounding = found.parts.iter().map(|part| part.rounding).fold(0.0, f64::max);
        // The bounds are those of the matrices as computed, whose errors move the radius as the bound of the nominal radius says.
        let nominal = analyse(&case.scene, Method::Reduced).unwrap().radius.error.max(rounding);
        assert!(
            found.lower <= case.radius + nominal && case.radius <= found.upper + nominal,
            "{}: {} to {}, but it is {}",
            case.name,
            found.lower,
            found.upper,
            case.radius
        );
        compared += 1;
    }
    assert!(compared > 40, "{compared}");
}
