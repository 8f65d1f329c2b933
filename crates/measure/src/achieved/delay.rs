//! Figures of delays.

use std::collections::BTreeMap;

use serde::Serialize;

use super::accumulator::Outcome;
use crate::batches;
use crate::series::{self, NORMAL_975, count, seconds};

/// Figures of the delays of arrived packets. The first arrived copy of a packet counts.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct DelayFigures {
    /// Mean delay \[s\].
    pub mean_s: f64,
    /// Standard error of the mean \[s\] by batch means, which take correlation into account. The true mean lies within 2.05 standard errors with confidence
    /// 0.95 (Student, 29 degrees of freedom). `None` for fewer than 300 packets, or for a memory of the delays longer than a fortieth of the stream.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_se_s: Option<f64>,
    /// Standard deviation \[s\] with the divisor n − 1; `None` for a single packet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sd_s: Option<f64>,
    /// Standard error of the standard deviation \[s\]: the error of the variance, by batch means of squared deviations, divided by 2·sd (delta method).
    /// Valid for laws with a fourth moment, which Pareto laws lack. `None` for fewer than 300 packets or equal delays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sd_se_s: Option<f64>,
    /// Least delay \[s\].
    pub least_s: f64,
    /// Greatest delay \[s\].
    pub greatest_s: f64,
    /// Quantiles \[s\] by probability, from `"0.01"` to `"0.9999"`, interpolated between order statistics (type 7 of Hyndman & Fan 1996). Quantiles beyond
    /// 1 − 1/n are close to the greatest delay.
    pub quantiles_s: BTreeMap<&'static str, f64>,
    /// Order statistics enclosing each quantile with confidence 0.95 \[s\]. Only quantiles inside the sample are present. From 300 packets on, batch means
    /// take correlation into account.
    pub quantile_intervals_95_s: BTreeMap<&'static str, [f64; 2]>,
    /// Autocorrelation at lags of 1 to 10 packets, over pairs with both packets arrived. Empty for equal delays.
    pub autocorrelation: Vec<f64>,
    /// Bound of the autocorrelation of independent packets: within ± this value with probability 0.95. The bound is 1.96/√n (Bartlett 1946), with n the
    /// number of pairs at the lag with the fewest pairs, and exceeds 1 for fewer than four pairs.
    pub autocorrelation_bound_95: f64,
}

/// Names and probabilities of the reported quantiles.
const QUANTILES: [(&str, f64); 9] = [
    ("0.01", 0.01),
    ("0.05", 0.05),
    ("0.25", 0.25),
    ("0.5", 0.5),
    ("0.75", 0.75),
    ("0.95", 0.95),
    ("0.99", 0.99),
    ("0.999", 0.999),
    ("0.9999", 0.9999),
];

/// Largest reported lag of an autocorrelation \[packet\].
pub(super) const LAGS: usize = 10;

impl DelayFigures {
    pub(super) fn of(outcomes: &[Outcome]) -> Option<Self> {
        let by_packet: Vec<Option<f64>> = outcomes.iter().map(|outcome| outcome.delay().map(seconds)).collect();
        let delays: Vec<f64> = by_packet.iter().filter_map(|delay| *delay).collect();
        let series: Vec<u64> = outcomes.iter().filter_map(|outcome| outcome.delay()).collect();
        // Sorted as whole nanoseconds, so that order and equality are exact.
        let mut sorted = series.clone();
        sorted.sort_unstable();
        let (&least, &greatest) = (sorted.first()?, sorted.last()?);
        let mean = series::mean(&delays)?;
        let sd = series::variance(&delays).map(f64::sqrt);
        let squares: Vec<f64> = delays.iter().map(|delay| (delay - mean).powi(2)).collect();
        Some(Self {
            mean_s: mean,
            mean_se_s: batches::batch_standard_error(&delays),
            sd_s: sd,
            sd_se_s: sd.filter(|&sd| sd > 0.0).and_then(|sd| Some(batches::batch_standard_error(&squares)? / (2.0 * sd))),
            least_s: seconds(least),
            greatest_s: seconds(greatest),
            quantiles_s: QUANTILES.into_iter().map(|(name, p)| (name, series::quantile(&sorted, p) / 1e9)).collect(),
            quantile_intervals_95_s: QUANTILES
                .into_iter()
                .filter_map(|(name, p)| Some((name, batches::quantile_interval(&sorted, &series, p)?.map(seconds))))
                .collect(),
            autocorrelation: series::autocorrelation(&by_packet, LAGS),
            autocorrelation_bound_95: NORMAL_975 / count(fewest_pairs(&by_packet).max(1)).sqrt(),
        })
    }
}

/// Returns the number of pairs with both packets arrived, at the lag with the fewest pairs.
fn fewest_pairs(by_packet: &[Option<f64>]) -> usize {
    let at_lag = |lag: usize| by_packet.iter().zip(by_packet.iter().skip(lag)).filter(|(one, other)| one.is_some() && other.is_some()).count();
    (1..=LAGS).map(at_lag).min().unwrap_or(0)
}
