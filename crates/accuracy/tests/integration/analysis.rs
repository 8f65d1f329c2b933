use std::sync::LazyLock;

use cohaptic_accuracy::analysis::references::{on_the_edge, references};
use cohaptic_accuracy::analysis::{Effort, rows};
use cohaptic_accuracy::{Row, Unwatched};

use crate::rows::assert_sound;

const EFFORT: Effort = Effort { rounds: 1, growth_frames: &[50, 200, 800], boundary_seconds: &[1, 4], runs: &[100, 1000, 10_000] };

static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| rows(EFFORT, &Unwatched).unwrap());

fn of(case: &str, methods: &[&str]) -> Vec<&'static Row> {
    ROWS.iter().filter(|row| row.case.starts_with(case) && methods.contains(&row.method.as_str())).collect()
}

#[test]
fn every_row_is_sound() {
    assert_sound(&ROWS);
    for reference in references() {
        assert!(ROWS.iter().any(|row| row.case == format!("radius, {}", reference.name)), "{}", reference.name);
    }
}

/// The reference has 50 digits and comes from another program, so an error above the claimed one is a wrong claim.
#[test]
fn every_radius_is_as_close_to_the_reference_as_it_claims() {
    let verdicts = of("radius, ", &["full", "reduced", "determinant"]);
    assert!(verdicts.len() >= 20);
    for row in verdicts {
        let claimed = row.note.strip_prefix("claims an error of at most ").and_then(|note| note.split_once(';')).unwrap().0;
        // The claim is printed with one digit, and a reference rounded to a double is off by half a unit in the last place.
        assert!(row.error.unwrap() <= 1.5 * claimed.parse::<f64>().unwrap() + 2e-16, "{row:?}");
    }
}

/// Two methods with errors a and b differ by at most a + b, so all three methods agree to 10⁻¹¹ (full has 4·10⁻¹² for a nearly defective matrix).
#[test]
fn the_methods_agree() {
    for row in of("radius, ", &["full", "reduced", "determinant"]) {
        assert!(row.error.unwrap() < 5e-12, "{row:?}");
    }
}

/// A disturbance gives the radius to a few percent, and to more digits the longer it lasts. On the edge of stability it never decays.
#[test]
fn more_frames_tell_more_as_long_as_there_is_a_disturbance() {
    let errors: Vec<f64> = of("radius, just-stable", &["growth"]).iter().map(|row| row.error.unwrap()).collect();
    assert!(errors.len() == 3 && errors.windows(2).all(|pair| pair[1] < 0.2 * pair[0]), "{errors:?}");
}

/// Halving 1600 N/m 52 times leaves less than a unit in the last place of 1806 N/m, 2·10⁻¹³. The radius is off by up to 2·10⁻¹⁵ and changes by 1.83·10⁻⁵ per
/// N/m (from `on-the-edge` to `just-unstable` of the references), so the boundary is off by up to 1.1·10⁻¹⁰ N/m. The search stops at 10⁻⁹ of its range.
#[test]
fn boundaries_are_found_to_what_their_verdicts_allow() {
    for row in of("boundary", &["full", "reduced", "family"]) {
        assert!(row.error.unwrap() < 1.5e-10, "{row:?}");
    }
    assert!(of("boundary", &["search"])[0].error.unwrap() < 1.6e-6);
    // A simulation finds the same boundary with a larger error, which falls with the length of the simulation.
    for method in ["growth", "two runs"] {
        let errors: Vec<f64> = of("boundary", &[method]).iter().map(|row| row.error.unwrap()).collect();
        assert!(errors.windows(2).all(|pair| pair[1] < pair[0]) && errors[0] < 20.0, "{method}: {errors:?}");
    }
}

#[test]
fn the_reference_of_the_boundary_lies_on_the_edge() {
    let (edge, text) = on_the_edge();
    assert!((edge.radius - 1.0).abs() < 2e-18, "{}", edge.radius);
    assert!(text.contains(&format!("stiffness = {:?}", edge.scene.coordination.gains.stiffness)));
}

/// The seeds are fixed. The interval of 95 % covers the exact probability for each number of runs of this test, and narrows with the root of this number.
#[test]
fn the_interval_of_monte_carlo_covers_the_exact_probability_and_narrows() {
    let rows = of("probability", &["monte carlo"]);
    assert_eq!(rows.len(), 6);
    assert!(rows.iter().all(|row| row.note.contains("covers the exact")), "{rows:?}");
    let halves: Vec<f64> = rows.iter().filter(|row| row.error_unit.starts_with("half")).map(|row| row.error.unwrap()).collect();
    for pair in halves.windows(2) {
        // √10 = 3.16; the observed shares differ by at most a fifth.
        assert!((2.6..3.8).contains(&(pair[0] / pair[1])), "{halves:?}");
    }
}

/// The weights of 2¹⁴ patterns are products of 14 factors with 15 roundings each, and their sum has 2¹⁴ roundings of at most 2⁻⁵³.
#[test]
fn the_patterns_of_losses_are_all_there_are() {
    let [every] = of("probability", &["every pattern"])[..] else { panic!("one row") };
    assert!(every.error.unwrap() < 16_400.0 * f64::EPSILON, "{every:?}");
    let exact: f64 = every.note.split_once(';').unwrap().0.parse().unwrap();
    assert!((0.05..0.5).contains(&exact), "an event that is neither sure nor seldom: {exact}");
}

/// The operator claims its error. Runs are biased by modes that have not decayed between the windows, by less than a hundredth.
#[test]
fn the_second_moment_grows_by_what_its_operator_says() {
    let [operator] = of("mean square", &["operator"])[..] else { panic!("one row") };
    // The reference has twelve digits.
    assert!(operator.error.unwrap() < 1e-12, "{operator:?}");
    for row in of("mean square", &["monte carlo"]) {
        assert!(row.error.unwrap() < 0.01, "{row:?}");
    }
}
