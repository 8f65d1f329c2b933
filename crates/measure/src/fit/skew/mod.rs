//! The drift of one clock against another, from one-way delays, and how certain it is.
//!
//! The arrivals are cut into blocks of equal numbers, in the order of sending, 4 integrated autocorrelation times long or longer ([`crate::batches`]).
//! Of delays without drift each block is a sample like any other, so that a location of its delays, T, is one independent number from one law, block by
//! block. So the drift s is where the locations T(d − s·t) of the blocks have no slope in time, and their residuals tell the standard error, whatever
//! the law of the delays and their memory: Student's law with two degrees of freedom fewer than blocks. (Drift within a block does no harm, since it is
//! taken off before the location is.)
//!
//! Which location is the most certain depends on the law: the mean for a normal one, the median for long tails on both sides, the least for those that begin
//! with an edge, as behind a queue, the lower eighth for those that begin gently and end far out. (Segment minima: Paxson 1998, SIGMETRICS, "On calibrating
//! measurements of packet transit times".) All four are computed, and the one with the least standard error is taken. That choice favours a location
//! whose error came out too small, so each is judged at a quarter of the level (Bonferroni): whichever is taken, a drift that is not there is found in at
//! most 1 % of all measurements.
//!
//! The line below all points of least distance (Moon, Skelly & Towsley 1999, INFOCOM) needs no blocks, and is 2.5 times as close for independent delays
//! of laws with an edge. But how close it is depends on the law and the memory of the delays near the edge, so that no error can be stated with it. Without an
//! edge it follows single points.

mod blocks;

use cohaptic_units::print::Counted;
use serde::Serialize;

use self::blocks::Blocks;
use super::LEAST_RECEIVED;
use crate::batches::{Batches, TooFew, student};

/// The linear drift of the receiver's clock against the sender's.
///
/// A path whose delay itself grows linearly looks the same. The constant offset of the clocks cannot be found from one direction.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Skew {
    /// Seconds that the receiver's clock gains each second of the sender's.
    pub seconds_per_second: f64,
    /// The standard error of that, for Student's law with two degrees of freedom fewer than `blocks`.
    pub standard_error: f64,
    /// The true drift lies within these two with confidence 0.99 at least, the choice of the location included.
    pub interval_99: [f64; 2],
    /// Whether zero lies outside: only then is there reason to believe in a drift, and only then is it removed.
    pub significant: bool,
    /// Which location of the delays it was found from.
    pub location: Location,
    /// The number of blocks.
    pub blocks: usize,
}

/// A number that stands for the delays of a block.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Location {
    /// The mean.
    Mean,
    /// The median.
    Median,
    /// The delay that an eighth of the others are below.
    LowerEighth,
    /// The least.
    Least,
}

/// Why no drift can be estimated.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum SkewError {
    /// Too few packets arrived.
    #[error("only {} arrived: expected at least {LEAST_RECEIVED} delays to tell drift from chance", Counted(*received, "packet"))]
    TooFew {
        /// Packets that arrived.
        received: usize,
    },
    /// All packets that arrived were sent at one instant.
    #[error("all packets that arrived were sent at one instant, {sent_s} s: expected different times to tell drift from")]
    OneInstant {
        /// That time \[s\].
        sent_s: f64,
    },
    /// The delays remember for too long, or change in other ways than by drift.
    #[error(
        "the delays hang together over about {memory_s:.3} s of the {span_s:.3} s measured, so that drift cannot be told from chance: \
         expected a measurement of {needed_s:.0} s or more (or leave the drift in)"
    )]
    LongMemory {
        /// The integrated autocorrelation time \[s\]; what it is at least, for it is seen in this measurement.
        memory_s: f64,
        /// The time from the first to the last packet \[s\].
        span_s: f64,
        /// The time that a measurement of that memory takes \[s\].
        needed_s: f64,
    },
}

impl Location {
    /// Every location; what the level is divided by.
    pub const ALL: [Self; 4] = [Self::Mean, Self::Median, Self::LowerEighth, Self::Least];

    /// The name in JSON.
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

/// The probability of a drift where there is none.
const LEVEL: f64 = 0.01;
/// With fewer blocks Student's quantiles are so large that nothing is found.
const LEAST_BLOCKS: usize = 5;
/// Delays are told to whole nanoseconds at best.
const RESOLUTION_S: f64 = 1e-9;

impl Skew {
    /// `points` are (sending, delay) in the order of sending.
    pub(super) fn of(points: &[(f64, f64)]) -> Result<Self, SkewError> {
        let (Some(first), Some(last)) = (points.first(), points.last()) else { return Err(SkewError::TooFew { received: 0 }) };
        if points.len() < LEAST_RECEIVED {
            return Err(SkewError::TooFew { received: points.len() });
        }
        let span_s = last.0 - first.0;
        if span_s <= 0.0 {
            return Err(SkewError::OneInstant { sent_s: first.0 });
        }
        // Far from zero, as between clocks that count from different years, numbers are spaced wider than nanoseconds.
        let largest = points.iter().map(|point| point.1.abs()).fold(0.0, f64::max);
        let resolution = RESOLUTION_S.max(4.0 * f64::EPSILON * largest);
        // About the first point, so that a common part costs no digits.
        let points: Vec<(f64, f64)> = points.iter().map(|point| (point.0 - first.0, point.1 - first.1)).collect();
        let batches = Batches::of(&blocks::residuals(&points), LEAST_BLOCKS, resolution).map_err(|error| match error {
            TooFew::Short => SkewError::TooFew { received: points.len() },
            TooFew::LongMemory { memory, allowed } => {
                SkewError::LongMemory { memory_s: memory * span_s, span_s, needed_s: memory * span_s / allowed }
            }
        })?;
        let blocks = Blocks::cut(&points, batches.count);
        // What rounding alone can make of a slope is never certain, however well the blocks agree.
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
