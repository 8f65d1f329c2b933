//! Judges a fitted link by packets that the fit has not seen.
//!
//! Input is the measurements and the share of the time that is held out; output is the figures of the held-out packets beside those of four predictions from
//! the first part: the fitted link, independent packets, Gilbert–Elliott losses with independent delays, and the first part itself. The first part itself shows
//! how far the line was from itself; a link that is twice as far is refused.

use cohaptic_units::print::Counted;
use serde::Serialize;

use super::{Measurement, Measurements};
use crate::batches;
use crate::series::{self, count};

/// Distances between packets, in packets, at which the correlation of delays is compared.
pub const LAGS: [usize; 3] = [1, 10, 100];

/// Figures of delays and losses.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Figures {
    /// Mean delay \[s\].
    pub mean_s: f64,
    /// Delays that 95 % and 99 % of the packets do not exceed \[s\]: of n sorted delays number ⌈qn⌉.
    pub quantiles_s: [f64; 2],
    /// ∫|F − G| over the distribution functions of these and of the held-out delays \[s\]; the mean distance by which delays must be moved. `None` for the
    /// held-out packets themselves.
    pub wasserstein_s: Option<f64>,
    /// Correlation of the delays of two packets that both arrived, 1, 10 and 100 packets apart, with mean and variance of all; `None` without such pairs.
    pub autocorrelation: [Option<f64>; 3],
    /// Share of the packets that was lost.
    pub loss: f64,
    /// Mean number of packets lost in a row; `None` without a loss.
    pub mean_run: Option<f64>,
    /// Shares of the runs of losses that have at least two and at least three packets; `None` without a loss.
    pub longer_runs: Option<[f64; 2]>,
}

/// Figures of the held-out packets and of predictions.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct HoldOut {
    /// Packets that were fitted.
    pub fitted: usize,
    /// Packets that were held out.
    pub held_out: usize,
    /// Figures of the held-out packets.
    pub measured: Figures,
    /// Figures of the fitted link.
    pub best: Figures,
    /// Figures of independent packets with the delays and the loss of the first part.
    pub independent: Figures,
    /// Figures of independent delays with runs of losses without memory, as long in the mean as in the first part.
    pub gilbert: Figures,
    /// Figures of the first part.
    pub replay: Figures,
    /// Why the fitted link is refused, as sentences without a full stop; empty if it is not.
    pub refused: Vec<String>,
}

/// Why nothing can be held out.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("a part has {arrived} packets that arrived: expected at least {FEWEST} in each part")]
pub struct HoldOutError {
    /// Packets that arrived in the part with fewer of them.
    pub arrived: usize,
}

/// Fewest arrived packets of a part.
const FEWEST: usize = 50;
/// Largest difference of correlations that is not refused.
const CORRELATION: f64 = 0.1;
/// Number of standard errors by which losses may differ: the quantile 0.975 for 30 batch means.
const ERRORS: f64 = 2.05;

impl Measurements {
    /// Divides the measurements in time: the last `share` of the time is held out. Returns the first part and the held-out part.
    ///
    /// # Errors
    ///
    /// [`HoldOutError`] if fewer than 50 packets of a part arrived.
    pub fn hold_out(&self, share: f64) -> Result<(Self, Self), HoldOutError> {
        let [first_s, last_s] = [self.packets.first(), self.packets.last()].map(|packet| packet.map_or(0.0, |packet| packet.sent_s));
        // The part of a time ends before the packet that is sent at that time, so that 40 000 packets have two halves of 20 000.
        let border_s = last_s - share * (last_s - first_s);
        let border = self.packets.partition_point(|packet| packet.sent_s < border_s);
        let parts = (self.part(0..border), self.part(border..self.packets.len()));
        let arrived = parts.0.arrivals().count().min(parts.1.arrivals().count());
        if arrived < FEWEST { Err(HoldOutError { arrived }) } else { Ok(parts) }
    }
}

impl HoldOut {
    /// Judges a link. `first` is the part that was fitted, `rest` the held-out part, `best` packets of the fitted link, and `tick_s` the tick of the clock
    /// \[s\]. Each has packets that arrived.
    #[must_use]
    pub fn of(first: &Measurements, rest: &Measurements, best: &Measurements, tick_s: f64) -> Self {
        let against = sorted(rest);
        let measured = Figures { wasserstein_s: None, ..Figures::of(rest.packets(), &against) };
        let replay = Figures::of(first.packets(), &against);
        let best = Figures::of(best.packets(), &against);
        // Quantiles and W₁ are those of the delays of the first part, whatever their order.
        let without_memory = Figures { autocorrelation: [Some(0.0); 3], ..replay };
        let lost = replay.loss > 0.0;
        // Without memory, a run of losses goes on with the probability `again` after each loss, so its length is geometric.
        let runs = |again: f64| (lost.then(|| 1.0 / (1.0 - again)), lost.then_some([again, again * again]));
        let with_runs = |again: f64| {
            let (mean_run, longer_runs) = runs(again);
            Figures { mean_run, longer_runs, ..without_memory }
        };
        let independent = with_runs(replay.loss);
        // A geometric run with the mean m goes on with the probability 1 − 1/m.
        let gilbert = with_runs(1.0 - replay.mean_run.unwrap_or(1.0).recip());
        let refused = refused(first, rest, tick_s, [&measured, &best, &replay]);
        Self { fitted: first.packets().len(), held_out: rest.packets().len(), measured, best, independent, gilbert, replay, refused }
    }
}

