use super::reference::{PLACES, QUANTILES};
use super::*;

/// The digits of a delay near its floor are those of the sum floor + X, so errors are relative to the delay.
#[test]
fn quantiles_agree_with_the_reference_in_both_tails() {
    for case in QUANTILES {
        let law = law(case.name, case.mean, case.sd, case.floor);
        for (place, expected) in PLACES.into_iter().zip(case.quantiles) {
            let z = place.normal();
            for (way, found) in [("place", law.at(place)), ("normal", law.at_normal(z))] {
                let error = (found - expected) / expected.abs().max(1e-300);
                assert!(
                    error.abs() < 1e-12,
                    "{} {} {} {} at {place:?} by {way}: {found} is not {expected}: {error:e}",
                    case.name,
                    case.mean,
                    case.sd,
                    case.floor
                );
            }
        }
    }
}

/// cdf and survival invert the quantiles. A relative error ε of a delay becomes an error of ε·delay·density/probability, which is large in steep tails.
#[test]
fn the_distribution_function_inverts_the_quantiles() {
    for (name, law) in every_law() {
        if name == "table" {
            continue;
        }
        for place in PLACES {
            let delay = law.at(place);
            if delay <= law.least() {
                assert!(law.survival(delay) <= place.above(), "{name}: the floor holds what was cut");
                continue;
            }
            let (found, expected) = match place {
                Tail::Below(p) => (law.cdf(delay), p),
                Tail::Above(q) => (law.survival(delay), q),
            };
            let nearby = match place {
                Tail::Below(_) => law.cdf(delay * (1.0 + 1e-13)) - found,
                Tail::Above(_) => found - law.survival(delay * (1.0 + 1e-13)),
            };
            assert!((found / expected - 1.0).abs() < 1e-11 + 10.0 * nearby / expected, "{name} at {place:?}: {found}");
            assert!((law.cdf(delay) + law.survival(delay) - 1.0).abs() < 1e-15);
        }
    }
}

#[test]
fn a_table_gives_its_entries_and_counts_them() {
    let law = law("table", 24.0, 8.192, 0.0);
    let entries = [-9.0, -4.0, -4.0, 0.0, 1.0, 5.0, 12.0, 20.0];
    for (i, entry) in entries.into_iter().enumerate() {
        assert!((law.quantile((i as f64 + 0.5) / 8.0) - (24.0 + entry)).abs() < 1e-13);
    }
    assert_eq!([14.9, 15.1, 20.1, 24.1, 50.0].map(|x| law.cdf(x)), [0.0, 0.125, 0.375, 0.5, 1.0]);
}

/// Large shapes: Fisher & Cornish's expansion (Abramowitz & Stegun 26.2.49) of the gamma law with skewness γ = 2/√a, in powers of γ; at a = 10¹² the
/// first term left out is z⁵·a^(−2)·sd, 10⁻²⁰ of the mean.
#[test]
fn a_narrow_gamma_law_agrees_with_its_expansion() {
    for shape in [1e10, 1e12, 1e15, 1e17, 1e20] {
        let sd = 1.0 / libm::sqrt(shape);
        let law = Law::new(&Distribution::Gamma, 1.0, sd, None).unwrap();
        for z in [-7.0, -2.0, -0.3, 0.0, 1.0, 4.0, 7.0_f64] {
            let expected = 1.0 + z * sd + (z * z - 1.0) / 3.0 * sd * sd + (z * z * z - 7.0 * z) / 36.0 * sd * sd * sd;
            for found in [law.at_normal(z), law.at(Tail::of_normal(z))] {
                assert!((found - expected).abs() < 5e-16 + 1e-13 * sd, "{shape}, {z}: {found} is not {expected}");
            }
        }
    }
}

/// The fast map and the exact inverse compute the same function.
#[test]
fn the_quick_gamma_map_is_exact() {
    for variation in [0.001, 0.03, 0.14, 0.3, 1.0, 1.5, 3.0, 30.0, 100.0] {
        let law = Law::new(&Distribution::Gamma, 1.0, variation, None).unwrap();
        for i in -9000..9000 {
            let z = f64::from(i) * 0.000_987;
            let (quick, exact) = (law.at_normal(z), law.at(Tail::of_normal(z)));
            // The error of the exact inverse is that of the last digits of the probability, divided by the shape.
            assert!((quick - exact).abs() <= (1e-13 + 3e-14 * variation * variation) * exact, "{variation}, {z}: {quick} is not {exact}");
        }
    }
}

/// A law with a choice of form and a known gamma law give the same bits, also at the edges of cells and beyond the last cell.
#[test]
fn gamma_delays_are_those_of_their_law() {
    for (variation, floor) in [(0.08, 0.0), (0.3, 0.5), (1.0, 0.0), (3.0, 0.0)] {
        let law = Law::new(&Distribution::Gamma, 1.0, variation, Some(floor)).unwrap();
        let gamma = law.as_gamma().unwrap();
        let edges = (-640..=640).flat_map(|i| [-1e-15, 0.0, 1e-15].map(|by| f64::from(i) / 64.0 + by));
        for z in edges.chain([-40.0, -37.5, 40.0, 1e300, f64::NEG_INFINITY, f64::INFINITY]) {
            assert_eq!(gamma.at_normal(z).to_bits(), law.at_normal(z).to_bits(), "{variation}, {z}");
        }
    }
}

#[test]
fn the_mean_and_the_deviation_are_those_of_the_quantiles() {
    for (name, law) in every_law() {
        // Panels have a width of 1/256 in z. Jumps and kinks inside a panel add an error of a part of its probability.
        let (mut mean, mut variance) = (0.0, 0.0);
        for i in -13 * 256..24 * 256 {
            let low = f64::from(i) / 256.0;
            special::quadrature::panel(low, low + 1.0 / 256.0, |z, weight| {
                let (probability, delay) = (weight * special::normal::density(z), law.at_normal(z));
                mean += probability * delay;
                variance += probability * (delay - law.mean()) * (delay - law.mean());
            });
        }
        let tolerance = if name == "table" || name == "empirical" { 1e-3 } else { 1e-6 } * law.sd();
        assert!((mean - law.mean()).abs() < tolerance, "{name}: mean {mean}, not {}", law.mean());
        let sd = libm::sqrt(variance);
        assert!((sd - law.sd()).abs() < tolerance, "{name}: deviation {sd}, not {}", law.sd());
    }
}
