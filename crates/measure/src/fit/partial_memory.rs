//! Correlation time of a share of the variation of the delays.
//!
//! Many lines have two memories: a level that stays for a while, such as a queue or a route, and a jitter of each packet on top of the level, such as the
//! access to a shared medium. Neighbours are then less alike than packets much farther apart would suggest, and no single correlation time describes the
//! delays. Input and output are those of [`correlation`](super::correlation). In the model the normal scores are y = √s·u + √(1 − s)·η with an
//! Ornstein–Uhlenbeck process u of unit variance and independent normal η, so that scores over a gap Δ have the correlation s·e^{−Δ/τ}. Over even gaps y is an
//! ARMA(1, 1) process (Granger & Morris 1976, Journal of the Royal Statistical Society A 139(2)).
//!
//! The likelihood comes from Kalman's filter (Kalman 1960, Journal of Basic Engineering 82(1)): with the mean m and the variance P of u given all scores
//! before,
//!
//! ```text
//! v = y − √s·m      S = s·P + 1 − s      ln L = Σ −½·ln S − v²/(2S) + y²/2      (0 for independent delays)
//! ```

use super::correlation::{CorrelationFit, error_of_time};
use super::search::climb;
use crate::series::count;

/// Least gain of 2·ln L over one memory of all of the variation, or over none. With one further parameter χ² exceeds 13.8 with probability 0.0002, and with two
/// 0.001; a share is a claim about the line, so that a few outliers or the ticks of a clock must not make one.
const CLEARLY: f64 = 13.8;
/// Largest share. Normal scores differ from the numbers of a chain by the errors of the ranks, which look like a rest of a thousandth.
const LARGEST: f64 = 0.99;
/// Largest number of arrivals with which the search looks for its start.
const LOOKED_AT: usize = 20_000;
/// Shares from which the search starts.
const SHARES: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];
/// Number of correlation times from which the search starts, from half of the spacing to the whole measurement.
const TIMES: u32 = 16;
/// Step of the differences of ln L in ln τ and in ln(s/(1 − s)).
const STEP: f64 = 1e-2;

/// Fits a correlation time and its share of the variance. `scores` are the normal scores of `arrivals`, `spacing` is the typical gap \[s\], and `before` is the
/// likelihood ratio of the model with one memory, 0 without a memory. Returns `None` unless the share makes the scores clearly more likely.
pub(super) fn fit(arrivals: &[(f64, f64)], scores: &[f64], spacing: f64, before: f64) -> Option<(CorrelationFit, Vec<f64>)> {
    let mut last = f64::NEG_INFINITY;
    let steps: Vec<[f64; 2]> =
        arrivals.iter().zip(scores).map(|(arrival, score)| [arrival.0 - std::mem::replace(&mut last, arrival.0), *score]).collect();
    let span = arrivals.last()?.0 - arrivals.first()?.0;
    let (least, greatest) = ((0.5 * spacing).ln(), span.ln());
    // A level that outlasts the measurement is the mean, not a memory.
    let likelihood = |[log_time, logit]: [f64; 2]| {
        if (least..=greatest).contains(&log_time) { log_likelihood(&steps, log_time.exp(), share_of(logit)) } else { f64::NEG_INFINITY }
    };
    let (at, log_likelihood) = climb(start(&steps, [least, greatest])?, [0.3, 0.3], likelihood)?;
    let likelihood_ratio = 2.0 * log_likelihood;
    let (time_s, share) = (at[0].exp(), share_of(at[1]));
    if likelihood_ratio - before < CLEARLY || share > LARGEST {
        return None;
    }
    let lag_one = share * (-spacing / time_s).exp();
    let covariance = covariance(&steps, at);
    let error = |[along_time, along_share]: [f64; 2]| {
        covariance.map(|[time, both, share]| (along_time.powi(2) * time + 2.0 * along_time * along_share * both + along_share.powi(2) * share).sqrt())
    };
    let mut innovations = Vec::with_capacity(steps.len());
    filter(&steps, time_s, share, |innovation, variance, _| innovations.push(innovation / variance.sqrt()));
    let fit = CorrelationFit {
        time_s,
        time_se_s: error([1.0, 0.0]).map(|relative| error_of_time(time_s, relative)),
        share,
        // By ds/d ln(s/(1 − s)) = s·(1 − s).
        share_se: error([0.0, share * (1.0 - share)]),
        lag_one,
        lag_one_se: error([lag_one * spacing / time_s, lag_one * (1.0 - share)]),
        likelihood_ratio,
    };
    Some((fit, innovations))
}

