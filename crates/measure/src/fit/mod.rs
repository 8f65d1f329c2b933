//! Estimates a link from measured one-way delays and losses.
//!
//! ```text
//! CSV ─────────┐                       ┌─► law of the delay: six families, floor, AIC, Kolmogorov's distance, or the delays themselves
//!              ├─► Measurements ─ fit ─┼─► its memory: correlation time of an Ornstein–Uhlenbeck process, or of a share of the variation
//! captures ────┘   (offset, skew)      └─► loss: independent or in bursts, BIC
//! ```
//!
//! The result is a [`Fitted`]: a link for a scene, and the goodness of the estimate. The methods and their sources are described at [`LawFit`],
//! [`CorrelationFit`] and [`LossFit`].
//!
//! One-way delays need synchronised clocks. A constant offset looks like delay and becomes part of the estimate, unless the offset is known
//! ([`Measurements::shifted`]). A significant linear drift can be removed on request ([`Measurements::without_skew`]).
//!
//! # Files of measurements
//!
//! [`Measurements::from_csv`] reads the columns `t,delay[,lost]` or `sent,arrived` ([`cohaptic_wan::delay_table`]). [`captures::between`] reads a pair of
//! captures, made at the two ends. [`readers`] read files of other programs, such as IRTT and ping.

pub mod captures;
mod cells;
mod correlation;
mod distribution;
mod hidden_markov;
pub mod hold_out;
mod independence;
mod law;
mod link;
mod link_delay;
mod loss;
mod measurements;
mod partial_memory;
mod rate_walk;
pub mod readers;
mod search;
mod skew;
mod steps;
mod table;
mod ticks;
pub mod transfer;

use std::fmt::Write as _;
use std::sync::Arc;

use cohaptic_units::print::Counted;
use cohaptic_wan::law::Empirical;
use serde::Serialize;

pub use correlation::CorrelationFit;
pub use distribution::LawFit;
pub use independence::Independence;
pub use law::DelayLaw;
pub use link::{FittedJitter, FittedLaw, FittedLink};
pub use loss::{LossFit, LossModel};
pub use measurements::{Measurement, Measurements, MeasurementsError};
pub use rate_walk::{RateWalk, RateWalkError};
pub use skew::{Location, Skew, SkewError};
pub use steps::Step;

use cells::Cells;
use distribution::Moments;
use link_delay::LinkDelay;

use crate::batches::{self, student};
use crate::series::{self, count};

/// An estimated link with the goodness of the estimate. Serialised: `link{…}, goodness{…}`.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Fitted {
    /// Estimated link.
    pub link: FittedLink,
    /// Goodness of the estimate.
    pub goodness: Goodness,
    /// Measured delays \[s\]; `None` if a law fits.
    #[serde(skip)]
    delays: Option<Arc<Empirical>>,
}

impl Fitted {
    /// Returns the file of delays for a link without a fitting law: CSV with the column `delay`, in seconds, sorted. `None` if a law fits.
    #[must_use]
    pub fn delays_csv(&self) -> Option<String> {
        let mut text = "delay\n".to_owned();
        for delay in self.delays.as_ref()?.knots() {
            // Writing to a `String` cannot fail.
            let _ = writeln!(text, "{delay}");
        }
        Some(text)
    }
}

