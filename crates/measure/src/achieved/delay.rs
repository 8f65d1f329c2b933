//! Figures of delays.

use std::collections::BTreeMap;

use serde::Serialize;

use super::accumulator::Outcome;
use crate::batches;
use crate::series::{self, NORMAL_975, count, seconds};

/// Figures of the delays of the packets that arrived, the first copy of each.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct DelayFigures {
    /// The mean \[s\].
    pub mean_s: f64,
    /// The standard error of the mean \[s\] by 30 batch means, which takes correlation into account; the mean asked for lies within 2.05 of these with
    /// confidence 0.95 (Student, 29 degrees of freedom). `None` of fewer than 300 packets, and of delays that remember for a fortieth of them or longer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_se_s: Option<f64>,
    /// The standard deviation \[s\], with n − 1; `None` of one packet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sd_s: Option<f64>,
    /// The standard error of the standard deviation \[s\]: that of the variance by batch means of the squared deviations, over 2·sd (the delta
    /// method). It holds for every law with four moments, which Pareto's does not have. `None` of fewer than 300 packets or of equal delays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sd_se_s: Option<f64>,
    /// The least \[s\].
    pub least_s: f64,
    /// The greatest \[s\].
    pub greatest_s: f64,
    /// Quantiles \[s\] by probability, from `"0.01"` to `"0.9999"`, interpolated between order statistics (type 7 of Hyndman & Fan 1996). Those
    /// beyond 1 − 1/n are hardly more than the greatest.
    pub quantiles_s: BTreeMap<&'static str, f64>,
    /// For each quantile that the sample is large enough for, the order statistics that enclose it with confidence 0.95 \[s\]; batch means take correlation
    /// into account, from 300 packets on.
    pub quantile_intervals_95_s: BTreeMap<&'static str, [f64; 2]>,
    /// The autocorrelation at lags of 1 to 10 packets, over the pairs of which both arrived. Empty if all delays are equal.
    pub autocorrelation: Vec<f64>,
    /// Of independent packets, each autocorrelation lies within ± this with probability 0.95: 1.96/√n (Bartlett 1946) with n the number of pairs of which
    /// both arrived, at the lag that has the fewest. Beyond 1 where there are fewer than four.
    pub autocorrelation_bound_95: f64,
}

/// The quantiles that are reported.
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

/// How far autocorrelation is reported \[packets\].
pub(super) const LAGS: usize = 10;

impl DelayFigures {
    pub(super) fn of(outcomes: &[Outcome]) -> Option<Self> {
        let by_packet: Vec<Option<f64>> = outcomes.iter().map(|outcome| outcome.delay().map(seconds)).collect();
        let delays: Vec<f64> = by_packet.iter().filter_map(|delay| *delay).collect();
        let series: Vec<u64> = outcomes.iter().filter_map(|outcome| outcome.delay()).collect();
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

/// At the lag that has the fewest pairs.
fn fewest_pairs(by_packet: &[Option<f64>]) -> usize {
    let at_lag = |lag: usize| by_packet.iter().zip(by_packet.iter().skip(lag)).filter(|(one, other)| one.is_some() && other.is_some()).count();
    (1..=LAGS).map(at_lag).min().unwrap_or(0)
}
