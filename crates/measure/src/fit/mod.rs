//! An estimate of a link from measured one-way delays and losses.
//!
//! ```text
//! CSV ─────────┐                       ┌─► law of the delay: six families, floor, AIC, Kolmogorov's distance, or the delays themselves
//!              ├─► Measurements ─ fit ─┼─► its memory: correlation time of an Ornstein–Uhlenbeck process
//! captures ────┘   (offset, skew)      └─► loss: independent or in bursts, BIC
//! ```
//!
//! What comes out is a [`Fitted`]: a link that can be written into a scene, and how good it is. The methods are described, with their sources, on
//! [`LawFit`], [`CorrelationFit`] and [`LossFit`].
//!
//! One-way delays need synchronised clocks. A constant offset cannot be told from the delay and is part of the estimate (unless it is known:
//! [`Measurements::shifted`]); a linear drift can be removed on request where it is significant ([`Measurements::without_skew`]).
//!
//! # Files of measurements
//!
//! [`Measurements::from_csv`] reads the columns `t,delay[,lost]` or `sent,arrived` ([`cohaptic_wan::delay_table`]). [`captures::between`] reads a pair of captures of
//! the two ends.

pub mod captures;
mod cells;
mod correlation;
mod distribution;
mod hidden_markov;
mod law;
mod link;
mod link_delay;
mod loss;
mod measurements;
mod search;
mod skew;
mod steps;
mod table;

use std::fmt::Write as _;
use std::sync::Arc;

use cohaptic_units::print::Counted;
use cohaptic_wan::law::Empirical;
use serde::Serialize;

pub use correlation::CorrelationFit;
pub use distribution::LawFit;
pub use law::DelayLaw;
pub use link::{FittedJitter, FittedLaw, FittedLink};
pub use loss::{LossFit, LossModel};
pub use measurements::{Measurement, Measurements, MeasurementsError};
pub use skew::{Location, Skew, SkewError};
pub use steps::Step;

use cells::Cells;
use distribution::Moments;
use link_delay::LinkDelay;

use crate::batches::{self, student};
use crate::series::{self, count};

/// A link and how good the estimate is. Serialised: `link{…}, goodness{…}`.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Fitted {
    /// The link.
    pub link: FittedLink,
    /// How good it is.
    pub goodness: Goodness,
    /// The measured delays \[s\], where they are the law of the link.
    #[serde(skip)]
    delays: Option<Arc<Empirical>>,
}

impl Fitted {
    /// The file of delays that the link names where no law fits: CSV with the column `delay`, in seconds, sorted. `None` where a law fits.
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

/// What the estimate rests on, and the models that were not chosen.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Goodness {
    /// Packets sent.
    pub packets: usize,
    /// Packets that arrived.
    pub received: usize,
    /// The number of independent delays that would say as much about their mean, n·(1 − r₁)/(1 + r₁) with the autocorrelation r₁ at lag one.
    pub effective: f64,
    /// The median gap between packets sent \[s\]; where most gaps are zero, because packets are sent in bursts, the median gap between bursts.
    pub spacing_s: f64,
    /// Whether at least 95 % of the gaps are within a fifth of the median. If so, correlation and loss are per packet, otherwise in time.
    pub evenly_spaced: bool,
    /// The mean of the measured delays \[s\].
    pub mean_s: f64,
    /// Its standard error by batch means \[s\], that of a drift that was taken off included; the mean of the link lies within 2.05 of these with confidence
    /// 0.95. `None` of fewer than 300, and where the delays hang together for too long.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_se_s: Option<f64>,
    /// The standard deviation of the measured delays \[s\].
    pub sd_s: f64,
    /// Standard error of the standard deviation \[s\], sd·√((κ − 1)/4m) with the kurtosis κ of the delays and m = `effective`, at most half of it.
    pub sd_se_s: f64,
    /// The least delay \[s\].
    pub least_s: f64,
    /// The resolution of the clock \[s\]: the greatest step of which all differences of delays are whole multiples, in nanoseconds. A delay stands for all within
    /// half a step.
    pub resolution_s: f64,
    /// The least delay corrected for its bias without a law, 2x₁ − x₂ of the two least *different* delays (Robson & Whitlock 1964, Biometrika 51(1/2)),
    /// not below zero \[s\]. It is right for laws that are dense at their floor, and too high for others, whose own floors stand in `laws`.
    pub floor_robson_whitlock_s: f64,
    /// The largest distance of distribution functions at which a law fits, 0.02 + 1.63/√m with m = `effective`, at least 50.
    pub kolmogorov_limit: f64,
    /// Every law that has the moments of the delays: those that fit first, of which the first one is the law of the link.
    pub laws: Vec<LawFit>,
    /// The memory of the delays; `None` if they are as good as independent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlation: Option<CorrelationFit>,
    /// Wilson's interval for the share lost at confidence 0.95; from 300 packets on, batch means take bursts into account. `None` where they hang together
    /// for too long.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss_interval_95: Option<[f64; 2]>,
    /// Every model of loss that applies, the chosen one first.
    pub losses: Vec<LossFit>,
}

/// Why no link can be estimated.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum FitError {
    /// No packet arrived, or there is none.
    #[error("none of {} arrived: expected at least {LEAST_RECEIVED} delays", Counted(*packets, "packet"))]
    NothingArrived {
        /// Packets sent.
        packets: usize,
    },
    /// Too few packets arrived.
    #[error("only {} arrived: expected at least {LEAST_RECEIVED} delays", Counted(*received, "packet"))]
    TooFew {
        /// Packets that arrived.
        received: usize,
    },
    /// A delay is negative: the clocks are offset.
    #[error("the packet sent at {sent_s} s has a delay of {delay_s} s: expected none below zero (are the two clocks apart?)")]
    NegativeDelay {
        /// When it was sent \[s\].
        sent_s: f64,
        /// Its delay \[s\].
        delay_s: f64,
    },
    /// All delays are equal.
    #[error("all {received} delays are {delay_s} s: there is no jitter to estimate, the link is this constant delay")]
    ConstantDelay {
        /// Packets that arrived.
        received: usize,
        /// Their delay \[s\].
        delay_s: f64,
    },
    /// All packets were sent at the same time.
    #[error("all packets were sent at one instant, {sent_s} s: expected packets of several instants")]
    OneInstant {
        /// That time \[s\].
        sent_s: f64,
    },
}