/// Data of the estimate, and all models with their goodness.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Goodness {
    /// Packets sent.
    pub packets: usize,
    /// Packets arrived.
    pub received: usize,
    /// Number of independent delays with the same information about the mean: n·(1 − r₁)/(1 + r₁), with the autocorrelation r₁ at lag one.
    pub effective: f64,
    /// Median gap between packets sent \[s\]. For packets sent in bursts, with most gaps zero, the median gap between bursts.
    pub spacing_s: f64,
    /// `true` if at least 95 % of the gaps are within a fifth of the median. If so, correlation and loss are per packet, otherwise in time.
    pub evenly_spaced: bool,
    /// Mean of the measured delays \[s\].
    pub mean_s: f64,
    /// Standard error of the mean by batch means \[s\], including the error of a removed drift. The true mean lies within 2.05 standard errors with
    /// confidence 0.95. `None` for fewer than 300 delays or a too long memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_se_s: Option<f64>,
    /// Standard deviation of the measured delays \[s\].
    pub sd_s: f64,
    /// Standard error of the standard deviation \[s\]: sd·√((κ − 1)/4m), with the kurtosis κ of the delays and m = `effective`, and at most half of the
    /// standard deviation.
    pub sd_se_s: f64,
    /// Least delay \[s\].
    pub least_s: f64,
    /// Tick of the clock \[s\], of the median delay: as given, as the program prints delays, or the greatest step such that all differences of delays are
    /// whole multiples, in nanoseconds. A shown delay stands for all delays within half a tick.
    pub resolution_s: f64,
    /// Least delay, corrected for its bias without a law and not below zero \[s\]: 2x₁ − x₂ of the two least *different* delays (Robson & Whitlock 1964,
    /// Biometrika 51(1/2)). Right for laws with a density at their floor, and too high for other laws, whose own floors are in `laws`.
    pub floor_robson_whitlock_s: f64,
    /// Largest distance of distribution functions of a fitting law: 0.02 + 1.63/√m, with m = `effective`, at least 50.
    pub kolmogorov_limit: f64,
    /// All laws able to have the moments of the delays. Fitting laws come first, and the first fitting law is the law of the link.
    pub laws: Vec<LawFit>,
    /// Correlation of the delays in the link; `None` if no single correlation time describes them significantly better than independent delays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlation: Option<CorrelationFit>,
    /// Test of independent delays, without a model of their memory. With a correlation time, the test of what the correlation time does not explain: the
    /// innovations of the normal scores. `None` if no two neighbours arrived.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub independence: Option<Independence>,
    /// Wilson's interval of the share lost at confidence 0.95. From 300 packets on, batch means take bursts into account. `None` for losses with a too long
    /// memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss_interval_95: Option<[f64; 2]>,
    /// All applicable models of loss, the chosen model first.
    pub losses: Vec<LossFit>,
}

/// Error of an estimate.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// No packet arrived, or no packet was sent.
    #[error("none of {} arrived: expected at least {LEAST_RECEIVED} delays", Counted(*packets, "packet"))]
    NothingArrived {
        /// Packets sent.
        packets: usize,
    },
    /// Too few packets arrived.
    #[error("only {} arrived: expected at least {LEAST_RECEIVED} delays", Counted(*received, "packet"))]
    TooFew {
        /// Packets arrived.
        received: usize,
    },
    /// A delay is negative, because the clocks are offset.
    #[error("the packet sent at {sent_s} s has a delay of {delay_s} s: expected none below zero (are the two clocks apart?)")]
    NegativeDelay {
        /// Instant of sending \[s\].
        sent_s: f64,
        /// Delay \[s\].
        delay_s: f64,
    },
    /// All delays are equal.
    #[error("all {received} delays are {delay_s} s: there is no jitter to estimate, the link is this constant delay")]
    ConstantDelay {
        /// Packets arrived.
        received: usize,
        /// Delay of all packets \[s\].
        delay_s: f64,
    },
    /// All delays are equal, to half a tick of the clock.
    #[error("all {received} delays are {delay_s} s, to half a tick of {tick_s} s: there is no jitter to estimate, the link is this constant delay")]
    OneTick {
        /// Packets arrived.
        received: usize,
        /// Least delay \[s\].
        delay_s: f64,
        /// Tick of the clock \[s\].
        tick_s: f64,
    },
    /// All packets were sent at the same instant.
    #[error("all packets were sent at one instant, {sent_s} s: expected packets of several instants")]
    OneInstant {
        /// Instant of sending of all packets \[s\].
        sent_s: f64,
    },
}

