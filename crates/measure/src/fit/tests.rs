use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::tests::TestRng;

/// Returns measurements of a link made without the emulator: a gamma law through a Gaussian copula of correlation time τ, with Gilbert–Elliott losses.
fn measured(seed: u64, n: usize, gap: impl Fn(&mut TestRng) -> f64) -> Measurements {
    let mut rng = TestRng::new(seed);
    let (mut sent_s, mut z): (f64, f64) = (0.0, StandardNormal.sample(&mut rng));
    let mut bad = false;
    let packets = (0..n)
        .map(|_| {
            let gap = gap(&mut rng);
            sent_s += gap;
            let (phi, noise): (f64, f64) = ((-gap / 0.05).exp(), StandardNormal.sample(&mut rng));
            z = phi * z + (1.0 - phi * phi).sqrt() * noise;
            bad ^= rng.unit() < if bad { 0.3 } else { 0.02 };
            Measurement { sent_s, delay_s: (!bad).then(|| 0.02 + gamma_of_shape_2(z) * 0.002) }
        })
        .collect();
    Measurements::new(packets).unwrap()
}

/// Returns the value of the gamma law of shape 2 and scale 1 at the place of a standard normal number: the solution of 1 − (1 + x)e^{−x} = Φ(z), by bisection.
fn gamma_of_shape_2(z: f64) -> f64 {
    let above = law::normal_below(-z);
    let (mut low, mut high) = (0.0_f64, 60.0_f64);
    for _ in 0..60 {
        let x = f64::midpoint(low, high);
        if (1.0 + x) * (-x).exp() > above { low = x } else { high = x }
    }
    low
}

/// Returns delays with these counts in an order without memory. `prime` must be prime to the number of delays.
pub(super) fn in_an_order_without_memory(counts: &[(u32, usize)], prime: usize) -> Vec<u32> {
    let sorted: Vec<u32> = counts.iter().flat_map(|&(delay, count)| std::iter::repeat_n(delay, count)).collect();
    (0..sorted.len()).map(|i| sorted[i * prime % sorted.len()]).collect()
}

/// Returns measurements of these delays \[s\], one packet every 10 ms.
pub(super) fn one_clock(delays: &[f64]) -> Measurements {
    Measurements::new((0..).zip(delays).map(|(i, &delay)| Measurement { sent_s: f64::from(i) * 0.01, delay_s: Some(delay) }).collect()).unwrap()
}

/// Tied delays, whose laws were computed by another program for the design: 200 delays of a clock of 1 ms, and ln L, Kolmogorov's distance, mean, deviation
/// and floor of three laws.
#[test]
fn laws_of_tied_delays_are_those_computed_elsewhere() {
    let delays = in_an_order_without_memory(&[(20, 22), (21, 61), (22, 53), (23, 31), (24, 17), (25, 9), (26, 4), (27, 3)], 77);
    let fitted = fit(&one_clock(&delays.iter().map(|delay| f64::from(*delay) * 1e-3).collect::<Vec<_>>())).unwrap();
    let expected = [
        (DelayLaw::Gamma, -348.9333, 0.0061, 22.0927, 1.5102, 19.6090),
        (DelayLaw::Lognormal, -349.6109, 0.0100, 22.0946, 1.5474, 18.7146),
        (DelayLaw::Normal, -368.4657, 0.0724, 22.0904, 1.4998, 0.0),
    ];
    for (law, log_likelihood, kolmogorov, mean, sd, floor) in expected {
        let found = fitted.goodness.laws.iter().find(|fit| fit.distribution == law).unwrap();
        // One unit of the last digit: the top of a likelihood is flat, and each optimiser ends at its own place.
        let figures = [found.log_likelihood, found.kolmogorov, found.mean_s * 1e3, found.sd_s * 1e3, found.floor_s.unwrap_or(0.0) * 1e3];
        for (found, expected) in figures.into_iter().zip([log_likelihood, kolmogorov, mean, sd, floor]) {
            assert!((found - expected).abs() < 1.5e-4, "{law:?} {found} {expected}");
        }
    }
    assert!(fitted.goodness.laws.iter().all(|law| law.log_likelihood <= 0.0));
    assert!(matches!(fitted.link.jitter.distribution, FittedLaw::Law(_)));
}

