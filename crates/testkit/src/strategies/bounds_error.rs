//! Why bounds are refused.

use std::fmt;
use std::time::Duration;

use super::stage::Stage;

/// Why bounds make no sense.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub enum BoundsError {
    /// The range has nothing in it.
    Empty {
        /// The stage.
        stage: Stage,
        /// Where it begins.
        low: String,
        /// Where it ends.
        high: String,
    },
    /// The range has only zero in it.
    OnlyZero {
        /// The stage.
        stage: Stage,
    },
    /// No percentage.
    Percentage {
        /// The stage.
        stage: Stage,
        /// What was found.
        found: f64,
    },
    /// A time that netem cannot count.
    TooLong {
        /// The stage.
        stage: Stage,
        /// What was found.
        found: Duration,
    },
    /// A rate that netem cannot count.
    Rate {
        /// What was found.
        found: u64,
    },
    /// Jitter above any delay.
    JitterAboveDelay {
        /// The least jitter.
        jitter: Duration,
        /// The longest delay.
        delay: Duration,
    },
    /// Loss without a model.
    NoModel,
}

impl fmt::Display for BoundsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty { stage, low, high } => {
                write!(f, "{stage}: the range from {low} to {high} is empty: expected its end at or above its beginning")
            }
            Self::OnlyZero { stage } => {
                write!(f, "{stage}: a range with nothing but zero: expected LinkBounds::never(Stage::{stage:?}), or an end above zero")
            }
            Self::Percentage { stage, found } => write!(f, "{stage}: {found} is no percentage: expected 0 to 100"),
            Self::TooLong { stage, found } => write!(f, "{stage}: {found:?} is too long: expected at most 1 hour"),
            Self::Rate { found } => write!(f, "rate: {found} bit/s: expected 8 bit/s to 1 Tbit/s"),
            Self::JitterAboveDelay { jitter, delay } => write!(
                f,
                "jitter of at least {jitter:?} around delays of at most {delay:?}: expected a delay that may be as long as the least jitter"
            ),
            Self::NoModel => f.write_str("loss without a model: expected one of random, gemodel and state, or LinkBounds::never(Stage::Loss)"),
        }
    }
}

impl std::error::Error for BoundsError {}
