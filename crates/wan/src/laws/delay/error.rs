//! Reasons for the refusal of a law.

use core::fmt;

use cohaptic_units::print::SixDigits;

/// Reason for the refusal of a law or of a correlation of a law. Numbers are in the caller's unit.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum LawError {
    /// A number is NaN or infinite.
    NotFinite {
        /// Name of the number.
        quantity: &'static str,
        /// Refused number.
        found: f64,
    },
    /// The standard deviation is below zero.
    NegativeDeviation {
        /// Refused standard deviation.
        sd: f64,
    },
    /// The mean is below the floor, impossible for a delay.
    FloorAboveMean {
        /// Mean asked for.
        mean: f64,
        /// Floor, zero unless another floor was given.
        floor: f64,
    },
    /// A law with a least value (uniform, Pareto, empirical) would begin below the floor, and cannot be cut there.
    ReachesBelowFloor {
        /// Name of the law.
        law: &'static str,
        /// Mean asked for.
        mean: f64,
        /// Standard deviation asked for.
        sd: f64,
        /// Least value of the law.
        least: f64,
        /// Floor, zero unless another floor was given.
        floor: f64,
        /// Largest standard deviation for this law above the floor.
        largest_sd: f64,
    },
    /// The deviation of a law with its begin at the floor is too large for its mean. Nearly every draw would be the floor, and no run would be long enough to
    /// reach the mean.
    TooVaried {
        /// Name of the law.
        law: &'static str,
        /// Mean minus floor.
        above_floor: f64,
        /// Standard deviation asked for.
        sd: f64,
        /// Largest standard deviation: 100 times the mean above the floor.
        largest_sd: f64,
    },
    /// The correlation is not a number from −1 to 1.
    NotACorrelation {
        /// Refused correlation.
        found: f64,
    },
    /// Two variables with this law cannot be so negatively correlated. Unless the law is symmetric, its least correlation is above −1.
    TooNegative {
        /// Correlation asked for.
        asked: f64,
        /// Least correlation of this law, between a delay at z and a delay at −z.
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