/// A link counts nanoseconds: delays that are closer are equal.
const HALF_A_NANOSECOND: f64 = 0.5e-9;
/// Fewer delays than this tell laws apart by chance.
const LEAST_RECEIVED: usize = 50;

/// Estimates the link.
///
/// # Errors
///
/// [`FitError`] if fewer than 50 packets arrived, a delay is negative, all delays are equal in nanoseconds, or all packets were sent at one instant.
///
/// # Panics
///
/// Never: the expectations inside state what the checks before have shown.
pub fn fit(measurements: &Measurements) -> Result<Fitted, FitError> {
    let packets = measurements.packets();
    let arrivals: Vec<(f64, f64)> = measurements.arrivals().collect();
    let received = arrivals.len();
    let mut sorted: Vec<f64> = arrivals.iter().map(|arrival| arrival.1).collect();
    sorted.sort_by(f64::total_cmp);
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
    let (spacing_s, evenly_spaced) = spacing(packets);
    if spacing_s <= 0.0 {
        return Err(FitError::OneInstant { sent_s: packets[0].sent_s });
    }

    let effective = effective(packets);
    let moments = Moments::of(&sorted, effective).expect("delays differ");
    let laws = distribution::fit_all(&Cells::new(&sorted, resolution_s), &moments, effective);
    let correlation = correlation::fit(&arrivals, spacing_s);
    let losses = loss::fit_all(&packets.iter().map(|packet| (packet.sent_s, packet.delay_s.is_none())).collect::<Vec<_>>(), evenly_spaced);
    let delays: Vec<f64> = arrivals.iter().map(|arrival| arrival.1).collect();
    let delay = match laws.first().filter(|best| best.fit.fits) {
        Some(best) => LinkDelay::of_law(best),
        None => LinkDelay::of_delays(&sorted),
    };
    let jitter = FittedJitter {
        sd_s: delay.sd_s,
        distribution: delay.distribution,
        floor_s: delay.floor_s,
        correlation: correlation.filter(|_| evenly_spaced).map(|fit| delay.law.as_ref().map_or(fit.lag_one, |law| law.correlation(fit.lag_one))),
        correlation_time_s: correlation.filter(|_| !evenly_spaced).map(|fit| fit.time_s),
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
        resolution_s,
        floor_robson_whitlock_s: robson_whitlock(&sorted),
        kolmogorov_limit: distribution::limit(effective),
        laws: laws.iter().map(|law| law.fit).collect(),
        correlation,
        loss_interval_95: batches::share_interval(&packets.iter().map(|packet| f64::from(u8::from(packet.delay_s.is_none()))).collect::<Vec<_>>()),
        losses,
    };
    let link = FittedLink { delay_s: delay.mean_s, jitter, loss: goodness.losses.first().expect("one model always applies").model };
    Ok(Fitted { link, goodness, delays: delay.delays })
}

/// What the error of a drift that was taken off, so that the first packet stayed as it is, makes of the mean \[s\].
fn error_of_drift(measurements: &Measurements, arrivals: &[(f64, f64)]) -> f64 {
    let Some((skew, first)) = measurements.removed().zip(measurements.packets().first()) else { return 0.0 };
    let since = series::mean(&arrivals.iter().map(|arrival| arrival.0 - first.sent_s).collect::<Vec<_>>()).unwrap_or(0.0);
    since * skew.standard_error * student(0.975, skew.blocks - 2) / student(0.975, batches::MOST - 1)
}

/// The median gap, and whether nearly all gaps are like it. Of packets that are sent in bursts, each at one instant, the median gap between bursts, which is
/// zero only if there is one burst.
fn spacing(packets: &[Measurement]) -> (f64, bool) {
    let mut gaps: Vec<f64> = packets.windows(2).map(|pair| pair[1].sent_s - pair[0].sent_s).collect();
    gaps.sort_by(f64::total_cmp);
    let median = |gaps: &[f64]| gaps.get(gaps.len() / 2).copied().unwrap_or(0.0);
    let all = median(&gaps);
    // Gaps are not negative.
    let spacing = if all > 0.0 { all } else { median(&gaps[gaps.partition_point(|gap| *gap <= 0.0)..]) };
    let like = gaps.iter().filter(|gap| (*gap - spacing).abs() <= 0.2 * spacing).count();
    (spacing, count(like) >= 0.95 * count(gaps.len()))
}

/// At least 2, at most the number of delays.
fn effective(packets: &[Measurement]) -> f64 {
    let delays: Vec<Option<f64>> = packets.iter().map(|packet| packet.delay_s).collect();
    let received = count(delays.iter().flatten().count());
    let lag_one = series::autocorrelation(&delays, 1).first().copied().unwrap_or(0.0).clamp(0.0, 0.999_999);
    (received * (1.0 - lag_one) / (1.0 + lag_one)).max(2.0)
}

fn robson_whitlock(sorted: &[f64]) -> f64 {
    let least = sorted[0];
    let second = sorted.iter().copied().find(|&delay| delay > least).unwrap_or(least);
    (2.0 * least - second).max(0.0)
}

#[cfg(test)]
mod refusal;
#[cfg(test)]
mod tests;
