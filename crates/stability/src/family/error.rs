//! Errors of a family of scenes: the family cannot be formed, or has no radius for the given values.

use cohaptic_scene::SceneError;
use cohaptic_units::print::SixDigits;

use crate::AnalysisError;

/// Reason for which a family of scenes cannot be formed, or has no radius for the given values.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FamilyError {
    /// The scene is refused, as it is without the keys or with one of their values: an unknown key or peer, a value out of range.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The scene cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// A key of the scene does not take a number.
    #[error("{key} is not a number that can be varied: {message}")]
    NoNumber {
        /// The key.
        key: String,
        /// Message of the scene's reader about a number at this key.
        message: String,
    },
    /// A family has one or two open keys; the caller gave none or more than two.
    #[error("{keys} keys are left open: expected one or two")]
    Keys {
        /// Number of keys given.
        keys: usize,
    },
    /// A key is named twice.
    #[error("{key} is left open twice: expected two different keys")]
    Twice {
        /// The key.
        key: String,
    },
    /// The number of values differs from the number of keys.
    #[error("{given} values for {keys} open keys: expected one for each")]
    Values {
        /// Number of values given.
        given: usize,
        /// Number of open keys.
        keys: usize,
    },
    /// A value is not in the range of its key.
    #[error("{key} = {} is out of its range: expected a number from {} to {}", SixDigits(*value), SixDigits(*low), SixDigits(*high))]
    Outside {
        /// The key.
        key: String,
        /// The value given, in the unit of the key's range.
        value: f64,
        /// Smallest value of the key's range.
        low: f64,
        /// Largest value of the key's range.
        high: f64,
    },
}