/// Difference \[s\] below which delays are equal for a link, which counts nanoseconds.
const HALF_A_NANOSECOND: f64 = 0.5e-9;
/// Fewest delays for an estimate. With fewer delays, chance decides between laws.
const LEAST_RECEIVED: usize = 50;

/// Estimates a link.
///
/// # Errors
///
/// [`FitError`] if fewer than 50 packets arrived, a delay is negative, all delays are equal in nanoseconds or to half a known tick, or all packets were sent at the same instant.
///
/// # Panics
///
/// Never: the checks at the beginning establish what the code expects later.
pub fn fit(measurements: &Measurements) -> Result<Fitted, FitError> {
    let packets = measurements.packets();
    let arrivals: Vec<(f64, f64)> = measurements.arrivals().collect();
    let received = arrivals.len();
    // Each delay keeps its own tick through the sort, because programs print long delays with fewer digits.
    let mut shown: Vec<(f64, Option<f64>)> =
        packets.iter().enumerate().filter_map(|(number, packet)| Some((packet.delay_s?, measurements.ticks.of(number)))).collect();
    shown.sort_by(|one, other| one.0.total_cmp(&other.0));
    let sorted: Vec<f64> = shown.iter().map(|delay| delay.0).collect();
    let [&least_s, &greatest] = [sorted.first(), sorted.last()].map(|end| end.unwrap_or(&0.0));
    if received == 0 {
        return Err(FitError::NothingArrived { packets: packets.len() });
    }
    if received < LEAST_RECEIVED {
        return Err(FitError::TooFew { received });
    }
    if let Some(&(sent_s, delay_s)) = arrivals.iter().find(|arrival| arrival.1 < 0.0) {
        return Err(FitError::NegativeDelay { sent_s, delay_s });
    }
    let resolution_s = cells::resolution(measurements).filter(|_| greatest - least_s >= HALF_A_NANOSECOND);
    let Some(resolution_s) = resolution_s else {
        return Err(FitError::ConstantDelay { received, delay_s: least_s });
    };
    let tick_s = |place: usize| shown[place].1.unwrap_or(resolution_s);
    let cells = Cells::new(&sorted, tick_s);
    if cells.cells.len() == 1 {
        return Err(FitError::OneTick { received, delay_s: least_s, tick_s: tick_s(0) });
    }
    let (spacing_s, evenly_spaced) = spacing(packets);
    if spacing_s <= 0.0 {
        return Err(FitError::OneInstant { sent_s: packets[0].sent_s });
    }

    let effective = effective(packets);
    let moments = Moments::of(&sorted, effective).expect("delays differ");
    let laws = distribution::fit_all(&cells, &moments, effective);
    let (correlation, innovations) = correlation::fit(&arrivals, spacing_s).unzip();
    let tested: Vec<Option<f64>> = match innovations {
        Some(innovations) => innovations.into_iter().map(Some).collect(),
        None => packets.iter().map(|packet| packet.delay_s).collect(),
    };
    let losses = loss::fit_all(&packets.iter().map(|packet| (packet.sent_s, packet.delay_s.is_none())).collect::<Vec<_>>(), evenly_spaced);
    // Batch means need the order of sending, so `sorted` does not serve here.
    let delays: Vec<f64> = arrivals.iter().map(|arrival| arrival.1).collect();
    let delay = match laws.first().filter(|best| best.fit.fits) {
        Some(best) => LinkDelay::of_law(best),
        None => LinkDelay::of_delays(&sorted),
    };
    let jitter = FittedJitter {
        sd_s: delay.sd_s,
        distribution: delay.distribution,
        floor_s: delay.floor_s,
        correlation: correlation
            .filter(|fit| evenly_spaced && fit.share >= 1.0)
            .map(|fit| delay.law.as_ref().map_or(fit.lag_one, |law| law.correlation(fit.lag_one))),
        // A share has a memory in time only, whatever the spacing.
        correlation_time_s: correlation.filter(|fit| !evenly_spaced || fit.share < 1.0).map(|fit| fit.time_s),
        correlation_share: correlation.map(|fit| fit.share).filter(|share| *share < 1.0),
    };
    let goodness = Goodness {
        packets: packets.len(),
        received,
        effective,
        spacing_s,
        evenly_spaced,
        mean_s: moments.mean,
        mean_se_s: batches::batch_standard_error(&delays).map(|error| error.hypot(error_of_drift(measurements, &arrivals))),
        sd_s: moments.sd,
        sd_se_s: moments.sd_error,
        least_s,
        resolution_s: tick_s(received / 2),
        floor_robson_whitlock_s: robson_whitlock(&sorted),
        kolmogorov_limit: distribution::limit(effective),
        laws: laws.iter().map(|law| law.fit).collect(),
        correlation,
        independence: independence::test(&tested),
        loss_interval_95: batches::share_interval(&packets.iter().map(|packet| f64::from(u8::from(packet.delay_s.is_none()))).collect::<Vec<_>>()),
        losses,
    };
    let link = FittedLink { delay_s: delay.mean_s, jitter, loss: goodness.losses.first().expect("one model always applies").model };
    Ok(Fitted { link, goodness, delays: delay.delays })
}

