//! Drift of a clock against another from one-way delays, with its uncertainty.
//!
//! Input is the arrivals (sending, delay); output is a [`Skew`]. The arrivals are divided into blocks of equal numbers in the order of sending, with a
//! length of at least 4 integrated autocorrelation times ([`crate::batches`]). Without drift each block is a sample of the same law, so a location T of the
//! delays of a block is an independent number from a common law. The drift s is therefore the slope whose removal leaves the locations T(d − s·t) without a
//! slope in time. The residuals of the locations give the standard error, for any law and memory of the delays: Student's law with two degrees of freedom
//! fewer than blocks. Drift inside a block does no harm, because the drift is removed before the location is taken.
//!
//! The most certain location depends on the law: the mean for a normal law, the median for long tails on both sides, the least delay for laws with an edge,
//! as after a queue, and the lower eighth for laws with a gentle beginning and a long tail. (Segment minima: Paxson 1998, SIGMETRICS, "On calibrating
//! measurements of packet transit times".) All four are computed, and the location with the least standard error is used. This choice favours a location
//! whose error came out too small, so each location is judged at a quarter of the level (Bonferroni): in at most 1 % of measurements without drift a drift
//! is found.
//!
//! Alternative: the line below all points with the least distance (Moon, Skelly & Towsley 1999, INFOCOM) needs no blocks, and is 2.5 times as close for
//! independent delays of laws with an edge. Its error depends on the law and on the memory of delays near the edge, and cannot be stated. Without an edge
//! the line follows single points.

mod blocks;

use cohaptic_units::print::Counted;
use serde::Serialize;

use self::blocks::Blocks;
use super::LEAST_RECEIVED;
use crate::batches::{Batches, TooFew, student};

/// Linear drift of the receiver's clock against the sender's.
///
/// A path with a linearly growing delay looks the same. The constant offset of the clocks cannot be found from one direction.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Skew {
    /// Seconds gained by the receiver's clock per second of the sender's clock.
    pub seconds_per_second: f64,
    /// Standard error of the drift, for Student's law with two degrees of freedom fewer than `blocks`.
    pub standard_error: f64,
    /// Interval of the true drift with confidence of at least 0.99, with the choice of the location taken into account.
    pub interval_99: [f64; 2],
    /// `true` if zero lies outside the interval. Only a significant drift is removed.
    pub significant: bool,
    /// Location of the delays used for the estimate.
    pub location: Location,
    /// Number of blocks.
    pub blocks: usize,
}

/// Location of the delays of a block: a single value that represents the block.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Location {
    /// Mean.
    Mean,
    /// Median.
    Median,
    /// Delay above an eighth of the delays.
    LowerEighth,
    /// Least delay.
    Least,
}

/// Error of estimating a drift.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SkewError {
    /// Too few packets arrived.
    #[error("only {} arrived: expected at least {LEAST_RECEIVED} delays to tell drift from chance", Counted(*received, "packet"))]
    TooFew {
        /// Packets arrived.
        received: usize,
    },
    /// All arrived packets were sent at the same instant.
    #[error("all packets that arrived were sent at one instant, {sent_s} s: expected different times to tell drift from")]
    OneInstant {
        /// Instant of sending \[s\].
        sent_s: f64,
    },
    /// The delays have a too long memory, or change in other ways than by drift.
    #[error(
        "the delays depend on each other over about {memory_s:.3} s of the {span_s:.3} s measured, so drift and chance look alike: \
         expected a measurement of {needed_s:.0} s or more (or leave the drift in)"
    )]
    LongMemory {
        /// Integrated autocorrelation time \[s\], a lower bound because the measurement is too short for the estimate.
        memory_s: f64,
        /// Time from the first to the last packet \[s\].
        span_s: f64,
        /// Length of a measurement sufficient for this memory \[s\].
        needed_s: f64,
    },
}

impl Location {
    /// All locations. Their number divides the level of the test.
    pub(crate) const ALL: [Self; 4] = [Self::Mean, Self::Median, Self::LowerEighth, Self::Least];

    /// Returns the name in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mean => "mean",
            Self::Median => "median",
            Self::LowerEighth => "lower-eighth",
            Self::Least => "least",
        }
    }
}

/// Probability of finding a drift without a drift.
const LEVEL: f64 = 0.01;
/// Fewest blocks. With fewer, Student's quantiles are so large that no drift is found.
const LEAST_BLOCKS: usize = 5;
/// Resolution of delays at best \[s\].
const RESOLUTION_S: f64 = 1e-9;

impl Skew {
    /// Estimates the drift of arrivals (sending, delay) \[s\] in the order of sending.
    pub(super) fn of(points: &[(f64, f64)]) -> Result<Self, SkewError> {
        let (Some(first), Some(last)) = (points.first(), points.last()) else { return Err(SkewError::TooFew { received: 0 }) };
        if points.len() < LEAST_RECEIVED {
            return Err(SkewError::TooFew { received: points.len() });
        }
        let span_s = last.0 - first.0;
        if span_s <= 0.0 {
            return Err(SkewError::OneInstant { sent_s: first.0 });
        }
        // Far from zero, as between clocks counting from different years, floating-point numbers are more than a nanosecond apart.
        let largest = points.iter().map(|point| point.1.abs()).fold(0.0, f64::max);
        let resolution = RESOLUTION_S.max(4.0 * f64::EPSILON * largest);
        // Relative to the first point, so that a common part costs no digits.
        let points: Vec<(f64, f64)> = points.iter().map(|point| (point.0 - first.0, point.1 - first.1)).collect();
        let batches = Batches::of(&blocks::residuals(&points), LEAST_BLOCKS, resolution).map_err(|error| match error {
            TooFew::Short => SkewError::TooFew { received: points.len() },
            TooFew::LongMemory { memory, allowed } => {
                SkewError::LongMemory { memory_s: memory * span_s, span_s, needed_s: memory * span_s / allowed }
            }
        })?;
        let blocks = Blocks::cut(&points, batches.count);
        // A slope that rounding alone could cause is never certain, even if the blocks agree perfectly.
        let least_error = resolution / span_s;
        let found = Location::ALL.into_iter().filter_map(|location| Some((location, blocks.slope(location, 1e-3 * least_error)?)));
        let (location, slope) = found.min_by(|one, other| one.1.error.total_cmp(&other.1.error)).ok_or(SkewError::OneInstant { sent_s: first.0 })?;
        let standard_error = (slope.error * batches.correction.sqrt()).hypot(least_error);
        let away = student(1.0 - LEVEL / 2.0 / crate::series::count(Location::ALL.len()), batches.count - 2) * standard_error;
        let interval_99 = [slope.value - away, slope.value + away];
        let significant = !(interval_99[0]..=interval_99[1]).contains(&0.0);
        Ok(Self { seconds_per_second: slope.value, standard_error, interval_99, significant, location, blocks: batches.count })
    }
}

#[cfg(test)]
mod tests;
