//! Why a law is refused.

use core::fmt;

/// Why a law, or a correlation of one, is refused. Numbers are in the caller's unit.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum LawError {
    /// NaN or an infinity.
    NotFinite {
        /// Which number.
        quantity: &'static str,
        /// What it was.
        found: f64,
    },
    /// A standard deviation below zero.
    NegativeDeviation {
        /// What it was.
        sd: f64,
    },
    /// No delay can be below the floor, so the mean cannot.
    FloorAboveMean {
        /// The mean asked for.
        mean: f64,
        /// The floor, zero unless another was given.
        floor: f64,
    },
    /// A law with a least value (uniform, Pareto, empirical) would begin below the floor, where it could not be kept.
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
    NotACorrelation {
        /// What it was.
        found: f64,
    },
    /// Two variables with this law cannot be so negatively correlated: unless the law is symmetric, the least correlation is above −1.
    TooNegative {
        /// The correlation asked for.
        asked: f64,
        /// The least that this law allows, between a delay at z and one at −z.
        least: f64,
    },
}

impl fmt::Display for LawError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { quantity, found } => write!(f, "the {quantity} is {found}: expected a finite number"),
            Self::NegativeDeviation { sd } => write!(f, "the standard deviation is {sd}: expected zero or more"),
            Self::FloorAboveMean { mean, floor } => write!(f, "the mean is {mean}, below the floor of {floor}: expected a mean at or above it"),
            Self::ReachesBelowFloor { law, mean, sd, least, floor, largest_sd } => write!(
                f,
                "the {law} law with mean {mean} and standard deviation {sd} begins at {least}, below the floor of {floor}: the deviation can be at most {largest_sd}"
            ),
            Self::TooVaried { law, above_floor, sd, largest_sd } => write!(
                f,
                "the {law} law has its mean {above_floor} above the floor and a standard deviation of {sd}: the deviation can be at most {largest_sd}"
            ),
            Self::NotACorrelation { found } => write!(f, "the correlation is {found}: expected a number from -1 to 1"),
            Self::TooNegative { asked, least } => {
                write!(f, "two delays with this law cannot have the correlation {asked}: expected at least {least}")
            }
        }
    }
}

impl core::error::Error for LawError {}