/// Two heaps, 20 ms apart. By construction the mean is 31 ms and the deviation 10.79 ms; 10 000 independent delays have the limit 0.036.
#[test]
fn two_heaps_have_no_law() {
    // A random order: in a regular one the delays have a memory, and are worth fewer.
    let mut rng = TestRng::new(7);
    let counts = [(20, 4000), (21, 900), (22, 100), (40, 100), (41, 900), (42, 4000)];
    let mut delays: Vec<f64> = counts.iter().flat_map(|&(delay, count)| std::iter::repeat_n(f64::from(delay) * 1e-3, count)).collect();
    for last in (1..delays.len()).rev() {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to below the number of delays")]
        let other = (rng.unit() * (last + 1) as f64) as usize;
        delays.swap(last, other);
    }
    let fitted = fit(&one_clock(&delays)).unwrap();
    assert_eq!(fitted.link.jitter.distribution, FittedLaw::Empirical);
    assert!((fitted.goodness.kolmogorov_limit - 0.036).abs() < 1e-3, "{}", fitted.goodness.kolmogorov_limit);
    assert!(
        !fitted.goodness.laws.is_empty() && fitted.goodness.laws.iter().all(|law| !law.fits && law.kolmogorov > 0.2),
        "{:#?}",
        fitted.goodness.laws
    );
    assert!((fitted.link.delay_s - 0.031).abs() < 1e-6 && (fitted.link.jitter.sd_s - 10.79e-3).abs() < 1e-5, "{:?}", fitted.link);
    assert!(fitted.delays_csv().is_some());
}

#[test]
fn a_link_is_found_from_its_measurements() {
    let fitted = fit(&measured(1, 40_000, |_| 0.008)).unwrap();
    let Fitted { link, goodness, .. } = &fitted;
    assert!(goodness.evenly_spaced && goodness.packets == 40_000);
    assert_eq!(link.jitter.distribution, FittedLaw::Law(DelayLaw::Gamma), "{goodness:#?}");
    // Mean 24 ms, deviation 2.83 ms, 37 500 arrivals and φ = 0.852, worth 3 000 independent delays. The tolerance is five standard errors of the mean, and
    // of the deviation with kurtosis 6.
    assert!((link.delay_s - 0.024).abs() < 5.0 * 0.00283 / 3_000_f64.sqrt(), "{link:?}");
    assert!((link.jitter.sd_s - 0.002_828).abs() < 5.0 * 0.00283 * (5.0 / 4.0 / 3_000_f64).sqrt(), "{link:?}");
    // Near zero F(x) = x²/2 in units of 2 ms, for the least of 3 000 delays.
    assert!((link.jitter.floor_s.unwrap() - 0.02).abs() < 0.002 * (2.0 * 7.0 / 3_000_f64).sqrt(), "{link:?}");
    let correlation = goodness.correlation.unwrap();
    let phi = (-0.008_f64 / 0.05).exp();
    assert!((correlation.lag_one - phi).abs() < 4.0 * correlation.lag_one_se.unwrap(), "{link:?}");
    // The correlation of delays of this law; the function grows hardly faster than φ.
    let rho = cohaptic_wan::law::Law::new(&cohaptic_wan::Distribution::Gamma, 24.0, 8_f64.sqrt(), Some(20.0)).unwrap().correlation(phi);
    assert!((link.jitter.correlation.unwrap() - rho).abs() < 4.0 * 1.1 * correlation.lag_one_se.unwrap(), "{rho} {link:?}");
    let LossModel::GilbertElliott { p, r, .. } = link.loss else { panic!("{link:?}") };
    let [se_p, se_r] = goodness.losses[0].standard_errors.unwrap();
    assert!((p - 0.02).abs() < 4.0 * se_p && (r - 0.3).abs() < 4.0 * se_r, "{link:?}");
    assert!(goodness.least_s >= 0.02 && goodness.floor_robson_whitlock_s <= goodness.least_s);

    let json = serde_json::to_value(&fitted).unwrap();
    assert_eq!(json["link"]["jitter"]["distribution"], "gamma");
    assert!(json["link"]["loss"]["gilbert-elliott"]["p"].is_f64());
    assert_eq!(json["goodness"]["laws"][0]["distribution"], "gamma");
    assert!(json["link"]["jitter"].get("correlation_time_s").is_none());
    let scene = link.to_scene_toml("");
    assert!(scene.contains("distribution = \"gamma\", floor = \"") && scene.contains("correlation = 0.8") && scene.contains("gilbert-elliott"));
}

