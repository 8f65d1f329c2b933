//! Why a law is refused.

/// Why a law, or a correlation of one, is refused. Numbers are in the caller's unit.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum LawError {
    /// NaN or an infinity.
    #[error("the {quantity} is {found}: expected a finite number")]
    NotFinite {
        /// Which number.
        quantity: &'static str,
        /// What it was.
        found: f64,
    },
    /// A standard deviation below zero.
    #[error("the standard deviation is {sd}: expected zero or more")]
    NegativeDeviation {
        /// What it was.
        sd: f64,
    },
    /// No delay can be below the floor, so the mean cannot.
    #[error("the mean is {mean}, below the floor of {floor}: expected a mean at or above it")]
    FloorAboveMean {
        /// The mean asked for.
        mean: f64,
        /// The floor, zero unless another was given.
        floor: f64,
    },
    /// A law with a least value (uniform, Pareto, empirical) would begin below the floor, where it could not be kept.
    #[error(
        "the {law} law with mean {mean} and standard deviation {sd} begins at {least}, below the floor of {floor}: the deviation can be at most {largest_sd}"
    )]
    ReachesBelowFloor {
        /// The name of the law.
        law: &'static str,
        /// The mean asked for.
        mean: f64,
        /// The standard deviation asked for.
        sd: f64,
        /// Where the law would begin.
        least: f64,
        /// The floor, zero unless another was given.
        floor: f64,
        /// The largest standard deviation with which this law stays above the floor.
        largest_sd: f64,
    },
    /// A law on the half-line above the floor whose deviation is too large for its mean: nearly every draw would be the floor, and no run would be
    /// long enough to meet the mean.
    #[error("the {law} law has its mean {above_floor} above the floor and a standard deviation of {sd}: the deviation can be at most {largest_sd}")]
    TooVaried {
        /// The name of the law.
        law: &'static str,
        /// Mean less floor.
        above_floor: f64,
        /// The standard deviation asked for.
        sd: f64,
        /// The largest one: [`MAX_VARIATION`](super::MAX_VARIATION) times the mean above the floor.
        largest_sd: f64,
    },
    /// A correlation is a number from −1 to 1.
    #[error("the correlation is {found}: expected a number from -1 to 1")]
    NotACorrelation {
        /// What it was.
        found: f64,
    },
    /// Two variables with this law cannot be so negatively correlated: unless the law is symmetric, the least correlation is above −1.
    #[error("two delays with this law cannot have the correlation {asked}: expected at least {least}")]
    TooNegative {
        /// The correlation asked for.
        asked: f64,
        /// The least that this law allows, between a delay at z and one at −z.
        least: f64,
    },
}
