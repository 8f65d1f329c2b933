//! Correlation time of the delays.
//!
//! Input is the arrivals (sending, delay); output is the correlation time, or `None` for delays that may be independent. The model is a Gaussian copula: an
//! Ornstein–Uhlenbeck process z of unit variance gives each delay its place in the delay's law. Over a gap Δ between two packets the correlation of z is φ
//! = e^{−Δ/τ}. The model is fitted to normal scores, Φ⁻¹((rank − ½)/n), so the estimate does not depend on the law (Genest, Ghoudi & Rivest 1995,
//! Biometrika 82(3)). The true gaps are used, also over lost packets. The estimate is the τ of greatest likelihood:
//!
//! ```text
//! ln L(τ) = Σ −½·ln(1 − φ²) − (z' − φz)²/(2(1 − φ²)) + z'²/2      (0 for independent delays)
//! ```
//!
//! Only a share of the variation has the memory where the delays say so clearly: see [`partial_memory`].

use serde::Serialize;

use super::law::normal_quantile;
use super::partial_memory;
use super::search::{maximise, standard_error};
use crate::series::{NORMAL_975, count};

/// Correlation of delays in time.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct CorrelationFit {
    /// Correlation time τ \[s\].
    pub time_s: f64,
    /// Standard error of τ \[s\], from the curvature of the likelihood of ln τ with the variance estimated too. Large enough that 1.96 standard errors
    /// reach the farther end of the interval of ln τ. `None` if the likelihood is flat.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_se_s: Option<f64>,
    /// Share s of the variance of the normal scores that has this memory, at most 1. The rest differs from packet to packet.
    pub share: f64,
    /// Standard error of `share`; `None` for a share of 1, or if the likelihood is flat.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share_se: Option<f64>,
    /// Correlation of the normal scores over the typical spacing Δ of packets: s·e^{−Δ/τ}.
    pub lag_one: f64,
    /// Standard error of `lag_one`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lag_one_se: Option<f64>,
    /// 2·(ln L(τ) − ln L of independent delays). Independent delays exceed 6.63 with probability 0.01 (χ², one degree of freedom).
    pub likelihood_ratio: f64,
}

/// Quantile 0.99 of χ² with one degree of freedom.
const SIGNIFICANT: f64 = 6.634_896_601_021_213;

/// Fits the correlation time. `arrivals` are (sending, delay) \[s\] in the order of sending; `spacing` is the typical gap \[s\], not zero. Returns `None`
/// if the delays do not differ significantly from independent delays. Also returns the innovations, such as (z' − φz)/√(1 − φ²), which are independent if the
/// correlation time is all of the memory.
pub(super) fn fit(arrivals: &[(f64, f64)], spacing: f64) -> Option<(CorrelationFit, Vec<f64>)> {
    let scores = normal_scores(&arrivals.iter().map(|arrival| arrival.1).collect::<Vec<_>>());
    let of_all = of_all(arrivals, &scores, spacing);
    partial_memory::fit(arrivals, &scores, spacing, of_all.as_ref().map_or(0.0, |(fit, _)| fit.likelihood_ratio)).or(of_all)
}

/// Fits the correlation time of all of the variation.
fn of_all(arrivals: &[(f64, f64)], scores: &[f64], spacing: f64) -> Option<(CorrelationFit, Vec<f64>)> {
    // Packets sent at the same instant tell nothing about time.
    let steps: Vec<[f64; 3]> = arrivals
        .windows(2)
        .zip(scores.windows(2))
        .filter(|(times, _)| times[1].0 > times[0].0)
        .map(|(times, scores)| [times[1].0 - times[0].0, scores[0], scores[1]])
        .collect();
    let log_likelihood = |log_time: f64| {
        let time = log_time.exp();
        let one = |&[gap, z, next]: &[f64; 3]| {
            let phi = (-gap / time).exp();
            let rest = -(-2.0 * gap / time).exp_m1();
            -0.5 * rest.ln() - (next - phi * z).powi(2) / (2.0 * rest) + next * next / 2.0
        };
        steps.iter().map(one).sum::<f64>()
    };
    // The search covers times from a twentieth of the least gap, where φ is practically zero, to ten times the measurement.
    let least = steps.iter().map(|step| step[0]).fold(f64::INFINITY, f64::min);
    let span: f64 = steps.iter().map(|step| step[0]).sum();
    if steps.is_empty() {
        return None;
    }
    let log_time = maximise((least.max(1e-6 * spacing) / 20.0).ln(), (10.0 * span).ln(), 80, log_likelihood);
    let likelihood_ratio = 2.0 * log_likelihood(log_time);
    if likelihood_ratio < SIGNIFICANT {
        return None;
    }
    let relative_error = standard_error(log_time, 1e-3, |log_time| profile(&steps, log_time.exp()));
    let time_s = log_time.exp();
    let lag_one = (-spacing / time_s).exp();
    let innovation = |&[gap, z, next]: &[f64; 3]| (next - (-gap / time_s).exp() * z) / (-(-2.0 * gap / time_s).exp_m1()).sqrt();
    let innovations = steps.iter().map(innovation).collect();
    let fit = CorrelationFit {
        time_s,
        time_se_s: relative_error.map(|error| error_of_time(time_s, error)),
        share: 1.0,
        share_se: None,
        lag_one,
        // By dφ/d ln τ = φ·Δ/τ.
        lag_one_se: relative_error.map(|error| error * lag_one * spacing / time_s),
        likelihood_ratio,
    };
    Some((fit, innovations))
}

