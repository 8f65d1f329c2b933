//! Why a law is refused.

use core::fmt;

use cohaptic_units::print::SixDigits;

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
        let six = SixDigits;
        match *self {
            Self::NotFinite { quantity, found } => write!(f, "the {quantity} is {}: expected a finite number", six(found)),
            Self::NegativeDeviation { sd } => write!(f, "the standard deviation is {}: expected zero or more", six(sd)),
            Self::FloorAboveMean { mean, floor } => {
                write!(f, "the mean is {}, below the floor of {}: expected a mean at or above it", six(mean), six(floor))
            }
            Self::ReachesBelowFloor { law, mean, sd, least, floor, largest_sd } => {
                write!(f, "the {law} law with mean {} and standard deviation {} begins at {}, below ", six(mean), six(sd), six(least))?;
                write!(f, "the floor of {}: the deviation can be at most {}", six(floor), six(largest_sd))
            }
            Self::TooVaried { law, above_floor, sd, largest_sd } => {
                write!(f, "the {law} law has its mean {} above the floor and a standard deviation of {}: ", six(above_floor), six(sd))?;
                write!(f, "the deviation can be at most {}", six(largest_sd))
            }
            Self::NotACorrelation { found } => write!(f, "the correlation is {}: expected a number from -1 to 1", six(found)),
            Self::TooNegative { asked, least } => {
                write!(f, "two delays with this law cannot have the correlation {}: expected at least {}", six(asked), six(least))
            }
        }
    }
}

impl core::error::Error for LawError {}