/// Returns ln τ and ln(s/(1 − s)) at which the search starts: of a grid with ln τ from `least` on and below `greatest`, the point at which the first
/// [`LOOKED_AT`] arrivals are most likely.
fn start(steps: &[[f64; 2]], [least, greatest]: [f64; 2]) -> Option<[f64; 2]> {
    let looked_at = &steps[..steps.len().min(LOOKED_AT)];
    let times = (0..TIMES).map(|place| least + (greatest - least) * f64::from(place) / f64::from(TIMES));
    let starts = times.flat_map(|log_time| SHARES.map(|share| [log_time, (share / (1.0 - share)).ln()]));
    let likelihoods = starts.map(|start| (start, log_likelihood(looked_at, start[0].exp(), share_of(start[1]))));
    likelihoods.max_by(|one, other| one.1.total_cmp(&other.1)).map(|(start, _)| start)
}

/// Returns the share s of ln(s/(1 − s)).
fn share_of(logit: f64) -> f64 {
    1.0 / (1.0 + (-logit).exp())
}

/// Runs Kalman's filter over steps of (gap since the arrival before, score), the first gap infinite. Calls `each` with the innovation v, its variance S and the
/// score.
fn filter(steps: &[[f64; 2]], time: f64, share: f64, mut each: impl FnMut(f64, f64, f64)) {
    let (root, rest) = (share.sqrt(), 1.0 - share);
    let (mut mean, mut variance) = (0.0, 1.0);
    // Most gaps are equal to the gap before, so that most exponentials are known.
    let (mut known_gap, mut phi, mut fresh) = (f64::NAN, 0.0, 1.0);
    for &[gap, score] in steps {
        if gap.to_bits() != known_gap.to_bits() {
            (known_gap, phi, fresh) = (gap, (-gap / time).exp(), -(-2.0 * gap / time).exp_m1());
        }
        mean *= phi;
        variance = phi * phi * variance + fresh;
        let (innovation, of_score) = (score - root * mean, share * variance + rest);
        each(innovation, of_score, score);
        mean += root * variance / of_score * innovation;
        variance *= rest / of_score;
    }
}

fn log_likelihood(steps: &[[f64; 2]], time: f64, share: f64) -> f64 {
    let mut sum = 0.0;
    filter(steps, time, share, |innovation, variance, score| sum -= 0.5 * (variance.ln() + innovation * innovation / variance - score * score));
    sum
}

/// Returns ln L with an estimated variance of y, up to a constant: normal scores have the scale of the sample (see [`correlation`](super::correlation)).
fn profile(steps: &[[f64; 2]], [log_time, logit]: [f64; 2]) -> f64 {
    let (mut logs, mut squares) = (0.0, 0.0);
    filter(steps, log_time.exp(), share_of(logit), |innovation, variance, _| {
        logs += variance.ln();
        squares += innovation * innovation / variance;
    });
    -0.5 * (logs + count(steps.len()) * squares.ln())
}

