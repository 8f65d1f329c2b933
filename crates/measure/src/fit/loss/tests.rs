use rand_distr::{Distribution, Exp1};

use super::*;
use crate::tests::TestRng;

const N: usize = 50_000;

/// Simulates the chain of Gilbert and Elliott. The state before the transition decides the loss.
fn chain(seed: u64, [p, r, h, k]: [f64; 4]) -> Vec<(f64, bool)> {
    let mut rng = TestRng::new(seed);
    let mut bad = rng.unit() < p / (p + r);
    (0..N)
        .map(|i| {
            let lost = rng.unit() >= if bad { h } else { k };
            bad ^= rng.unit() < if bad { r } else { p };
            (i as f64 * 0.008, lost)
        })
        .collect()
}

#[test]
fn independent_losses_are_found() {
    for (seed, probability) in [(1, 0.01), (2, 0.3)] {
        let mut rng = TestRng::new(seed);
        let packets: Vec<_> = (0..N).map(|i| (i as f64, rng.unit() < probability)).collect();
        let best = fit_all(&packets, true)[0];
        let LossModel::Independent { probability: found } = best.model else { panic!("{best:?}") };
        assert!((found - probability).abs() < 4.0 * best.standard_errors.unwrap()[0], "{best:?}");
    }
}

#[test]
fn bursts_are_found_within_their_standard_errors() {
    for (seed, p, r) in [(3, 0.01, 0.25), (4, 0.05, 0.9), (5, 0.002, 0.02)] {
        let best = fit_all(&chain(seed, [p, r, 0.0, 1.0]), true)[0];
        let LossModel::GilbertElliott { p: found_p, r: found_r, h: 0.0, k: 1.0 } = best.model else { panic!("{best:?}") };
        let [se_p, se_r] = best.standard_errors.unwrap();
        assert!((found_p - p).abs() < 4.0 * se_p && (found_r - r).abs() < 4.0 * se_r, "{best:?}");
        // Standard error of p: the chain is in the good state for n·r/(p + r) packets.
        let theory = (p * (1.0 - p) / (N as f64 * r / (p + r))).sqrt();
        assert!((0.8..1.25).contains(&(se_p / theory)), "{best:?}");
    }
}

#[test]
fn losses_that_are_sure_in_neither_state_are_found() {
    let true_values = [0.005, 0.05, 0.3, 0.999];
    let packets = chain(6, true_values);
    let best = fit_all(&packets, true)[0];
    let LossModel::GilbertElliott { p, r, h, k } = best.model else { panic!("{best:?}") };
    // The standard error has no closed form, but a bound from counting: the chain enters the bad state about 227 times (n·p·r/(p + r)), so p and r are
    // known to 1/√227 = 6.6 % at best. Guessing the states costs a factor of at most 2 at this contrast. The tolerance is four standard errors.
    assert!((p / 0.005 - 1.0).abs() < 0.53 && (r / 0.05 - 1.0).abs() < 0.53, "{best:?}");
    // 4 500 packets in the bad state give √(0.3·0.7/4 500) = 0.0068, doubled, times four. 45 500 packets in the good state give √(0.001/45 500) = 0.000 15.
    assert!((h - 0.3).abs() < 0.055 && (k - 0.999).abs() < 0.0012, "{best:?}");
    // The maximum is at least as likely as the truth.
    let truth = hidden_markov::log_likelihood(&packets.iter().map(|packet| packet.1).collect::<Vec<_>>(), true_values);
    assert!(best.log_likelihood >= truth - 1e-6, "{best:?} {truth}");
    // The share lost is (0.001·0.05 + 0.7·0.005)/0.055. The time in the bad state has the variance π(1−π)·(1+c)/(1−c)/n with c = 0.945, a standard error of
    // 0.0076, and 0.7 of the packets in this time are lost. The tolerance is four standard errors.
    assert!((best.mean_loss - 0.064_55).abs() < 0.022, "{best:?}");
}

#[test]
fn bursts_in_time_are_found_at_uneven_gaps() {
    // Means 2 s and 0.1 s, packets at exponential gaps of mean 8 ms: 400 s, about 190 bursts.
    let (mean_good, mean_bad) = (2.0, 0.1);
    let mut rng = TestRng::new(7);
    let (mut now, mut bad, mut turn) = (0.0, false, 2.0);
    let packets: Vec<(f64, bool)> = (0..N)
        .map(|_| {
            let gap: f64 = Exp1.sample(&mut rng);
            now += 0.008 * gap;
            while turn < now {
                bad = !bad;
                let stay: f64 = Exp1.sample(&mut rng);
                turn += stay * if bad { mean_bad } else { mean_good };
            }
            (now, bad)
        })
        .collect();
    let best = fit_all(&packets, false)[0];
    let LossModel::GilbertElliottInTime { mean_good_s, mean_bad_s } = best.model else { panic!("{best:?}") };
    // The mean of 190 exponential times is known to 1/√190 = 7.3 %. The tolerance is four times as large.
    assert!((mean_good_s / mean_good - 1.0).abs() < 0.29 && (mean_bad_s / mean_bad - 1.0).abs() < 0.29, "{best:?}");
}

#[test]
fn few_and_odd_losses_are_answered() {
    let model = |lost: &[bool], even| fit_all(&lost.iter().enumerate().map(|(i, lost)| (i as f64, *lost)).collect::<Vec<_>>(), even)[0].model;
    assert_eq!(model(&[false; 9], true), LossModel::None);
    assert_eq!(model(&[true, false, false, false], true), LossModel::Independent { probability: 0.25 });
    for even in [true, false] {
        for pattern in 0..255_u8 {
            let lost: Vec<bool> = (0..8).map(|bit| pattern >> bit & 1 == 1).collect();
            let packets: Vec<_> = lost.iter().enumerate().map(|(i, lost)| (count(i / 2), *lost)).collect();
            for fit in fit_all(&packets, even) {
                assert!(fit.bic.is_finite() && (0.0..=1.0).contains(&fit.mean_loss), "{pattern} {fit:?}");
            }
        }
    }
}