fn sorted(measurements: &Measurements) -> Vec<f64> {
    let mut delays: Vec<f64> = measurements.arrivals().map(|arrival| arrival.1).collect();
    delays.sort_by(f64::total_cmp);
    delays
}

/// Returns the number of packets of each run of losses.
fn runs(packets: &[Measurement]) -> Vec<f64> {
    packets
        .chunk_by(|one, other| one.delay_s.is_none() == other.delay_s.is_none())
        .filter(|run| run[0].delay_s.is_none())
        .map(|run| count(run.len()))
        .collect()
}

impl Figures {
    /// Computes the figures of packets, at least one of which arrived. `against` are the sorted held-out delays.
    fn of(packets: &[Measurement], against: &[f64]) -> Self {
        let mut delays: Vec<f64> = packets.iter().filter_map(|packet| packet.delay_s).collect();
        delays.sort_by(f64::total_cmp);
        // Number ⌈qn⌉ of n, counted from 1, in hundredths.
        let rank = |hundredths: usize| delays[(hundredths * delays.len()).div_ceil(100).max(1) - 1];
        let correlations = series::autocorrelation(&packets.iter().map(|packet| packet.delay_s).collect::<Vec<_>>(), LAGS[2]);
        let runs = runs(packets);
        let at_least = |length: f64| count(runs.iter().filter(|run| **run >= length).count()) / count(runs.len());
        Self {
            mean_s: series::mean(&delays).unwrap_or(0.0),
            quantiles_s: [rank(95), rank(99)],
            wasserstein_s: Some(wasserstein(&delays, against)),
            autocorrelation: LAGS.map(|lag| correlations.get(lag - 1).copied()),
            loss: count(packets.len() - delays.len()) / count(packets.len()),
            mean_run: series::mean(&runs),
            longer_runs: (!runs.is_empty()).then(|| [at_least(2.0), at_least(3.0)]),
        }
    }
}

/// Returns ∫|F − G| of two sorted samples.
fn wasserstein(one: &[f64], other: &[f64]) -> f64 {
    let (mut sum, mut before) = (0.0, f64::NAN);
    let (mut below_one, mut below_other) = (0, 0);
    while below_one < one.len() || below_other < other.len() {
        // `next` is the least delay not yet passed in either sample. Each pass goes beyond at least one delay, so the loop ends.
        let next = one.get(below_one).copied().unwrap_or(f64::INFINITY).min(other.get(below_other).copied().unwrap_or(f64::INFINITY));
        if !before.is_nan() {
            // Between two neighbouring delays of the joined samples, both distribution functions are constant.
            sum += (count(below_one) / count(one.len()) - count(below_other) / count(other.len())).abs() * (next - before);
        }
        below_one += one[below_one..].iter().take_while(|delay| **delay <= next).count();
        below_other += other[below_other..].iter().take_while(|delay| **delay <= next).count();
        before = next;
    }
    sum
}

/// Returns the standard errors of the share lost and of the mean run of losses; `None` for fewer than two runs.
fn errors(packets: &[Measurement]) -> (f64, Option<f64>) {
    let lost: Vec<f64> = packets.iter().map(|packet| f64::from(u8::from(packet.delay_s.is_none()))).collect();
    let independent = || series::share_error(lost.iter().filter(|lost| **lost > 0.0).count() as u64, lost.len() as u64);
    let runs = runs(packets);
    let of_runs = series::variance(&runs).map(|variance| (variance / count(runs.len())).sqrt());
    (batches::batch_standard_error(&lost).unwrap_or_else(independent), of_runs)
}

/// Returns why the fitted link is refused. Losses are compared with the errors of both parts: the link has those of the first part.
fn refused(first: &Measurements, rest: &Measurements, tick_s: f64, [measured, best, replay]: [&Figures; 3]) -> Vec<String> {
    let mut refused = Vec::new();
    let [found, own] = [best, replay].map(|figures| figures.wasserstein_s.unwrap_or(0.0));
    // Measured delays are rounded to ticks and delays of the link are not, so a distance within one tick refuses nothing.
    let limit = tick_s.max(2.0 * own);
    if found > limit {
        refused.push(format!("its delays are {:.4} ms from the held-out ones (W1), and at most {:.4} ms may be", found * 1e3, limit * 1e3));
    }
    for (place, lag) in LAGS.iter().enumerate() {
        if let Some((wanted, found)) = measured.autocorrelation[place].zip(best.autocorrelation[place])
            && (wanted - found).abs() > CORRELATION
        {
            let apart = Counted(*lag, "packet");
            refused.push(format!("the correlation of its delays {apart} apart is {found:.3}, and {wanted:.3} of the held-out ones"));
        }
    }
    let ((loss_first, runs_first), (loss_rest, runs_rest)) = (errors(first.packets()), errors(rest.packets()));
    let (found, wanted, error) = (best.loss * 100.0, measured.loss * 100.0, 100.0 * loss_first.hypot(loss_rest));
    if (found - wanted).abs() > ERRORS * error {
        refused.push(format!("its loss is {found:.4} %, and {wanted:.4} % of the held-out packets; {error:.4} % is a standard error"));
    }
    // A link without a loss has no runs. The share lost, compared before, judges such a link.
    if let (Some(found), Some(wanted), Some(error)) = (best.mean_run, measured.mean_run, runs_first.zip(runs_rest)) {
        let error = error.0.hypot(error.1);
        if (found - wanted).abs() > ERRORS * error {
            refused.push(format!(
                "its runs of losses have {found:.3} packets in the mean, and {wanted:.3} of the held-out ones; {error:.3} is a standard error"
            ));
        }
    }
    refused
}

#[cfg(test)]
mod tests;
