//! Everything that is printed with a bound, over random scenes, against the truth in long arithmetic: see `tests/reference/README.md`.
//!
//! | printed | is | counted here |
//! | --- | --- | --- |
//! | `spectral radius … +- …` of `stability point` and `admittance` | a bound of rounding | [`no_spectral_radius_is_farther_off_than_it_says`] |
//! | `a spring of`, `a viscosity of`, `an inertia of … +- …` of `admittance` | a bound of extrapolation and rounding | [`no_limit_is_farther_off_than_it_says`] |
//! | crossings of `stability boundary` within a tolerance | half the tolerance | [`a_boundary_is_where_the_radius_is_one`] |
//! | `growth … between … and …`, `a quadratic certificate` of a worst case | bounds | `the_worst_case_is_nominal_where_nothing_is_left_to_choose`, `worst_case/tests.rs` of `cohaptic-proofs` |

use cohaptic_stability::{Admittance, Boundary, BoundaryOptions, Estimate, Family, KeyRange, Method, Radius, Verdict, analyse};

use crate::cases::cases;

/// A bound is one: of all these scenes none may be outside. The reference is a double, half a unit in the last place from the truth.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn no_spectral_radius_is_farther_off_than_it_says() {
    for method in [Method::Reduced, Method::Determinant, Method::Full] {
        let mut wide = Vec::new();
        for case in cases() {
            let analysis = analyse(&case.scene, method).unwrap();
            let Radius { value, error } = analysis.radius;
            assert_eq!(analysis.rigid_modes as u64, case.rigid_modes, "{}", case.name);
            let off = (value - case.radius).abs();
            assert!(off <= error + f64::EPSILON * case.radius, "{method:?} {}: {value} +- {error:e}, but it is {}", case.name, case.radius);
            if error > 1e-6 * case.radius {
                wide.push(format!("{} {value:e} +- {error:e}", case.name));
            }
        }
        // A bound that says nothing would hold too: it is sharp for nine scenes in ten.
        assert!(wide.len() < 20, "{method:?}: {wide:#?}");
    }
}

/// Whatever the gains, from nothing to 10¹⁴ N/m: what the two methods for every scene say is true, and where one is sure the other is too. The determinant,
/// which is chosen for long delays only, is never sure of a wrong verdict.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn the_verdicts_of_all_gains_are_true() {
    for case in cases() {
        let [reduced, full, determinant] =
            [Method::Reduced, Method::Full, Method::Determinant].map(|method| analyse(&case.scene, method).unwrap().verdict());
        let expected = if case.radius > 1.0 { Verdict::Unstable } else { Verdict::Stable };
        // Rounding of a frame covers no more than this.
        if (case.radius - 1.0).abs() < 1e-9 {
            assert!(
                [expected, Verdict::Marginal].contains(&reduced) && [expected, Verdict::Marginal].contains(&full),
                "{}: {}",
                case.name,
                case.radius
            );
        } else {
            assert_eq!((reduced, full), (expected, expected), "{}: {}", case.name, case.radius);
        }
        assert!([expected, Verdict::Marginal, Verdict::Overflow].contains(&determinant), "{}: {determinant:?}", case.name);
    }
}

#[test]
fn no_limit_is_farther_off_than_it_says() {
    let mut outside = Vec::new();
    let (mut compared, mut sharp) = (0, 0);
    for case in cases() {
        let Some((place, truth)) = case.felt else { continue };
        let fit = Admittance::of(&case.scene, place).unwrap().fit_low_frequency();
        let tied = fit.stiffness.value != 0.0 || fit.stiffness.error != 0.0;
        for (what, Estimate { value, error }, truth) in
            [("stiffness", fit.stiffness, truth[0]), ("viscosity", fit.viscosity, truth[1]), ("inertia", fit.inertia, truth[2])]
        {
            // What nothing ties has a stiffness of exactly zero; the reference reads 10⁻⁴⁰ N/m.
            if what == "stiffness" && !tied {
                assert!(truth.abs() < 1e-30, "{}: {truth}", case.name);
                continue;
            }
            compared += 1;
            sharp += usize::from(error < 1e-4 * truth.abs());
            let off = (value - truth).abs();
            if off.is_nan() || off > error + f64::EPSILON * truth.abs() {
                outside.push(format!("{} {what}: {value} +- {error:e}, but it is {truth}: {:.2} times", case.name, off / error));
            }
        }
    }
    assert!(outside.is_empty(), "{} of {compared}: {outside:#?}", outside.len());
    assert!(compared > 300 && 10 * sharp > 9 * compared, "{sharp} of {compared}");
}

/// The verdicts of [`analyse`] half a tolerance below and above each crossing equal the verdicts of the boundary.
#[test]
fn a_boundary_is_where_the_radius_is_one() {
    let mut found = 0;
    for case in cases().iter().filter(|case| case.felt.is_some()).take(40) {
        let key = KeyRange::parse("coordination.stiffness=10..4000").unwrap();
        let family = Family::new(&case.text, case.name.as_ref(), &[], vec![key.clone()]).unwrap();
        let options = BoundaryOptions { samples: 40, tolerance: 1e-4, ..BoundaryOptions::of(&key) };
        let boundary = Boundary::find(&family, options, &[], |_| (), || false).unwrap();
        let verdict = |stiffness: f64| {
            let mut scene = case.scene.clone();
            scene.coordination.gains.stiffness = stiffness;
            analyse(&scene, Method::Full).unwrap().verdict()
        };
        for crossing in boundary.crossings.iter().filter(|crossing| crossing.from != Verdict::Marginal && crossing.to != Verdict::Marginal) {
            let half = 0.5 * options.tolerance;
            assert_eq!((verdict(crossing.value - half), verdict(crossing.value + half)), (crossing.from, crossing.to), "{}: {crossing:?}", case.name);
            found += 1;
        }
    }
    assert!(found >= 10, "{found} crossings");
}
