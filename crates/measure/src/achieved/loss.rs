//! Figures of losses.

use std::collections::BTreeMap;

use serde::Serialize;

use super::accumulator::Outcome;
use super::delay::LAGS;
use crate::batches;
use crate::series::{self, NORMAL_975, count_u64, wilson};

/// Figures of arrived and lost packets, in the order of sending.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct LossFigures {
    /// Packets with at least one arrived copy.
    pub received: u64,
    /// Packets without an arrived copy, and without a copy on the way.
    pub lost: u64,
    /// Share of packets lost; `None` if no packet has ended.
    #[serde(rename = "loss", skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// Wilson's interval of the share at confidence 0.95. From 300 packets on, batch means take bursts into account.
    #[serde(rename = "loss_interval_95", skip_serializing_if = "Option::is_none")]
    pub interval_95: Option<[f64; 2]>,
    /// Standard error of the share by batch means, which take bursts into account. `None` for fewer than 300 packets.
    #[serde(rename = "loss_se", skip_serializing_if = "Option::is_none")]
    pub standard_error: Option<f64>,
    /// Mean number of packets lost in a row.
    #[serde(rename = "loss_run_mean", skip_serializing_if = "Option::is_none")]
    pub run_mean: Option<f64>,
    /// Standard error of the mean run of losses: sd/√(number of runs), because runs of a Markov chain are independent. At least the error implied by
    /// Wilson's interval of the share of lost packets that end a run, which matters for few or equal runs.
    #[serde(rename = "loss_run_mean_se", skip_serializing_if = "Option::is_none")]
    pub run_mean_se: Option<f64>,
    /// Number of runs of losses, by length. Runs cut off by the ends of the measurement count with their visible length.
    #[serde(rename = "loss_runs")]
    pub runs: BTreeMap<u64, u64>,
    /// Mean number of packets received in a row, between losses and at the ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap_mean: Option<f64>,
    /// Standard error of the mean gap, computed as for runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap_mean_se: Option<f64>,
    /// Number of gaps, by length.
    pub gaps: BTreeMap<u64, u64>,
    /// Autocorrelation of the loss indicator (1 lost, 0 received) at lags of 1 to 10 packets. Empty if no packet or every packet was lost.
    #[serde(rename = "loss_autocorrelation")]
    pub autocorrelation: Vec<f64>,
}

impl LossFigures {
    pub(super) fn of(outcomes: &[Outcome]) -> Self {
        let by_packet: Vec<Option<f64>> = outcomes.iter().map(|outcome| outcome.lost().map(|lost| f64::from(u8::from(lost)))).collect();
        let indicator: Vec<f64> = by_packet.iter().filter_map(|lost| *lost).collect();
        let [gaps, runs] = runs(outcomes.iter().filter_map(|outcome| outcome.lost()));
        let packets = |runs: &BTreeMap<u64, u64>| runs.iter().map(|(length, times)| length * times).sum::<u64>();
        let (received, lost) = (packets(&gaps), packets(&runs));
        let ended = received + lost;
        Self {
            received,
            lost,
            value: (ended > 0).then(|| count_u64(lost) / count_u64(ended)),
            interval_95: batches::share_interval(&indicator),
            standard_error: batches::batch_standard_error(&indicator),
            run_mean: mean_of_lengths(&runs),
            run_mean_se: standard_error_of_lengths(&runs),
            gap_mean: mean_of_lengths(&gaps),
            gap_mean_se: standard_error_of_lengths(&gaps),
            runs,
            gaps,
            autocorrelation: series::autocorrelation(&by_packet, LAGS),
        }
    }
}

impl Outcome {
    pub(super) const fn delay(self) -> Option<u64> {
        match self {
            Self::Received(nanos) => Some(nanos),
            Self::Lost | Self::OnTheWay => None,
        }
    }

    const fn lost(self) -> Option<bool> {
        match self {
            Self::Received(_) => Some(false),
            Self::Lost => Some(true),
            Self::OnTheWay => None,
        }
    }
}

/// Counts runs by length, first of received packets, then of lost packets.
fn runs(lost: impl Iterator<Item = bool>) -> [BTreeMap<u64, u64>; 2] {
    let mut runs = [BTreeMap::new(), BTreeMap::new()];
    let mut current: Option<(bool, u64)> = None;
    // The extra `None` at the end closes the last run.
    for lost in lost.map(Some).chain([None]) {
        match (current, lost) {
            (Some((kind, length)), Some(lost)) if kind == lost => current = Some((kind, length + 1)),
            (before, next) => {
                if let Some((kind, length)) = before {
                    *runs[usize::from(kind)].entry(length).or_default() += 1;
                }
                current = next.map(|lost| (lost, 1));
            }
        }
    }
    runs
}

fn mean_of_lengths(runs: &BTreeMap<u64, u64>) -> Option<f64> {
    let times: u64 = runs.values().sum();
    (times > 0).then(|| runs.iter().map(|(length, times)| count_u64(length * times)).sum::<f64>() / count_u64(times))
}

fn standard_error_of_lengths(runs: &BTreeMap<u64, u64>) -> Option<f64> {
    let mean = mean_of_lengths(runs)?;
    let times: u64 = runs.values().sum();
    let squares: f64 = runs.iter().map(|(&length, &times)| count_u64(times) * (count_u64(length) - mean).powi(2)).sum();
    let packets: u64 = runs.iter().map(|(length, times)| length * times).sum();
    // 1/mean is the share of lost packets that end a run, so Wilson's interval of the share gives an interval of the mean.
    let reach = wilson(times, packets).map_or(0.0, |[low, high]| (1.0 / low - mean).max(mean - 1.0 / high) / NORMAL_975);
    (times > 1).then(|| (squares / count_u64(times - 1) / count_u64(times)).sqrt().max(reach))
}