/// Returns the standard error of a time whose logarithm has the standard error `relative`: 1.96 errors reach the farther end of the interval.
pub(super) fn error_of_time(time_s: f64, relative: f64) -> f64 {
    (NORMAL_975 * relative).exp_m1() / NORMAL_975 * time_s
}

/// Returns ln L with an estimated variance of z, up to a constant. Only this curvature tells the real error, because normal scores have the scale of the
/// sample. For even gaps the error is √((1 − φ²)/n), as for an autoregression; the likelihood with unit variance would give a smaller error.
fn profile(steps: &[[f64; 3]], time: f64) -> f64 {
    let (logs, squares) = steps.iter().fold((0.0, 0.0), |(logs, squares), &[gap, z, next]| {
        let rest = -(-2.0 * gap / time).exp_m1();
        (logs + rest.ln(), squares + (next - (-gap / time).exp() * z).powi(2) / rest)
    });
    -0.5 * (logs + count(steps.len()) * squares.ln())
}

/// Returns the normal scores Φ⁻¹((rank − ½)/n). Equal values share the mean of their ranks.
pub(super) fn normal_scores(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&one, &other| values[one].total_cmp(&values[other]));
    let mut scores = vec![0.0; values.len()];
    let mut before = 0;
    for equal in order.chunk_by(|&one, &other| values[one].total_cmp(&values[other]).is_eq()) {
        // The ranks run from before + 1 to before + m. Their mean minus a half is before + m/2.
        let score = normal_quantile((count(before) + count(equal.len()) / 2.0) / count(values.len()));
        equal.iter().for_each(|&place| scores[place] = score);
        before += equal.len();
    }
    scores
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, Exp1, StandardNormal};

    use super::*;
    use crate::tests::TestRng;

    /// Simulates an Ornstein–Uhlenbeck process of correlation time `time`, at random or even gaps of mean 8 ms, through a skewed law and with a tenth of
    /// the packets lost.
    fn arrivals(seed: u64, time: f64, even: bool) -> Vec<(f64, f64)> {
        let mut rng = TestRng::new(seed);
        let (mut now, mut z): (f64, f64) = (0.0, StandardNormal.sample(&mut rng));
        let mut arrivals = Vec::new();
        for _ in 0..20_000 {
            let random: f64 = Exp1.sample(&mut rng);
            let gap = if even { 0.008 } else { 0.008 * random };
            let (phi, noise): (f64, f64) = ((-gap / time).exp(), StandardNormal.sample(&mut rng));
            z = phi * z + (1.0 - phi * phi).sqrt() * noise;
            now += gap;
            if rng.unit() > 0.1 {
                arrivals.push((now, 0.02 + 0.004 * (0.6 * z).exp()));
            }
        }
        arrivals
    }

    #[test]
    fn the_correlation_time_is_found_within_its_standard_error() {
        for (seed, time, even) in [(1, 0.02, true), (2, 0.2, true), (3, 0.02, false), (4, 0.2, false)] {
            let (fit, innovations) = fit(&arrivals(seed, time, even), 0.008).unwrap();
            let se = fit.time_se_s.unwrap();
            // Compared in the logarithm, because the error of the logarithm does not depend on the estimate.
            assert!((fit.time_s / time).ln().abs() < 4.0 * se / fit.time_s, "{fit:?}");
            assert!(se < 0.1 * time, "{fit:?}");
            let rho = (-0.008 / time).exp();
            assert!((fit.lag_one - rho).abs() < 4.0 * fit.lag_one_se.unwrap(), "{fit:?}");
            // The correlation time is all of the memory, so that the innovations are independent.
            assert!(super::super::independence::test(&innovations.into_iter().map(Some).collect::<Vec<_>>()).unwrap().holds());
            // With even gaps and few losses the standard error is that of an autoregression, √((1 − φ²)/n), of 18 000 to 20 000 packets.
            if even {
                let theory = ((1.0 - rho * rho) / 19_000.0).sqrt();
                assert!((0.9..1.1).contains(&(fit.lag_one_se.unwrap() / theory)), "{fit:?} {theory}");
            }
        }
    }

    #[test]
    fn independent_delays_have_no_correlation_time() {
        assert_eq!(fit(&arrivals(5, 1e-5, true), 0.008), None);
        assert_eq!(fit(&[(0.0, 1.0), (0.0, 2.0)], 0.008), None);
    }

    #[test]
    fn ties_share_their_ranks() {
        let scores = normal_scores(&[2.0, 1.0, 2.0, 3.0]);
        assert_eq!(scores[0], scores[2]);
        assert!((scores[0] - 0.0).abs() < 1e-12 && (scores[1] + scores[3]).abs() < 1e-12);
    }
}
