//! Errors of bounds.

use std::fmt;
use std::time::Duration;

use super::stage::Stage;

/// Reason why bounds make no sense.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub enum BoundsError {
    /// The range is empty.
    Empty {
        /// The stage.
        stage: Stage,
        /// Beginning of the range.
        low: String,
        /// End of the range.
        high: String,
    },
    /// The range contains only zero.
    OnlyZero {
        /// The stage.
        stage: Stage,
    },
    /// A number is no percentage.
    Percentage {
        /// The stage.
        stage: Stage,
        /// The number.
        found: f64,
    },
    /// A time is too long for netem.
    TooLong {
        /// The stage.
        stage: Stage,
        /// The time.
        found: Duration,
    },
    /// A rate is out of the range of netem.
    Rate {
        /// The rate \[bit/s\].
        found: u64,
    },
    /// The least jitter is longer than the longest delay.
    JitterAboveDelay {
        /// Least jitter.
        jitter: Duration,
        /// Longest delay.
        delay: Duration,
    },
    /// Loss is permitted, but no model of loss is.
    NoModel,
}

impl fmt::Display for BoundsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty { stage, low, high } => {
                write!(f, "{stage}: the range from {low} to {high} is empty: expected its end at or above its beginning")
            }
            Self::OnlyZero { stage } => {
                write!(f, "{stage}: the range holds only zero: expected LinkBounds::never(Stage::{stage:?}), or an end above zero")
            }
            Self::Percentage { stage, found } => write!(f, "{stage}: {found} is not a percentage: expected 0 to 100"),
            Self::TooLong { stage, found } => write!(f, "{stage}: {found:?} is too long: expected at most 1 hour"),
            Self::Rate { found } => write!(f, "rate: {found} bit/s: expected 8 bit/s to 1 Tbit/s"),
            Self::JitterAboveDelay { jitter, delay } => {
                write!(f, "the jitter is at least {jitter:?} and the delay at most {delay:?}: expected a longest delay of at least the least jitter")
            }
            Self::NoModel => f.write_str("loss has no model: expected one of random, gemodel and state, or LinkBounds::never(Stage::Loss)"),
        }
    }
}

impl std::error::Error for BoundsError {}
