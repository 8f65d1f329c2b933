//! Tests with delays that follow no law.

use cohaptic_tests_common::{cases, properties};
use proptest::prelude::*;
use rand_distr::{Distribution as _, Exp1, StandardNormal};

use cohaptic_wan::law::Law;

use super::*;
use crate::tests::TestRng;

/// Returns delays as shown by a clock of the given resolution.
fn shown(delays: impl IntoIterator<Item = f64>, resolution_s: f64) -> Vec<f64> {
    delays.into_iter().map(|delay| (delay / resolution_s).round() * resolution_s).collect()
}

fn fit_of(delays: &[f64]) -> Result<Fitted, FitError> {
    fit(&Measurements::new((0..).zip(delays).map(|(i, &delay)| Measurement { sent_s: f64::from(i) * 0.01, delay_s: Some(delay) }).collect()).unwrap())
}

/// Returns mean and standard deviation of a sample, and their standard errors for independent numbers.
fn moments(delays: &[f64]) -> [f64; 4] {
    let n = delays.len() as f64;
    let mean = delays.iter().sum::<f64>() / n;
    let power = |order: i32| delays.iter().map(|delay| (delay - mean).powi(order)).sum::<f64>() / n;
    let sd = (power(2) * n / (n - 1.0)).sqrt();
    [mean, sd, sd / n.sqrt(), ((power(4) - sd.powi(4)).max(0.0) / n).sqrt() / (2.0 * sd)]
}

/// Returns the law of the link as written into a scene, with whole nanoseconds \[ns\].
fn delivered(link: &FittedLink, law: DelayLaw) -> Law {
    let nanos = |seconds: f64| (seconds * 1e9).round();
    Law::new(&law.into(), nanos(link.delay_s), nanos(link.jitter.sd_s), link.jitter.floor_s.map(nanos)).unwrap()
}

/// Returns 2000 delays of a kind: a normal law around 20 ms, with a coarse clock, modes or outliers.
fn case(kind: usize, seed: u64) -> Vec<f64> {
    let mut rng = TestRng::new(seed);
    let mut spike = 0.0;
    (0..2000)
        .map(|_| {
            let z: f64 = StandardNormal.sample(&mut rng);
            match kind {
                0 => 0.02 + 1e-3 * z.abs(),
                // Two routes.
                1 => (if rng.unit() < 0.5 { 0.02 } else { 0.04 }) + 5e-4 * z,
                // Each packet takes a second with probability 0.005.
                2 => (if rng.unit() < 0.005 { 1.0 } else { 0.02 }) + 1e-3 * z,
                // Spikes of 100 ms, once a second on average, with a decay time of 20 ms, and packets every 10 ms.
                _ => {
                    spike = spike * (-0.5_f64).exp() + if rng.unit() < 0.01 { 0.1 } else { 0.0 };
                    0.02 + 2e-4 * z.abs() + spike
                }
            }
        })
        .collect()
}

#[test]
fn a_law_that_does_not_fit_is_refused() {
    for (kind, resolution_s) in [(1, 1e-3), (1, 1e-6), (2, 1e-3), (2, 1e-9), (3, 1e-5), (3, 1e-6)] {
        let delays = shown(case(kind, 7), resolution_s);
        let fitted = fit_of(&delays).unwrap();
        let Fitted { link, goodness, .. } = &fitted;
        assert_eq!(link.jitter.distribution, FittedLaw::Empirical, "{kind} {goodness:#?}");
        assert!((goodness.resolution_s / resolution_s - 1.0).abs() < 1e-3, "{kind} {}", goodness.resolution_s);
        for law in &goodness.laws {
            assert!(!law.fits && law.kolmogorov > goodness.kolmogorov_limit && law.p_value < 0.01, "{kind} {law:?}");
        }
        // The delays themselves are the law, and the text of the link names their file.
        let csv = fitted.delays_csv().unwrap();
        let mut sorted = delays.clone();
        sorted.sort_by(f64::total_cmp);
        assert_eq!(csv.lines().next(), Some("delay"));
        assert_eq!(csv.lines().skip(1).map(|line| line.parse::<f64>().unwrap()).collect::<Vec<_>>(), sorted);
        assert!(link.to_scene_toml("d.csv").contains("distribution = { empirical = \"d.csv\" }"));
        let [mean, sd, mean_error, _] = moments(&delays);
        assert!((link.delay_s - mean).abs() < mean_error && (0.8 * sd..=sd * 1.000_1).contains(&link.jitter.sd_s), "{kind} {link:?} {mean} {sd}");
    }
}

