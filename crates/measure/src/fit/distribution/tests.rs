use rand_distr::{Distribution, Gamma, LogNormal, Normal, StandardUniform, Weibull};

use super::*;
use crate::tests::TestRng;

const N: usize = 20_000;
const FLOOR: f64 = 20.0;

/// Sorted samples in milliseconds, as if they were seconds: no law knows the unit.
fn sample(seed: u64, draw: impl Fn(&mut TestRng) -> f64) -> Vec<f64> {
    let mut rng = TestRng::new(seed);
    let mut delays: Vec<f64> = (0..N).map(|_| draw(&mut rng)).collect();
    delays.sort_by(f64::total_cmp);
    delays
}

/// The best law must be the one drawn from. Its mean and deviation must lie within 5 standard errors, sd/√n and sd·√((κ−1)/4n) of a law with kurtosis κ
/// (an estimate of greatest likelihood is no worse than the moments).
fn recovers(name: DelayLaw, delays: &[f64], mean: f64, sd: f64, kurtosis: f64) -> LawFit {
    let fits = fit_all(delays, N as f64);
    let best = fits[0];
    assert_eq!(best.distribution, name, "{fits:#?}");
    assert!(fits[1].aic - best.aic > 10.0, "{fits:#?}");
    let n = (N as f64).sqrt();
    assert!((best.mean_s - mean).abs() < 5.0 * sd / n, "{best:?}");
    assert!((best.sd_s - sd).abs() < 5.0 * sd * ((kurtosis - 1.0) / 4.0).sqrt() / n, "{best:?}");
    // The distance of a fitted law is smaller than that of the true one, of which the 0.999 quantile is 1.95/√n.
    assert!(best.kolmogorov < 1.95 / n, "{best:?}");
    best
}

/// The least delay lies below F⁻¹(7/n) with probability 1 − e⁻⁷, and so does its correction: no further may the floor be off.
fn floor_is_found(best: &LawFit, quantile_of_7_in_n: f64) {
    assert!((best.floor_s.unwrap() - FLOOR).abs() < quantile_of_7_in_n, "{best:?}");
}

#[test]
fn a_normal_law_is_found() {
    let law = Normal::new(24.0, 2.0).unwrap();
    recovers(DelayLaw::Normal, &sample(1, |rng| law.sample(rng)), 24.0, 2.0, 3.0);
}

#[test]
fn a_uniform_law_is_found_to_its_ends() {
    let best = recovers(DelayLaw::Uniform, &sample(2, |rng| 20.0 + 6.0 * rng.unit()), 23.0, 6.0 / 12.0_f64.sqrt(), 1.8);
    floor_is_found(&best, 6.0 * 7.0 / N as f64);
}

#[test]
fn a_laplace_law_is_found() {
    let delays = sample(3, |rng| {
        let unit: f64 = StandardUniform.sample(rng);
        24.0 + if unit < 0.5 { (2.0 * unit).ln() } else { -(2.0 - 2.0 * unit).ln() }
    });
    recovers(DelayLaw::Laplace, &delays, 24.0, 2.0_f64.sqrt(), 6.0);
}

#[test]
fn a_lognormal_law_and_its_floor_are_found() {
    // ln of the delay above the floor: mean 0.5, deviation 0.6. Mean e^0.68, variance e^1.36·(e^0.36 − 1); kurtosis e^{4s²}+2e^{3s²}+3e^{2s²}−3.
    let law = LogNormal::new(0.5, 0.6).unwrap();
    let mean = 0.68_f64.exp();
    let sd = mean * 0.36_f64.exp_m1().sqrt();
    let kurtosis = 1.44_f64.exp() + 2.0 * 1.08_f64.exp() + 3.0 * 0.72_f64.exp() - 3.0;
    let best = recovers(DelayLaw::Lognormal, &sample(4, |rng| FLOOR + law.sample(rng)), FLOOR + mean, sd, kurtosis);
    floor_is_found(&best, (0.5 + 0.6 * super::super::law::normal_quantile(7.0 / N as f64)).exp());
}

#[test]
fn a_gamma_law_and_its_floor_are_found() {
    let law = Gamma::new(2.5, 1.2).unwrap();
    let best = recovers(DelayLaw::Gamma, &sample(5, |rng| FLOOR + law.sample(rng)), FLOOR + 3.0, 1.2 * 2.5_f64.sqrt(), 3.0 + 6.0 / 2.5);
    // Near zero F(x) = (x/scale)^2.5/Γ(3.5), Γ(3.5) = 3.3234.
    floor_is_found(&best, 1.2 * (3.3234 * 7.0 / N as f64).powf(0.4));
}

#[test]
fn a_gamma_law_that_is_densest_at_its_floor_is_found() {
    let law = Gamma::new(0.7, 2.0).unwrap();
    let best = recovers(DelayLaw::Gamma, &sample(6, |rng| FLOOR + law.sample(rng)), FLOOR + 1.4, 2.0 * 0.7_f64.sqrt(), 3.0 + 6.0 / 0.7);
    // Γ(1.7) = 0.9086.
    floor_is_found(&best, 2.0 * (0.9086 * 7.0 / N as f64).powf(1.0 / 0.7));
}

#[test]
fn a_weibull_law_and_its_floor_are_found() {
    // Scale 3, shape 1.8: Γ(1 + 1/1.8) = 0.889 288, Γ(1 + 2/1.8) = 1.046 858; kurtosis below 3.5.
    let law = Weibull::new(3.0, 1.8).unwrap();
    let sd = 3.0 * (1.046_858_f64 - 0.889_288 * 0.889_288).sqrt();
    let best = recovers(DelayLaw::Weibull, &sample(7, |rng| FLOOR + law.sample(rng)), FLOOR + 3.0 * 0.889_288, sd, 3.5);
    floor_is_found(&best, 3.0 * (7.0 / N as f64).powf(1.0 / 1.8));
}

#[test]
fn a_law_without_a_floor_above_zero_gets_none() {
    let law = Gamma::new(2.0, 3.0).unwrap();
    let fits = fit_all(&sample(8, |rng| law.sample(rng)), N as f64);
    assert_eq!(fits[0].distribution, DelayLaw::Gamma);
    // F(x) = (x/3)²/2 near zero.
    assert!(fits[0].floor_s.unwrap_or(0.0) < 3.0 * (2.0 * 7.0 / N as f64).sqrt(), "{fits:?}");
}

#[test]
fn odd_samples_give_finite_figures() {
    let mut samples = vec![vec![1.0, 2.0], vec![0.0, 0.0, 1.0], vec![5.0; 40], vec![1e-9, 1e9], (0..100).map(|i| f64::from(i / 50)).collect()];
    samples[2].push(5.000_000_1);
    samples.push((0..1000).map(|i| f64::from(i % 3)).collect());
    for mut sample in samples {
        sample.sort_by(f64::total_cmp);
        let fits = fit_all(&sample, sample.len() as f64);
        assert!(!fits.is_empty());
        for fit in fits {
            assert!(fit.mean_s.is_finite() && fit.sd_s.is_finite() && !fit.aic.is_nan() && (0.0..=1.0).contains(&fit.kolmogorov), "{fit:?}");
        }
    }
}
