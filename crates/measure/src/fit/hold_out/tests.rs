//! The trace of the design, of which another program computed the figures.

use super::*;

/// Sebastiano Vigna's splitmix64, so that the trace is that of the design.
struct SplitMix(u64);

impl SplitMix {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 * 2.0_f64.powi(-53)
    }
}

/// Returns the trace of the design: two states, 40 000 packets every 10 ms.
fn trace() -> Measurements {
    let (mut random, mut is_bad) = (SplitMix(1), false);
    let packet = |number: u32| {
        let [change, loss, delay] = [random.unit(), random.unit(), random.unit()];
        is_bad = if is_bad { change >= 0.02 } else { change < 0.002 };
        let (lost, [floor, scale]) = if is_bad { (loss < 0.2, [45.0, 10.0]) } else { (loss < 0.001, [20.0, 2.0]) };
        let delay_ms = floor - scale * (1.0 - delay).ln();
        Measurement { sent_s: f64::from(number) * 0.01, delay_s: (!lost).then_some(delay_ms * 1e-3) }
    };
    Measurements::new((0..40_000).map(packet).collect()).unwrap()
}

#[track_caller]
fn assert_near(found: f64, expected: f64, of: f64) {
    assert!((found - expected).abs() <= of, "{found} {expected}");
}

/// Delays \[ms\] to four digits, correlations to three, loss \[%\] and mean run to four, shares of runs to three: as another program computed them.
#[test]
fn figures_are_those_computed_elsewhere() {
    let whole = trace();
    let delays: Vec<f64> = whole.packets()[..3].iter().map(|packet| packet.delay_s.unwrap() * 1e3).collect();
    for (found, expected) in delays.into_iter().zip([27.081_109, 22.878_499, 20.672_369]) {
        assert_near(found, expected, 6e-7);
    }
    assert_eq!(whole.packets().iter().filter(|packet| packet.delay_s.is_none()).count(), 741);
    let (first, rest) = whole.hold_out(0.5).unwrap();
    assert_eq!((first.packets().len(), rest.packets().len()), (20_000, 20_000));
    let judged = HoldOut::of(&first, &rest, &first, 1e-9);
    let HoldOut { measured, independent, gilbert, replay, .. } = &judged;
    for (figures, mean, quantiles, wasserstein, correlations, loss, run, longer) in [
        (measured, 24.4856, [49.0554, 65.0160], None, [0.711, 0.594, 0.113], 1.9750, 1.2117, [0.184, 0.025]),
        (independent, 24.0803, [47.5361, 63.3429], Some(0.4179), [0.0; 3], 1.7300, 1.0176, [0.0173, 0.000_299]),
        (gilbert, 24.0803, [47.5361, 63.3429], Some(0.4179), [0.0; 3], 1.7300, 1.2313, [0.188, 0.035]),
        (replay, 24.0803, [47.5361, 63.3429], Some(0.4179), [0.691, 0.579, 0.119], 1.7300, 1.2313, [0.178, 0.032]),
    ] {
        assert_near(figures.mean_s * 1e3, mean, 5e-5);
        for (found, expected) in figures.quantiles_s.into_iter().zip(quantiles) {
            assert_near(found * 1e3, expected, 5e-5);
        }
        assert_eq!(figures.wasserstein_s.is_some(), wasserstein.is_some());
        assert_near(figures.wasserstein_s.unwrap_or(0.0) * 1e3, wasserstein.unwrap_or(0.0), 5e-5);
        for (found, expected) in figures.autocorrelation.into_iter().zip(correlations) {
            assert_near(found.unwrap(), expected, 6e-4);
        }
        assert_near(figures.loss * 100.0, loss, 5e-5);
        assert_near(figures.mean_run.unwrap(), run, 5e-5);
        for (found, expected) in figures.longer_runs.unwrap().into_iter().zip(longer) {
            assert_near(found, expected, 6e-4);
        }
    }
    // The first part is like the rest, so as a prediction it is not refused.
    assert_eq!(judged.refused, Vec::<String>::new());
}

/// The normal law with mean and deviation of the first part has a W₁ of 5.650 ms.
#[test]
fn a_normal_law_is_refused() {
    let (first, rest) = trace().hold_out(0.5).unwrap();
    let delays = sorted(&first);
    let (mean, sd) = (series::mean(&delays).unwrap(), series::variance(&delays).unwrap().sqrt());
    let quantile = |number: u32| mean + sd * crate::fit::law::normal_quantile((f64::from(number) + 0.5) / 20_000.0);
    // In an order without memory: 7777 is prime to 20 000.
    let packet = |number: u32| Measurement { sent_s: f64::from(number) * 0.01, delay_s: Some(quantile(number * 7_777 % 20_000)) };
    let normal = Measurements::new((0..20_000).map(packet).collect()).unwrap();
    let judged = HoldOut::of(&first, &rest, &normal, 1e-9);
    assert_near(judged.best.wasserstein_s.unwrap() * 1e3, 5.650, 2e-3);
    for part in ["(W1), and at most 0.8358 ms may be", "10 packets apart", "its loss is 0.0000 %"] {
        assert!(judged.refused.iter().any(|reason| reason.contains(part)), "no {part:?} in {:#?}", judged.refused);
    }
}

#[test]
fn a_distance_is_the_area_between_distribution_functions() {
    assert_near(wasserstein(&[1.0, 2.0], &[1.0, 2.0]), 0.0, 0.0);
    assert_near(wasserstein(&[0.0], &[3.0]), 3.0, 0.0);
    // Half of the mass goes from 0 to 1, and a quarter from 0 to 4.
    assert_near(wasserstein(&[0.0, 0.0, 0.0, 0.0], &[0.0, 1.0, 1.0, 4.0]), 1.5, 1e-12);
}

#[test]
fn a_part_without_packets_is_refused() {
    let few = Measurements::new((0..120).map(|i| Measurement { sent_s: f64::from(i), delay_s: (i < 90).then_some(0.02) }).collect()).unwrap();
    assert_eq!(few.hold_out(0.5).unwrap_err(), HoldOutError { arrived: 30 });
    assert_eq!(Measurements::default().hold_out(0.5).unwrap_err().arrived, 0);
}