/// Returns the error of the mean caused by the error of a removed drift \[s\]. The removal kept the delay of the first packet, so the error grows with the
/// mean time since then.
fn error_of_drift(measurements: &Measurements, arrivals: &[(f64, f64)]) -> f64 {
    let Some((skew, first)) = measurements.removed().zip(measurements.packets().first()) else { return 0.0 };
    let since = series::mean(&arrivals.iter().map(|arrival| arrival.0 - first.sent_s).collect::<Vec<_>>()).unwrap_or(0.0);
    // The drift has other degrees of freedom than 30 batch means. The ratio of quantiles makes one factor, 2.045, right for both errors.
    since * skew.standard_error * student(0.975, skew.blocks - 2) / student(0.975, batches::MOST - 1)
}

/// Returns the median gap \[s\], and whether nearly all gaps are close to the median. For bursts (most gaps zero) returns the median gap between bursts,
/// which is zero only for a single burst.
fn spacing(packets: &[Measurement]) -> (f64, bool) {
    let mut gaps: Vec<f64> = packets.windows(2).map(|pair| pair[1].sent_s - pair[0].sent_s).collect();
    gaps.sort_by(f64::total_cmp);
    let median = |gaps: &[f64]| gaps.get(gaps.len() / 2).copied().unwrap_or(0.0);
    let all = median(&gaps);
    // The gaps are sorted and not negative, so the slice has the positive gaps.
    let spacing = if all > 0.0 { all } else { median(&gaps[gaps.partition_point(|gap| *gap <= 0.0)..]) };
    let like = gaps.iter().filter(|gap| (*gap - spacing).abs() <= 0.2 * spacing).count();
    (spacing, count(like) >= 0.95 * count(gaps.len()))
}

/// Returns the effective number of delays, see [`Goodness::effective`]: at least 2, at most the number of delays.
fn effective(packets: &[Measurement]) -> f64 {
    let delays: Vec<Option<f64>> = packets.iter().map(|packet| packet.delay_s).collect();
    let received = count(delays.iter().flatten().count());
    // A negative correlation would count more delays than were measured, and a correlation of 1 none.
    let lag_one = series::autocorrelation(&delays, 1).first().copied().unwrap_or(0.0).clamp(0.0, 0.999_999);
    (received * (1.0 - lag_one) / (1.0 + lag_one)).max(2.0)
}

/// Returns the bias-corrected least delay, see [`Goodness::floor_robson_whitlock_s`].
fn robson_whitlock(sorted: &[f64]) -> f64 {
    let least = sorted[0];
    let second = sorted.iter().copied().find(|&delay| delay > least).unwrap_or(least);
    (2.0 * least - second).max(0.0)
}

#[cfg(test)]
mod refusal;
#[cfg(test)]
mod tests;
