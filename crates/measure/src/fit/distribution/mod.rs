//! Which law do the delays follow?
//!
//! | law | estimate |
//! | --- | --- |
//! | normal | mean and deviation (greatest likelihood) |
//! | Laplace | median and mean deviation from it (greatest likelihood) |
//! | uniform | x₁ − w, xₙ + w with w = (xₙ − x₁)/(n − 1): unbiased of least variance |
//! | lognormal, gamma, Weibull | shape and scale of greatest likelihood for the floor θ of Cohen & Whitten: F(x₁ − θ) = 1/(n + 1) |
//!
//! The condition on the floor (Cohen & Whitten 1980, JASA 75(370); 1982, Technometrics 24(4)) says that the least of n delays lies where the least of n
//! is expected. Unlike the full likelihood, which is infinite at θ = x₁ for the lognormal law and for shapes below 1, it has one solution, if there is
//! a floor above zero at all. For correlated delays n is the effective number, n·(1 − r₁)/(1 + r₁).
//!
//! The laws are compared by Akaike's criterion, 2k − 2·ln L with k parameters; the least is chosen. Correlation makes the differences larger than they
//! should be, but does not move them systematically to one of the laws.

use serde::Serialize;
use statrs::function::gamma;

use super::law::{DelayLaw, Law};
use super::search::crossing;
use crate::series::{self, count};

/// One law fitted to the delays.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct LawFit {
    /// The law.
    pub distribution: DelayLaw,
    /// Its mean \[s\].
    pub mean_s: f64,
    /// Its standard deviation \[s\].
    pub sd_s: f64,
    /// Its least delay \[s\]; `None` if it has none or if the data show none above zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor_s: Option<f64>,
    /// Its shape: that of the gamma and Weibull laws, the standard deviation of the logarithm of the lognormal law.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<f64>,
    /// ln L of the delays, in seconds, as if they were independent.
    pub log_likelihood: f64,
    /// Akaike's criterion; less is better, and a difference of 10 is plain (Burnham & Anderson 2002).
    pub aic: f64,
    /// The largest distance between the distribution functions of the data and of the law (Kolmogorov). The usual table does not apply, as the
    /// parameters were fitted.
    pub kolmogorov: f64,
}

/// How many order statistics stand for all of them while a floor is looked for.
const THINNED: usize = 4_000;
/// The finest resolution of a distance of distribution functions.
const COMPARED: usize = 50_000;
/// Beyond this shape a gamma law is a normal law.
const LARGEST_SHAPE: f64 = 1e4;
const LEAST_SHAPE: f64 = 1e-2;

/// All laws, the best first. `sorted` are at least two different delays, none negative.
pub(super) fn fit_all(sorted: &[f64], effective: f64) -> Vec<LawFit> {
    let mut fits: Vec<LawFit> = DelayLaw::ALL.into_iter().filter_map(|name| Some(judge(&fit(name, sorted, effective)?, sorted))).collect();
    fits.sort_by(|one, other| one.aic.total_cmp(&other.aic));
    fits
}

fn judge(law: &Law, sorted: &[f64]) -> LawFit {
    let floor_s = law.floor().filter(|&floor| floor > 0.0);
    let name = law.name();
    let parameters = match name {
        DelayLaw::Normal | DelayLaw::Uniform | DelayLaw::Laplace => 2.0,
        DelayLaw::Lognormal | DelayLaw::Gamma | DelayLaw::Weibull => {
            if floor_s.is_some() {
                3.0
            } else {
                2.0
            }
        }
    };
    let log_likelihood = sorted.iter().map(|&delay| law.log_density(delay)).sum::<f64>();
    LawFit {
        distribution: name,
        mean_s: law.mean(),
        sd_s: law.sd(),
        floor_s,
        shape: law.shape(),
        log_likelihood,
        aic: 2.0 * parameters - 2.0 * log_likelihood,
        kolmogorov: kolmogorov(law, sorted),
    }
}

/// Exact up to 50 000 delays; with more, at 50 000 of them, which misses at most 1/50 000.
fn kolmogorov(law: &Law, sorted: &[f64]) -> f64 {
    let n = count(sorted.len());
    let step = sorted.len().div_ceil(COMPARED);
    let distance = |(i, &delay): (usize, &f64)| {
        let below = law.below(delay);
        (below - count(i) / n).max(count(i + 1) / n - below)
    };
    sorted.iter().enumerate().step_by(step).map(distance).fold(0.0, f64::max)
}

fn fit(name: DelayLaw, sorted: &[f64], effective: f64) -> Option<Law> {
    let (least, greatest) = (*sorted.first()?, *sorted.last()?);
    match name {
        DelayLaw::Normal => {
            let mean = series::mean(sorted)?;
            let n = count(sorted.len());
            Some(Law::Normal { mean, sd: (series::variance(sorted)? * (n - 1.0) / n).sqrt() })
        }
        DelayLaw::Uniform => {
            let widening = (greatest - least) / (effective - 1.0).max(1.0);
            Some(Law::Uniform { low: (least - widening).max(0.0), high: greatest + widening })
        }
        DelayLaw::Laplace => {
            let middle = f64::midpoint(sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2]);
            let spread = series::mean(&sorted.iter().map(|delay| (delay - middle).abs()).collect::<Vec<_>>())?;
            (spread > 0.0).then_some(Law::Laplace { middle, spread })
        }
        DelayLaw::Lognormal | DelayLaw::Gamma | DelayLaw::Weibull => {
            let floor = floor(name, sorted, effective)?;
            fit_above(name, floor, sorted)
        }
    }
}