#[test]
fn a_coarse_clock_alone_is_no_reason_to_refuse() {
    // Half a normal law of deviation 1 ms, shown by clocks of 1 ns to half a millisecond. By construction the mean is 20 ms + 1 ms·√(2/π) and the deviation
    // 1 ms·√(1 − 2/π).
    for resolution_s in [1e-9, 1e-5, 2.5e-4, 5e-4] {
        let delays = shown(case(0, 11), resolution_s);
        let fitted = fit_of(&delays).unwrap();
        let FittedLaw::Law(law) = fitted.link.jitter.distribution else { panic!("{:#?}", fitted.goodness) };
        assert_eq!(fitted.delays_csv(), None);
        let law = delivered(&fitted.link, law);
        assert!((law.mean() - 20e6 - 797_885.0).abs() < 4.0 * 602_810.0 / 2000_f64.sqrt(), "{law:?}");
        // With the kurtosis 3.869 the relative error of the deviation is √(2.869/8000).
        assert!((law.sd() / 602_810.0 - 1.0).abs() < 4.0 * (2.869_f64 / 8000.0).sqrt(), "{} {resolution_s}", law.sd());
    }
}

#[test]
fn a_clock_is_as_coarse_as_it_was_before_a_drift_was_taken_off() {
    let mut rng = TestRng::new(5);
    let packet = |i: u32| {
        let (sent_s, exponential): (f64, f64) = (f64::from(i) * 0.01, Exp1.sample(&mut rng));
        let delay = 0.02 + 2e-3 * exponential + 5e-4 * sent_s;
        Measurement { sent_s, delay_s: Some((delay / 1e-3).round() * 1e-3) }
    };
    let measurements = Measurements::new((0..4000).map(packet).collect()).unwrap();
    let (corrected, skew) = measurements.without_skew().unwrap();
    assert!(skew.significant);
    assert!((fit(&corrected).unwrap().goodness.resolution_s - 1e-3).abs() < 1e-9);
}

#[test]
fn more_delays_than_a_link_takes_are_quantiles() {
    let sorted: Vec<f64> = (0..3_000_000).map(|i| f64::from(i) * 1e-9).collect();
    let found = LinkDelay::of_delays(&sorted);
    let delays = found.delays.unwrap();
    assert_eq!((delays.knots().len(), delays.knots()[0], delays.knots()[Empirical::MOST - 1]), (Empirical::MOST, 0.0, sorted[2_999_999]));
    // A uniform law from 0 to 3 ms.
    assert!((found.mean_s - 1.5e-3).abs() < 2e-9 && (found.sd_s - 3e-3 / 12_f64.sqrt()).abs() < 2e-9);
}

/// Lists of 50 to 400 delays between 0 and some seconds, of many forms: mixtures of narrow and wide laws and of points, and with outliers.
fn lists() -> impl Strategy<Value = Vec<f64>> {
    let part = (0.0..0.2_f64, -6.0..-1.0_f64, 0..4_u8, 1..20_u32);
    (prop::collection::vec(part, 1..4), any::<u64>(), 50..400_usize).prop_map(|(parts, seed, n)| {
        let mut rng = TestRng::new(seed);
        let whole: u32 = parts.iter().map(|part| part.3).sum();
        let draw = |_| {
            let mut left = rng.unit() * f64::from(whole);
            let part = parts.iter().find(|part| {
                left -= f64::from(part.3);
                left < 0.0
            });
            let &(at, log_width, form, _) = part.unwrap_or(&parts[0]);
            let (z, e): (f64, f64) = (StandardNormal.sample(&mut rng), Exp1.sample(&mut rng));
            let width = 10_f64.powf(log_width);
            at + width * [z.abs(), e, rng.unit(), (1.5 * z).exp()][usize::from(form)]
        };
        (0..n).map(draw).collect()
    })
}

properties! {
    #![proptest_config(cases(48))]

    /// For any list of delays and any resolution of the clock, the mean and the deviation of the link lie within the standard errors of the sample, or the
    /// link has no law.
    #[test]
    fn a_link_has_the_moments_of_the_delays_or_no_law(delays in lists(), log_resolution in -9.0..-1.5_f64) {
        let delays = shown(delays, 10_f64.powf(log_resolution));
        match fit_of(&delays) {
            Ok(fitted) => {
                let [mean, sd, mean_error, sd_error] = moments(&delays);
                let FittedLaw::Law(law) = fitted.link.jitter.distribution else {
                    prop_assert!(fitted.delays_csv().is_some());
                    return Ok(());
                };
                let law = delivered(&fitted.link, law);
                // Correlated delays, even if correlated by chance, are worth fewer independent ones. A scene has whole nanoseconds.
                let fewer = (delays.len() as f64 / fitted.goodness.effective).sqrt();
                prop_assert!((law.mean() / 1e9 - mean).abs() <= 1.001 * fewer * mean_error + 1e-9, "{} {mean} {mean_error} {:?}", law.mean(), fitted.link);
                prop_assert!((law.sd() / 1e9 - sd).abs() <= 1.001 * fewer * sd_error + 1e-9, "{} {sd} {sd_error} {:?}", law.sd(), fitted.link);
            }
            Err(error) => prop_assert!(matches!(error, FitError::ConstantDelay { .. }), "{error}"),
        }
    }
}
