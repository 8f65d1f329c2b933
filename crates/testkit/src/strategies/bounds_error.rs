//! Why bounds are refused.

use core::time::Duration;

use super::stage::Stage;

/// Why bounds make no sense.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BoundsError {
    /// The range has nothing in it.
    #[error("{stage}: the range from {low} to {high} is empty: expected its end at or above its beginning")]
    Empty {
        /// The stage.
        stage: Stage,
        /// Where it begins.
        low: String,
        /// Where it ends.
        high: String,
    },
    /// The range has only zero in it.
    #[error("{stage}: a range with nothing but zero: expected LinkBounds::never(Stage::{stage:?}), or an end above zero")]
    OnlyZero {
        /// The stage.
        stage: Stage,
    },
    /// No percentage.
    #[error("{stage}: {found} is no percentage: expected 0 to 100")]
    Percentage {
        /// The stage.
        stage: Stage,
        /// What was found.
        found: f64,
    },
    /// A time that netem cannot count.
    #[error("{stage}: {found:?} is too long: expected at most 1 hour")]
    TooLong {
        /// The stage.
        stage: Stage,
        /// What was found.
        found: Duration,
    },
    /// A rate that netem cannot count.
    #[error("rate: {found} bit/s: expected 8 bit/s to 1 Tbit/s")]
    Rate {
        /// What was found.
        found: u64,
    },
    /// Jitter above any delay.
    #[error("jitter of at least {jitter:?} around delays of at most {delay:?}: expected a delay that may be as long as the least jitter")]
    JitterAboveDelay {
        /// The least jitter.
        jitter: Duration,
        /// The longest delay.
        delay: Duration,
    },
    /// Loss without a model.
    #[error("loss without a model: expected one of random, gemodel and state, or LinkBounds::never(Stage::Loss)")]
    NoModel,
}