/// Returns the variance of ln τ, the covariance, and the variance of ln(s/(1 − s)) from the curvature of [`profile`]; `None` if the likelihood is flat.
fn covariance(steps: &[[f64; 2]], at: [f64; 2]) -> Option<[f64; 3]> {
    let beside = |time: f64, share: f64| profile(steps, [at[0] + time * STEP, at[1] + share * STEP]);
    let middle = beside(0.0, 0.0);
    let [of_time, of_share] = [[1.0, 0.0], [0.0, 1.0]].map(|[time, share]| 2.0 * middle - beside(time, share) - beside(-time, -share));
    let both = 0.25 * (beside(1.0, -1.0) + beside(-1.0, 1.0) - beside(1.0, 1.0) - beside(-1.0, -1.0));
    let determinant = of_time * of_share - both * both;
    (of_time > 0.0 && determinant > 0.0).then(|| [of_share, -both, of_time].map(|minor| minor / determinant * STEP * STEP))
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, Exp1, StandardNormal};

    use super::super::{correlation, independence};
    use super::*;
    use crate::series::NORMAL_975;
    use crate::tests::TestRng;

    /// Returns packets every 8 ms in the mean, a tenth of them lost, with delays of a skewed law: the share `share` of the variance of the normal numbers has
    /// the correlation time `time`.
    fn arrivals(seed: u64, packets: usize, memory: (f64, f64), even: bool) -> Vec<(f64, f64)> {
        arrivals_with_loss(0.1, seed, packets, memory, even)
    }

    fn arrivals_with_loss(loss: f64, seed: u64, packets: usize, (time, share): (f64, f64), even: bool) -> Vec<(f64, f64)> {
        let mut rng = TestRng::new(seed);
        let (mut now, mut level): (f64, f64) = (0.0, StandardNormal.sample(&mut rng));
        let mut arrivals = Vec::new();
        for _ in 0..packets {
            let random: f64 = Exp1.sample(&mut rng);
            let gap = if even { 0.008 } else { 0.008 * random };
            let phi: f64 = (-gap / time).exp();
            let [noise, jitter]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
            level = phi * level + (1.0 - phi * phi).sqrt() * noise;
            now += gap;
            if rng.unit() >= loss {
                let score = share.sqrt() * level + (1.0 - share).sqrt() * jitter;
                arrivals.push((now, 0.02 + 0.004 * (0.6 * score).exp()));
            }
        }
        arrivals
    }

    /// Two numbers, each within four standard errors; the time in the logarithm, because the error of the logarithm does not depend on the estimate.
    #[test]
    fn time_and_share_are_found_within_their_standard_errors() {
        for (seed, time, share, even) in [(1, 0.5, 0.6, true), (2, 0.1, 0.3, true), (3, 0.5, 0.6, false), (4, 2.0, 0.8, false), (5, 0.03, 0.7, true)]
        {
            let (fit, innovations) = correlation::fit(&arrivals(seed, 20_000, (time, share), even), 0.008).unwrap();
            let [time_se, share_se, lag_se] = [fit.time_se_s, fit.share_se, fit.lag_one_se].map(Option::unwrap);
            assert!((fit.time_s / time).ln().abs() < 4.0 * time_se / fit.time_s && time_se < 0.5 * time, "{fit:?}");
            assert!((fit.share - share).abs() < 4.0 * share_se && share_se < 0.1, "{fit:?}");
            assert!((fit.lag_one - share * (-0.008 / time).exp()).abs() < 4.0 * lag_se, "{fit:?}");
            // An innovation is in units of its own deviation: over 18 000 packets the mean square has the standard error √(2/n) = 0.011.
            let squares = innovations.iter().map(|innovation| innovation * innovation).sum::<f64>();
            assert!((squares / count(innovations.len()) - 1.0).abs() < 0.05, "{squares}");
            // The memory consists of the two numbers, so that the innovations are independent.
            assert!(independence::test(&innovations.into_iter().map(Some).collect::<Vec<_>>()).unwrap().holds(), "{fit:?}");
        }
    }

    /// Returns the expected standard errors of ln τ, s and s·e^{−Δ/τ} for `n` scores of unknown variance, Δ = 8 ms apart. The information of two parameters is
    /// n/2 times the covariance, over the frequencies, of the derivatives of the logarithm of the spectrum (Whittle 1953, Arkiv för Matematik 2(5)).
    fn expected_errors(n: usize, time: f64, share: f64) -> [f64; 3] {
        const FREQUENCIES: u32 = 10_000;
        const SMALL: f64 = 1e-5;
        let lag_one = |log_time: f64| (-0.008 / log_time.exp()).exp();
        let along = |of: &dyn Fn(f64, f64) -> f64| {
            let at = |by_time: f64, by_share: f64| of(time.ln() + by_time * SMALL, share + by_share * SMALL);
            [at(1.0, 0.0) - at(-1.0, 0.0), at(0.0, 1.0) - at(0.0, -1.0)].map(|difference| difference / (2.0 * SMALL))
        };
        let derivatives: Vec<[f64; 2]> = (0..FREQUENCIES)
            .map(|place| (std::f64::consts::PI * (f64::from(place) + 0.5) / f64::from(FREQUENCIES)).cos())
            .map(|cosine| {
                along(&|log_time, share| {
                    let phi = lag_one(log_time);
                    (share * (1.0 - phi * phi) / (1.0 - 2.0 * phi * cosine + phi * phi) + 1.0 - share).ln()
                })
            })
            .collect();
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| derivatives.iter().map(of).sum::<f64>() / f64::from(FREQUENCIES);
        // An unknown variance raises the spectrum alike at all frequencies, so that only differences from the mean tell of the other parameters.
        let information = |one: usize, other: usize| count(n) / 2.0 * (mean(&|at| at[one] * at[other]) - mean(&|at| at[one]) * mean(&|at| at[other]));
        let [time_time, both, share_share] = [information(0, 0), information(0, 1), information(1, 1)];
        let determinant = time_time * share_share - both * both;
        let error = |of: &dyn Fn(f64, f64) -> f64| {
            let [by_time, by_share] = along(of);
            ((by_time.powi(2) * share_share - 2.0 * by_time * by_share * both + by_share.powi(2) * time_time) / determinant).sqrt()
        };
        [error(&|log_time, _| log_time), error(&|_, share| share), error(&|log_time, share| share * lag_one(log_time))]
    }

    /// The curvature of 20 000 scores differs from the expected curvature, so that the errors differ by up to 1.2 %.
    #[test]
    fn standard_errors_are_those_of_the_spectrum() {
        for (seed, time, share) in [(1, 0.5, 0.6), (2, 0.1, 0.3), (3, 0.03, 0.7), (4, 0.2, 0.95)] {
            let fit = correlation::fit(&arrivals_with_loss(0.0, seed, 20_000, (time, share), true), 0.008).unwrap().0;
            let [time_se, share_se, lag_se] = [fit.time_se_s, fit.share_se, fit.lag_one_se].map(Option::unwrap);
            // 1.96 errors of the time reach the farther end of the interval of ln τ.
            let log_time_se = (1.0 + NORMAL_975 * time_se / fit.time_s).ln() / NORMAL_975;
            for (found, expected) in [log_time_se, share_se, lag_se].into_iter().zip(expected_errors(20_000, fit.time_s, fit.share)) {
                assert!((found / expected - 1.0).abs() < 0.03, "{found} {expected} {fit:?}");
            }
        }
    }

    /// The least gain is the value of χ² that two further parameters exceed with probability 0.001, which is −2·ln 0.001 = 13.8.
    #[test]
    fn a_share_must_gain_the_quantile_of_chi_squared() {
        let arrivals = arrivals(6, 2_000, (0.5, 0.95), true);
        let scores = correlation::normal_scores(&arrivals.iter().map(|arrival| arrival.1).collect::<Vec<_>>());
        let gain = fit(&arrivals, &scores, 0.008, 0.0).unwrap().0.likelihood_ratio;
        let quantile = -2.0 * 0.001_f64.ln();
        for (left, has_share) in [(quantile + 0.1, true), (quantile - 0.1, false)] {
            assert_eq!(fit(&arrivals, &scores, 0.008, gain - left).is_some(), has_share, "{left}");
        }
    }

    /// Returns the steps of arrivals with a memory, and the scores of these arrivals alone.
    fn steps(seed: u64, packets: usize, memory: (f64, f64), even: bool) -> Vec<[f64; 2]> {
        let arrivals = arrivals_with_loss(0.0, seed, packets, memory, even);
        let scores = correlation::normal_scores(&arrivals.iter().map(|arrival| arrival.1).collect::<Vec<_>>());
        let mut last = 0.0;
        arrivals.iter().zip(scores).map(|(arrival, score)| [arrival.0 - std::mem::replace(&mut last, arrival.0), score]).collect()
    }

    /// The memory changes after 10 000 and after 20 000 packets, so that more packets or fewer would give another start.
    #[test]
    fn the_search_starts_from_the_first_20_000_arrivals() {
        let parts = [(1, 10_000, (0.5, 0.9)), (2, 10_000, (0.02, 0.5)), (3, 60_000, (2.0, 0.3))];
        let all: Vec<_> = parts.into_iter().flat_map(|(seed, packets, memory)| steps(seed, packets, memory, true)).collect();
        let begins = |steps: &[[f64; 2]]| start(steps, [0.004_f64.ln(), 640_f64.ln()]).unwrap();
        assert_eq!(begins(&all), begins(&all[..20_000]));
        assert_ne!(begins(&all), begins(&all[..10_000]));
        assert_ne!(begins(&all), begins(&all[20_000..]));
    }

    /// The start is the nearest point of the grid: two times are a factor of 1.9 apart, and two shares 0.2.
    #[test]
    fn the_search_starts_near_the_memory() {
        for (seed, time, share) in [(1, 0.005, 0.9), (2, 0.05, 0.1), (3, 0.3, 0.5), (4, 2.0, 0.3), (5, 30.0, 0.7)] {
            let [log_time, logit] = start(&steps(seed, 20_000, (time, share), false), [0.004_f64.ln(), 160_f64.ln()]).unwrap();
            assert!((log_time - f64::ln(time)).abs() < 0.7 && (share_of(logit) - share).abs() < 0.21, "{} {}", log_time.exp(), share_of(logit));
        }
    }

    /// Times from the spacing of the packets to a large part of the measurement are found, if the gaps or the length allow.
    #[test]
    fn short_and_long_times_are_found() {
        let short = correlation::fit(&arrivals(1, 20_000, (0.006, 0.8), false), 0.008).unwrap().0;
        assert!(short.share < 1.0 && (short.time_s / 0.006).ln().abs() < 0.5, "{short:?}");
        // The measurement takes 160 s, and has few times of a slow level: the estimates scatter.
        let long = (0..6).map(|seed| correlation::fit(&arrivals(seed, 20_000, (80.0, 0.9), true), 0.008).unwrap().0);
        assert!(long.into_iter().any(|fit| fit.share < 1.0 && fit.time_s > 16.0));
    }

    /// A level that drifts for the whole measurement of 16 s has no time of its own: the time is no longer than the measurement.
    #[test]
    fn no_time_outlasts_the_measurement() {
        for seed in 0..4 {
            let arrivals = arrivals(seed, 2_000, (1e4, 0.5), true);
            let drifting: Vec<_> = arrivals.into_iter().map(|(now, delay)| (now, delay + 0.0005 * now)).collect();
            let (fit, _) = correlation::fit(&drifting, 0.008).unwrap();
            assert!(fit.share < 1.0 && fit.time_s <= 16.0, "{fit:?}");
        }
    }

    /// Of 40 measurements with one memory and 40 without, hardly any gain 13.8 from a share: the probabilities are 0.0002 and 0.001. With random gaps, some of
    /// them tiny, the errors of the ranks gain more, with a share above 0.998.
    #[test]
    fn one_memory_and_none_get_no_share() {
        for seed in 0..40 {
            let one = correlation::fit(&arrivals(seed, 2_000, (0.05, 1.0), seed % 2 == 0), 0.008).unwrap().0;
            assert_eq!((one.share, one.share_se), (1.0, None), "{seed}");
            let none = correlation::fit(&arrivals(seed, 2_000, (0.05, 0.0), seed % 2 == 0), 0.008);
            assert!(none.as_ref().is_none_or(|(fit, _)| fit.share == 1.0), "{none:?}");
        }
    }

    /// Returns the ln L of normal numbers with unit variances and these covariances, by Cholesky's factor L of the matrix: the forward substitution L·w = y
    /// gives y'·C⁻¹·y = w'·w.
    fn of_matrix(scores: &[f64], covariance: impl Fn(usize, usize) -> f64) -> f64 {
        let n = scores.len();
        let (mut factor, mut solved) = (vec![vec![0.0; n]; n], vec![0.0; n]);
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..=i {
                let inner: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                let left = covariance(i, j) - inner;
                factor[i][j] = if i == j { f64::sqrt(left) } else { left / factor[j][j] };
            }
            solved[i] = (scores[i] - (0..i).map(|k| factor[i][k] * solved[k]).sum::<f64>()) / factor[i][i];
            sum += 0.5 * (scores[i] * scores[i] - solved[i] * solved[i]) - factor[i][i].ln();
        }
        sum
    }

    /// The filter is exact: its likelihood is that of the whole matrix of covariances, with two packets of the same instant and a long gap among the packets.
    #[test]
    fn the_likelihood_is_that_of_all_covariances() {
        let times: [f64; 7] = [0.0, 0.01, 0.01, 0.05, 0.06, 3.0, 3.02];
        let scores = [0.3, -1.2, 0.7, 2.1, 1.4, -0.4, -0.9];
        let mut last = f64::NEG_INFINITY;
        let steps: Vec<[f64; 2]> = times.iter().zip(scores).map(|(now, score)| [now - std::mem::replace(&mut last, *now), score]).collect();
        for (time, share) in [(0.05, 0.6), (1.0, 0.95), (0.002, 0.1)] {
            let expected = of_matrix(&scores, |i, j| if i == j { 1.0 } else { share * (-(times[i] - times[j]).abs() / time).exp() });
            let found = log_likelihood(&steps, time, share);
            assert!((found - expected).abs() < 1e-12 * (1.0 + expected.abs()), "{found} {expected}");
        }
    }
}