/// The floor θ at which F(x₁ − θ) = 1/(n + 1); 0 if no floor above zero is far enough below x₁.
fn floor(name: DelayLaw, sorted: &[f64], effective: f64) -> Option<f64> {
    let &least = sorted.first()?;
    let thinned = thin(sorted);
    let median = thinned[thinned.len() / 2];
    let wanted = 1.0 / (effective + 1.0);
    let excess = |floor: f64| fit_above(name, floor, &thinned).map(|law| law.below(least) - wanted);
    if least <= 0.0 {
        // A delay of zero has no logarithm: only a floor of zero is left, and no law with one.
        return None;
    }
    if excess(0.0).is_none_or(|excess| excess < 0.0) {
        return Some(0.0);
    }
    // In the logarithm of the distance below x₁. A part in 10⁹ of the typical distance above it is as good as none.
    let nearest = (1e-9 * (median - least).max(1e-3 * (sorted[sorted.len() - 1] - least))).min(least);
    let distance = crossing(nearest.ln(), least.ln(), |log_distance| excess(least - log_distance.exp()).unwrap_or(1.0)).exp();
    Some((least - distance).max(0.0))
}

/// The most order statistics, at the middles of equal shares; the least is among them.
fn thin(sorted: &[f64]) -> Vec<f64> {
    if sorted.len() <= THINNED {
        return sorted.to_vec();
    }
    (0..THINNED).map(|i| sorted[(2 * i + 1) * sorted.len() / (2 * THINNED)]).collect()
}

/// The law of greatest likelihood above that floor, which lies below all delays. `None` where it degenerates.
fn fit_above(name: DelayLaw, floor: f64, delays: &[f64]) -> Option<Law> {
    let logs: Vec<f64> = delays.iter().map(|delay| (delay - floor).ln()).collect();
    let mean_log = series::mean(&logs).filter(|mean| mean.is_finite())?;
    let n = count(delays.len());
    let sd_log = (series::variance(&logs)? * (n - 1.0) / n).sqrt();
    if sd_log <= 0.0 {
        return None;
    }
    match name {
        DelayLaw::Normal | DelayLaw::Uniform | DelayLaw::Laplace => None,
        DelayLaw::Lognormal => Some(Law::Lognormal { floor, mean_log, sd_log }),
        DelayLaw::Gamma => {
            let mean = series::mean(delays)? - floor;
            // ln k − ψ(k) = ln(mean) − mean of the logarithms (Johnson, Kotz & Balakrishnan 1994, 17.42); the left side falls with k.
            let wanted = mean.ln() - mean_log;
            let gap = |shape: f64| shape.ln() - gamma::digamma(shape);
            if !(gap(LARGEST_SHAPE)..gap(LEAST_SHAPE)).contains(&wanted) {
                return None;
            }
            let shape = crossing(LEAST_SHAPE.ln(), LARGEST_SHAPE.ln(), |log| wanted - gap(log.exp())).exp();
            Some(Law::Gamma { floor, shape, scale: mean / shape })
        }
        DelayLaw::Weibull => {
            let shape = weibull_shape(&logs, mean_log, sd_log)?;
            // Scale about the greatest logarithm, so that no power overflows.
            let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let power = logs.iter().map(|log| (shape * (log - top)).exp()).sum::<f64>() / n;
            Some(Law::Weibull { floor, shape, scale: (top + power.ln() / shape).exp() })
        }
    }
}

/// The root of Σxᵏ·ln x/Σxᵏ − 1/k − mean of ln x (Johnson, Kotz & Balakrishnan 1994, 21.49), which increases in k: Newton from the estimate of the
/// moments of ln x, π/(√6·sd).
fn weibull_shape(logs: &[f64], mean_log: f64, sd_log: f64) -> Option<f64> {
    let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut shape = std::f64::consts::PI / (6.0_f64.sqrt() * sd_log);
    for _ in 0..100 {
        let [s0, s1, s2] = logs.iter().fold([0.0; 3], |[s0, s1, s2], log| {
            let weight = (shape * (log - top)).exp();
            [s0 + weight, s1 + weight * log, s2 + weight * log * log]
        });
        let value = s1 / s0 - 1.0 / shape - mean_log;
        let slope = s2 / s0 - (s1 / s0).powi(2) + 1.0 / (shape * shape);
        // Never further than by half or to double: the function is not convex everywhere.
        let next = (shape - value / slope).clamp(shape / 2.0, shape * 2.0);
        if !(LEAST_SHAPE..LARGEST_SHAPE).contains(&next) {
            return None;
        }
        if (next - shape).abs() <= 1e-10 * shape {
            return Some(next);
        }
        shape = next;
    }
    None
}

#[cfg(test)]
mod tests;