#[test]
fn uneven_gaps_give_figures_in_time() {
    // Gaps of 1 to 15 ms.
    let fitted = fit(&measured(2, 40_000, |rng| 0.001 + 0.014 * rng.unit())).unwrap();
    assert!(!fitted.goodness.evenly_spaced);
    let correlation = fitted.goodness.correlation.unwrap();
    assert_eq!((fitted.link.jitter.correlation, fitted.link.jitter.correlation_time_s), (None, Some(correlation.time_s)));
    assert!((correlation.time_s - 0.05).abs() < 4.0 * correlation.time_se_s.unwrap(), "{correlation:?}");
    assert!(matches!(fitted.link.loss, LossModel::GilbertElliottInTime { .. }));
    assert!(fitted.link.to_scene_toml("").contains("correlation-time = \""));
}

#[test]
fn drift_between_clocks_can_be_removed_first() {
    let clean = measured(3, 20_000, |_| 0.008);
    // A drift of 100 ppm over 160 s is 16 ms.
    let drifted = Measurements::new(
        clean.packets().iter().map(|packet| Measurement { delay_s: packet.delay_s.map(|delay| delay + 1e-4 * packet.sent_s), ..*packet }).collect(),
    )
    .unwrap();
    let (corrected, skew) = drifted.without_skew().unwrap();
    // The lower ends of the two halves are known to F⁻¹(7/n) of 800 effective delays, 0.26 ms, and are 80 s apart.
    assert!((skew.seconds_per_second - 1e-4).abs() < 0.000_26 / 80.0, "{skew:?}");
    let [before, after] = [&drifted, &corrected].map(|measurements| fit(measurements).unwrap().link.jitter.sd_s);
    assert!(before > 0.005 && (after - 0.002_83).abs() < 0.000_6, "{before} {after}");
    assert_eq!(corrected.packets()[0], drifted.packets()[0]);
}

#[test]
fn what_cannot_be_estimated_says_why() {
    let of = |delays: &dyn Fn(usize) -> Option<f64>, n: usize| {
        fit(&Measurements::new((0..n).map(|i| Measurement { sent_s: i as f64 * 0.001, delay_s: delays(i) }).collect()).unwrap())
    };
    assert_eq!(of(&|_| None, 100).unwrap_err().to_string(), "none of 100 packets arrived: expected at least 50 delays");
    assert_eq!(of(&|_| None, 0).unwrap_err(), FitError::NothingArrived { packets: 0 });
    assert_eq!(of(&|i| Some(i as f64), 49).unwrap_err().to_string(), "only 49 packets arrived: expected at least 50 delays");
    assert_eq!(of(&|_| Some(0.024), 60).unwrap_err(), FitError::ConstantDelay { received: 60, delay_s: 0.024 });
    let hair = |i: usize| Some(0.024 + if i.is_multiple_of(2) { 1e-10 } else { 0.0 });
    assert!(matches!(of(&hair, 60).unwrap_err(), FitError::ConstantDelay { received: 60, .. }));
    assert!(matches!(of(&|i| Some(0.01 - i as f64 * 0.001), 60).unwrap_err(), FitError::NegativeDelay { .. }));
    let one_instant = Measurements::new((0..60).map(|i| Measurement { sent_s: 1.0, delay_s: Some(f64::from(i)) }).collect()).unwrap();
    assert_eq!(fit(&one_instant).unwrap_err(), FitError::OneInstant { sent_s: 1.0 });

    let packet = |sent_s, delay_s| Measurement { sent_s, delay_s };
    let refused = |packets: &[Measurement]| Measurements::new(packets.to_vec()).unwrap_err();
    assert!(matches!(refused(&[packet(0.0, Some(f64::NAN))]), MeasurementsError::NotFinite { packet: 1, .. }));
    assert!(matches!(refused(&[packet(f64::INFINITY, None)]), MeasurementsError::NotFinite { packet: 1, .. }));
    assert!(matches!(refused(&[packet(1.0, None), packet(0.5, None)]), MeasurementsError::TimeGoesBack { packet: 2, .. }));
}

#[test]
fn a_known_offset_can_be_added() {
    let early =
        Measurements::new((0..60).map(|i| Measurement { sent_s: f64::from(i), delay_s: Some(-1.0 + 1e-3 * f64::from(i % 7)) }).collect()).unwrap();
    assert!(matches!(fit(&early), Err(FitError::NegativeDelay { .. })));
    assert!((fit(&early.shifted(1.02).unwrap()).unwrap().goodness.least_s - 0.02).abs() < 1e-12);
    assert!(early.shifted(f64::NAN).is_err());
}
