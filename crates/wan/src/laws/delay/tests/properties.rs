use cohaptic_tests_common::properties;
use proptest::prelude::*;

use super::*;

fn distribution() -> impl Strategy<Value = Distribution> {
    prop_oneof![
        prop::sample::select(vec![
            Distribution::Normal,
            Distribution::Uniform,
            Distribution::Pareto,
            Distribution::ParetoNormal,
            Distribution::LogNormal,
            Distribution::Gamma,
            Distribution::Weibull,
            Distribution::Laplace,
        ]),
        prop::collection::vec(-1e3..1e3_f64, 2..9).prop_map(|values| empirical(&values)),
        prop::collection::vec(any::<i16>(), 1..9).prop_map(|entries| table(&entries.iter().map(|entry| format!("{entry} ")).collect::<String>())),
    ]
}

/// Returns a size between 10⁻⁶ and 10⁹.
fn size() -> impl Strategy<Value = f64> {
    (-6.0..9.0_f64).prop_map(libm::exp10)
}

properties! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// An accepted law is monotone, finite and not below its floor. Any other law is refused with a stated reason.
    #[test]
    fn every_law_is_monotone_finite_and_above_its_floor(
        distribution in distribution(), floor in size(), above in size(), sd in size(), mut zs in prop::collection::vec(-45.0..45.0_f64, 12),
    ) {
        let Ok(law) = Law::new(&distribution, floor + above, sd, Some(floor)) else { return Ok(()) };
        zs.extend([f64::MIN, f64::MAX, -8.0, 8.0]);
        zs.sort_by(f64::total_cmp);
        let delays: Vec<f64> = zs.iter().map(|&z| law.at_normal(z)).collect();
        prop_assert!(law.least() >= floor && law.mean() >= law.least() && law.sd() >= 0.0, "{law:?}");
        for pair in delays.windows(2) {
            prop_assert!(pair[0] >= law.least() && pair[1].is_finite());
            prop_assert!(pair[0] <= pair[1] * (1.0 + 1e-13), "{pair:?} of {law:?}");
            prop_assert!(law.cdf(pair[0]) <= law.cdf(pair[1]) + 1e-13);
        }
    }

    /// The words include both ends of their range, and both words at its middle.
    #[test]
    fn draws_of_any_words_are_delays(distribution in distribution(), sd in size(), word: u64, more: u64) {
        let Ok(law) = Law::new(&distribution, 1e9, sd, Some(1.0)) else { return Ok(()) };
        for word in [word, 0, u64::MAX, u64::MAX / 2, u64::MAX / 2 + 1] {
            let mut more = more;
            let draw = law.draw(word, || { more = more.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(1); more });
            prop_assert!(draw.is_finite() && draw >= law.least(), "{draw} of {law:?}");
        }
    }

    #[test]
    fn the_widest_probabilities_have_finite_quantiles(distribution in distribution(), sd in size(), p in 0.0..=1.0_f64) {
        let Ok(law) = Law::new(&distribution, 1e9, sd, None) else { return Ok(()) };
        for p in [0.0, p, 1.0] {
            prop_assert!(law.quantile(p).is_finite());
        }
        prop_assert!(law.quantile(f64::NAN).is_nan());
    }

    #[test]
    fn a_table_is_read_back_as_it_is_written(entries in prop::collection::vec(any::<i16>(), 1..200)) {
        let text: String = entries.iter().map(|entry| format!("{entry}\n")).collect();
        let table = DistTable::parse(&text).unwrap();
        prop_assert_eq!(&DistTable::parse(&table.to_string()).unwrap(), &table);
        prop_assert_eq!(table.entries().len(), entries.len());
    }

    #[test]
    fn no_text_makes_the_parser_panic(text in "[-+0-9a-fxX# \\t\\r\\nµ\\u{2003}]{0,60}", bytes in prop::collection::vec(any::<u8>(), 0..60)) {
        for text in [text.as_str(), &String::from_utf8_lossy(&bytes)] {
            if let Err(error) = DistTable::parse(text) {
                prop_assert!(!error.to_string().is_empty());
            }
        }
    }
}
